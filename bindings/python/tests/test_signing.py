"""Signing, verifying, tracing: arrays in memory, and files."""

from __future__ import annotations

import gzip
import json
import stat
import subprocess
import sys
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import sigmark
import sigmark.shapes
from files import glb, glb_parts, gltf, obj, rigged_glb, with_broken_rig

SCRIPT = [sys.executable, "-m", "sigmark"]


def rotated(points: NDArray[np.float64]) -> NDArray[np.float64]:
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    return np.asarray(2.5 * points @ turn.T + [10.0, -20.0, 30.0])


def test_a_copy_in_any_pose_is_verified(
    torus: sigmark.Mesh, signed: sigmark.Signed, key: sigmark.SigningKey
) -> None:
    moved = sigmark.Mesh(rotated(signed.vertices), torus.faces)
    verdict = sigmark.verify(moved, signed.certificate, torus, key.public_key)
    assert verdict and verdict.outcome == "verified" and verdict.is_evidence and not verdict.own_key
    assert verdict.bit_errors == 0 and verdict.p_value < 1e-36 and verdict.message == "© 2026 Studio"
    assert verdict.transform is not None
    back = np.c_[moved.vertices, np.ones(len(moved.vertices))] @ verdict.transform.T
    # But for the mark, which the pose is not told from.
    assert np.abs(back[:, :3] - signed.vertices).max() < 1e-3 * torus.diagonal


