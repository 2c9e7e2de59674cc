"""Taubin smoothing, as MeshLab has it."""

import numpy

from mesh import Mesh
from meshlab import filtered
from strength import Strength

STRENGTH = Strength(default=10, lowest=0, highest=1000, whole=True)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """`strength` steps of λ = 0.5, μ = −0.53. Not random."""
    return filtered(mesh, "apply_coord_taubin_smoothing", lambda_=0.5, mu=-0.53, stepsmoothnum=int(strength))
