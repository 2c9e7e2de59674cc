"""Files, wherever they lie: a path of this machine, or a URI that pyarrow has a file system for."""

from __future__ import annotations

import os
import uuid
from pathlib import Path
from typing import Any

import pyarrow.fs as fs


def normal(name: str) -> str:
    """One name for all spellings of a path; a URI as it is."""
    return name if "://" in name else os.path.normcase(os.path.abspath(name))


class Place:
    """A file or a folder on some file system."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.system: Any
        if "://" in name:
            self.system, self.path = fs.FileSystem.from_uri(name)
        else:
            self.system, self.path = fs.LocalFileSystem(), os.path.abspath(name)

    @property
    def is_local(self) -> bool:
        return isinstance(self.system, fs.LocalFileSystem)

    def __truediv__(self, name: str) -> Place:
        return Place(f"{self.name.rstrip('/')}/{name}")

    def exists(self) -> bool:
        return bool(self.system.get_file_info(self.path).type != fs.FileType.NotFound)

    def read(self) -> bytes:
        with self.system.open_input_stream(self.path) as stream:
            return bytes(stream.read())

    def read_if_any(self) -> bytes | None:
        """None where there is no such file."""
        return self.read() if self.exists() else None

    def write(self, data: bytes, *, private: bool = False) -> None:
        """Writes the whole file or nothing of it; `private` keeps others of this machine from reading it."""
        if not self.is_local:
            # An object appears when all of it is there.
            with self.system.open_output_stream(self.path) as stream:
                stream.write(data)
            return
        path = Path(self.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
        try:
            with open(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600 if private else 0o666), "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(unfinished, path)
        finally:
            unfinished.unlink(missing_ok=True)

    def entries(self) -> list[str]:
        """The names of what lies in a folder, sorted; none where there is no folder."""
        found = self.system.get_file_info(fs.FileSelector(self.path, allow_not_found=True))
        return sorted(str(entry.base_name) for entry in found)

    def delete(self) -> None:
        self.system.delete_file(self.path)

    def delete_folder(self) -> None:
        if self.exists():
            self.system.delete_dir(self.path)
