"""Taubin smoothing, as MeshLab has it."""

DEFAULT_STRENGTH = 10


def apply(meshes, strength: float, seed: int):
    """`strength` steps of λ = 0.5, μ = −0.53. Not random."""
    meshes.apply_coord_taubin_smoothing(lambda_=0.5, mu=-0.53, stepsmoothnum=int(strength))
    return meshes
