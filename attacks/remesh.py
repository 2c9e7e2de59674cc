"""Isotropic re-meshing, as MeshLab has it (after Hoppe 1993)."""

import numpy
import pymeshlab

from mesh import Mesh
from meshlab import filtered
from strength import Strength

STRENGTH = Strength(default=100, lowest=10, highest=1000)


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """Ten rounds towards edges of `strength` % of the mean length, with vertices put back onto the surface. Not random.

    MeshLab's check of every step's distance to the surface forbids next to none at its default bound, and takes half of the time.
    """
    length = pymeshlab.PureValue(strength / 100 * mesh.edge_lengths().mean())
    return filtered(
        mesh, "meshing_isotropic_explicit_remeshing", iterations=10, targetlen=length, checksurfdist=False
    )
