"""The command that the wheel brings."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import sigmark
import sigmark.shapes
from files import obj


def script() -> str:
    found = shutil.which("sigmark", path=str(Path(sys.executable).parent))
    assert found, "the wheel puts the command beside the interpreter"
    return found


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([script(), *map(str, arguments)], capture_output=True, text=True, stdin=subprocess.DEVNULL)


def test_exit_codes_are_those_of_the_program(tmp_path: Path, torus: sigmark.Mesh) -> None:
    helped = run("--help")
    assert helped.returncode == 0 and "keygen" in helped.stdout and not helped.stderr
    assert run("--version").stdout.split() == ["sigmark", sigmark.__version__]
    nothing = run()
    assert nothing.returncode == 2
    wrong = run("embd")
    assert wrong.returncode == 2 and wrong.stderr.startswith("sigmark: ") and wrong.stderr.count("\n") == 1

    model, key = tmp_path / "model.obj", tmp_path / "owner.pem"
    model.write_bytes(obj(torus))
    assert run("keygen", "-o", key).returncode == 0
    signed = tmp_path / "signed.obj"
    embedded = run("embed", model, "-o", signed, "--key", key, "--message", "© 2026")
    assert embedded.returncode == 0, embedded.stderr
    certificate = f"{signed}.cert.json"
    verified = run("verify", signed, "--certificate", certificate)
    assert verified.returncode == 0 and verified.stdout.startswith("VERIFIED")
    assert run("verify", model, "--certificate", certificate).returncode == 1
    assert run("verify", tmp_path / "nowhere.obj", "--certificate", certificate).returncode == 2


def test_names_that_are_no_text_reach_the_command(tmp_path: Path) -> None:
    if sys.platform != "linux":
        pytest.skip("names of files are text here")
    name = os.fsencode(tmp_path) + b"/caf\xe9.obj"
    inspected = subprocess.run([script().encode(), b"inspect", name], capture_output=True)
    assert inspected.returncode == 2 and b"cannot be read" in inspected.stderr, inspected.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals can't be sent")
def test_ctrl_c_ends_it_as_it_ends_the_program(tmp_path: Path) -> None:
    model = tmp_path / "model.obj"
    model.write_bytes(obj(sigmark.shapes.sphere(6)))
    process = subprocess.Popen(
        [script(), "spectrum", str(model), "-k", "600", "-o", str(tmp_path / "out.npz")],
        stderr=subprocess.PIPE, text=True,
    )
    time.sleep(2.0)
    process.send_signal(signal.SIGINT)
    begun = time.monotonic()
    _, said = process.communicate(timeout=10)
    assert time.monotonic() - begun < 2.0
    assert process.returncode == 130
    assert said == "sigmark: interrupted; no file is half-written\n"
    assert not (tmp_path / "out.npz").exists()
