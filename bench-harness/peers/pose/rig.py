"""Gives a model a skeleton and Blender's automatic weights: python rig.py INPUT.ply OUTPUT.glb.

The skeleton has two bones to each of five tips, which are the vertices farthest from all tips so far, over edges: joints are the middles of
the vertices that are as far from their tip as a share of the way to the body.
"""

import heapq
import sys

import bpy
import numpy as np

TIPS = 5
SHARES = (0.03, 0.45)


def main() -> int:
    source, target = sys.argv[1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.ply_import(filepath=source)
    model = bpy.context.view_layer.objects.active
    for polygon in model.data.polygons:
        polygon.use_smooth = True
    points = np.array([vertex.co for vertex in model.data.vertices])
    body, limbs = skeleton(points, [tuple(edge.vertices) for edge in model.data.edges])

    armature = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
    bpy.context.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    diagonal = float(np.linalg.norm(points.max(0) - points.min(0)))
    root = bone(armature, "body", body, body + [0, 0, 0.05 * diagonal], None)
    for number, limb in enumerate(limbs):
        upper = bone(armature, f"upper.{number}", body, limb[1], root)
        bone(armature, f"lower.{number}", limb[1], limb[0], upper)
    bpy.ops.object.mode_set(mode="OBJECT")

    model.select_set(True)
    armature.select_set(True)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.parent_set(type="ARMATURE_AUTO")
    give_all_a_bone(model, armature, points)
    bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_yup=True)
    return 0


def bone(armature, name, head, tail, parent):
    made = armature.data.edit_bones.new(name)
    made.head, made.tail, made.parent = head, tail, parent
    return made


def skeleton(points, edges):
    neighbours = [[] for _ in points]
    for a, b in edges:
        length = float(np.linalg.norm(points[a] - points[b]))
        neighbours[a].append((b, length))
        neighbours[b].append((a, length))
    middle = points.mean(0)
    start = int(np.argmin(np.linalg.norm(points - middle, axis=1)))
    nearest, fields, tips = distances(neighbours, start), [], []
    for _ in range(TIPS):
        tip = int(np.argmax(np.where(np.isfinite(nearest), nearest, -1.0)))
        tips.append(tip)
        fields.append(distances(neighbours, tip))
        nearest = np.minimum(nearest, fields[-1])
    own = np.argmin(np.stack(fields), axis=0)
    limbs = []
    for number, field in enumerate(fields):
        of_tip = (own == number) & np.isfinite(field)
        far = field[of_tip].max()
        joints = []
        for share in SHARES:
            near = of_tip & (np.abs(field - share * far) <= 0.04 * far)
            joints.append(points[near if near.any() else tips[number]].reshape(-1, 3).mean(0))
        limbs.append(joints)
    return middle, limbs


def distances(neighbours, start):
    """Over edges, from a vertex (Dijkstra)."""
    found = np.full(len(neighbours), np.inf)
    found[start], queue = 0.0, [(0.0, start)]
    while queue:
        distance, vertex = heapq.heappop(queue)
        if distance > found[vertex]:
            continue
        for other, length in neighbours[vertex]:
            if distance + length < found[other]:
                found[other] = distance + length
                heapq.heappush(queue, (distance + length, other))
    return found


def give_all_a_bone(model, armature, points) -> None:
    """Vertices that the automatic weights left out follow the nearest bone."""
    bones = armature.data.bones
    middles = np.array([(np.array(b.head_local) + np.array(b.tail_local)) / 2 for b in bones])
    groups = [model.vertex_groups.get(b.name) or model.vertex_groups.new(name=b.name) for b in bones]
    left_out = 0
    for vertex in model.data.vertices:
        if sum(group.weight for group in vertex.groups) <= 0.0:
            nearest = int(np.argmin(np.linalg.norm(middles - points[vertex.index], axis=1)))
            groups[nearest].add([vertex.index], 1.0, "REPLACE")
            left_out += 1
    print(f"{left_out} of {len(points)} vertices follow the nearest bone")


if __name__ == "__main__":
    sys.exit(main())
