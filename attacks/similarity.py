"""A random similarity transform: what any modelling program does to a model on its way."""

import numpy

from meshfile import of_arrays

DEFAULT_STRENGTH = 100.0


def apply(meshes, strength: float, seed: int):
    """Rotates (uniformly), scales by 1/strength … strength (log-uniformly), shifts by up to ten diagonals."""
    random = numpy.random.default_rng(seed)
    w, x, y, z = (lambda q: q / numpy.linalg.norm(q))(random.normal(size=4))
    rotation = numpy.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    scale = strength ** random.uniform(-1, 1)
    mesh = meshes.current_mesh()
    positions = mesh.vertex_matrix()
    diagonal = numpy.linalg.norm(numpy.ptp(positions, axis=0))
    shift = random.uniform(-10, 10, size=3) * diagonal
    return of_arrays(scale * (positions @ rotation.T + shift), mesh.face_matrix())
