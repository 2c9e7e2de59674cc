"""Stretching, as by pulling at one handle of the bounding box."""

import numpy

from bending import along_longest_axis
from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=2, lowest=-50, highest=100)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Makes the model longer by strength % along its longest axis. Not random."""
    positions, _, [axis, *_] = along_longest_axis(mesh)
    positions[:, axis] *= 1 + strength / 100
    return Mesh(positions, mesh.faces)
