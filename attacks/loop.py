"""Loop's subdivision, as MeshLab has it."""

import pymeshlab

DEFAULT_STRENGTH = 1


def apply(meshes, strength: float, seed: int):
    """`strength` times every triangle in four. Not random.

    Faces at edges with more than two are removed first: MeshLab subdivides manifold meshes only.
    """
    meshes.meshing_repair_non_manifold_edges(method="Remove Faces")
    meshes.meshing_surface_subdivision_loop(
        loopweight="Loop", iterations=int(strength), threshold=pymeshlab.PureValue(0)
    )
    return meshes
