"""Many models at once: whatever runs them and whatever is killed, the rows are those of a serial run."""

from __future__ import annotations

import gzip
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import sigmark
from files import archive, glb, gltf, obj, three_mf

pa = pytest.importorskip("pyarrow", reason="batches need pyarrow")
pytest.importorskip("daft", reason="batches are run by Daft")

from sigmark import batch  # noqa: E402

# Takes down the process that reads a file of this name, and notes which files are read: what a broken file, or a machine without memory, does.
POISON = """
import os, sigmark
read = sigmark.read
def reading(path):
    with open({log!r}, "a") as log:
        log.write(os.path.basename(path) + "\\n")
    if "poison" in str(path):
        os.kill(os.getpid(), 9)
    return read(path)
sigmark.read = reading
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, torus: sigmark.Mesh, key: sigmark.SigningKey) -> Path:
    """An original, its signed copy, copies of that, and their jobs."""
    folder = tmp_path_factory.mktemp("models")
    (folder / "model.obj").write_bytes(obj(torus))
    key.save(folder / "owner.pem")
    key.public_key.save(folder / "owner.pub.pem")
    sigmark.embed(folder / "model.obj", key, message="© 2026 Studio").save(folder / "signed.obj")
    for i in range(8):
        (folder / f"found{i}.obj").write_bytes((folder / "signed.obj").read_bytes())
    (folder / "broken.obj").write_text("f 1 2 3\n")
    (folder / "poison.obj").write_bytes((folder / "signed.obj").read_bytes())
    return folder


@pytest.fixture
def read_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The list of files that were read; `poison.obj` takes its reader down."""
    log, site = tmp_path / "read.txt", tmp_path / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(POISON.format(log=str(log)))
    monkeypatch.setenv("PYTHONPATH", str(site))
    log.write_text("")
    yield log


def jobs(folder: Path, *suspects: str) -> Any:
    return pa.table(
        {
            "suspect": [str(folder / name) for name in suspects],
            "original": [str(folder / "model.obj")] * len(suspects),
            "certificate": [str(folder / "signed.obj.cert.json")] * len(suspects),
            "ticket": list(range(100, 100 + len(suspects))),
        }
    )


SUSPECTS = ["found0.obj", "model.obj", "broken.obj", "missing.obj", "found1.obj", "found2.obj"]


def test_rows_are_those_of_a_serial_run(folder: Path, tmp_path: Path) -> None:
    key = str(folder / "owner.pub.pem")
    serial = batch.verify(jobs(folder, *SUSPECTS), tmp_path / "serial", public_key=key, engine="serial")
    native = batch.verify(jobs(folder, *SUSPECTS), tmp_path / "native", public_key=key, workers=2)
    assert (serial.rows, serial.errors) == (native.rows, native.errors) == (6, 2)
    assert serial.table().equals(native.table())
    rows = serial.table().to_pylist()
    assert [row["outcome"] for row in rows] == ["verified", "not_found", None, None, "verified", "verified"]
    assert [row["ticket"] for row in rows] == list(range(100, 106)) and [row["row"] for row in rows] == list(range(6))
    assert "broken.obj" in rows[2]["error"] and rows[3]["error"].startswith("AssetError") and rows[0]["error"] is None
    assert not (tmp_path / "serial/_ledger").exists() and (tmp_path / "serial/_SUCCESS").exists()


def test_complete_results_are_not_replaced_unasked(folder: Path, tmp_path: Path) -> None:
    one = jobs(folder, "found0.obj")
    batch.verify(one, tmp_path / "out", engine="serial")
    with pytest.raises(FileExistsError, match="overwrite=True"):
        batch.verify(one, tmp_path / "out", engine="serial")
    assert batch.verify(one, tmp_path / "out", engine="serial", overwrite=True).rows == 1


