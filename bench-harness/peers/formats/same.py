"""Whether two GLB differ in positions and their bounds alone: python same.py BEFORE AFTER. Prints `same`, or what else differs."""

import json
import struct
import sys

SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}


def chunks(path: str) -> list[tuple[bytes, bytes]]:
    data = open(path, "rb").read()
    at, found = 12, []
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        found.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    return found


def main() -> int:
    before, after = (chunks(path) for path in sys.argv[1:3])
    if [kind for kind, _ in before] != [kind for kind, _ in after]:
        return say("other chunks")
    scenes = [json.loads(content[0][1]) for content in (before, after)]
    positions = {
        primitive["attributes"]["POSITION"] for mesh in scenes[0]["meshes"] for primitive in mesh["primitives"]
    }
    changeable = bytearray(len(before[1][1]))
    for number in positions:
        accessor = scenes[0]["accessors"][number]
        view = scenes[0]["bufferViews"][accessor["bufferView"]]
        size = 3 * SIZES[accessor["componentType"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        for i in range(accessor["count"]):
            at = start + i * view.get("byteStride", size)
            changeable[at : at + size] = b"\1" * size
        for scene in scenes:
            scene["accessors"][number].pop("min", None)
            scene["accessors"][number].pop("max", None)
    # As text, so that the order of keys counts.
    if json.dumps(scenes[0]) != json.dumps(scenes[1]):
        return say("the JSON, beyond bounds of positions")
    for (kind, old), (_, new) in zip(before[1:], after[1:]):
        if len(old) != len(new):
            return say(f"the length of {kind!r}")
        free = changeable if kind == b"BIN\0" else bytes(len(old))
        if any(a != b and not ok for a, b, ok in zip(old, new, free)):
            return say(f"bytes of {kind!r} that are no positions")
    return say("same")


def say(words: str) -> int:
    print(words)
    return 0


if __name__ == "__main__":
    sys.exit(main())
