"""What subdivision needs of a mesh, and decimation may have broken."""

import numpy

from mesh import Mesh
from meshlab import filtered


def repaired(mesh: Mesh) -> tuple[Mesh, dict[str, int]]:
    """A mesh whose edges have one or two triangles, and how many triangles went, by reason. Nothing of a mesh that is as good changes."""
    counts = {}
    for reason, repair in REPAIRS.items():
        after = repair(mesh)
        if len(after.faces) < len(mesh.faces):
            counts[reason] = len(mesh.faces) - len(after.faces)
            mesh = after
    return (mesh.compacted() if counts else mesh), counts


def without_degenerate(mesh: Mesh) -> Mesh:
    a, b, c = mesh.faces.T
    return Mesh(mesh.positions, mesh.faces[(a != b) & (b != c) & (c != a)])


def without_repeated(mesh: Mesh) -> Mesh:
    _, first = numpy.unique(numpy.sort(mesh.faces, axis=1), axis=0, return_index=True)
    return Mesh(mesh.positions, mesh.faces[numpy.sort(first)])


def without_crowded_edges(mesh: Mesh) -> Mesh:
    return filtered(mesh, "meshing_repair_non_manifold_edges", method="Remove Faces")


REPAIRS = {
    "triangles that name a vertex twice": without_degenerate,
    "triangles that are there twice": without_repeated,
    "triangles at edges with more than two": without_crowded_edges,
}
