"""Meshes in and out, through pymeshlab. A mesh is passed around in a set of its own: pymeshlab frees it with its set."""

import numpy
import pymeshlab


def load(path: str) -> pymeshlab.MeshSet:
    """The mesh of a file, with double-precision positions."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(path)
    return meshes


def save(meshes: pymeshlab.MeshSet, path: str) -> None:
    """Writes positions (doubles) and faces, nothing else, as binary PLY."""
    if not path.endswith(".ply"):
        raise SystemExit(f"{path}: attacked meshes are written as PLY; name a .ply file")
    mesh = meshes.current_mesh()
    bare = of_arrays(mesh.vertex_matrix(), mesh.face_matrix())
    bare.save_current_mesh(path, save_vertex_color=False, save_vertex_quality=False)


def of_arrays(positions: numpy.ndarray, faces: numpy.ndarray) -> pymeshlab.MeshSet:
    """A mesh of positions (#V by 3) and faces (#F by 3)."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=positions, face_matrix=faces))
    return meshes
