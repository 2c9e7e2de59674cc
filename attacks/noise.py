"""The paper's noise."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=0.1, lowest=0, highest=100)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Moves each coordinate by a uniform amount in ±strength % of the bounding box's edge along that axis."""
    amplitude = strength / 100 * numpy.ptp(mesh.positions, axis=0)
    return Mesh(mesh.positions + random.uniform(-1, 1, size=mesh.positions.shape) * amplitude, mesh.faces)
