"""Twisting."""

import numpy

from bending import along_longest_axis
from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=5, lowest=-360, highest=360)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Turns every slice across the longest axis about it, the last by strength degrees more than the first. Not random."""
    positions, share, [_, first, second] = along_longest_axis(mesh)
    angle = numpy.radians(strength) * share
    a, b = positions[:, first].copy(), positions[:, second].copy()
    positions[:, first] = numpy.cos(angle) * a - numpy.sin(angle) * b
    positions[:, second] = numpy.sin(angle) * a + numpy.cos(angle) * b
    return Mesh(positions, mesh.faces)
