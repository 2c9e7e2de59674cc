"""Decimation by quadric error metrics (Garland and Heckbert 1997), as fast-simplification has it."""

import fast_simplification
import numpy

from meshfile import of_arrays

DEFAULT_STRENGTH = 50.0


def apply(meshes, strength: float, seed: int):
    """Leaves `strength` % of the faces. Not random."""
    mesh = meshes.current_mesh()
    faces = mesh.face_matrix()
    count = max(4, round(strength / 100 * len(faces)))
    positions, faces = fast_simplification.simplify(mesh.vertex_matrix(), faces, target_count=count)
    return of_arrays(numpy.asarray(positions, dtype=float), faces)
