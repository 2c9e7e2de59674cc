"""A shop's download: every buyer gets a copy of his own, signed when he asks for it.

A copy is sent when its certificate is on the disk, never before, so that no copy is out there that nobody could trace. The same order gives the same bytes: a download that broke off, or a
service that was killed, costs a second request and nothing else.
"""

from __future__ import annotations

import os
import re
import threading
from collections import OrderedDict
from collections.abc import AsyncIterator
from concurrent.futures import Future
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path

from fastapi import FastAPI, HTTPException, Response

import sigmark

# A model's name, size and time: what was computed of a file serves that file alone, not one that took its place.
Version = tuple[str, int, int]

NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}")


@dataclass
class Shelf:
    """What was computed of models, for as many of those last asked for as there is room for."""

    models: Path
    key: sigmark.SigningKey
    message: str
    room: int
    """Bytes of what is kept."""
    lock: threading.Lock = field(default_factory=threading.Lock)
    preparing: threading.Lock = field(default_factory=threading.Lock)
    kept: OrderedDict[Version, Future[sigmark.Prepared]] = field(default_factory=OrderedDict)

    def prepared(self, model: str) -> sigmark.Prepared:
        """Computed by the first who asks; others wait for it."""
        status = (self.models / model).stat()
        version = (model, status.st_size, status.st_mtime_ns)
        with self.lock:
            first = version not in self.kept
            future = self.kept.setdefault(version, Future())
            self.kept.move_to_end(version)
        if first:
            try:
                # One at a time: it takes all processors, and memory before there is a number to make room by.
                with self.preparing:
                    future.set_result(sigmark.prepare(self._one_file(model), self.key, message=self.message))
            except BaseException as error:
                with self.lock:
                    del self.kept[version]
                future.set_exception(error)
                raise
            self._make_room()
        return future.result()

    def _one_file(self, model: str) -> sigmark.Asset:
        """A download is one file: what a model keeps in others, the mark among it, would stay behind."""
        asset = sigmark.read(self.models / model)
        if asset.companions:
            raise HTTPException(500, f"{model} refers to {', '.join(asset.companions)}: save it as GLB, with all that belongs to it inside")
        return asset

    def _make_room(self) -> None:
        with self.lock:
            done = [version for version, future in self.kept.items() if future.done()]
            taken = sum(self.kept[version].result().nbytes for version in done)
            # The one that was asked for last stays, however large it is.
            for version in done[:-1]:
                if taken <= self.room:
                    break
                taken -= self.kept.pop(version).result().nbytes


class Shop:
    """The shop's files, and what signs them."""

    def __init__(self) -> None:
        self.models = Path(os.environ["SHOP_MODELS"])
        self.certificates = Path(os.environ["SHOP_CERTIFICATES"])
        key = sigmark.SigningKey.read(os.environ["SHOP_KEY"], os.environ.get("SHOP_PASSPHRASE"))
        room = int(float(os.environ.get("SHOP_GIGABYTES", "2")) * 1e9)
        self.shelf = Shelf(self.models, key, os.environ.get("SHOP_MESSAGE", ""), room)
        # More copies at once would only wait for each other.
        self.signing = threading.Semaphore(os.cpu_count() or 1)

    def copy(self, model: str, order: str) -> bytes:
        """The copy of a model for an order."""
        prepared = self.shelf.prepared(model)
        with self.signing:
            signed = prepared.embed(order, threads=1)
        assert signed.asset, "a file was signed"
        data = signed.asset.to_bytes()
        self._keep(signed.certificate, self.certificates / order / f"{model}.cert.json")
        return data

    @staticmethod
    def _keep(certificate: sigmark.Certificate, path: Path) -> None:
        """Whole or not at all, and there before the copy is."""
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            certificate.save(path)
        except sigmark.AssetError:
            # Two requests of one order write the same, here or in another process.
            if not path.exists():
                raise
            if sigmark.Certificate.read(path).digest != certificate.digest:
                raise HTTPException(500, f"{path.name} of this order is there, of a copy of another version of the model, or by another key: nothing is sent") from None


@asynccontextmanager
async def opened(app: FastAPI) -> AsyncIterator[None]:
    app.state.shop = Shop()
    yield


app = FastAPI(title="Downloads", lifespan=opened)


@app.get("/orders/{order}/{model}")
def download(order: str, model: str) -> Response:
    """The buyer's copy. Who may ask for which order is for the shop to check before."""
    shop: Shop = app.state.shop
    if not NAME.fullmatch(order) or not NAME.fullmatch(model) or not (shop.models / model).is_file():
        raise HTTPException(404, "there is no such model or order")
    try:
        data = shop.copy(model, order)
    except sigmark.Error as error:
        raise HTTPException(500, f"{model} can't be signed: {error}") from error
    return Response(data, media_type="application/octet-stream", headers={"Content-Disposition": f'attachment; filename="{model}"'})
