"""Coordinates with few bits, as formats for the web have them."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=11, lowest=1, highest=30, whole=True)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Rounds each coordinate to the nearest of 2^strength values, evenly from end to end of the bounding box along its axis. Not random."""
    lowest, size = mesh.positions.min(axis=0), numpy.ptp(mesh.positions, axis=0)
    step = numpy.where(size > 0, size, 1) / (2 ** int(strength) - 1)
    return Mesh(lowest + numpy.rint((mesh.positions - lowest) / step) * step, mesh.faces)
