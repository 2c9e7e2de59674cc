"""Mesh files in and out."""

import os

import numpy
import pymeshlab

from mesh import Mesh, Refused


def load(path: str) -> Mesh:
    """The mesh of a file of any kind that MeshLab reads."""
    if not os.path.isfile(path):
        raise Refused(f"{path}: no such file")
    meshes = pymeshlab.MeshSet(verbose=False)
    try:
        meshes.load_new_mesh(path)
        mesh = meshes.current_mesh()
        loaded = Mesh(mesh.vertex_matrix(), mesh.face_matrix())
    except pymeshlab.PyMeshLabException as error:
        raise Refused(f"{path}: {' '.join(str(error).split())}") from error
    try:
        return loaded.checked()
    except Refused as reason:
        raise Refused(f"{path}: {reason}") from reason


def save(mesh: Mesh, path: str) -> None:
    """Writes positions (doubles) and triangles as binary PLY, under a name of its own until the file is whole."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(mesh.positions)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    triangles = numpy.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    triangles["count"], triangles["corners"] = 3, mesh.faces
    partial = f"{path}.{os.getpid()}.partial"
    try:
        with open(partial, "wb") as file:
            file.write(header.encode())
            file.write(numpy.ascontiguousarray(mesh.positions, dtype="<f8").data)
            file.write(triangles.data)
        os.replace(partial, path)
    except OSError as error:
        raise Refused(f"{path}: {error.strerror}") from error
    finally:
        if os.path.exists(partial):
            os.remove(partial)
