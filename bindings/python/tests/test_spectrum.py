"""The spectrum: what mathematics says of it."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

import sigmark
import sigmark.shapes


@pytest.fixture(scope="module")
def sphere() -> sigmark.Mesh:
    return sigmark.shapes.sphere(5)


@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_a_sphere_has_l_times_l_plus_1(sphere: sigmark.Mesh, mass: Literal["lumped", "full"]) -> None:
    found = sigmark.spectrum(sphere.vertices, sphere.faces, k=49, mass=mass)
    expected = np.concatenate([[l * (l + 1)] * (2 * l + 1) for l in range(7)])
    assert np.allclose(found.eigenvalues, expected, rtol=0.01, atol=1e-9)
    # Conforming finite elements with their own mass matrix never lie below the eigenvalues of their surface; lumping takes about as much again away.
    assert (found.eigenvalues[1:4] > 2.0).all() == (mass == "full")


def test_functions_are_orthonormal_and_solve_the_problem(sphere: sigmark.Mesh) -> None:
    found = sigmark.spectrum(sphere, k=30)
    stiffness, mass = found.laplacian()
    functions = found.eigenfunctions
    assert np.abs(functions.T @ (mass @ functions) - np.eye(30)).max() < 1e-10
    residual = stiffness @ functions - mass @ functions * found.eigenvalues
    assert np.abs(residual).max() < 1e-8
    assert np.allclose(mass.diagonal(), found.mass)
    assert abs(stiffness.sum(axis=1)).max() < 1e-10
    assert found.max_residual == found.residuals.max() <= 1e-10


def test_inertia_counts_every_pair(sphere: sigmark.Mesh) -> None:
    found = sigmark.spectrum(sphere, k=40)
    last_shift, last_count = found.inertia[-1]
    assert last_shift > found.eigenvalues[-1] and last_count >= 40
    for shift, below in found.inertia[:-1]:
        assert (found.eigenvalues < shift).sum() == below


def test_it_does_not_depend_on_threads_or_on_the_type_of_indices(torus: sigmark.Mesh) -> None:
    one = sigmark.spectrum(torus.vertices, torus.faces.astype(np.int32), k=20, threads=1)
    two = sigmark.spectrum(torus.vertices.tolist(), torus.faces.astype(np.uint64), k=20, threads=2)
    assert np.array_equal(one.eigenfunctions, two.eigenfunctions)


def test_any_laplacian_of_scipy_can_be_given(torus: sigmark.Mesh) -> None:
    import scipy.sparse

    direct = sigmark.spectrum(torus, k=12)
    stiffness, mass = sigmark.laplacian(torus)
    for form in (stiffness.tocsc(), scipy.sparse.coo_array(stiffness)):
        for masses in (mass, mass.diagonal()):
            of_matrices = sigmark.spectrum_of_matrices(form, masses, k=12)
            assert np.allclose(of_matrices.eigenvalues, direct.eigenvalues, rtol=1e-9, atol=1e-9)
    full = sigmark.laplacian(torus, mass="full")[1]
    with pytest.raises(ValueError, match="off its diagonal; lump it"):
        sigmark.spectrum_of_matrices(stiffness, full, k=12)
    with pytest.raises(sigmark.SpectrumError) as refused:
        sigmark.spectrum_of_matrices(stiffness + mass, mass, k=12)
    assert refused.value.variant == "RowSum"
    with pytest.raises(TypeError, match="sparse matrix of scipy"):
        sigmark.spectrum_of_matrices(stiffness.toarray(), mass)


def test_arrays_are_views_that_outlive_their_spectrum(torus: sigmark.Mesh) -> None:
    spectrum = sigmark.spectrum(torus, k=10)
    functions = spectrum.eigenfunctions
    assert functions.ctypes.data == spectrum.eigenfunctions.ctypes.data, "no copy"
    owner: object = functions.base
    assert owner is spectrum
    assert not functions.flags.writeable
    with pytest.raises(ValueError):
        functions.flags.writeable = True
    before = functions.copy()
    del owner, spectrum
    rubbish = [np.ones(functions.size) for _ in range(20)]
    assert np.array_equal(functions, before) and len(rubbish) == 20


def test_scipy_is_imported_only_when_it_is_asked_for() -> None:
    import subprocess
    import sys

    code = (
        "import sys, sigmark, sigmark.shapes; assert 'numpy' not in sys.modules;"
        "s = sigmark.spectrum(sigmark.shapes.sphere(2), k=3); s.eigenvalues; assert 'scipy' not in sys.modules;"
        "s.laplacian(); assert 'scipy' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_can_not_be_solved_is_refused_with_the_reason(torus: sigmark.Mesh) -> None:
    with pytest.raises(sigmark.SpectrumError, match="1536 vertices has 1 to 1536") as refused:
        sigmark.spectrum(torus, k=1537)
    assert refused.value.variant == "Count"
    with pytest.raises(sigmark.SpectrumError, match="tolerance"):
        sigmark.spectrum(torus, k=3, tolerance=2.0)
    stray = np.vstack([torus.vertices, [9.0, 9.0, 9.0]])
    with pytest.raises(sigmark.SpectrumError, match="no triangle uses it"):
        sigmark.spectrum(stray, torus.faces, k=3)
    assert sigmark.spectrum(sigmark.Mesh(stray, torus.faces), k=3).eigenfunctions.shape == (1536, 3)
    with pytest.raises(ValueError, match="cotangent"):
        sigmark.spectrum(torus, k=3, laplacian="graph")  # type: ignore[call-overload]
