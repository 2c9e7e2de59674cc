"""The shop of bindings/python/examples/downloads under load: how long a buyer waits, and what is left when it is killed.

    downloads.py MODEL FOLDER SERVICE

Prints one object. MODEL is a file; FOLDER is for what the shop needs, and is emptied; SERVICE is the folder of service.py.
"""

import gzip
import hashlib
import http.client
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import threading
import time
from pathlib import Path

import sigmark

PORT = 18730
REQUESTS = 60


class Shop:
    def __init__(self, service, environment):
        self.command = [sys.executable, "-m", "uvicorn", "service:app", "--port", str(PORT), "--log-level", "error", "--app-dir", service]
        self.environment = environment

    def start(self):
        self.process = subprocess.Popen(self.command, env=os.environ | self.environment)
        until = time.monotonic() + 60
        while time.monotonic() < until:
            try:
                ask("/")
                return
            except OSError:
                time.sleep(0.05)
        raise SystemExit("the service does not answer")

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


def ask(path):
    """The status and the body; an OSError or an http.client.HTTPException where the service went away."""
    connection = http.client.HTTPConnection("127.0.0.1", PORT, timeout=300)
    try:
        connection.request("GET", path)
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def load(name, orders, clients, keep=None):
    """Seconds of each answer, when so many buyers ask at once, each for one order after the other; None where there was no answer."""
    waiting, seconds, lock = list(orders), [], threading.Lock()

    def client():
        while True:
            with lock:
                if not waiting:
                    return
                order = waiting.pop(0)
            begin = time.perf_counter()
            try:
                status, body = ask(f"/orders/{order}/{name}")
            except (OSError, http.client.HTTPException):
                status, body = None, b""
            with lock:
                seconds.append(time.perf_counter() - begin if status == 200 else None)
                if keep is not None and status == 200:
                    keep[order] = hashlib.sha256(body).hexdigest()

    threads = [threading.Thread(target=client) for _ in range(clients)]
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return seconds, time.perf_counter() - begin


def killed(shop, name, orders):
    """Kills the shop in the middle of a load, starts it again, and compares what buyers have with what they get when they ask again."""
    copies = {}
    load_thread = threading.Thread(target=lambda: load(name, orders, 4, copies))
    load_thread.start()
    while len(copies) < len(orders) // 3:
        time.sleep(0.005)
    shop.kill()
    load_thread.join()
    answered = dict(copies)
    begin = time.perf_counter()
    shop.start()
    again = {}
    seconds, _ = load(name, orders, 4, again)
    return {
        "orders": len(orders),
        "answered_before": len(answered),
        "answered_after": len(again),
        "same_bytes": sum(again.get(order) == copy for order, copy in answered.items()),
        "seconds_until_all_are_answered": time.perf_counter() - begin,
    }, again


def main():
    model, folder, service = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "models").mkdir(parents=True)
    data = model.read_bytes()
    if model.suffix == ".gz":
        model, data = model.with_suffix(""), gzip.decompress(data)
    name = f"model{model.suffix}"
    (folder / "models" / name).write_bytes(data)
    key = sigmark.SigningKey.generate()
    key.save(folder / "shop.pem")

    asset = sigmark.read(folder / "models" / name)
    begin = time.perf_counter()
    prepared = sigmark.prepare(asset, key)
    prepare = time.perf_counter() - begin
    embeds = []
    for i in range(9):
        begin = time.perf_counter()
        prepared.embed(f"warm {i}")
        embeds.append(time.perf_counter() - begin)

    shop = Shop(service, {"SHOP_MODELS": str(folder / "models"), "SHOP_CERTIFICATES": str(folder / "certificates"), "SHOP_KEY": str(folder / "shop.pem")})
    shop.start()
    [first], _ = load(name, ["first"], 1)
    loads = []
    for clients in (1, 4, 16):
        seconds, wall = load(name, [f"load-{clients}-{i}" for i in range(REQUESTS)], clients)
        ordered = sorted(second for second in seconds if second is not None)
        loads.append(
            {
                "clients": clients,
                "answered": len(ordered),
                "asked": REQUESTS,
                "p50": statistics.median(ordered),
                "p99": ordered[min(len(ordered) - 1, round(0.99 * len(ordered)))],
                "per_second": len(ordered) / wall,
            }
        )
    orders = [f"killed-{i}" for i in range(REQUESTS)]
    report, copies = killed(shop, name, orders)
    leak = sigmark.Asset.from_bytes(ask(f"/orders/{orders[-1]}/{name}")[1], asset.format)
    shop.kill()

    certificates = {path.parent.name: path for path in (folder / "certificates").glob(f"*/{name}.cert.json")}
    report["without_certificate"] = sum(order not in certificates for order in copies)
    traced = sigmark.trace(leak, folder / "models" / name, list(certificates.values()))
    report["certificates"] = len(certificates)
    report["leak_named"] = [accused.recipient for accused in traced.accused] == [orders[-1]]
    vertices = len(asset.mesh.vertices)
    print(json.dumps({"vertices": vertices, "bytes": len(data), "prepare": prepare, "embed": statistics.median(embeds), "first": first, "loads": loads, "killed": report}))


main()
