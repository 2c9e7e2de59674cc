"""What many models cost in batches of sigmark.batch.

    batches.py MODEL FOLDER

Prints one object. MODEL is a file that is signed for many buyers, and whose copies are then verified; FOLDER is emptied.
"""

import gzip
import json
import os
import shutil
import sys
import time
from pathlib import Path

import pyarrow as pa

import sigmark
from sigmark import batch

ROWS = 40


def measured(run, engine):
    begin = time.perf_counter()
    summary = run(engine)
    cores = 1 if engine == "serial" else os.cpu_count()
    return {"rows": summary.rows, "errors": summary.errors, "wall": time.perf_counter() - begin, "cores": cores}, summary.table()


def main():
    model, folder = Path(sys.argv[1]), Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    data = model.read_bytes()
    if model.suffix == ".gz":
        model, data = model.with_suffix(""), gzip.decompress(data)
    original = folder / f"original{model.suffix}"
    original.write_bytes(data)
    key = sigmark.SigningKey.generate()
    key.save(folder / "shop.pem")
    key.public_key.save(folder / "shop.pub.pem")

    def embed(engine):
        copies = [str(folder / engine / f"{i}{model.suffix}") for i in range(ROWS)]
        orders = pa.table({"model": [str(original)] * ROWS, "recipient": [f"order {i}" for i in range(ROWS)], "output": copies})
        return batch.embed(orders, folder / f"embed-{engine}", key=str(folder / "shop.pem"), engine=engine)

    def verify(engine):
        copies = [str(folder / "serial" / f"{i}{model.suffix}") for i in range(ROWS)]
        certificates = [f"{copy}.cert.json" for copy in copies]
        jobs = pa.table({"suspect": copies, "original": [str(original)] * ROWS, "certificate": certificates})
        return batch.verify(jobs, folder / f"verify-{engine}", public_key=str(folder / "shop.pub.pem"), engine=engine)

    report = {"vertices": len(sigmark.read(original).mesh.vertices)}
    for name, run in (("embed", embed), ("verify", verify)):
        serial, expected = measured(run, "serial")
        native, found = measured(run, "native")
        own = ["output", "certificate"] if name == "embed" else []
        report[name] = {"serial": serial, "native": native, "same": found.drop_columns(own).equals(expected.drop_columns(own))}
    print(json.dumps(report))


main()
