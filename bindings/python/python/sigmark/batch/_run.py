"""A run: jobs in, a folder of Parquet out."""

from __future__ import annotations

import json
import os
from collections import Counter
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal

import pyarrow as pa
import pyarrow.csv
import pyarrow.dataset
import pyarrow.parquet as pq

from .. import __version__
from ._engines import by_daft, discard_parts, in_this_process, is_part
from ._ledger import Ledger
from ._operations import OPERATIONS, TEXT, Operation
from ._places import Place

Engine = Literal["native", "ray", "serial"]

# Says that a folder holds all rows.
ENDED = "_SUCCESS"


@dataclass(frozen=True)
class Summary:
    """How a run ended."""

    rows: int
    """Rows in the results, one a job."""
    errors: int
    """How many of them say why they are empty."""
    output: str
    """The folder of Parquet. `pyarrow.parquet.read_table`, pandas, Polars, DuckDB and Spark read it as one table; the column `row` has the order of the jobs."""

    def table(self) -> pa.Table:
        """The results in the order of the jobs."""
        return _rows(Place(self.output)).sort_by("row")


def verify(
    jobs: pa.Table | str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    public_key: str | None = None,
    p_bound: float = 1e-6,
    engine: Engine = "native",
    workers: int | None = None,
    threads: int = 1,
    overwrite: bool = False,
) -> Summary:
    """Asks of many suspects whether they are marked.

    Parameters
    ----------
    jobs : pyarrow.Table, or the place of a Parquet or CSV file
        Columns `suspect`, `original` and `certificate`: places of files; `public_key`, if each row has its own. Others stay beside the results.
    output : str
        A folder for the results.
    public_key : str, optional
        The place of the signer's key, for rows without one; by default the certificate's own, which shows no more than that somebody signed.
    p_bound : float, default 1e-6
        As `sigmark.verify` has it.
    engine : {"native", "ray", "serial"}
        Daft on this machine; Daft on the cluster of Ray that this process belongs to, or that RAY_ADDRESS names; or one row after the other without Daft.
    workers : int, optional
        How many rows are worked on at once, by default as many as there are processors: on a cluster, say how many that is.
    threads : int, default 1
        Threads a worker.
    overwrite : bool, default False
        Replace results that are complete.

    Returns
    -------
    Summary
        Its rows have `outcome`, `p_value`, `margin`, `extraction_rate`, `overlap`, `message`, `own_key`, `details` (what `sigmark verify --json` prints) and `error`.
    """
    if not 0 < p_bound < 1:
        raise ValueError(f"the largest p-value that counts is a number between 0 and 1: p_bound={p_bound} is not")
    options = {"public_key": public_key, "p_bound": p_bound, "threads": threads}
    return _run("verify", jobs, output, options, engine, workers, overwrite)


def embed(
    jobs: pa.Table | str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    key: str,
    passphrase: str | None = None,
    message: str = "",
    payload: Literal["signature", "tag"] | None = None,
    strength: Literal["subtle", "standard", "strong"] | None = None,
    engine: Engine = "native",
    workers: int | None = None,
    threads: int = 1,
    overwrite: bool = False,
) -> Summary:
    """Signs copies of models, each for its recipient.

    What was computed of a model serves its next rows, so rows of one model belong together. The same job gives the same bytes, so a copy that is there already is left; another file of
    that name is an error of its row. Nothing is signed where two different jobs name one `output`.

    Parameters
    ----------
    jobs : pyarrow.Table, or the place of a Parquet or CSV file
        Columns `model` and `output`, the places of the original and of its copy; if wanted `recipient`, text or whole numbers, and `message`. A copy is one file: a model with
        buffers, materials or textures beside it is an error of its row.
    output : str
        A folder for the results.
    key : str
        The place of the signing key, which every worker reads.
    passphrase, message, payload, strength
        As `sigmark.embed` has them; `message` is for rows without one.
    engine, workers, threads, overwrite
        As `verify` has them.

    Returns
    -------
    Summary
        Its rows have `certificate`, the place beside the copy, its `digest`, `margin_predicted`, `details` (what `sigmark embed --json` prints) and `error`.
    """
    options = {"key": key, "passphrase": passphrase, "message": message, "payload": payload, "strength": strength, "threads": threads}
    return _run("embed", jobs, output, options, engine, workers, overwrite)


def _run(
    name: str,
    jobs: pa.Table | str | os.PathLike[str],
    output: str | os.PathLike[str],
    options: dict[str, Any],
    engine: Engine,
    workers: int | None,
    overwrite: bool,
) -> Summary:
    operation, place = OPERATIONS[name], Place(os.fspath(output))
    if engine not in ("native", "ray", "serial"):
        raise ValueError(f'engine is {engine!r}; it is "native", "ray" or "serial"')
    for what, number in (("workers", workers), ("threads", options["threads"])):
        if number is not None and number < 1:
            raise ValueError(f"{what} is {number}; it is 1 at least")
    if (place / ENDED).exists() and not overwrite:
        raise FileExistsError(f"{place.name} has complete results already: name another folder, or give overwrite=True")
    table = _numbered(_read(jobs, operation), operation)
    _refuse_shared_places(table, operation)
    # What else a table holds may be of any type, and nobody who works on a row needs it.
    options |= {"columns": ["row", *(name for name in operation.reads if name in table.column_names)]}
    ledger = Ledger((place / "_ledger").name)
    _take(place, ledger)
    if engine == "serial":
        in_this_process(table, place, operation, options, ledger.folder.name)
    else:
        by_daft(table, place, operation, options, ledger.folder.name, engine, workers or os.cpu_count() or 1)
    return _ended(place, ledger, table.num_rows)


