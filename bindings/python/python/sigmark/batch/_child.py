"""The process that works on jobs, and the one that feeds it: a file that takes the first one down costs no more than its own row."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import IO, Any

from ._ledger import Ledger, key_of
from ._operations import OPERATIONS, Operation, Worker

# One file may be killed for another's memory: the second death is its own.
TRIES = 2


class Child:
    """A process that works on the jobs of one operation, one after the other; and another one when it died."""

    def __init__(self, operation: str, options: dict[str, Any], ledger: str) -> None:
        self.operation: Operation = OPERATIONS[operation]
        self.options = options
        self.ledger = Ledger(ledger)
        self.process: subprocess.Popen[str] | None = None

    def result(self, row: int, job: dict[str, Any]) -> dict[str, Any]:
        """The result of a job: what the ledger has, or what is worked out now."""
        key = key_of(self.operation.name, self.options, row, job)
        finished = self.ledger.finished(key)
        if finished is None:
            finished = self._worked_out(job)
            self.ledger.finish(key, finished)
        return finished

    def close(self) -> None:
        """Ends the process."""
        if self.process and self.process.stdin:
            self.process.stdin.close()
            self.process.wait()
        self.process = None

    def _worked_out(self, job: dict[str, Any]) -> dict[str, Any]:
        ended = 0
        for _ in range(TRIES):
            process = self._alive()
            assert process.stdin and process.stdout
            try:
                _say(process.stdin, job)
                line = process.stdout.readline()
            except BrokenPipeError:
                line = ""
            if line:
                return dict(json.loads(line))
            ended = process.wait()
            self.process = None
        nothing = {name: None for name in self.operation.gives.names}
        return {**nothing, "error": f"the process that worked on it ended {TRIES} times ({_how(ended)})"}

    def _alive(self) -> subprocess.Popen[str]:
        if self.process is None:
            arguments = [sys.executable, "-c", "from sigmark.batch._child import main; main()"]
            # Ctrl-C is for the one who feeds it.
            self.process = subprocess.Popen(
                arguments, text=True, encoding="utf-8", stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
            )
            assert self.process.stdin
            _say(self.process.stdin, {"operation": self.operation.name, "options": self.options})
        return self.process


def _say(stream: IO[str], value: dict[str, Any]) -> None:
    print(json.dumps(value, ensure_ascii=False), file=stream, flush=True)


def _how(code: int) -> str:
    return f"exit code {code}" if code >= 0 else f"signal {-code}"


def main() -> None:
    """Works on the jobs of standard input, a line each."""
    # Whatever else prints, prints among the errors.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    sys.stdin.reconfigure(encoding="utf-8")  # type: ignore[union-attr]
    first = json.loads(sys.stdin.readline())
    operation, worker = OPERATIONS[first["operation"]], Worker(first["options"])
    for line in sys.stdin:
        _say(answers, worker.result(operation, json.loads(line)))

