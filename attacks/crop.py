"""Cuts part of the model off by a plane."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=50, lowest=0.001, highest=100)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Keeps `strength` % of the vertices that triangles use: those on one side of a plane in a random direction. Keeps the triangles between them."""
    heights = mesh.positions @ random.normal(size=3)
    kept = heights <= numpy.percentile(heights[mesh.used()], strength)
    return Mesh(mesh.positions, mesh.faces[kept[mesh.faces].all(axis=1)]).compacted()