def _take(place: Place, ledger: Ledger) -> None:
    """Makes a folder this run's: what lies there of another run goes, and nothing else."""
    is_ours = (place / ENDED).exists() or ledger.folder.exists()
    others = [name for name in place.entries() if is_part(name)]
    if others and not is_ours:
        raise FileExistsError(f"{place.name} holds {others[0]}, which is of no run of this kind and would be deleted: name another folder")
    if (place / ENDED).exists():
        # A ledger beside it is of the run that ended, killed before its last step: files may have changed since.
        ledger.discard()
    # First the ledger, by which a later call knows the folder however this one ends.
    ledger.folder.system.create_dir(ledger.folder.path, recursive=True)
    if (place / ENDED).exists():
        (place / ENDED).delete()
    ledger.forget_failed()
    discard_parts(place)


def _ended(place: Place, ledger: Ledger, jobs: int) -> Summary:
    errors = _rows(place, ["row", "error"])
    if errors.num_rows != jobs:
        raise RuntimeError(f"{place.name} has {errors.num_rows} rows for {jobs} jobs; the same call goes on")
    summary = Summary(jobs, jobs - errors.column("error").null_count, place.name)
    said = {"rows": summary.rows, "errors": summary.errors, "sigmark": __version__}
    (place / ENDED).write(json.dumps(said).encode())
    ledger.discard()
    return summary


def _rows(place: Place, columns: list[str] | None = None) -> pa.Table:
    """The results, and nothing else that lies there: copies and jobs may be in the same folder."""
    parts = [(place / name).path for name in filter(is_part, place.entries())]
    return pyarrow.dataset.dataset(parts, filesystem=place.system, format="parquet").to_table(columns=columns)


def _read(jobs: pa.Table | str | os.PathLike[str], operation: Operation) -> pa.Table:
    if isinstance(jobs, pa.Table):
        return jobs
    place = Place(os.fspath(jobs))
    with place.system.open_input_file(place.path) as file:
        if not place.path.endswith(".csv"):
            return pq.read_table(file)
        # An order 0042 is not 42.
        as_written = pyarrow.csv.ConvertOptions(column_types=dict.fromkeys(operation.reads, TEXT))
        return pyarrow.csv.read_csv(file, convert_options=as_written)


def _numbered(jobs: pa.Table, operation: Operation) -> pa.Table:
    """The jobs with a first column `row`, from 0."""
    missing = [name for name in operation.needs if name not in jobs.column_names]
    if missing:
        raise ValueError(f"the jobs have no column {', '.join(map(repr, missing))}, but {', '.join(map(repr, jobs.column_names))}")
    twice = [name for name, count in Counter(jobs.column_names).items() if count > 1]
    if twice:
        raise ValueError(f"the jobs have more than one column {', '.join(map(repr, twice))}: rename all but one")
    taken = [name for name in ["row", *operation.gives.names] if name in jobs.column_names]
    if taken:
        raise ValueError(f"results have a column {', '.join(map(repr, taken))} of their own: rename the jobs'")
    if not jobs.num_rows:
        raise ValueError("there are no jobs")
    fields = [field.with_type(TEXT) if _becomes_text(field, operation) else field for field in jobs.schema]
    jobs = jobs.cast(pa.schema(fields))
    return jobs.add_column(0, "row", pa.array(range(jobs.num_rows), pa.int64()))


def _refuse_shared_places(jobs: pa.Table, operation: Operation) -> None:
    """Of two copies in one place one would be lost, and with it the certificate that tells whose the other is."""
    if operation.writes is None:
        return
    first: dict[str, int] = {}
    for row, name in enumerate(chain.from_iterable(chunk.to_pylist() for chunk in jobs.column(operation.writes).chunks)):
        if not name:
            continue
        place = _normal(name)
        other = first.setdefault(place, row)
        if other != row and _job(jobs, operation, other) != _job(jobs, operation, row):
            raise ValueError(f"rows {other} and {row} both write {place}, and are not the same job: name another place for one of them")


def _normal(name: str) -> str:
    """One name for a file that has several."""
    return name if "://" in name else os.path.normcase(os.path.normpath(os.path.abspath(name)))


def _job(jobs: pa.Table, operation: Operation, row: int) -> list[str]:
    """What is read of a row, but for the place, which may have several names; an empty cell is as good as none."""
    names = [name for name in operation.reads if name in jobs.column_names and name != operation.writes]
    return [jobs.column(name)[row].as_py() or "" for name in names]


def _becomes_text(field: pa.Field, operation: Operation) -> bool:
    """Strings do, and whatever the operation reads: an order's number is its name."""
    if field.name not in operation.reads:
        return bool(pa.types.is_string(field.type))
    values = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
    if any(is_such(values) for is_such in (pa.types.is_string, pa.types.is_large_string, pa.types.is_string_view, pa.types.is_integer, pa.types.is_null)):
        return True
    raise ValueError(f"the column {field.name!r} is of type {field.type}: make it text, or whole numbers")
