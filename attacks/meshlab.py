"""MeshLab's filters as functions of a mesh."""

import pymeshlab

from mesh import Mesh, Refused


def filtered(mesh: Mesh, name: str, **options) -> Mesh:
    """What a filter makes of a mesh."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=mesh.positions, face_matrix=mesh.faces))
    try:
        meshes.apply_filter(name, **options)
    except pymeshlab.PyMeshLabException as error:
        raise Refused(f"MeshLab's {name}: {' '.join(str(error).split())}") from error
    result = meshes.current_mesh()
    result.compact()  # some filters leave holes in the arrays
    return Mesh(result.vertex_matrix(), result.face_matrix())
