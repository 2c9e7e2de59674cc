"""Compares two meshes with one of the peers, and prints what came out and what it cost.

    quality.py hausdorff FROM TO SAMPLES      MeshLab's filter (Metro): from FROM, sampled, to TO
    quality.py scipy MESH COUNT               the lowest non-zero eigenvalues of S h = λ B h, by ARPACK in shift-invert mode
    quality.py lapy MESH COUNT                the same by LaPy, its own matrices

FROM, TO, MESH: folders with positions.f64 and triangles.u32, three numbers each, little-endian, without headers. Prints one JSON
object with the CPU seconds of the measurement; reading is not in them.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

# Of the mesh as it is for LaPy, of unit area for scipy: just below the spectrum.
SHIFT = -0.01


def read(folder):
    positions = np.fromfile(Path(folder) / "positions.f64", "<f8").reshape(-1, 3)
    triangles = np.fromfile(Path(folder) / "triangles.u32", "<u4").reshape(-1, 3)
    return positions, triangles.astype(np.int64)


def timed(work):
    begun = time.process_time()
    result = work()
    return result, time.process_time() - begun


def hausdorff(start, target, samples):
    """RMS, mean and greatest over face samples, as the filter draws them; the greatest over vertices, too, as ours has it."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    for folder in (start, target):
        meshes.add_mesh(pymeshlab.Mesh(*read(folder)))

    def measure(faces):
        return meshes.get_hausdorff_distance(
            sampledmesh=0, targetmesh=1, samplevert=not faces, sampleedge=False, sampleface=faces,
            samplenum=int(samples), maxdist=pymeshlab.PercentageValue(50),
        )

    on_faces, cpu = timed(lambda: measure(True))
    on_vertices, more = timed(lambda: measure(False))
    greatest = max(on_faces["max"], on_vertices["max"])
    return {
        "rms": on_faces["RMS"], "mean": on_faces["mean"], "max": greatest, "samples": on_faces["n_samples"],
        "cpu": cpu + more,
    }


def fem(positions, triangles):
    """Stiffness and consistent mass of linear elements (eq. 3), written down a second time."""
    import scipy.sparse as sparse

    corners = positions[triangles]
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # opposite to each corner
    twice_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    rows, columns, s, b = [], [], [], []
    for i in range(3):
        for j in range(3):
            rows.append(triangles[:, i])
            columns.append(triangles[:, j])
            s.append(np.einsum("ij,ij->i", edges[:, i], edges[:, j]) / (2 * twice_area))
            b.append(twice_area / (12 if i == j else 24))
    shape = (len(positions), len(positions))
    place = np.concatenate(rows), np.concatenate(columns)
    return [sparse.csc_matrix((np.concatenate(values), place), shape=shape) for values in (s, b)]


def by_scipy(folder, count):
    import scipy.sparse.linalg as linalg

    def solve():
        stiffness, mass = fem(*read(folder))
        area = mass.sum()
        start = np.random.default_rng(0).standard_normal(mass.shape[0])
        values = linalg.eigsh(
            stiffness, int(count) + 1, mass / area, sigma=SHIFT, tol=1e-12, v0=start, return_eigenvectors=False
        )
        return np.sort(values)[1:] / area

    values, cpu = timed(solve)
    return {"eigenvalues": values.tolist(), "cpu": cpu}


def by_lapy(folder, count):
    from lapy import Solver, TriaMesh

    mesh = TriaMesh(*read(folder))
    values, cpu = timed(lambda: Solver(mesh).eigs(int(count) + 1)[0])
    return {"eigenvalues": np.sort(values)[1:].tolist(), "cpu": cpu}


def main():
    what, *arguments = sys.argv[1:]
    report = {"hausdorff": hausdorff, "scipy": by_scipy, "lapy": by_lapy}[what](*arguments)
    print(json.dumps(report))


if __name__ == "__main__":
    main()
