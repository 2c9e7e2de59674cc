"""The noise of the LIRIS benchmark (Wang, Lavoué, Denis, Baskurt, He, A benchmark for 3D mesh watermarking, SMI 2010)."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=0.3, lowest=0, highest=100)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Moves each coordinate by a uniform amount in ±strength % of the vertices' mean distance to their mean.

    Boundary vertices stay, as they do in the benchmark's own program.
    """
    positions = mesh.positions[mesh.used()]
    distance = numpy.linalg.norm(positions - positions.mean(axis=0), axis=1).mean()
    offset = random.uniform(-1, 1, size=mesh.positions.shape) * (strength / 100 * distance)
    offset[mesh.boundary()] = 0
    return Mesh(mesh.positions + offset, mesh.faces)
