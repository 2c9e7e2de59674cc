"""Meshes and what is wrong with arrays."""

from __future__ import annotations

import numpy as np
import pytest

import sigmark

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_texture_seams_are_welded_and_told() -> None:
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2], [4, 5, 6]])
    mesh = sigmark.Mesh(positions, faces)
    assert repr(mesh) == "Mesh(7 vertices, 2 faces; a surface of 4 vertices)"
    assert np.array_equal(mesh.vertices, positions) and np.array_equal(mesh.faces, faces)
    assert mesh.vertex_of.tolist() == [0, 1, 2, -1, 1, 3, 2]
    assert mesh.surface.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
    assert mesh.area == 1.0 and mesh.diagonal == pytest.approx(2**0.5)
    plain = sigmark.Mesh(positions, faces, weld=False)
    assert plain.vertex_of.tolist() == list(range(7))


def test_vertices_are_one_view_that_nobody_writes_to() -> None:
    mesh = sigmark.Mesh(TRIANGLE, [[0, 1, 2]])
    assert mesh.vertices.ctypes.data == mesh.vertices.ctypes.data
    owner: object = mesh.vertices.base
    assert owner is mesh
    assert not mesh.vertices.flags.writeable
    assert mesh.vertices.flags.c_contiguous


def test_the_mesh_does_not_change_with_the_array_that_it_was_made_of() -> None:
    own = TRIANGLE.copy()
    mesh = sigmark.Mesh(own, [[0, 1, 2]])
    own[0] = 5.0
    assert np.array_equal(mesh.vertices, TRIANGLE)


@pytest.mark.parametrize("dtype", [np.int8, np.int32, np.int64, np.uint16, np.uint32, np.uint64])
def test_faces_may_be_of_any_integer_type(dtype: type) -> None:
    assert sigmark.Mesh(TRIANGLE, np.array([[0, 1, 2]], dtype)).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.int32, ">f8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_vertices_may_be_of_any_real_type_and_order(dtype: str, order: str) -> None:
    positions = np.asarray(TRIANGLE, dtype, order=order)  # type: ignore[call-overload]
    assert np.array_equal(sigmark.Mesh(positions, [[0, 1, 2]]).vertices, TRIANGLE)
    assert np.array_equal(sigmark.Mesh(positions[::-1], [[0, 1, 2]]).vertices, TRIANGLE[::-1])


@pytest.mark.parametrize(
    ("vertices", "faces", "exception", "message"),
    [
        (TRIANGLE[:, :2], [[0, 1, 2]], ValueError, r"vertices has the shape \(3, 2\); \(n, 3\) is needed"),
        (TRIANGLE.ravel(), [[0, 1, 2]], ValueError, r"vertices has the shape \(9,\)"),
        (TRIANGLE, [[0, 1, 2, 0]], ValueError, r"faces has the shape \(1, 4\); \(m, 3\) is needed"),
        (TRIANGLE, np.array([[0.0, 1, 2]]), TypeError, "faces has dtype float64; indices are integers"),
        (TRIANGLE.astype(complex), [[0, 1, 2]], TypeError, "vertices has dtype complex128"),
        (TRIANGLE.astype(str), [[0, 1, 2]], TypeError, "vertices has dtype <U"),
        (TRIANGLE, [[0, 1, -1]], ValueError, r"faces\[0\] has the index -1; indices start at 0"),
        (TRIANGLE, [[0, 1, 3]], sigmark.MeshError, "refers to vertex 3, but there are only 3"),
        (TRIANGLE, [[0, 1, 2**40]], sigmark.MeshError, f"refers to vertex {2**40}"),
        (TRIANGLE * np.nan, [[0, 1, 2]], sigmark.MeshError, "not a finite number"),
        (TRIANGLE, np.zeros((0, 3), int), sigmark.MeshError, "no triangles"),
        (TRIANGLE * 0, [[0, 1, 2]], sigmark.MeshError, "two corners at the same point"),
    ],
)
def test_what_is_no_mesh_is_refused_with_its_place(
    vertices: object, faces: object, exception: type[Exception], message: str
) -> None:
    with pytest.raises(exception, match=message):
        sigmark.Mesh(vertices, faces)  # type: ignore[arg-type]


def test_exceptions_name_the_variant_and_are_of_one_family() -> None:
    with pytest.raises(sigmark.Error) as refused:
        sigmark.Mesh(TRIANGLE, [[0, 1, 7]])
    assert isinstance(refused.value, sigmark.MeshError) and isinstance(refused.value, ValueError)
    assert refused.value.variant == "IndexOutOfRange"
    import pickle

    copy = pickle.loads(pickle.dumps(refused.value))
    assert (str(copy), copy.variant) == (str(refused.value), "IndexOutOfRange")
    classes = [name for name in sigmark.__all__ if name.endswith("Error") and name != "Error"]
    assert len(classes) == 12
    assert all(issubclass(getattr(sigmark, name), sigmark.Error) for name in classes)


def test_what_is_no_mesh_at_all_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="object of type dict has neither vertices and faces"):
        sigmark.spectrum({}, k=3)  # type: ignore[call-overload]
