"""Decimation by quadric error metrics (Garland and Heckbert 1997), as MeshLab has it."""

import numpy

from mesh import Mesh
from meshlab import filtered
from simplify import STRENGTH, reached, wanted

__all__ = ["STRENGTH", "apply"]


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Leaves `strength` % of the triangles. Not random."""
    target = wanted(mesh, strength)
    return reached(filtered(mesh, "meshing_decimation_quadric_edge_collapse", targetfacenum=target), target)