def test_tables_that_no_run_wrote_are_never_deleted(folder: Path, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    one = jobs(folder, "found0.obj")
    pq.write_table(one, tmp_path / "jobs.parquet")
    for overwrite in (False, True):
        with pytest.raises(FileExistsError, match="holds jobs.parquet.*name another folder"):
            batch.verify(tmp_path / "jobs.parquet", tmp_path, engine="serial", overwrite=overwrite)
    assert pq.read_table(tmp_path / "jobs.parquet").equals(one)
    assert [path.name for path in tmp_path.iterdir()] == ["jobs.parquet"]


def test_a_run_that_ended_before_its_first_row_is_taken_up(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "_ledger").mkdir()
    (tmp_path / "part-0.parquet").write_text("half")
    assert batch.verify(jobs(folder, "found0.obj"), tmp_path, engine="serial").rows == 1


def test_jobs_that_make_no_sense_are_refused(folder: Path, tmp_path: Path) -> None:
    one = jobs(folder, "found0.obj")
    with pytest.raises(ValueError, match="no column 'certificate'"):
        batch.verify(one.drop_columns(["certificate"]), tmp_path / "out")
    with pytest.raises(ValueError, match="a column 'error' of their own"):
        batch.verify(one.append_column("error", [["x"]]), tmp_path / "out")
    with pytest.raises(ValueError, match="more than one column 'ticket'"):
        batch.verify(one.append_column("ticket", [["x"]]), tmp_path / "out")
    with pytest.raises(ValueError, match="no jobs"):
        batch.verify(one.slice(0, 0), tmp_path / "out")
    with pytest.raises(ValueError, match="engine"):
        batch.verify(one, tmp_path / "out", engine="spark")  # type: ignore[arg-type]
    for bound in (0.0, 1.0, 2.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match=f"p_bound={bound} is not"):
            batch.verify(one, tmp_path / "out", p_bound=bound)
    for number in (0, -1):
        with pytest.raises(ValueError, match=f"workers is {number}; it is 1 at least"):
            batch.verify(one, tmp_path / "out", workers=number)
        with pytest.raises(ValueError, match=f"threads is {number}; it is 1 at least"):
            batch.embed(one, tmp_path / "out", key="none.pem", threads=number)
    assert not (tmp_path / "out").exists()


def test_a_file_that_takes_its_process_down_costs_its_own_row(folder: Path, tmp_path: Path, read_files: Path) -> None:
    suspects = ["found0.obj", "poison.obj", "found1.obj"]
    summary = batch.verify(jobs(folder, *suspects), tmp_path / "out", workers=1)
    rows = summary.table().to_pylist()
    assert [row["outcome"] for row in rows] == ["verified", None, "verified"]
    assert "signal 9" in rows[1]["error"]
    assert Counter(read_files.read_text().split())["poison.obj"] == 2


def start(folder: Path, output: Path, table: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "sigmark.batch", "verify", table, "-o", output, "--workers", "2"]
    command += ["--public-key", folder / "owner.pub.pem"]
    return subprocess.Popen(list(map(str, command)), start_new_session=True)


def wait_for_rows(output: Path, rows: int, process: subprocess.Popen[bytes]) -> set[str]:
    """The ledger's rows, as soon as there are so many."""
    until = time.monotonic() + 120
    while time.monotonic() < until and process.poll() is None:
        finished = {path.name for path in (output / "_ledger").glob("??/*.json")}
        if len(finished) >= rows:
            return finished
        time.sleep(0.02)
    raise AssertionError("the run did not come so far")


def test_rows_that_failed_are_tried_again_by_the_next_call_and_not_before(folder: Path, tmp_path: Path, read_files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sigmark.batch import _run

    suspects, output = jobs(folder, "found0.obj", "broken.obj").set_column(0, "suspect", [[str(folder / "found0.obj"), str(tmp_path / "later.obj")]]), tmp_path / "out"

    def ended(*_: Any) -> None:
        raise KeyboardInterrupt

    def reads() -> list[int]:
        count = Counter(read_files.read_text().split())
        return [count["found0.obj"], count["later.obj"]]

    with monkeypatch.context() as patch:
        patch.setattr(_run, "_ended", ended)
        with pytest.raises(KeyboardInterrupt):
            batch.verify(suspects, output, engine="serial")
    assert reads() == [1, 1] and len(list(output.glob("_ledger/??-failed/*.json"))) == 1
    (tmp_path / "later.obj").write_bytes((folder / "signed.obj").read_bytes())
    assert batch.verify(suspects, output, engine="serial").table()["error"].to_pylist() == [None, None]
    assert reads() == [1, 2]


def test_a_run_that_ends_early_does_not_repeat_what_failed(folder: Path, tmp_path: Path, read_files: Path) -> None:
    from sigmark.batch._child import Child

    options = {"public_key": None, "p_bound": 1e-6, "threads": 1}
    [job] = jobs(folder, "missing.obj").to_pylist()
    results = []
    for _ in range(2):
        child = Child("verify", options, str(tmp_path / "_ledger"))
        results.append(child.result(0, job))
        child.close()
    assert results[0] == results[1] and "missing.obj" in results[0]["error"]
    assert Counter(read_files.read_text().split())["missing.obj"] == 1


def test_an_ended_run_never_answers_for_the_next(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sigmark.batch._ledger import Ledger

    (tmp_path / "found.obj").write_bytes((folder / "signed.obj").read_bytes())
    one = jobs(tmp_path, "found.obj").set_column(1, "original", [[str(folder / "model.obj")]])
    one = one.set_column(2, "certificate", [[str(folder / "signed.obj.cert.json")]])
    with monkeypatch.context() as patch:
        # As one that is killed between its last two steps.
        patch.setattr(Ledger, "discard", lambda _: None)
        assert batch.verify(one, tmp_path / "out", engine="serial").table()["outcome"].to_pylist() == ["verified"]
    assert (tmp_path / "out/_ledger").exists() and (tmp_path / "out/_SUCCESS").exists()
    (tmp_path / "found.obj").write_bytes((folder / "model.obj").read_bytes())
    assert batch.verify(one, tmp_path / "out", engine="serial", overwrite=True).table()["outcome"].to_pylist() == ["not_found"]


def test_names_in_the_ledger_tell_nothing_of_the_passphrase() -> None:
    from sigmark.batch._ledger import key_of

    keys = {key_of("embed", {"key": "shop.pem", "passphrase": passphrase}, 0, {"model": "a.obj"}) for passphrase in (None, "secret")}
    assert len(keys) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
@pytest.mark.parametrize("who", ["a worker", "all"])
def test_what_is_killed_loses_nothing_and_repeats_nothing(folder: Path, tmp_path: Path, read_files: Path, who: str) -> None:
    import pyarrow.parquet as pq

    names, output, table = [f"found{i % 8}.obj" for i in range(24)], tmp_path / "out", tmp_path / "jobs.parquet"
    for i in range(24):
        os.link(folder / names[i], tmp_path / f"suspect{i}.obj")
    suspects = jobs(folder, *names).set_column(0, "suspect", [[str(tmp_path / f"suspect{i}.obj") for i in range(24)]])
    pq.write_table(suspects, table)

    run = start(folder, output, table)
    wait_for_rows(output, 4, run)
    if who == "a worker":
        os.kill(workers_of(run.pid)[0], signal.SIGKILL)
    else:
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        # What was being worked on may still end.
        time.sleep(1)
        run = start(folder, output, table)
    assert run.wait(240) == 0

    serial = batch.verify(suspects, tmp_path / "serial", public_key=str(folder / "owner.pub.pem"), engine="serial")
    assert batch.Summary(24, 0, str(output)).table().equals(serial.table())
    # Once by the run and once by the serial one; and once more what was being worked on by the two.
    again = [count for name, count in Counter(read_files.read_text().split()).items() if name.startswith("suspect") and count > 2]
    assert len(again) <= 2 and all(count == 3 for count in again)


def workers_of(process: int) -> list[int]:
    """The processes that Daft works in."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            line = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if parent == process and b"daft" in line:
            found.append(int(entry.name))
    assert found
    return found


def test_copies_are_those_of_embed(folder: Path, tmp_path: Path, key: sigmark.SigningKey) -> None:
    buyers = ["Anna", "Bert", "Carl"]
    orders = pa.table(
        {
            "model": [str(folder / "model.obj")] * 3 + [str(folder / "broken.obj")],
            "recipient": [*buyers, "Dora"],
            "output": [str(tmp_path / f"copies/{name}.obj") for name in [*buyers, "Dora"]],
        }
    )
    arguments: dict[str, Any] = {"key": str(folder / "owner.pem"), "message": "© 2026 Studio", "workers": 2}
    summary = batch.embed(orders, tmp_path / "native", **arguments)
    assert (summary.rows, summary.errors) == (4, 1)
    for buyer, row in zip(buyers, summary.table().to_pylist()):
        alone = sigmark.embed(folder / "model.obj", key, message="© 2026 Studio", recipient=buyer)
        assert alone.asset and Path(row["output"]).read_bytes() == alone.asset.to_bytes()
        assert sigmark.Certificate.read(row["certificate"]).to_json() == alone.certificate.to_json()
        assert os.stat(row["certificate"]).st_mode & 0o077 == 0 or os.name == "nt"
    # Once more, where all is there already; and where another file is.
    assert batch.embed(orders, tmp_path / "again", **arguments).table().equals(summary.table())
    Path(orders["output"][0].as_py()).write_text("mine")
    again = batch.embed(orders, tmp_path / "third", **arguments).table().to_pylist()
    assert "is another file" in again[0]["error"] and again[1]["error"] is None
    assert Path(orders["output"][0].as_py()).read_text() == "mine"


@pytest.mark.parametrize("engine", ["serial", "native"])
def test_copies_and_jobs_may_lie_among_the_results(folder: Path, tmp_path: Path, engine: Any) -> None:
    (tmp_path / "orders.csv").write_text(f"model,output\n{folder / 'model.obj'},{tmp_path / 'copies/Anna.obj'}\n{folder / 'model.obj'},{tmp_path / 'Bert.obj'}\n")
    summary = batch.embed(tmp_path / "orders.csv", tmp_path, key=str(folder / "owner.pem"), engine=engine, workers=1)
    assert (summary.rows, summary.errors, summary.table().num_rows) == (2, 0, 2)
    assert (tmp_path / "copies/Anna.obj").exists() and (tmp_path / "orders.csv").exists()


def test_two_copies_are_never_written_to_one_place(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    outputs = ["Bert.obj", "copies/Anna.obj", f"{tmp_path}/copies/../copies//Anna.obj"]
    orders = pa.table({"model": [str(folder / "model.obj")] * 3, "output": outputs, "recipient": ["Bert", "Anna", "Carl"]})
    arguments: dict[str, Any] = {"key": str(folder / "owner.pem"), "workers": 2}
    with pytest.raises(ValueError, match="rows 1 and 2 both write .*Anna.obj, "):
        batch.embed(orders, tmp_path / "out", **arguments)
    assert list(tmp_path.iterdir()) == []
    # One job twice is one copy.
    twice = orders.set_column(2, "recipient", [["Bert", "Anna", "Anna"]])
    rows = batch.embed(twice, tmp_path / "out", **arguments).table().to_pylist()
    assert [row["error"] for row in rows] == [None] * 3 and rows[1]["digest"] == rows[2]["digest"]


@pytest.mark.parametrize("links", [True, False], ids=["links", "no links"])
def test_what_is_created_never_takes_the_place_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool) -> None:
    from sigmark.batch._operations import _write_once
    from sigmark.batch._places import Place

    def no_links(*_: Any) -> None:
        raise PermissionError("no links here")

    if not links:
        monkeypatch.setattr(os, "link", no_links)
    place = Place(str(tmp_path / "copies/Anna.obj"))
    _write_once(place, b"Anna's", private=True)
    _write_once(place, b"Anna's", private=True)
    assert os.stat(place.path).st_mode & 0o077 == 0 or os.name == "nt"
    # Nobody had it when it was looked for.
    monkeypatch.setattr(Place, "exists", lambda _: False)
    _write_once(place, b"Anna's", private=False)
    with pytest.raises(FileExistsError, match="Anna.obj is there already, and is another file"):
        _write_once(place, b"Bert's", private=False)
    assert place.read() == b"Anna's" and os.listdir(tmp_path / "copies") == ["Anna.obj"]


def test_numbers_are_recipients_as_they_are_written(folder: Path, tmp_path: Path) -> None:
    """In a CSV 0042 is not 42, and 0 is somebody; an empty cell is nobody, and a row without a message has the run's."""
    names = ["0042", "0", ""]
    lines = [f"{folder / 'model.obj'},{tmp_path / f'copy{i}.obj'},{name},{'7' if i == 0 else ''}" for i, name in enumerate(names)]
    (tmp_path / "orders.csv").write_text("\n".join(["model,output,recipient,message", *lines]) + "\n")
    arguments: dict[str, Any] = {"key": str(folder / "owner.pem"), "message": "© 2026 Studio", "engine": "serial"}
    rows = batch.embed(tmp_path / "orders.csv", tmp_path / "csv", **arguments).table().to_pylist()
    certificates = [sigmark.Certificate.read(row["certificate"]) for row in rows]
    assert [certificate.recipient for certificate in certificates] == names
    assert [certificate.message for certificate in certificates] == ["7", "© 2026 Studio", "© 2026 Studio"]

    orders = pa.table({"model": [str(folder / "model.obj")] * 2, "output": [str(tmp_path / f"number{i}.obj") for i in range(2)], "recipient": [0, None]})
    rows = batch.embed(orders, tmp_path / "numbers", **arguments).table().to_pylist()
    assert [sigmark.Certificate.read(row["certificate"]).recipient for row in rows] == ["0", ""]
    with pytest.raises(ValueError, match="'recipient' is of type double: make it text, or whole numbers"):
        batch.embed(orders.set_column(2, "recipient", [[0.5, 1.5]]), tmp_path / "fractions", **arguments)


@pytest.mark.parametrize("engine", ["serial", "native"])
def test_columns_of_any_type_stay_beside_the_results(folder: Path, tmp_path: Path, engine: Any) -> None:
    from datetime import date, datetime
    from decimal import Decimal

    others = {"day": date(2026, 1, 2), "at": datetime(2026, 1, 2, 3, 4), "price": Decimal("9.90"), "blob": b"\xff\x00"}
    table = jobs(folder, "found0.obj")
    for name, value in others.items():
        table = table.append_column(name, [[value]])
    [row] = batch.verify(table, tmp_path / "out", engine=engine, workers=1).table().to_pylist()
    assert row["outcome"] == "verified" and {name: row[name] for name in others} == others


@pytest.mark.parametrize("engine", ["serial", "native"])
def test_columns_of_any_name_stay_beside_the_results(folder: Path, tmp_path: Path, engine: Any) -> None:
    others = {name: f"of {name}" for name in ("result", "*", "a.b", "a", "c0", "c1", "")}
    table = jobs(folder, "found0.obj")
    for name, value in others.items():
        table = table.append_column(name, [[value]])
    [row] = batch.verify(table, tmp_path / "out", engine=engine, workers=1).table().to_pylist()
    assert row["outcome"] == "verified" and {name: row[name] for name in others} == others
    assert list(row)[: len(table.column_names) + 1] == ["row", *table.column_names]


def test_a_copy_is_one_file_of_the_models_format_or_an_error(folder: Path, tmp_path: Path, torus: sigmark.Mesh) -> None:
    document, buffer = gltf(torus, "model.bin")
    (tmp_path / "model.gltf").write_bytes(document)
    (tmp_path / "model.bin").write_bytes(buffer)
    outputs = [tmp_path / "copies/Anna.gltf", tmp_path / "copies/Anna.glb"]
    orders = pa.table({"model": [str(tmp_path / "model.gltf"), str(folder / "model.obj")], "output": list(map(str, outputs))})
    summary = batch.embed(orders, tmp_path / "out", key=str(folder / "owner.pem"), engine="serial")
    beside, misnamed = (row["error"] for row in summary.table().to_pylist())
    assert "refers to model.bin" in beside and "save the model as GLB" in beside
    assert misnamed.startswith("AssetError") and ".obj" in misnamed
    assert not (tmp_path / "copies").exists()


def test_on_ray(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ray", reason="the cluster is Ray's")
    # Whoever starts a cluster says this; here it is one of this machine alone, in a process of its own, since a process has one engine.
    code = f"""
import ray
from sigmark import batch
import pyarrow.parquet as pq
ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
summary = batch.verify({str(tmp_path / "jobs.parquet")!r}, {str(tmp_path / "ray")!r}, engine="ray", workers=2, public_key={str(folder / "owner.pub.pem")!r})
assert summary.errors == 2, summary
"""
    import pyarrow.parquet as pq

    pq.write_table(jobs(folder, *SUSPECTS), tmp_path / "jobs.parquet")
    subprocess.run([sys.executable, "-c", code], check=True, timeout=300)
    serial = batch.verify(jobs(folder, *SUSPECTS), tmp_path / "serial", public_key=str(folder / "owner.pub.pem"), engine="serial")
    assert batch.Summary(6, 2, str(tmp_path / "ray")).table().equals(serial.table())


def test_the_command_says_what_is_wrong(folder: Path, tmp_path: Path) -> None:
    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "sigmark.batch", *map(str, arguments)], capture_output=True, text=True)

    assert "columns suspect, original, certificate" in run("--help").stdout
    missing = run("verify", tmp_path / "none.parquet", "-o", tmp_path / "out")
    assert missing.returncode == 2 and missing.stderr.startswith("sigmark.batch: ") and "Traceback" not in missing.stderr


@pytest.mark.parametrize("name", ["model.obj.gz", "MODEL.OBJ.GZ", "model.glb", "model.3mf", "model.zip"])
def test_packed_models_may_lie_on_object_storage(tmp_path: Path, torus: sigmark.Mesh, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    from sigmark.batch._operations import _asset
    from sigmark.batch._places import Place

    data = {"gz": gzip.compress(obj(torus)), "glb": glb(torus), "3mf": archive("3D/3dmodel.model", three_mf(torus)), "zip": archive("model.obj", obj(torus))}
    (tmp_path / name).write_bytes(data[name.lower().rpartition(".")[2]])
    at_hand = sigmark.read(tmp_path / name)
    monkeypatch.setattr(Place, "is_local", False)
    far_off = _asset(str(tmp_path / name))
    assert far_off.format == at_hand.format and far_off.to_bytes() == at_hand.to_bytes()
    far_off.check_name(name)
    copy = Place(str(tmp_path / f"copy of {name}"))
    copy.write(far_off.to_bytes())
    assert copy.read() == (tmp_path / f"copy of {name}").read_bytes() == far_off.to_bytes()


def test_everything_may_lie_on_object_storage(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    server = pytest.importorskip("moto.server", reason="moto stands for a store").ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    variables = {"AWS_ENDPOINT_URL": f"http://{host}:{port}", "AWS_ACCESS_KEY_ID": "id", "AWS_SECRET_ACCESS_KEY": "secret", "AWS_REGION": "us-east-1"}
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    try:
        import pyarrow.fs as fs

        store = fs.S3FileSystem(endpoint_override=variables["AWS_ENDPOINT_URL"], allow_bucket_creation=True)
        store.create_dir("shop")
        (tmp_path / "model.obj.gz").write_bytes(gzip.compress((folder / "model.obj").read_bytes()))
        for path in (folder / "model.obj", folder / "owner.pem", folder / "owner.pub.pem", tmp_path / "model.obj.gz"):
            with store.open_output_stream(f"shop/{path.name}", compression=None) as stream:
                stream.write(path.read_bytes())
        models = ["s3://shop/model.obj", "s3://shop/model.obj.gz"]
        orders = pa.table({"model": models, "recipient": ["Anna", "Bert"], "output": ["s3://shop/Anna.obj", "s3://shop/Bert.obj.gz"]})
        signed = batch.embed(orders, "s3://shop/signed", key="s3://shop/owner.pem", workers=2)
        assert signed.errors == 0, signed.table()
        # Once more, where all is there already.
        assert batch.embed(orders, "s3://shop/again", key="s3://shop/owner.pem", workers=2).table().equals(signed.table())
        copies = signed.table()
        suspects = pa.table({"suspect": copies["output"], "original": copies["model"], "certificate": copies["certificate"]})
        asked = batch.verify(suspects, "s3://shop/verdicts", public_key="s3://shop/owner.pub.pem", workers=2)
        assert asked.table()["outcome"].to_pylist() == ["verified", "verified"]
        kept = {entry.base_name for entry in store.get_file_info(fs.FileSelector("shop/verdicts"))}
        assert "_SUCCESS" in kept and "_ledger" not in kept
    finally:
        server.stop()
