"""Prints d_rmse (eq. 21) of MARKED against ORIGINAL as a fraction of MARKED's diagonal: python distance.py MARKED ORIGINAL."""

import sys

import pymeshlab

# The paper samples at 0.05 % of the diagonal: this many points on the bunny.
SAMPLES = 3_650_000


def main(marked: str, original: str) -> None:
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(marked)
    meshes.load_new_mesh(original)
    report = meshes.get_hausdorff_distance(
        sampledmesh=0, targetmesh=1, samplevert=False, sampleedge=False, sampleface=True, samplenum=SAMPLES,
        maxdist=pymeshlab.PercentageValue(5),
    )
    print(report["RMS"] / report["diag_mesh_0"])


if __name__ == "__main__":
    main(*sys.argv[1:])
