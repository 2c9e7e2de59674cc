"""Bending."""

import numpy

from bending import along_longest_axis
from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=10, lowest=-180, highest=180)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Lays the longest axis onto an arc of strength degrees that is as long. Not random."""
    positions, share, [axis, side, _] = along_longest_axis(mesh)
    if strength == 0 or not numpy.ptp(share) > 0:
        return Mesh(positions, mesh.faces)
    radius = numpy.ptp(positions[:, axis]) / numpy.radians(strength)
    angle = numpy.radians(strength) * share
    inward = radius - positions[:, side]
    positions[:, axis] = numpy.sin(angle) * inward
    positions[:, side] = radius - numpy.cos(angle) * inward
    return Mesh(positions, mesh.faces)
