"""Isotropic re-meshing, as MeshLab has it (after Hoppe 1993)."""

import numpy
import pymeshlab

DEFAULT_STRENGTH = 100.0


def apply(meshes, strength: float, seed: int):
    """Ten rounds towards edges of `strength` % of the mean length, with vertices put back onto the surface. Not random."""
    mesh = meshes.current_mesh()
    positions, faces = mesh.vertex_matrix(), mesh.face_matrix()
    sides = positions[faces] - positions[numpy.roll(faces, 1, axis=1)]
    length = strength / 100 * numpy.linalg.norm(sides, axis=2).mean()
    meshes.meshing_isotropic_explicit_remeshing(iterations=10, targetlen=pymeshlab.PureValue(length))
    return meshes
