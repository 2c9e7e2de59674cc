"""The example of a shop that signs at download."""

from __future__ import annotations

import sys
import threading
from pathlib import Path
from typing import Any

import pytest

import sigmark
import sigmark.shapes
from files import gltf, obj

pytest.importorskip("fastapi", reason="the service is FastAPI's")
pytest.importorskip("httpx", reason="FastAPI's test client needs httpx")

EXAMPLE = Path(__file__).parents[1] / "examples/downloads"


@pytest.fixture
def shop(tmp_path: Path, torus: sigmark.Mesh, key: sigmark.SigningKey, monkeypatch: pytest.MonkeyPatch) -> Any:
    from fastapi.testclient import TestClient

    (tmp_path / "models").mkdir()
    (tmp_path / "models/vase.obj").write_bytes(obj(torus))
    (tmp_path / "models/broken.obj").write_text("f 1 2 3\n")
    key.save(tmp_path / "shop.pem")
    for name, value in {"MODELS": "models", "CERTIFICATES": "certificates", "KEY": "shop.pem"}.items():
        monkeypatch.setenv(f"SHOP_{name}", str(tmp_path / value))
    monkeypatch.syspath_prepend(str(EXAMPLE))
    sys.modules.pop("service", None)
    import service  # type: ignore[import-not-found, unused-ignore]

    with TestClient(service.app) as client:
        yield client


def test_each_order_has_a_copy_that_names_it(shop: Any, tmp_path: Path) -> None:
    copies = {order: shop.get(f"/orders/{order}/vase.obj") for order in ("4711", "4712", "4713")}
    assert all(answer.status_code == 200 for answer in copies.values())
    assert len({answer.content for answer in copies.values()}) == 3
    assert shop.get("/orders/4712/vase.obj").content == copies["4712"].content
    certificates = sorted((tmp_path / "certificates").glob("*/vase.obj.cert.json"))
    assert [path.parent.name for path in certificates] == ["4711", "4712", "4713"]
    leak = sigmark.Asset.from_bytes(copies["4712"].content, "obj")
    traced = sigmark.trace(leak, tmp_path / "models/vase.obj", certificates)
    assert [accused.recipient for accused in traced.accused] == ["4712"]


def test_one_preparation_serves_all_who_wait_for_it(shop: Any) -> None:
    answers: list[int] = []
    asking = [threading.Thread(target=lambda i=i: answers.append(shop.get(f"/orders/{i}/vase.obj").status_code)) for i in range(8)]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    assert answers == [200] * 8 and names(shop.app.state.shop.shelf) == ["vase.obj"]


def names(shelf: Any) -> list[str]:
    return [name for name, _, _ in shelf.kept]


