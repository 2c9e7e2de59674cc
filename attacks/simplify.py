"""Decimation by quadric error metrics (Garland and Heckbert 1997), as fast-simplification has it."""

import fast_simplification
import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=50, lowest=0.001, highest=100)


def wanted(mesh: Mesh, strength: float) -> int:
    """So many triangles are to be left: `strength` %, no fewer than a tetrahedron has."""
    return max(4, round(strength / 100 * len(mesh.faces)))


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Leaves `strength` % of the triangles. Not random."""
    positions, faces = fast_simplification.simplify(
        mesh.positions, mesh.faces, target_count=wanted(mesh, strength)
    )
    return Mesh(numpy.asarray(positions, dtype=float), numpy.asarray(faces))
