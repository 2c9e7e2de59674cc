"""Re-extraction from a signed distance field by marching cubes, as MeshLab has it: nothing is left of vertices, and of the surface what the grid holds."""

import numpy
import pymeshlab

from mesh import Mesh
from meshlab import filtered
from strength import Strength

STRENGTH = Strength(default=128, lowest=8, highest=1024, whole=True)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """A grid of `strength` cells along the longest edge of the bounding box. Not random.

    The sign is that of the nearest triangle's side, so that holes grow lips; what the filter leaves of the corners is merged.
    """
    cell = float(numpy.ptp(mesh.positions, axis=0).max()) / strength
    return filtered(
        mesh,
        "generate_resampled_uniform_mesh",
        cellsize=pymeshlab.PureValue(cell),
        offset=pymeshlab.PureValue(0),
        mergeclosevert=True,
    ).compacted()
