"""Whether two files differ in positions alone: python same.py BEFORE AFTER. Prints `same`, or what else differs.

In glTF and GLB the bounds of positions may differ, too; in OBJ the three coordinates of a vertex.
"""

import base64
import json
import re
import struct
import sys
from pathlib import Path

SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
BOUNDS = re.compile(rb'"(min|max)"\s*:\s*\[[^\]]*\]')
DATA = re.compile(rb'"data:[^"]*"')


class Scene:
    """The JSON of a glTF or GLB, its buffers, and what else it holds."""

    def __init__(self, path: Path):
        data = path.read_bytes()
        self.chunks = list(chunks(data)) if data[:4] == b"glTF" else [(b"JSON", data)]
        self.text = self.chunks[0][1]
        self.json = json.loads(self.text)
        self.buffers = [self.buffer(path, buffer.get("uri")) for buffer in self.json.get("buffers", [])]

    def buffer(self, path: Path, uri: str | None) -> bytes:
        if uri is None:
            return next(content for kind, content in self.chunks if kind == b"BIN\0")
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        return (path.parent / uri).read_bytes()

    def outside(self) -> tuple[bytes, str]:
        """The text without any bounds and data, and its meaning without the bounds of positions and without data."""
        meaning = json.loads(self.text)
        for number in positions(meaning):
            meaning["accessors"][number].pop("min", None)
            meaning["accessors"][number].pop("max", None)
        for buffer in meaning.get("buffers", []):
            if buffer.get("uri", "").startswith("data:"):
                del buffer["uri"]
        return DATA.sub(b"", BOUNDS.sub(b"", self.text)).rstrip(b" "), json.dumps(meaning)


def chunks(data: bytes):
    at = 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        yield kind, data[at + 8 : at + 8 + length]
        at += 8 + length


def positions(scene: dict) -> set[int]:
    return {primitive["attributes"]["POSITION"] for mesh in scene["meshes"] for primitive in mesh["primitives"]}


def changeable(scene: Scene) -> list[bytearray]:
    """Which bytes of each buffer are positions."""
    masks = [bytearray(len(buffer)) for buffer in scene.buffers]
    for number in positions(scene.json):
        accessor = scene.json["accessors"][number]
        view = scene.json["bufferViews"][accessor["bufferView"]]
        size = 3 * SIZES[accessor["componentType"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        for i in range(accessor["count"]):
            at = start + i * view.get("byteStride", size)
            masks[view["buffer"]][at : at + size] = b"\1" * size
    return masks


def gltf(before: Path, after: Path) -> str:
    old, new = Scene(before), Scene(after)
    if [kind for kind, _ in old.chunks] != [kind for kind, _ in new.chunks]:
        return "other chunks"
    if old.outside() != new.outside():
        return "the JSON, beyond bounds of positions"
    for number, (a, b, mask) in enumerate(zip(old.buffers, new.buffers, changeable(old))):
        if len(a) != len(b):
            return f"the length of buffer {number}"
        if any(x != y and not ok for x, y, ok in zip(a, b, mask)):
            return f"bytes of buffer {number} that are no positions"
    others = [[chunk for chunk in scene.chunks[1:] if chunk[0] != b"BIN\0"] for scene in (old, new)]
    return "same" if others[0] == others[1] else "chunks that are not buffers"


def obj(before: Path, after: Path) -> str:
    def outside(line: bytes) -> list[bytes]:
        parts = re.split(rb"(\s+)", line)
        if parts[0] == b"v":
            parts[2:7:2] = [b"", b"", b""]
        return parts

    old, new = (path.read_bytes().split(b"\n") for path in (before, after))
    if len(old) != len(new):
        return "the number of lines"
    for number, (a, b) in enumerate(zip(old, new), 1):
        if outside(a) != outside(b):
            return f"line {number}, beyond a vertex' coordinates"
    return "same"


def main() -> int:
    before, after = map(Path, sys.argv[1:3])
    print((obj if before.suffix == ".obj" else gltf)(before, after))
    return 0


if __name__ == "__main__":
    sys.exit(main())
