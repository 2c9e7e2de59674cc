"""What runs jobs: this process, or Daft on this machine or on a cluster. The work itself is the same, and so are the rows."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ._child import Child
from ._operations import OPERATIONS, Operation
from ._places import Place

log = logging.getLogger("sigmark.batch")

# How often a run of the engine that ended early is begun anew without any row finished in between.
STALLED = 3


def table_of(operation: Operation, jobs: pa.Table, results: list[dict[str, Any]]) -> pa.Table:
    """The jobs' own columns, and those of their results."""
    added = pa.Table.from_pylist(results, schema=operation.gives)
    for name in operation.gives.names:
        jobs = jobs.append_column(operation.gives.field(name), added.column(name))
    return jobs


def in_this_process(jobs: pa.Table, output: Place, operation: Operation, options: dict[str, Any], ledger: str) -> None:
    """One row after the other."""
    child = Child(operation.name, options, ledger)
    results = [child.result(row.pop("row"), row) for row in jobs.select(options["columns"]).to_pylist()]
    child.close()
    rows = table_of(operation, jobs, results)
    pq.write_table(rows, (output / "part-0.parquet").path, filesystem=output.system)


def by_daft(jobs: pa.Table, output: Place, operation: Operation, options: dict[str, Any], ledger: str, engine: str, workers: int) -> None:
    """By Daft, on this machine or on the cluster that Ray was told of."""
    # Whom it is about is nobody's business.
    os.environ.setdefault("DAFT_ANALYTICS_ENABLED", "0")
    try:
        import daft
    except ImportError as error:
        raise ImportError('batches are run by Daft: pip install "sigmark[batch]", or take engine="serial"') from error
    _choose_runner(daft, engine)
    work = _work_for_daft(daft, operation, options, ledger, engine, workers)
    # Names of the jobs' own may mean something to Daft, as "*" and "a.b" do, or be that of the result.
    inner = {name: f"c{i}" for i, name in enumerate(jobs.column_names)}
    frame = daft.from_arrow(jobs.rename_columns(list(inner.values())))
    if engine == "ray":
        # Several a worker, so that none waits long for the slowest.
        frame = frame.into_partitions(max(1, min(jobs.num_rows, 4 * workers)))
    frame = frame.with_column("result", work(*[daft.col(inner[name]) for name in options["columns"]]))
    result = daft.col("result")
    columns = [daft.col(column).alias(name) for name, column in inner.items()]
    frame = frame.select(*columns, *(result[name].alias(name) for name in operation.gives.names))
    _until_it_ends(lambda: frame.write_parquet(output.name), output, Place(ledger))


def _choose_runner(daft: Any, engine: str) -> None:
    """A process has one, from its first use of Daft on."""
    try:
        daft.set_runner_ray() if engine == "ray" else daft.set_runner_native()
    except Exception as error:
        if "more than once" not in str(error):
            raise RuntimeError(f"Daft can't run on {engine!r}: {error}") from error
        chosen = daft.runners.get_or_infer_runner_type()
        if chosen != engine:
            raise ValueError(f"Daft runs on {chosen!r} in this process already: start another one for engine={engine!r}") from None


def _work_for_daft(daft: Any, operation: Operation, options: dict[str, Any], ledger: str, engine: str, workers: int) -> Any:
    """The function of columns that Daft calls, in as many processes as there are workers."""
    name, columns = operation.name, daft.DataType.from_arrow_type(pa.struct(list(operation.gives)))

    class Work:
        def __init__(self) -> None:
            self.child = Child(name, options, ledger)

        @daft.method.batch(return_dtype=columns, batch_size=1)  # type: ignore[untyped-decorator, unused-ignore]
        def __call__(self, *series: Any) -> pa.Array:
            jobs = [dict(zip(job_columns, values)) for values in zip(*(column.to_pylist() for column in series))]
            results = [self.child.result(job.pop("row"), job) for job in jobs]
            return pa.array(results, type=pa.struct(list(OPERATIONS[name].gives)))

    job_columns = options["columns"]
    return daft.cls(Work, max_concurrency=workers, use_process=True if engine == "native" else None)()


def _until_it_ends(run: Callable[[], Any], output: Place, ledger: Place) -> None:
    """Begins anew what ended early, as when a worker is killed: finished rows are in the ledger. Gives up when nothing gets done any more."""
    stalled, done = 0, _count(ledger)
    while True:
        try:
            run()
            return
        except Exception as error:
            now = _count(ledger)
            stalled = 0 if now > done else stalled + 1
            if stalled >= STALLED:
                raise
            log.warning("the run ended early and is begun anew, with %d rows finished: %s", now, error)
            done = now
            discard_parts(output)


def is_part(name: str) -> bool:
    """Whether a file of this name would be taken for one of the results."""
    return name.endswith(".parquet")


def discard_parts(output: Place) -> None:
    """Deletes what a run that ended early has written; its rows are in the ledger."""
    for name in filter(is_part, output.entries()):
        (output / name).delete()


def _count(ledger: Place) -> int:
    return sum(len((ledger / folder).entries()) for folder in ledger.entries())
