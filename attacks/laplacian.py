"""Laplacian smoothing, as MeshLab has it: the umbrella operator with almost a full step."""

import numpy

from mesh import Mesh
from meshlab import filtered
from strength import Strength

STRENGTH = Strength(default=5, lowest=0, highest=1000, whole=True)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """`strength` steps; boundaries are smoothed along themselves. Not random.

    MeshLab counts a vertex with n neighbours as one of its own, and each neighbour twice, once a triangle: it goes 2n / (2n + 1) of
    the way to their mean.
    """
    return filtered(
        mesh, "apply_coord_laplacian_smoothing", stepsmoothnum=int(strength), boundary=True, cotangentweight=False
    )
