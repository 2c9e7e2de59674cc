"""A surface that was made solid, or grew: everything nearer than a wall's half thickness, as MeshLab's distance field and marching cubes have it."""

import numpy
import pymeshlab

from mesh import Mesh
from meshlab import filtered
from strength import Strength

STRENGTH = Strength(default=256, lowest=8, highest=1024, whole=True)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Walls of two cells, of which there are `strength` along the longest edge of the bounding box. Not random.

    An open surface gets a wall on either side; a closed one an outer wall that is a cell too large, and an inner one that is a cell too small.
    """
    cell = float(numpy.ptp(mesh.positions, axis=0).max()) / strength
    return filtered(
        mesh,
        "generate_resampled_uniform_mesh",
        cellsize=pymeshlab.PureValue(cell),
        offset=pymeshlab.PureValue(cell),
        absdist=True,
        mergeclosevert=True,
    ).compacted()
