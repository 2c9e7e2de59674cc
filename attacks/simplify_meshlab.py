"""Decimation by quadric error metrics (Garland and Heckbert 1997), as MeshLab has it."""

import numpy

from mesh import Mesh
from meshlab import filtered
from simplify import STRENGTH, wanted

__all__ = ["STRENGTH", "apply"]


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Leaves `strength` % of the triangles. Not random."""
    return filtered(mesh, "meshing_decimation_quadric_edge_collapse", targetfacenum=wanted(mesh, strength))
