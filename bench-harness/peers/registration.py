"""Runs one of registration's peers, and prints what it found and what it cost, as one JSON object.

    registration.py icp PEER ORIGINAL SUSPECT    PEER: open3d, small_gicp, pymeshlab; from the pose in the files
    registration.py rays ORIGINAL SUSPECT        embreex through trimesh: along the normal of every vertex of ORIGINAL, both ways
    registration.py nearest ORIGINAL SUSPECT     pymeshlab: from samples of SUSPECT to the nearest points of ORIGINAL

Meshes are .ply files. Reading and building search trees is not timed, except where a peer does it inside the call.
"""

import json
import sys
import time

import numpy as np

# Pairs farther apart are not used, as a fraction of the diagonal; ours begins as wide.
GATE = 0.05
STEPS = 100
SAMPLES = 1_000_000


def timed(work):
    begun = time.process_time(), time.perf_counter()
    result = work()
    return result, {"cpu": time.process_time() - begun[0], "wall": time.perf_counter() - begun[1]}


def read(path):
    import trimesh

    return trimesh.load(path, process=False)


def icp(peer, original, suspect):
    """The 4 by 4 matrix, row by row, that takes SUSPECT to ORIGINAL."""
    matrix, cost = {"open3d": open3d, "small_gicp": small_gicp, "pymeshlab": meshlab}[peer](original, suspect)
    return {"matrix": np.asarray(matrix).tolist(), **cost}


def clouds(original, suspect):
    original, suspect = read(original), read(suspect)
    return original, suspect, GATE * np.linalg.norm(original.extents)


def open3d(original, suspect):
    """Point to plane, on vertices with the normals of the mesh."""
    import open3d as o3d

    original, suspect, gate = clouds(original, suspect)

    def cloud(mesh):
        # It takes arrays of its own alone.
        points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.array(mesh.vertices)))
        points.normals = o3d.utility.Vector3dVector(np.array(mesh.vertex_normals))
        return points

    target, source = cloud(original), cloud(suspect)
    method = o3d.pipelines.registration.TransformationEstimationPointToPlane()
    criteria = o3d.pipelines.registration.ICPConvergenceCriteria(1e-12, 1e-12, STEPS)
    run = lambda: o3d.pipelines.registration.registration_icp(source, target, gate, np.eye(4), method, criteria)
    result, cost = timed(run)
    return result.transformation, cost


def small_gicp(original, suspect):
    """Point to plane with its own normals, all vertices (no downsampling to speak of)."""
    import small_gicp as gicp

    original, suspect, gate = clouds(original, suspect)
    options = {"registration_type": "PLANE_ICP", "downsampling_resolution": 1e-5, "max_iterations": STEPS, "num_threads": 1}
    # It divides space into cells of the resolution: in units of the diagonal they stay within its integers.
    unit = np.linalg.norm(original.extents)
    target, source = np.asarray(original.vertices) / unit, np.asarray(suspect.vertices) / unit
    run = lambda: gicp.align(target, source, max_correspondence_distance=gate / unit, **options)
    result, cost = timed(run)
    matrix = np.array(result.T_target_source)
    matrix[:3, 3] *= unit
    return matrix, cost


def meshlab(original, suspect):
    """MeshLab's ICP between two meshes."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(original)
    meshes.load_new_mesh(suspect)
    # Its distances are absolute, and it stops as soon as the target is reached.
    diagonal = meshes.mesh(0).bounding_box().diagonal()
    options = {"mindistabs": GATE * diagonal, "trgdistabs": 1e-9 * diagonal, "samplenum": 20_000, "maxiternum": STEPS}
    run = lambda: meshes.compute_matrix_by_icp_between_meshes(referencemesh=0, sourcemesh=1, **options)
    _, cost = timed(run)
    return meshes.mesh(1).transform_matrix(), cost


def rays(original, suspect):
    """Both ways from every vertex: where the nearest hit lies."""
    original, suspect = read(original), read(suspect)
    origins, normals = np.array(original.vertices), np.array(original.vertex_normals)
    first = lambda count, side: suspect.ray.intersects_location(origins[:count], side * normals[:count], multiple_hits=False)
    first(10, 1)
    hits, cost = timed(lambda: (first(None, 1), first(None, -1)))
    seen = np.union1d(hits[0][1], hits[1][1])
    return {"queries": len(origins), "found": len(seen), **cost}


def nearest(original, suspect):
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(suspect)
    meshes.load_new_mesh(original)
    options = {"samplevert": False, "sampleedge": False, "sampleface": True, "samplenum": SAMPLES}
    limit = pymeshlab.PercentageValue(5)
    run = lambda: meshes.get_hausdorff_distance(sampledmesh=0, targetmesh=1, maxdist=limit, **options)
    report, cost = timed(run)
    return {"queries": int(report["n_samples"]), "rms": report["RMS"], **cost}


def main():
    task, *rest = sys.argv[1:]
    print(json.dumps({"icp": icp, "rays": rays, "nearest": nearest}[task](*rest)))


if __name__ == "__main__":
    main()
