"""Small files of meshes."""

from __future__ import annotations

import io
import json
import struct
import zipfile

import numpy as np

import sigmark


def obj(mesh: sigmark.Mesh) -> bytes:
    lines = ["# a comment that stays"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()


def glb(mesh: sigmark.Mesh) -> bytes:
    """With a material and extras, which have to stay."""
    positions = mesh.vertices.astype("<f4")
    indices = mesh.faces.astype("<u4").tobytes()
    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    document = {
        "asset": {"version": "2.0", "extras": {"note": "stays"}},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "model"}],
        "materials": [{"name": "gold", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.8, 0.2, 1]}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": 5125, "count": mesh.faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes},
            {"buffer": 0, "byteOffset": positions.nbytes, "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": positions.nbytes + len(indices)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", positions.nbytes + len(indices), b"BIN\0") + positions.tobytes() + indices
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf(mesh: sigmark.Mesh, buffer: str) -> tuple[bytes, bytes]:
    """The same as a document and its buffer, a file of this name beside it."""
    plain = glb(mesh)
    length = struct.unpack_from("<I", plain, 12)[0]
    document = json.loads(plain[20 : 20 + length])
    document["buffers"][0]["uri"] = buffer
    return json.dumps(document).encode(), plain[28 + length :]


def three_mf(mesh: sigmark.Mesh) -> bytes:
    """The model's part of a 3MF."""
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in mesh.vertices.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces.tolist())
    inside = f'<object id="1" type="model"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>'
    space = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    return f'<model unit="millimeter" xmlns="{space}"><resources>{inside}</resources><build><item objectid="1"/></build></model>'.encode()


def archive(name: str, data: bytes) -> bytes:
    """A zip archive of one file."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr(name, data)
    return whole.getvalue()


def rigged_glb(mesh: sigmark.Mesh, weights: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> bytes:
    """The model with a joint for each column of weights, four at most."""
    joints, count = weights.shape[1], len(mesh.vertices)
    own = np.zeros((count, 4), "<f4")
    own[:, :joints] = weights
    views = [np.tile(np.arange(4, dtype=np.uint8) % joints, (count, 1)).tobytes(), own.tobytes()]
    plain = glb(mesh)
    length = struct.unpack_from("<I", plain, 12)[0]
    document, binary = json.loads(plain[20 : 20 + length]), plain[28 + length :]
    for number, (view, kind) in enumerate(zip(views, (5121, 5126), strict=True), start=2):
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(view)})
        document["accessors"].append({"bufferView": number, "componentType": kind, "count": count, "type": "VEC4"})
        binary += view
    document["buffers"][0]["byteLength"] = len(binary)
    document["nodes"] = [{"mesh": 0, "skin": 0}, *({} for _ in range(joints))]
    document["scenes"] = [{"nodes": list(range(joints + 1))}]
    document["skins"] = [{"joints": list(range(1, joints + 1))}]
    document["meshes"][0]["primitives"][0]["attributes"] |= {"JOINTS_0": 2, "WEIGHTS_0": 3}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def with_broken_rig(data: bytes) -> bytes:
    """The same model with a skin whose joints and weights are no such thing."""
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    document["skins"] = [{"joints": [0]}]
    document["nodes"][0]["skin"] = 0
    document["meshes"][0]["primitives"][0]["attributes"] |= {"JOINTS_0": 1, "WEIGHTS_0": 1}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON") + text + rest


def glb_parts(data: bytes) -> tuple[dict[str, object], np.ndarray[tuple[int], np.dtype[np.uint8]]]:
    """The document without the bounds of positions, and the binary chunk."""
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    for name in ("min", "max"):
        del document["accessors"][0][name]
    return document, np.frombuffer(data, np.uint8, offset=28 + length)
