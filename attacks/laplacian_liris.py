"""The smoothing of the LIRIS benchmark (Wang, Lavoué, Denis, Baskurt, He, A benchmark for 3D mesh watermarking, SMI 2010)."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=10, lowest=0, highest=1000, whole=True)

# Of the way to the mean of its neighbours, a vertex goes this part in a step.
STEP = 0.1


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """`strength` steps of 0.1 by the umbrella operator; boundary vertices stay. Not random."""
    edges, _ = mesh.edges()
    fixed = mesh.boundary()
    for _ in range(int(strength)):
        offset = STEP * (mesh.neighbour_means(edges) - mesh.positions)
        offset[fixed] = 0
        mesh = Mesh(mesh.positions + offset, mesh.faces)
    return mesh