def test_one_model_is_prepared_at_a_time(shop: Any, tmp_path: Path, torus: sigmark.Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    prepare, under_way, most = sigmark.prepare, [0], [0]

    def counted(*arguments: Any, **options: Any) -> sigmark.Prepared:
        under_way[0] += 1
        most[0] = max(most[0], under_way[0])
        try:
            return prepare(*arguments, **options)
        finally:
            under_way[0] -= 1

    monkeypatch.setattr(sigmark, "prepare", counted)
    for i in range(4):
        (tmp_path / f"models/{i}.obj").write_bytes(obj(torus))
    answers: list[int] = []
    asking = [threading.Thread(target=lambda i=i: answers.append(shop.get(f"/orders/4711/{i}.obj").status_code)) for i in range(4)]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    assert answers == [200] * 4 and most == [1]


def test_a_model_that_was_replaced_is_prepared_anew(shop: Any, tmp_path: Path) -> None:
    model = tmp_path / "models/vase.obj"
    assert shop.get("/orders/4711/vase.obj").status_code == 200
    kept = sigmark.Certificate.read(tmp_path / "certificates/4711/vase.obj.cert.json").to_json()
    model.rename(tmp_path / "former.obj")
    model.write_bytes(obj(sigmark.shapes.bumpy_torus(seed=2)))
    # The order has a copy of the former: its certificate is the only one that names it.
    answer = shop.get("/orders/4711/vase.obj")
    assert answer.status_code == 500 and "another version of the model" in answer.json()["detail"]
    assert sigmark.Certificate.read(tmp_path / "certificates/4711/vase.obj.cert.json").to_json() == kept
    copy = shop.get("/orders/4712/vase.obj")
    assert copy.status_code == 200
    traced = sigmark.trace(sigmark.Asset.from_bytes(copy.content, "obj"), model, [tmp_path / "certificates/4712/vase.obj.cert.json"])
    assert [accused.recipient for accused in traced.accused] == ["4712"]


@pytest.mark.parametrize("same", [True, False], ids=["of the same copy", "of another"])
def test_a_certificate_that_another_process_saves_meanwhile_stays(shop: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, same: bool) -> None:
    import service  # type: ignore[import-not-found, unused-ignore]

    path = tmp_path / "certificates/4711/vase.obj.cert.json"
    own = shop.app.state.shop.shelf.key
    theirs = sigmark.embed(tmp_path / "models/vase.obj", own if same else sigmark.SigningKey.generate(), recipient="4711").certificate
    keep: Any = service.Shop._keep

    class Late:
        def __init__(self, certificate: sigmark.Certificate) -> None:
            self.certificate, self.digest = certificate, certificate.digest

        def save(self, path: Path, *, overwrite: bool = False) -> None:
            theirs.save(path)
            self.certificate.save(path, overwrite=overwrite)

    monkeypatch.setattr(service.Shop, "_keep", staticmethod(lambda certificate, path: keep(Late(certificate), path)))
    assert shop.get("/orders/4711/vase.obj").status_code == (200 if same else 500)
    assert sigmark.Certificate.read(path).to_json() == theirs.to_json()


def test_what_is_not_there_or_cannot_be_signed_is_said(shop: Any, tmp_path: Path) -> None:
    for path in ("/orders/4711/none.obj", "/orders/../4711/vase.obj", "/orders/4711/..%2Fshop.pem", "/orders/.ssh/vase.obj"):
        assert shop.get(path).status_code == 404
    broken = shop.get("/orders/4711/broken.obj")
    assert broken.status_code == 500 and "broken.obj" in broken.json()["detail"]
    assert not (tmp_path / "certificates/4711/broken.obj.cert.json").exists()
    assert shop.get("/orders/4711/vase.obj").status_code == 200


def test_a_model_that_keeps_its_shape_in_another_file_is_never_sent_without_its_mark(shop: Any, tmp_path: Path, torus: sigmark.Mesh) -> None:
    document, buffer = gltf(torus, "vase.bin")
    (tmp_path / "models/vase.gltf").write_bytes(document)
    (tmp_path / "models/vase.bin").write_bytes(buffer)
    answer = shop.get("/orders/4711/vase.gltf")
    assert answer.status_code == 500 and "vase.bin" in answer.json()["detail"] and "GLB" in answer.json()["detail"]
    assert not (tmp_path / "certificates/4711").exists()


def test_a_certificate_of_another_key_is_not_replaced(shop: Any, tmp_path: Path, torus: sigmark.Mesh) -> None:
    theirs = sigmark.embed(tmp_path / "models/vase.obj", sigmark.SigningKey.generate(), recipient="4711").certificate
    (tmp_path / "certificates/4711").mkdir(parents=True)
    theirs.save(tmp_path / "certificates/4711/vase.obj.cert.json")
    assert shop.get("/orders/4711/vase.obj").status_code == 500
    assert sigmark.Certificate.read(tmp_path / "certificates/4711/vase.obj.cert.json").to_json() == theirs.to_json()


def test_the_shelf_makes_room(shop: Any, tmp_path: Path, torus: sigmark.Mesh) -> None:
    shelf = shop.app.state.shop.shelf
    for i in range(3):
        (tmp_path / f"models/{i}.obj").write_bytes(obj(torus))
    shelf.room = int(2.5 * shelf.prepared("0.obj").nbytes)
    for name in ("1.obj", "0.obj", "2.obj"):
        shelf.prepared(name)
    assert names(shelf) == ["0.obj", "2.obj"]
