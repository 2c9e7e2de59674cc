"""Solves S h = λ D h with one of the peers, and prints what it cost.

    eigen.py PEER MATRICES COUNT TOLERANCE RESULT

PEER: superlu, cholmod (ARPACK in shift-invert mode, scipy's eigsh, with that factorisation) or lobpcg.
MATRICES: a folder with the stiffness S as compressed rows, offsets.u64, columns.u64, values.f64, and the lumped mass D,
mass.f64; little-endian, without headers. RESULT: a folder for eigenvalues.f64 and eigenfunctions.f64, one function after
the other, of unit D-norm; whoever calls judges them. Prints one JSON object: CPU and wall seconds of the solve,
factorisation included, reading and writing not.
"""

import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

# Of the mesh scaled to unit area, where eigenvalues are about 4π k: just below the spectrum, so that S − σ D is definite.
SHIFT = -0.01
# LOBPCG converges slowly; after so many steps it is judged as it stands.
LOBPCG_STEPS = 60
LOBPCG_SHIFT = -1.0


def read(folder):
    offsets = np.fromfile(folder / "offsets.u64", "<u8").astype(np.int32)
    columns = np.fromfile(folder / "columns.u64", "<u8").astype(np.int32)
    values = np.fromfile(folder / "values.f64", "<f8")
    mass = np.fromfile(folder / "mass.f64", "<f8")
    shape = (len(mass), len(mass))
    return sparse.csr_matrix((values, columns, offsets), shape=shape).tocsc(), mass


def solver_of(peer, matrix):
    """A function that solves with the positive definite `matrix`."""
    if peer == "cholmod":
        from sksparse.cholmod import cholesky

        return cholesky(matrix)
    # The options for symmetric matrices: no pivoting off the diagonal, ordering of Aᵀ + A.
    options = {"SymmetricMode": True}
    return linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve


def arpack(peer, stiffness, mass, count, tolerance):
    shape = stiffness.shape
    inverse = linalg.LinearOperator(shape, matvec=solver_of(peer, stiffness - SHIFT * mass))
    start = np.random.default_rng(0).standard_normal(shape[0])
    return linalg.eigsh(stiffness, count, mass, sigma=SHIFT, OPinv=inverse, tol=tolerance, v0=start)


def lobpcg(stiffness, mass, count, tolerance):
    """On D^-½ S D^-½, with the exact inverse of what is shifted as the preconditioner: the best that there is.

    A fifth more vectors than pairs, since the last ones hardly converge, and a shift further away, because the inverse's
    rounding errors keep the first ones from converging otherwise. The tolerance is one for all pairs: that of the first
    after λ = 0, which is about 4π.
    """
    root = sparse.diags(1 / np.sqrt(mass.diagonal()), format="csc")
    matrix = (root @ stiffness @ root).tocsc()
    solve = solver_of("superlu", matrix - LOBPCG_SHIFT * sparse.identity(matrix.shape[0], format="csc"))
    inverse = linalg.LinearOperator(matrix.shape, matvec=solve, matmat=solve)
    start = np.random.default_rng(0).standard_normal((matrix.shape[0], count + count // 5))
    options = {"M": inverse, "tol": 4 * np.pi * tolerance, "maxiter": LOBPCG_STEPS, "largest": False}
    with warnings.catch_warnings():
        # Whoever calls sees by the residuals whether it converged.
        warnings.simplefilter("ignore")
        values, vectors = linalg.lobpcg(matrix, start, **options)
    order = np.argsort(values)[:count]
    return values[order], root @ vectors[:, order]


def solve(peer, stiffness, mass, count, tolerance):
    mass = sparse.diags(mass, format="csc")
    if peer == "lobpcg":
        values, vectors = lobpcg(stiffness, mass, count, tolerance)
    else:
        values, vectors = arpack(peer, stiffness, mass, count, tolerance)
    order = np.argsort(values)
    return values[order], vectors[:, order]


def main():
    peer, matrices, count, tolerance, result = sys.argv[1:]
    stiffness, mass = read(Path(matrices))
    area = mass.sum()
    begun = time.process_time(), time.perf_counter()
    values, vectors = solve(peer, stiffness, mass / area, int(count), float(tolerance))
    cpu, wall = time.process_time() - begun[0], time.perf_counter() - begun[1]
    (values / area).astype("<f8").tofile(Path(result) / "eigenvalues.f64")
    (vectors.T / np.sqrt(area)).astype("<f8").tofile(Path(result) / "eigenfunctions.f64")
    print(json.dumps({"cpu": cpu, "wall": wall}))


if __name__ == "__main__":
    main()
