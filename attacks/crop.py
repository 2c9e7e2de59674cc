"""Cuts part of the model off by a plane."""

import numpy

from meshfile import of_arrays

DEFAULT_STRENGTH = 50.0


def apply(meshes, strength: float, seed: int):
    """Keeps `strength` % of the vertices: those on one side of a plane in a random direction. Keeps the faces between them."""
    mesh = meshes.current_mesh()
    positions, faces = mesh.vertex_matrix(), mesh.face_matrix()
    direction = numpy.random.default_rng(seed).normal(size=3)
    heights = positions @ direction
    kept = heights <= numpy.percentile(heights, strength)
    return compacted(positions, faces[kept[faces].all(axis=1)])


def compacted(positions, faces):
    """The mesh without the vertices that no face uses."""
    used = numpy.unique(faces)
    if len(used) == 0:
        raise SystemExit("nothing is left of the mesh")
    number = numpy.zeros(len(positions), dtype=faces.dtype)
    number[used] = numpy.arange(len(used))
    return of_arrays(positions[used], number[faces])
