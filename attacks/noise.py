"""The paper's noise."""

import numpy

from meshfile import of_arrays

DEFAULT_STRENGTH = 0.1


def apply(meshes, strength: float, seed: int):
    """Moves each coordinate by a uniform amount in ±strength % of the bounding box's edge along that axis."""
    mesh = meshes.current_mesh()
    positions = mesh.vertex_matrix()
    random = numpy.random.default_rng(seed)
    amplitude = strength / 100 * numpy.ptp(positions, axis=0)
    return of_arrays(positions + random.uniform(-1, 1, size=positions.shape) * amplitude, mesh.face_matrix())
