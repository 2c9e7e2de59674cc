"""What other libraries call the two arrays of a mesh."""

from __future__ import annotations

from typing import Any


def arrays_of(mesh: Any) -> tuple[Any, Any]:
    """Vertices and triangles of a mesh of another library. None of them is imported."""
    if hasattr(mesh, "current_mesh"):  # pymeshlab.MeshSet
        mesh = mesh.current_mesh()
    if hasattr(mesh, "vertex_matrix"):  # pymeshlab.Mesh
        return mesh.vertex_matrix(), mesh.face_matrix()
    if hasattr(mesh, "cells_dict"):  # meshio.Mesh
        return mesh.points, _triangles(mesh.cells_dict)
    if hasattr(mesh, "faces") and hasattr(mesh, "vertices"):  # trimesh.Trimesh, whose triangles are corners
        return mesh.vertices, mesh.faces
    if hasattr(mesh, "triangles") and hasattr(mesh, "vertices"):  # open3d.geometry.TriangleMesh
        return mesh.vertices, mesh.triangles
    raise TypeError(
        f"no mesh: an object of type {type(mesh).__name__} has neither vertices and faces, nor vertices and triangles, "
        "nor points and cells; make one with sigmark.Mesh(vertices, faces)"
    )


def _triangles(cells: dict[str, Any]) -> Any:
    if "triangle" not in cells:
        raise ValueError(f"the mesh has no triangles, but {', '.join(sorted(cells)) or 'nothing'}: triangulate it first")
    return cells["triangle"]
