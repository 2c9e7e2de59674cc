"""The lower Laplace-Beltrami spectrum of a mesh, by one of the ways that Python offers, each called as its makers show it.

    spectrum.py WAY MESH COUNT TOLERANCE

WAY is a name of WAYS. Everyone gets the same two arrays, of the mesh scaled to unit area, and assembles matrices of its own: the time counts from there.
Prints one JSON object: CPU and wall seconds, the worst residual ‖S h − λ M h‖ / λ in the norm of the inverse lumped mass, of the way's own matrices, and the eigenvalues.
"""

import json
import sys
import time

import numpy as np

import sigmark

# Just below the spectrum, so that S − σ M is definite: what LaPy takes.
SHIFT = -0.01


def ours(laplacian, mass):
    def solve(vertices, faces, count, tolerance):
        found = sigmark.spectrum(
            vertices, faces, count, laplacian=laplacian, mass=mass, tolerance=tolerance, threads=1
        )
        return found.eigenvalues, found.eigenfunctions, found.laplacian

    return solve


def eigsh(stiffness, mass, count, tolerance):
    import scipy.sparse.linalg

    values, functions = scipy.sparse.linalg.eigsh(stiffness, count, mass, sigma=SHIFT, tol=tolerance)
    return values, functions, lambda: (stiffness, mass)


def robust(vertices, faces, count, tolerance):
    import robust_laplacian

    stiffness, mass = robust_laplacian.mesh_laplacian(vertices, faces)
    return eigsh(stiffness, mass, count, tolerance)


def potpourri(vertices, faces, count, tolerance):
    import potpourri3d
    import scipy.sparse

    stiffness = potpourri3d.cotan_laplacian(vertices, faces)
    mass = scipy.sparse.diags(potpourri3d.vertex_areas(vertices, faces), format="csc")
    return eigsh(stiffness.tocsc(), mass, count, tolerance)


def libigl(vertices, faces, count, tolerance):
    import igl

    stiffness = -igl.cotmatrix(vertices, faces)
    mass = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    return eigsh(stiffness.tocsc(), mass.tocsc(), count, tolerance)


def lapy(vertices, faces, count, _tolerance):
    """To the precision of the machine, since its solver takes no tolerance."""
    from lapy import Solver, TriaMesh

    solver = Solver(TriaMesh(vertices, faces))
    values, functions = solver.eigs(count)
    return values, functions, lambda: (solver.stiffness, solver.mass)


WAYS = {
    "sigmark-cotangent": ours("cotangent", "lumped"),
    "sigmark-full": ours("cotangent", "full"),
    "sigmark-intrinsic": ours("intrinsic", "lumped"),
    "robust_laplacian": robust,
    "potpourri3d": potpourri,
    "libigl": libigl,
    "lapy": lapy,
}


def worst_residual(values, functions, stiffness, mass):
    lumped = np.asarray(mass.sum(axis=1)).ravel()
    norms = np.sqrt(np.einsum("ij,ij->j", functions, mass @ functions))
    difference = stiffness @ functions - (mass @ functions) * values
    residuals = np.sqrt((difference**2 / lumped[:, None]).sum(axis=0)) / norms
    # λ_0 is 0; the surface has unit area.
    return float((residuals / np.maximum(values, 1.0)).max())


def main():
    way, path, count, tolerance = sys.argv[1:]
    mesh = sigmark.read(path).mesh
    vertices, faces = mesh.vertices / np.sqrt(mesh.area), mesh.faces
    # What a library needs to be imported is not what it takes to solve.
    small = sigmark.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    WAYS[way](small.vertices.copy(), small.faces, 2, 1e-3)
    begun = time.process_time(), time.perf_counter()
    values, functions, matrices = WAYS[way](vertices, faces, int(count), float(tolerance))
    cpu, wall = time.process_time() - begun[0], time.perf_counter() - begun[1]
    order = np.argsort(values)
    residual = worst_residual(values[order], functions[:, order], *matrices())
    print(json.dumps({"cpu": cpu, "wall": wall, "residual": residual, "eigenvalues": values[order].tolist()}))


if __name__ == "__main__":
    main()
