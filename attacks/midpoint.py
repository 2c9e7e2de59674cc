"""Midpoint subdivision: other triangles, the same surface."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=1, lowest=1, highest=4, whole=True)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """`strength` times every triangle in four, with a vertex in the middle of each edge. Not random."""
    for _ in range(int(strength)):
        mesh = once(mesh)
    return mesh


def once(mesh: Mesh) -> Mesh:
    """One step."""
    edges, along = mesh.edges()
    positions = numpy.concatenate([mesh.positions, mesh.positions[edges].mean(axis=1)])
    a, b, c = mesh.faces.T
    ab, bc, ca = (len(mesh.positions) + along).reshape(-1, 3).T
    faces = numpy.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return Mesh(positions, faces)
