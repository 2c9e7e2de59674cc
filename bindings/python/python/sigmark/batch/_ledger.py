"""What is finished of a run that has not ended: one small file a row, so that nothing is lost or done twice whenever it is killed."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from .. import __version__
from ._places import Place

# Ends the folders of rows that failed, apart from the others: what was in the way may be gone when the next call comes.
FAILED = "-failed"


class Ledger:
    """The finished rows of a run."""

    def __init__(self, folder: str) -> None:
        self.folder = Place(folder)

    def finished(self, key: str) -> dict[str, Any] | None:
        """The result of a row; None while there is none."""
        for failed in (False, True):
            text = self._place(key, failed=failed).read_if_any()
            if text is not None:
                return dict(json.loads(text))
        return None

    def finish(self, key: str, result: dict[str, Any]) -> None:
        """Keeps the result of a row."""
        place = self._place(key, failed=result["error"] is not None)
        place.write(json.dumps(result, ensure_ascii=False).encode())

    def forget_failed(self) -> None:
        """Forgets the rows that have an error, so that they are tried again."""
        for name in self.folder.entries():
            if name.endswith(FAILED):
                (self.folder / name).delete_folder()

    def discard(self) -> None:
        """Forgets all rows."""
        self.folder.delete_folder()

    def _place(self, key: str, *, failed: bool) -> Place:
        # Folders of many thousand files are slow on most systems.
        return self.folder / (key[:2] + FAILED if failed else key[:2]) / f"{key}.json"


def key_of(operation: str, options: dict[str, Any], row: int, job: dict[str, Any]) -> str:
    """What a row's result depends on, but for the files that it names, and the passphrase: who reads the names of files could try out which it is."""
    named = {name: value for name, value in options.items() if name != "passphrase"}
    said = json.dumps([__version__, operation, named, row, job], sort_keys=True, ensure_ascii=False, default=str)
    return hashlib.sha256(said.encode()).hexdigest()
