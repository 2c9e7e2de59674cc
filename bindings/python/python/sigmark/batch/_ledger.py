"""What is finished of a run that has not ended: one small file a row, so that nothing is lost or done twice whenever it is killed."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from .. import __version__
from ._places import Place


class Ledger:
    """The finished rows of a run."""

    def __init__(self, folder: str) -> None:
        self.folder = Place(folder)

    def finished(self, key: str) -> dict[str, Any] | None:
        """The result of a row; None while there is none."""
        text = self._place(key).read_if_any()
        return None if text is None else dict(json.loads(text))

    def finish(self, key: str, result: dict[str, Any]) -> None:
        """Keeps the result of a row."""
        self._place(key).write(json.dumps(result, ensure_ascii=False).encode())

    def discard(self) -> None:
        """Forgets all rows: the run has ended."""
        self.folder.delete_folder()

    def _place(self, key: str) -> Place:
        # Folders of many thousand files are slow on most systems.
        return self.folder / key[:2] / f"{key}.json"


def key_of(operation: str, options: dict[str, Any], row: int, job: dict[str, Any]) -> str:
    """What a row's result depends on, but for the files that it names."""
    said = json.dumps([__version__, operation, options, row, job], sort_keys=True, ensure_ascii=False, default=str)
    return hashlib.sha256(said.encode()).hexdigest()
