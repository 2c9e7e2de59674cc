"""What is finished of a run that has not ended: one small file a row, so that nothing is lost or done twice whenever it is killed."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from .. import __version__
from ._places import Place


# Ends the names of folders of rows that failed.
FAILED = "-failed"


class Ledger:
    """The finished rows of a run."""

    def __init__(self, folder: str) -> None:
        self.folder = Place(folder)

    def begin(self) -> None:
        """Makes the folder, and forgets rows that failed in an earlier call: what was missing then may be there now."""
        self.folder.system.create_dir(self.folder.path, recursive=True)
        for name in self.folder.entries():
            if name.endswith(FAILED):
                (self.folder / name).delete_folder()

    def finished(self, key: str) -> dict[str, Any] | None:
        """The result of a row; None while there is none."""
        for folder in (key[:2], key[:2] + FAILED):
            text = (self.folder / folder / f"{key}.json").read_if_any()
            if text is not None:
                return dict(json.loads(text))
        return None

    def finish(self, key: str, result: dict[str, Any]) -> None:
        """Keeps the result of a row."""
        # Folders of many thousand files are slow on most systems.
        folder = key[:2] if result["error"] is None else key[:2] + FAILED
        (self.folder / folder / f"{key}.json").write(json.dumps(result, ensure_ascii=False).encode())

    def discard(self) -> None:
        """Forgets all rows: the run has ended."""
        self.folder.delete_folder()


def key_of(operation: str, options: dict[str, Any], row: int, job: dict[str, Any]) -> str:
    """What a row's result depends on, but for the files that it names."""
    # Names of files are seen by more people than a passphrase, and quickly tried.
    options = {name: option for name, option in options.items() if name != "passphrase"}
    said = json.dumps([__version__, operation, options, row, job], sort_keys=True, ensure_ascii=False, default=str)
    return hashlib.sha256(said.encode()).hexdigest()
