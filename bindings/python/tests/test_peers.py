"""Objects of other libraries are meshes as they are: one line each."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import sigmark
import sigmark._peers
from files import obj


@pytest.fixture
def model(tmp_path: Path, torus: sigmark.Mesh) -> Path:
    path = tmp_path / "model.obj"
    path.write_bytes(obj(torus))
    return path


def check(loaded: object, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    """The spectrum has a row for each of its vertices, and it is the original."""
    expected = sigmark.spectrum(torus, k=5).eigenvalues
    found = sigmark.spectrum(loaded, k=5)  # type: ignore[call-overload]
    assert np.allclose(found.eigenvalues, expected, rtol=1e-6, atol=1e-6)
    assert found.eigenfunctions.shape == (len(torus.vertices), 5)
    verdict = sigmark.verify(signed.mesh, signed.certificate, loaded)  # type: ignore[arg-type]
    assert verdict.outcome == "verified"


def test_trimesh(model: Path, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    trimesh = pytest.importorskip("trimesh")
    loaded = trimesh.load(model, process=False)
    check(loaded, torus, signed)
    marked = sigmark.embed(loaded, sigmark.SigningKey.generate())
    back = trimesh.Trimesh(marked.vertices, marked.mesh.faces, process=False)
    assert sigmark.verify(back, marked.certificate, loaded)


def test_meshio(model: Path, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    meshio = pytest.importorskip("meshio")
    check(meshio.read(model), torus, signed)
    back = meshio.Mesh(signed.vertices, [("triangle", signed.mesh.faces)])
    assert sigmark.verify(back, signed.certificate, torus)
    with pytest.raises(ValueError, match="no triangles, but quad"):
        sigmark.Mesh(*sigmark._peers.arrays_of(meshio.Mesh(signed.vertices, [("quad", [[0, 1, 2, 3]])])))


def test_pymeshlab(model: Path, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    pymeshlab = pytest.importorskip("pymeshlab")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(model))
    check(meshes, torus, signed)
    check(meshes.current_mesh(), torus, signed)
    back = pymeshlab.Mesh(signed.vertices, signed.mesh.faces)
    assert sigmark.verify(back, signed.certificate, torus)


def test_open3d(model: Path, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    # It wants libraries of the system, such as libusb.
    open3d = pytest.importorskip("open3d", exc_type=ImportError)
    check(open3d.io.read_triangle_mesh(str(model)), torus, signed)
    vector = open3d.utility
    # Its vectors take arrays that may be written to alone.
    back = open3d.geometry.TriangleMesh(
        vector.Vector3dVector(signed.vertices.copy()), vector.Vector3iVector(signed.mesh.faces)
    )
    assert sigmark.verify(back, signed.certificate, torus)


def test_robust_laplacian(torus: sigmark.Mesh) -> None:
    robust_laplacian = pytest.importorskip("robust_laplacian")
    stiffness, mass = robust_laplacian.mesh_laplacian(torus.vertices, torus.faces, mollify_factor=0.0)
    theirs = sigmark.spectrum_of_matrices(stiffness, mass, k=20)
    ours = sigmark.spectrum(torus, k=20, laplacian="intrinsic")
    assert np.allclose(theirs.eigenvalues, ours.eigenvalues, rtol=1e-6, atol=1e-8)


def test_scipy_solves_what_is_handed_out(torus: sigmark.Mesh) -> None:
    linalg = pytest.importorskip("scipy.sparse.linalg")
    masses: list[Literal["lumped", "full"]] = ["lumped", "full"]
    for mass in masses:
        L, M = sigmark.laplacian(torus, mass=mass)
        expected = linalg.eigsh(L, 20, M, sigma=-0.01)[0]
        found = sigmark.spectrum(torus, k=20, mass=mass)
        assert np.allclose(found.eigenvalues, np.sort(expected), rtol=1e-8, atol=1e-8)


def test_a_path_is_a_mesh(model: Path, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    check(model, torus, signed)
    check(str(model), torus, signed)
    check(sigmark.read(model), torus, signed)
