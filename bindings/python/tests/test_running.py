"""Long calls: Ctrl-C, progress, the interpreter's lock."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

import sigmark
import sigmark.shapes

# Some seconds of work on any machine.
LONG = 400


@pytest.fixture(scope="module")
def sphere() -> sigmark.Mesh:
    return sigmark.shapes.sphere(6)


@pytest.fixture
def heeds_signals() -> Iterator[None]:
    """What a shell starts in the background is told to pass Ctrl-C over."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(sys.platform == "win32", reason="signals can't be sent to oneself")
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("after", [0.05, 0.3, 1.0])
def test_ctrl_c_ends_a_call_within_a_fifth_of_a_second(
    sphere: sigmark.Mesh, threads: int, after: float, heeds_signals: None
) -> None:
    pressed: list[float] = []

    def press() -> None:
        time.sleep(after)
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press).start()
    with pytest.raises(KeyboardInterrupt):
        sigmark.spectrum(sphere, k=LONG, threads=threads)
    took = time.monotonic() - pressed[0]
    print(f"Ctrl-C ended the call after {1000 * took:.0f} ms")
    assert took < 0.2


def test_progress_is_told_and_may_end_the_call(torus: sigmark.Mesh, sphere: sigmark.Mesh) -> None:
    told: list[tuple[str, float]] = []
    sigmark.spectrum(torus, k=100, progress=lambda stage, done: told.append((stage, done)))
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["assembly", "ordering", "slicing", "solving", "finishing"][-len(stages) :] and stages
    assert all(0 <= done <= 1 for _, done in told)

    class Enough(Exception):
        pass

    def stop(stage: str, done: float) -> None:
        if stage == "solving" and done > 0:
            raise Enough

    begun = time.monotonic()
    with pytest.raises(Enough):
        sigmark.spectrum(sphere, k=LONG, progress=stop)
    assert time.monotonic() - begun < 30


def test_other_threads_go_on_meanwhile(sphere: sigmark.Mesh) -> None:
    def counted(seconds: float) -> float:
        count, end = 0, time.perf_counter() + seconds
        while time.perf_counter() < end:
            count += 1
        return count / seconds

    alone = counted(0.5)
    work = threading.Thread(target=lambda: sigmark.spectrum(sphere, k=120, threads=1))
    work.start()
    beside = counted(0.5)
    assert work.is_alive(), "the call was over too soon to tell"
    work.join()
    print(f"beside a call Python counts at {100 * beside / alone:.0f} % of its speed")
    # Where there is one processor, both share it.
    assert beside > 0.35 * alone


def test_two_meshes_in_two_threads_give_what_each_gives_alone() -> None:
    meshes = [sigmark.shapes.bumpy_torus(seed=seed) for seed in (1, 2)]
    alone = [sigmark.spectrum(mesh, k=60, threads=1).eigenvalues for mesh in meshes]
    together: dict[int, NDArray[np.float64]] = {}

    def solve(i: int) -> None:
        together[i] = sigmark.spectrum(meshes[i], k=60, threads=1).eigenvalues

    threads = [threading.Thread(target=solve, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(alone[i], together[i]) for i in range(2))


def test_one_verifier_serves_several_threads(torus: sigmark.Mesh, signed: sigmark.Signed) -> None:
    verifier = sigmark.Verifier(signed.certificate, torus)
    outcomes: list[str] = []
    threads = [threading.Thread(target=lambda: outcomes.append(verifier.verify(signed.mesh).outcome)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert outcomes == ["verified"] * 3


def test_importing_costs_little() -> None:
    code = "import time; begun = time.perf_counter(); import sigmark; print(time.perf_counter() - begun)"
    best = min(float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5))
    print(f"import sigmark: {1000 * best:.1f} ms")
    assert best < 0.05
