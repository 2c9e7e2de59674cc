"""Files, wherever they lie: a path of this machine, or a URI that pyarrow has a file system for."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow.fs as fs


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
        # By default what ends in .gz would be unpacked here, and packed once more where it is written.
        with self.system.open_input_stream(self.path, compression=None) as stream:
            return bytes(stream.read())

    def read_if_any(self) -> bytes | None:
        """None where there is no such file."""
        return self.read() if self.exists() else None

    def write(self, data: bytes) -> None:
        """Writes the whole file or nothing of it, in the place of one that is there."""
        if self.is_local:
            with self._unfinished(data, 0o666) as unfinished:
                os.replace(unfinished, self.path)
        else:
            # An object appears when all of it is there.
            with self.system.open_output_stream(self.path, compression=None) as stream:
                stream.write(data)

    def create(self, data: bytes, *, private: bool = False) -> None:
        """As `write`, but a file that is there stays as it is: FileExistsError. `private` keeps others of this machine from reading it."""
        if self.exists():
            raise FileExistsError(f"{self.name} is there already")
        if self.is_local:
            with self._unfinished(data, 0o600 if private else 0o666) as unfinished:
                _publish(unfinished, Path(self.path))
        else:
            # What another creates at the same moment is not seen: stores have no call of this kind that pyarrow knows.
            self.write(data)

    @contextmanager
    def _unfinished(self, data: bytes, mode: int) -> Iterator[Path]:
        """All of a file under a name that nobody else takes; it goes away unless it is renamed."""
        path = Path(self.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
        try:
            with open(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            yield unfinished
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


def _publish(unfinished: Path, path: Path) -> None:
    """Gives a file its name, unless another has it."""
    try:
        os.link(unfinished, path)
    except FileExistsError:
        raise
    except (OSError, NotImplementedError):
        # Not every file system has links; a rename would take the place of what was there.
        if os.path.lexists(path):
            raise FileExistsError(f"{path} is there already") from None
        os.replace(unfinished, path)
