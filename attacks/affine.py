"""A general affine map."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=1, lowest=0, highest=50)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Multiplies positions by a matrix whose entries are off those of the identity by a uniform amount in ±strength %."""
    matrix = numpy.eye(3) + random.uniform(-1, 1, size=(3, 3)) * strength / 100
    return Mesh(mesh.positions @ matrix.T, mesh.faces)
