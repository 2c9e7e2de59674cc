"""Aligning, comparing, dividing."""

from __future__ import annotations

import numpy as np
import pytest

import sigmark
import sigmark.shapes


def test_a_mirrored_and_moved_copy_comes_back(torus: sigmark.Mesh) -> None:
    moved = sigmark.Mesh(np.array([-3.0, 3.0, 3.0]) * torus.vertices + [1.0, 2.0, 3.0], torus.faces)
    found = sigmark.align(moved, torus)
    assert found and found.mirrored and found.scale == pytest.approx(1 / 3)
    assert np.linalg.det(found.rotation) == pytest.approx(-1)
    assert np.allclose(found.apply(moved.vertices), torus.vertices)
    assert np.allclose(found.transform[:3, 3], found.translation)
    assert found.to_dict()["registration"] == "connectivity"


def test_pairs_of_points_are_enough(torus: sigmark.Mesh) -> None:
    moved = sigmark.Mesh(2.0 * torus.vertices, torus.faces)
    pairs = np.stack([moved.vertices[[0, 100, 200]], torus.vertices[[0, 100, 200]]], axis=1)
    assert sigmark.align(moved, torus, points=pairs.tolist()).scale == pytest.approx(0.5)
    with pytest.raises(sigmark.RegistrationError):
        sigmark.align(moved, torus, points=pairs[:2].tolist())


def test_a_larger_sphere_is_as_far_as_it_is_larger() -> None:
    sphere = sigmark.shapes.sphere(4)
    larger = sigmark.Mesh(1.1 * sphere.vertices, sphere.faces)
    compared = sigmark.compare(sphere, larger, metrics=["distance", "shape_dna", "dame"], interval=5e-3)
    distance = compared["distance"]
    assert distance["d_rmse"] * compared.diagonal == pytest.approx(0.1, rel=0.01)
    assert compared["shape_dna"]["distance"] < 1e-6, "eigenvalues are normalised"
    assert compared["dame"]["error"] < 1e-6
    assert compared.to_dict()["msdm2"] is None
    with pytest.raises(KeyError, match="msdm2"):
        compared["msdm2"]
    with pytest.raises(sigmark.RegistrationError, match="connectivity differs"):
        sigmark.compare(sphere, sigmark.shapes.sphere(3), metrics=["dame"])
    with pytest.raises(ValueError, match="no metric"):
        sigmark.compare(sphere, larger, metrics=["beauty"])  # type: ignore[list-item]


def test_parts_are_balanced_whatever_the_graph_is_given_as(torus: sigmark.Mesh) -> None:
    import scipy.sparse

    parts = sigmark.partition(torus, 6)
    sizes = np.bincount(parts.labels, minlength=6)
    assert sizes.max() <= 1.03 * len(torus.vertices) / 6 and len(parts) == parts.parts == 6
    edges = np.sort(np.concatenate([torus.faces[:, [0, 1]], torus.faces[:, [1, 2]], torus.faces[:, [2, 0]]]), axis=1)
    edges = np.unique(edges, axis=0)
    assert (parts.labels[edges[:, 0]] != parts.labels[edges[:, 1]]).sum() == parts.cut
    n = len(torus.vertices)
    half = scipy.sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    of_graph = sigmark.partition(half + half.T, 6)
    assert np.array_equal(of_graph.labels, parts.labels)
    with pytest.raises(ValueError, match="positive integers"):
        sigmark.partition(0.5 * (half + half.T), 6)
    with pytest.raises(sigmark.PartitionError) as refused:
        sigmark.partition(torus, 2000)
    assert refused.value.variant == "Parts"
