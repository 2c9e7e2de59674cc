"""Laplacian smoothing, as MeshLab has it: the umbrella operator with a full step."""

DEFAULT_STRENGTH = 5


def apply(meshes, strength: float, seed: int):
    """`strength` steps; borders are smoothed along themselves. Not random."""
    meshes.apply_coord_laplacian_smoothing(stepsmoothnum=int(strength), boundary=True, cotangentweight=False)
    return meshes
