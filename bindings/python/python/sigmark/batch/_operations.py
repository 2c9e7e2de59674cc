"""What is done for a job. A job is a row of the table: column names to values; a result is the columns that are added to it."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar, get_args

import pyarrow as pa

import sigmark

from ._places import Place

# As Daft hands strings on, whatever it was given.
TEXT = pa.large_string()

# Of how many originals a process keeps what it computed: up to a gigabyte each.
KEPT = 2

Format = Literal["obj", "ply", "stl", "off", "gltf", "glb", "3mf"]
FORMATS: tuple[Format, ...] = get_args(Format)

_Made = TypeVar("_Made")


@dataclass(frozen=True)
class Operation:
    """One kind of job."""

    name: str
    needs: tuple[str, ...]
    """The columns without which there is nothing to do."""
    may_have: tuple[str, ...]
    """Those that it reads where they are there."""
    gives: pa.Schema
    """The columns of a result. `details` is JSON; `error` says why the others are empty."""
    does: Callable[[Worker, dict[str, Any]], dict[str, Any]]
    writes: str | None = None
    """The column that says which file it writes."""

    @property
    def reads(self) -> tuple[str, ...]:
        """All columns that a result may depend on; they are text."""
        return self.needs + self.may_have


@dataclass
class Worker:
    """Works on one job after the other, and keeps what the next may need."""

    options: dict[str, Any]
    kept: OrderedDict[str, Any] = field(default_factory=OrderedDict)

    def result(self, operation: Operation, job: dict[str, Any]) -> dict[str, Any]:
        """The result of a job, or why there is none."""
        nothing = {name: None for name in operation.gives.names}
        try:
            return {**nothing, **operation.does(self, job)}
        except Exception as error:  # whatever is wrong with a file is said in its row
            return nothing | failure(error)

    def keep(self, key: str, make: Callable[[], _Made]) -> _Made:
        """What was made under this key before, if it is among the last."""
        if key not in self.kept:
            while len(self.kept) >= KEPT:
                self.kept.popitem(last=False)
            self.kept[key] = make()
        self.kept.move_to_end(key)
        made: _Made = self.kept[key]
        return made


def failure(error: Exception) -> dict[str, Any]:
    """The columns that say what went wrong."""
    return {"error": f"{type(error).__name__}: {error}"}


def _verify(worker: Worker, job: dict[str, Any]) -> dict[str, Any]:
    certificate, original = _text(job, "certificate"), _text(job, "original")
    key = job.get("public_key") or worker.options["public_key"]

    def verifier() -> sigmark.Verifier:
        return sigmark.Verifier(
            sigmark.Certificate.from_json(Place(certificate).read().decode()),
            _asset(original),
            None if key is None else sigmark.PublicKey.from_pem(Place(key).read().decode()),
            p_bound=worker.options["p_bound"],
        )

    kept = worker.keep(json.dumps([certificate, original, key]), verifier)
    verdict = kept.verify(_asset(_text(job, "suspect")), threads=worker.options["threads"])
    return {
        "outcome": verdict.outcome,
        "p_value": verdict.p_value,
        "margin": verdict.margin,
        "extraction_rate": verdict.extraction_rate,
        "overlap": verdict.overlap,
        "message": verdict.message,
        "own_key": verdict.own_key,
        "details": _json(verdict.to_dict()),
    }


def _embed(worker: Worker, job: dict[str, Any]) -> dict[str, Any]:
    model, output, message = _text(job, "model"), _text(job, "output"), job.get("message") or worker.options["message"]
    certificate = f"{output}.cert.json"

    def prepared() -> sigmark.Prepared:
        options = worker.options
        key = sigmark.SigningKey.from_pem(Place(options["key"]).read().decode(), options["passphrase"])
        return sigmark.prepare(
            _asset_alone(model), key, message=message, payload=options["payload"], strength=options["strength"], threads=options["threads"]
        )

    kept = worker.keep(json.dumps([model, message]), prepared)
    signed = kept.embed(job.get("recipient") or "", threads=worker.options["threads"])
    if signed.asset is None:
        raise ValueError(f"{model}: no file")
    signed.asset.check_name(Place(output).path)
    # Last the certificate: it says that its copy is whole.
    _write_once(Place(output), signed.asset.to_bytes(), private=False)
    _write_once(Place(certificate), signed.certificate.to_json().encode(), private=True)
    return {
        "certificate": certificate,
        "digest": signed.certificate.digest,
        "margin_predicted": signed.margin_predicted,
        "details": _json(signed.to_dict()),
    }


def _text(job: dict[str, Any], column: str) -> str:
    value = job.get(column)
    if not isinstance(value, str) or not value:
        raise ValueError(f"the column {column!r} is empty")
    return value


def _asset(name: str) -> sigmark.Asset:
    place = Place(name)
    # A model may name files beside it, which a path alone leads to.
    return sigmark.read(place.path) if place.is_local else sigmark.Asset.from_bytes(place.read(), _format(place.path))


def _format(path: str) -> Format | None:
    """The format that a name tells, which bytes that are packed don't; an archive's is that of the mesh inside."""
    ending = path.lower().removesuffix(".gz").rpartition(".")[2]
    return next((format for format in FORMATS if format == ending), None)


def _asset_alone(name: str) -> sigmark.Asset:
    """A file that needs no others: beside a copy, theirs would meet those of other copies."""
    asset = _asset(name)
    if asset.companions:
        raise ValueError(f"{name}: refers to {', '.join(asset.companions)}, and a copy is one file: save the model as GLB, with all that belongs to it inside, or put it into a zip archive")
    return asset


def _write_once(place: Place, data: bytes, *, private: bool) -> None:
    """Writes a file that nobody may have changed since: the same job gives the same bytes."""
    try:
        place.create(data, private=private)
    except FileExistsError:
        if place.read() != data:
            raise FileExistsError(f"{place.name} is there already, and is another file") from None


def _json(value: dict[str, Any]) -> str:
    return json.dumps(value, ensure_ascii=False, sort_keys=True)


def _columns(**types: pa.DataType) -> pa.Schema:
    return pa.schema([*types.items(), ("details", TEXT), ("error", TEXT)])


OPERATIONS = {
    operation.name: operation
    for operation in [
        Operation(
            "verify",
            ("suspect", "original", "certificate"),
            ("public_key",),
            _columns(
                outcome=TEXT,
                p_value=pa.float64(),
                margin=pa.float64(),
                extraction_rate=pa.float64(),
                overlap=pa.float64(),
                message=TEXT,
                own_key=pa.bool_(),
            ),
            _verify,
        ),
        Operation(
            "embed",
            ("model", "output"),
            ("recipient", "message"),
            _columns(certificate=TEXT, digest=TEXT, margin_predicted=pa.float64()),
            _embed,
            "output",
        ),
    ]
}
