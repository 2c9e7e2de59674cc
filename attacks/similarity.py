"""A random similarity transform: what any modelling program does to a model on its way."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=100, lowest=1, highest=1e6)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Rotates (uniformly), scales by 1/strength … strength (log-uniformly), shifts by up to ten diagonals."""
    w, x, y, z = (lambda q: q / numpy.linalg.norm(q))(random.normal(size=4))
    rotation = numpy.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    scale = strength ** random.uniform(-1, 1)
    shift = random.uniform(-10, 10, size=3) * mesh.diagonal()
    return Mesh(scale * (mesh.positions @ rotation.T + shift), mesh.faces)