def test_a_mesh_without_the_mark_is_not_found(torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    verdict = sigmark.verify(torus, signed.certificate, torus)
    assert not verdict and verdict.outcome == "not_found" and verdict.own_key
    other = sigmark.shapes.bumpy_torus(seed=2)
    assert not sigmark.verify(other, signed.certificate, torus)


def test_another_key_or_original_is_refused(torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    other = sigmark.SigningKey.generate().public_key
    with pytest.raises(sigmark.SigmarkError, match="issued by the key") as refused:
        sigmark.verify(signed.mesh, signed.certificate, torus, other)
    assert refused.value.variant == "AnotherKey"
    with pytest.raises(sigmark.SigmarkError, match="not the original") as refused:
        sigmark.verify(signed.mesh, signed.certificate, sigmark.shapes.bumpy_torus(seed=2))
    assert refused.value.variant == "AnotherOriginal"


def test_the_surface_moves_as_little_as_was_asked_for(torus: sigmark.Mesh, key: sigmark.SigningKey) -> None:
    moves = []
    strengths: list[Literal["subtle", "standard"] | float] = ["subtle", "standard", 8e-4]
    for strength in strengths:
        signed = sigmark.embed(torus, key, strength=strength)
        moves.append(np.linalg.norm(signed.vertices - torus.vertices, axis=1).max() / torus.diagonal)
    assert 0 < moves[0] < moves[1] < moves[2] < 5e-3


def test_seams_do_not_tear(key: sigmark.SigningKey) -> None:
    torus = sigmark.shapes.bumpy_torus()
    split = torus.vertices[torus.faces.ravel()]
    soup = sigmark.Mesh(split, np.arange(len(split)).reshape(-1, 3))
    signed = sigmark.embed(soup, key)
    assert signed.vertices.shape == split.shape
    whole = np.empty_like(torus.vertices)
    whole[torus.faces.ravel()] = signed.vertices
    assert np.array_equal(whole[torus.faces.ravel()], signed.vertices)


def test_the_result_is_the_same_on_any_number_of_threads(torus: sigmark.Mesh, key: sigmark.SigningKey) -> None:
    one, two = (sigmark.embed(torus, key, message="m", threads=threads) for threads in (1, 2))
    assert np.array_equal(one.vertices, two.vertices)
    assert one.certificate == two.certificate and hash(one.certificate) == hash(two.certificate)
    assert one.certificate != sigmark.embed(torus, key, message="n").certificate


def test_copies_are_told_apart(torus: sigmark.Mesh, key: sigmark.SigningKey) -> None:
    prepared = sigmark.prepare(torus, key, message="© 2026 Studio")
    copies = [prepared.embed(buyer) for buyer in ("Anna", "Bert", "Carl")]
    alone = sigmark.embed(torus, key, message="© 2026 Studio", recipient="Bert")
    assert np.array_equal(alone.vertices, copies[1].vertices)
    certificates = [copy.certificate for copy in copies]
    tracer = sigmark.Tracer(torus, certificates, key.public_key)
    assert len(tracer) == 3
    for copy in copies:
        trace = tracer.trace(sigmark.Mesh(rotated(copy.vertices), torus.faces))
        assert [accused.recipient for accused in trace.accused] == [copy.certificate.recipient]
        assert trace and trace.candidates == 3 and trace.accused[0].p_value < 1e-5
    nobody = sigmark.trace(torus, torus, certificates)
    assert not nobody and repr(nobody) == "Trace(nobody of 3 copies)"
    with pytest.raises(ValueError, match="no certificates"):
        sigmark.trace(torus, torus, [])


def test_of_a_file_only_positions_change_and_the_command_agrees(
    tmp_path: Path, torus: sigmark.Mesh, key: sigmark.SigningKey
) -> None:
    model, found = tmp_path / "model.obj", tmp_path / "found.obj"
    model.write_bytes(obj(torus))
    asset = sigmark.read(model)
    assert asset.to_bytes() == model.read_bytes() and asset.format == "obj"
    signed = sigmark.embed(asset, key, message="m")
    assert signed.asset is not None and signed.certificate.original_name == "model.obj"
    signed.save(found)
    with pytest.raises(sigmark.AssetError, match="exists"):
        signed.save(found)
    certificate = tmp_path / "found.obj.cert.json"
    if sys.platform != "win32":
        assert stat.S_IMODE(certificate.stat().st_mode) == 0o600
    before, after = (path.read_text().splitlines() for path in (model, found))
    assert [line for line in before if line[0] != "v"] == [line for line in after if line[0] != "v"]

    verdict = sigmark.verify(found, certificate, model)
    assert verdict.outcome == "verified"
    arguments = ["verify", found, "--certificate", certificate, "--original", model, "--json"]
    run = subprocess.run([*SCRIPT, *map(str, arguments)], capture_output=True, text=True, check=True)
    printed = json.loads(run.stdout)
    own = verdict.to_dict()
    assert set(own) - set(printed) == {"mismatch"}
    assert {name: own[name] for name in own if name in printed} == {name: printed[name] for name in own if name in printed}
    left_out = {"suspect", "original", "parts", "remark", "stamps", "stamps_refused", "seconds"}
    assert set(printed) - set(own) == left_out

    pem = tmp_path / "owner.pem"
    key.save(pem)
    arguments = ["embed", model, "-o", tmp_path / "again.obj", "--key", pem, "--message", "m", "--json"]
    run = subprocess.run([*SCRIPT, *map(str, arguments)], capture_output=True, text=True, check=True)
    assert (tmp_path / "again.obj").read_bytes() == found.read_bytes()
    printed = json.loads(run.stdout)
    assert {name: printed[name] for name in signed.to_dict()} == signed.to_dict()


def test_of_a_glb_all_but_positions_stays(tmp_path: Path, torus: sigmark.Mesh, key: sigmark.SigningKey) -> None:
    model = tmp_path / "model.glb"
    model.write_bytes(glb(torus))
    signed = sigmark.embed(model, key)
    assert signed.asset is not None and signed.asset.format == "glb"
    before, after = glb_parts(model.read_bytes()), glb_parts(signed.asset.to_bytes())
    assert before[0] == after[0]
    positions = torus.vertices.size * 4
    assert np.array_equal(before[1][positions:], after[1][positions:])
    assert not np.array_equal(before[1][:positions], after[1][:positions])
    assert sigmark.verify(signed.asset, signed.certificate, model).outcome == "verified"


def test_copies_of_a_coarse_file_are_those_of_embed(key: sigmark.SigningKey) -> None:
    """So far from the origin single precision has too few digits for the standard mark, and enough for the strong one."""
    torus = sigmark.shapes.bumpy_torus()
    asset = sigmark.Asset.from_bytes(glb(sigmark.Mesh(torus.vertices + 4e4, torus.faces)), "glb")
    with pytest.raises(sigmark.SigmarkError, match="precision of this file"):
        sigmark.embed(asset, key, recipient="Anna", strength="standard")
    alone = sigmark.embed(asset, key, recipient="Anna")
    prepared = sigmark.prepare(asset, key)
    copy = prepared.embed("Anna")
    assert alone.asset and copy.asset and copy.asset.to_bytes() == alone.asset.to_bytes()
    assert copy.certificate.to_json() == alone.certificate.to_json()
    with pytest.raises(sigmark.SigmarkError, match="precision of this file"):
        sigmark.prepare(asset, key, strength="standard").embed("Anna")


def test_of_a_gltf_the_mark_lies_in_the_buffer_beside_it(tmp_path: Path, torus: sigmark.Mesh, key: sigmark.SigningKey) -> None:
    document, buffer = gltf(torus, "model.bin")
    (tmp_path / "model.gltf").write_bytes(document)
    (tmp_path / "model.bin").write_bytes(buffer)
    signed = sigmark.embed(tmp_path / "model.gltf", key)
    assert signed.asset is not None and signed.asset.companions == ["model.bin"]
    assert sigmark.Asset.from_bytes(glb(torus)).companions == []
    with pytest.raises(sigmark.AssetError, match=".gltf"):
        signed.asset.check_name("signed.glb")
    (tmp_path / "signed").mkdir()
    signed.save(tmp_path / "signed/model.gltf")
    assert (tmp_path / "signed/model.bin").read_bytes() != buffer
    assert sigmark.verify(tmp_path / "signed/model.gltf", signed.certificate, tmp_path / "model.gltf").outcome == "verified"


def test_arrays_are_saved_by_whoever_reads_them(tmp_path: Path, signed: sigmark.Signed) -> None:
    assert signed.asset is None
    with pytest.raises(ValueError, match="arrays were signed"):
        signed.save(tmp_path / "signed.obj")


def test_certificates_and_keys_go_through_files(
    tmp_path: Path, torus: sigmark.Mesh, signed: sigmark.Signed, key: sigmark.SigningKey
) -> None:
    signed.certificate.save(tmp_path / "cert.json")
    key.public_key.save(tmp_path / "owner.pub.pem")
    assert sigmark.Certificate.read(tmp_path / "cert.json") == signed.certificate
    assert sigmark.Certificate.from_json(signed.certificate.to_json()) == signed.certificate
    verdict = sigmark.verify(signed.mesh, tmp_path / "cert.json", torus, str(tmp_path / "owner.pub.pem"))
    assert verdict.outcome == "verified"
    with pytest.raises(sigmark.CertificateError) as refused:
        sigmark.Certificate.from_json("{}")
    assert refused.value.variant == "Malformed"
    with pytest.raises(FileNotFoundError, match="nowhere.json"):
        sigmark.Certificate.read(tmp_path / "nowhere.json")

    locked = key.to_pem("correct horse")
    assert sigmark.SigningKey.from_pem(locked, "correct horse").public_key == key.public_key
    with pytest.raises(sigmark.KeysError, match="wrong"):
        sigmark.SigningKey.from_pem(locked, "battery")
    with pytest.raises(sigmark.KeysError) as locked_out:
        sigmark.SigningKey.from_pem(locked)
    assert locked_out.value.variant == "PassphraseNeeded"
    assert "PRIVATE" not in repr(key) and key.public_key.fingerprint in repr(key)
    assert len({key.public_key, sigmark.PublicKey.from_pem(key.public_key.to_pem())}) == 1


def test_small_meshes_hold_a_tag_and_smaller_ones_nothing(key: sigmark.SigningKey) -> None:
    small = sigmark.embed(sigmark.shapes.bumpy_torus(16, 12), key)
    assert small.certificate.payload == "tag"
    with pytest.raises(sigmark.MarkError):
        sigmark.embed(sigmark.shapes.sphere(1), key)
    with pytest.raises(ValueError, match="strength is loud"):
        sigmark.embed(sigmark.shapes.sphere(3), key, strength="loud")  # type: ignore[arg-type]


@pytest.mark.parametrize("bound", [1.0, 2.0, -0.1, float("inf"), float("nan")])
def test_no_bound_is_taken_by_which_everything_would_be_found(bound: float, torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    with pytest.raises(sigmark.SigmarkError) as refused:
        sigmark.verify(torus, signed.certificate, torus, p_bound=bound)
    assert refused.value.variant == "Bound"
    with pytest.raises(sigmark.SigmarkError):
        sigmark.trace(torus, torus, [signed.certificate], p_bound=bound)


def test_files_in_memory(torus: sigmark.Mesh) -> None:
    asset = sigmark.Asset.from_bytes(obj(torus))
    assert asset.format == "obj" and np.array_equal(asset.mesh.vertices, torus.vertices)
    assert b"# a comment that stays" in asset.with_vertices(2 * torus.vertices).to_bytes()
    with pytest.raises(sigmark.AssetError) as refused:
        sigmark.Asset.from_bytes(b"ply\nformat ascii 1.0\n", "ply")
    assert refused.value.variant == "Malformed"
    packed = sigmark.Asset.from_bytes(gzip.compress(obj(torus)))
    assert packed.format == "obj" and packed.is_gzipped
    with pytest.raises(sigmark.AssetError, match="no known format"):
        sigmark.Asset.from_bytes(b"a letter")
    with pytest.raises(sigmark.AssetError, match="nowhere.obj"):
        sigmark.read("nowhere.obj")


@pytest.mark.parametrize(
    "value",
    ["torus", "signed", "signed.certificate", "key", "key.public_key", "sigmark.verify(signed.mesh, signed.certificate, torus)"],
)
def test_results_are_frozen_and_say_what_they_are(
    value: str, torus: sigmark.Mesh, signed: sigmark.Signed, key: sigmark.SigningKey
) -> None:
    result = eval(value)
    assert repr(result).startswith(type(result).__name__ + "(")
    with pytest.raises(AttributeError):
        result.message = "another"
    with pytest.raises(AttributeError):
        result.anything = 1


def test_a_damaged_rig_costs_nobody_a_claim(torus: sigmark.Mesh, key: sigmark.SigningKey) -> None:
    original = sigmark.Asset.from_bytes(with_broken_rig(glb(torus)), "glb")
    signed = sigmark.embed(original, key)
    assert sigmark.verify(signed.mesh, signed.certificate, original, key.public_key).outcome == "verified"
    assert sigmark.trace(signed.mesh, original, [signed.certificate]).accused


def test_a_copy_that_its_own_rig_posed_is_read_by_it(
    tmp_path: Path, torus: sigmark.Mesh, key: sigmark.SigningKey
) -> None:
    share = np.clip(0.5 + torus.vertices[:, 0] / np.ptp(torus.vertices[:, 0]), 0.0, 1.0)
    original = tmp_path / "model.glb"
    original.write_bytes(rigged_glb(torus, np.c_[1.0 - share, share]))
    signed = sigmark.embed(original, key)

    def turned(points: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
        cos, sin = np.cos(angle), np.sin(angle)
        return np.asarray(points @ np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]))

    posed = (1.0 - share)[:, None] * signed.vertices + share[:, None] * turned(signed.vertices, 0.8)
    suspect = sigmark.Mesh(rotated(posed), torus.faces)
    verdict = sigmark.verify(suspect, signed.certificate, original, key.public_key)
    assert verdict.outcome == "verified" and verdict.is_evidence
    # No one transform takes a suspect back that was posed.
    assert verdict.to_dict()["registration"] == "rig" and verdict.transform is None
    # The same geometry without what was signed with it.
    bare = sigmark.verify(suspect, signed.certificate, sigmark.Mesh(torus.vertices, torus.faces))
    assert bare.to_dict()["registration"] != "rig"
