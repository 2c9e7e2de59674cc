"""Decimation by quadric error metrics (Garland and Heckbert 1997), as fast-simplification has it."""

import fast_simplification
import numpy

from mesh import Mesh, Refused
from strength import Strength

STRENGTH = Strength(default=50, lowest=0.001, highest=100)

# More than wanted by this factor is not what was asked for.
TOLERANCE = 1.02


def wanted(mesh: Mesh, strength: float) -> int:
    """So many triangles are to be left: `strength` %, no fewer than a tetrahedron has."""
    return max(4, round(strength / 100 * len(mesh.faces)))


def reached(mesh: Mesh, target: int) -> Mesh:
    """The decimated mesh, if it is as small as it should be."""
    if len(mesh.faces) > max(TOLERANCE * target, target + 4):
        raise Refused(f"decimation stops at {len(mesh.faces)} triangles, and {target} were wanted")
    return mesh


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Leaves `strength` % of the triangles. Not random.

    fast-simplification gives up when its threshold has risen long enough, so it is called until nothing more goes.
    """
    target = wanted(mesh, strength)
    before = len(mesh.faces) + 1
    while before > len(mesh.faces) > target:
        before = len(mesh.faces)
        mesh = Mesh(*fast_simplification.simplify(mesh.positions, mesh.faces, target_count=target))
    return reached(mesh, target)
