"""Loop's subdivision (1987), as MeshLab has it."""

import numpy
import pymeshlab

from mesh import Mesh
from meshlab import filtered
from strength import Strength

STRENGTH = Strength(default=1, lowest=1, highest=4, whole=True)

# MeshLab refuses other meshes.
NEEDS_MANIFOLD_EDGES = True


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """`strength` times every triangle in four. Not random."""
    return filtered(
        mesh, "meshing_surface_subdivision_loop",
        loopweight="Loop", iterations=int(strength), threshold=pymeshlab.PureValue(0),
    )
