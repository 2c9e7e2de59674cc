"""Poses a model by Blender and bakes it: python pose.py INPUT POSES.json. With --animations in place of poses it prints the first and the last frame of
each animation of the file.

POSES is a list of {"output": FILE, "pose": {...}, "after": {...}}. A pose is one of
  {"kind": "rest"}
  {"kind": "frame", "action": NUMBER, "frame": NUMBER}        an animation of the file's own
  {"kind": "bones", "degrees": MOST, "seed": N}               every bone but the first about an axis at random; with "preserve_volume" by dual quaternions
  {"kind": "targets", "seed": N}                              every morph target as far as a random number says
  {"kind": "twist" | "bend", "degrees": ANGLE}                the simple-deform modifier, along the longest axis
  {"kind": "lattice", "seed": N}                              a lattice of 4 x 4 x 4 points, moved by up to a twelfth of the diagonal
  {"kind": "proportional", "seed": N}                         three vertices pulled, those around them less (Blender's smooth falloff)
and what happens to it afterwards any of
  {"decimate": SHARE, "subdivide": LEVELS, "crop": true, "weld": true, "shuffle": SEED, "bits": N}
The format is the output's ending: obj, stl, glb or ply.
"""

import json
import math
import os
import sys

import bpy  # makes the next one known

import bmesh
import numpy as np


def main() -> int:
    source, jobs = sys.argv[1:]
    if jobs == "--animations":
        print("animations " + json.dumps(animations(source)))
        return 0
    with open(jobs, encoding="utf-8") as file:
        jobs = json.load(file)
    for job in jobs:
        if os.path.exists(job["output"]):
            continue
        model = posed(source, job["pose"])
        model = afterwards(model, job.get("after", {}))
        write(model, job["output"])
    return 0


def load(source: str):
    """The file's meshes and its armatures."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if source.endswith(".ply"):
        bpy.ops.wm.ply_import(filepath=source)
    else:
        bpy.ops.import_scene.gltf(filepath=source, disable_bone_shape=True)
    shown = [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]
    return shown, [thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE"]


def animations(source: str) -> list[list[int]]:
    meshes, armatures = load(source)
    ranges = []
    for thing in armatures or meshes:
        for track in thing.animation_data.nla_tracks if thing.animation_data else []:
            strips = track.strips
            ranges.append([math.floor(min(s.frame_start for s in strips)), math.ceil(max(s.frame_end for s in strips))])
        break
    return ranges


def posed(source: str, pose: dict):
    """The baked model, alone in its scene."""
    meshes, armatures = load(source)
    kind, random = pose["kind"], np.random.default_rng(pose.get("seed", 0))
    if kind != "frame":
        for thing in bpy.context.scene.objects:
            thing.animation_data_clear()
    for armature in armatures:
        armature.data.pose_position = "POSE" if kind in ("frame", "bones") else "REST"
    match kind:
        case "frame":
            for thing in [*armatures, *meshes]:
                animate(thing, pose["action"])
            bpy.context.scene.frame_set(pose["frame"])
        case "bones":
            for armature in armatures:
                turn_bones(armature, math.radians(pose["degrees"]), random)
            for mesh in meshes:
                for modifier in mesh.modifiers:
                    if modifier.type == "ARMATURE":
                        modifier.use_deform_preserve_volume = pose.get("preserve_volume", False)
        case "targets":
            for mesh in meshes:
                for key in mesh.data.shape_keys.key_blocks[1:] if mesh.data.shape_keys else []:
                    key.slider_min, key.slider_max = -2.0, 2.0
                    key.value = random.uniform(0.0, 1.0)
    model = baked()
    match kind:
        case "twist" | "bend":
            deform(model, kind.upper(), math.radians(pose["degrees"]))
        case "lattice":
            by_lattice(model, random)
        case "proportional":
            by_proportional_edits(model, random)
    return model


def animate(thing, number: int) -> None:
    """Plays one of the file's animations, which the importer keeps as tracks."""
    data = thing.animation_data
    if data is None:
        return
    data.action = None
    for track_number, track in enumerate(data.nla_tracks):
        track.mute = track_number != number


def turn_bones(armature, most: float, random) -> None:
    for bone in armature.pose.bones:
        axis, angle = random.normal(size=3), random.uniform(-most, most)
        axis /= np.linalg.norm(axis)
        # The root moves all; of joints that hang on nothing one stays.
        if bone == armature.pose.bones[0]:
            continue
        bone.rotation_mode = "QUATERNION"
        bone.rotation_quaternion = [math.cos(angle / 2), *(math.sin(angle / 2) * axis)]


def baked():
    """All meshes as they are shown now, in one, with nothing else in the scene."""
    view = bpy.context.view_layer
    view.update()
    graph = bpy.context.evaluated_depsgraph_get()
    made = []
    for thing in [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]:
        mesh = bpy.data.meshes.new_from_object(thing.evaluated_get(graph))
        mesh.transform(thing.matrix_world)
        mesh.shape_keys and thing.shape_key_clear()
        made.append(bpy.data.objects.new("baked", mesh))
    for thing in list(bpy.context.scene.objects):
        bpy.data.objects.remove(thing, do_unlink=True)
    for thing in made:
        bpy.context.scene.collection.objects.link(thing)
        thing.select_set(True)
    view.objects.active = made[0]
    if len(made) > 1:
        bpy.ops.object.join()
    return view.objects.active


def applied(model):
    """The model with its modifiers applied."""
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(model.evaluated_get(graph))
    model.modifiers.clear()
    model.data = mesh
    return model


def points_of(model):
    points = np.empty(3 * len(model.data.vertices))
    model.data.vertices.foreach_get("co", points)
    return points.reshape(-1, 3)


def move_to(model, points) -> None:
    model.data.vertices.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())
    model.data.update()


def deform(model, method: str, angle: float) -> None:
    """Along the longest axis, which is laid along z for it."""
    points = points_of(model)
    longest = int(np.argmax(np.ptp(points, axis=0)))
    order = [(longest + 1) % 3, (longest + 2) % 3, longest]
    middle = (points.max(0) + points.min(0)) / 2
    move_to(model, (points - middle)[:, order])
    modifier = model.modifiers.new("deform", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.angle = method, angle
    # Blender bends about the deform axis, and twists along it.
    modifier.deform_axis = "Z" if method == "TWIST" else "X"
    applied(model)


def by_lattice(model, random) -> None:
    points = points_of(model)
    low, high = points.min(0), points.max(0)
    cage = bpy.data.lattices.new("cage")
    cage.points_u = cage.points_v = cage.points_w = 4
    around = bpy.data.objects.new("cage", cage)
    around.location, around.scale = (low + high) / 2, high - low
    bpy.context.scene.collection.objects.link(around)
    for point in cage.points:
        shift = random.uniform(-1.0, 1.0, size=3) * np.linalg.norm(high - low) / 12 / (high - low)
        point.co_deform = np.array(point.co_deform) + shift
    modifier = model.modifiers.new("lattice", "LATTICE")
    modifier.object = around
    bpy.context.view_layer.update()
    applied(model)
    bpy.data.objects.remove(around, do_unlink=True)


def by_proportional_edits(model, random) -> None:
    points = points_of(model)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    for _ in range(3):
        centre = points[random.integers(len(points))]
        way = random.normal(size=3)
        way *= 0.1 * diagonal / np.linalg.norm(way)
        near = np.clip(1 - np.linalg.norm(points - centre, axis=1) / (0.25 * diagonal), 0, 1)
        points = points + (3 * near**2 - 2 * near**3)[:, None] * way
    move_to(model, points)


def afterwards(model, after: dict):
    if "decimate" in after:
        model.modifiers.new("decimate", "DECIMATE").ratio = after["decimate"]
        applied(model)
    if "subdivide" in after:
        modifier = model.modifiers.new("subdivide", "SUBSURF")
        modifier.levels = modifier.render_levels = after["subdivide"]
        applied(model)
    if after.get("crop"):
        edit(model, crop)
    if after.get("weld"):
        distance = 1e-6 * float(np.linalg.norm(np.ptp(points_of(model), axis=0)))
        edit(model, lambda mesh: bmesh.ops.remove_doubles(mesh, verts=mesh.verts, dist=distance))
    if "shuffle" in after:
        shuffle(model, np.random.default_rng(after["shuffle"]))
    if "bits" in after:
        points = points_of(model)
        low, steps = points.min(0), 2 ** after["bits"] - 1
        step = np.ptp(points, axis=0).max() / steps
        move_to(model, low + np.round((points - low) / step) * step)
    return model


def edit(model, change) -> None:
    mesh = bmesh.new()
    mesh.from_mesh(model.data)
    change(mesh)
    mesh.to_mesh(model.data)
    mesh.free()


def crop(mesh) -> None:
    middle = np.mean([vertex.co for vertex in mesh.verts], axis=0)
    extent = np.ptp([vertex.co for vertex in mesh.verts], axis=0)
    normal = np.zeros(3)
    normal[int(np.argmax(extent))] = 1.0
    everything = [*mesh.verts, *mesh.edges, *mesh.faces]
    bmesh.ops.bisect_plane(mesh, geom=everything, plane_co=middle, plane_no=normal, clear_outer=True)


def shuffle(model, random) -> None:
    """Vertices and faces in another order."""
    points, faces = points_of(model), [list(polygon.vertices) for polygon in model.data.polygons]
    order = random.permutation(len(points))
    place = np.empty(len(points), int)
    place[order] = np.arange(len(points))
    faces = [[int(place[v]) for v in faces[i]] for i in random.permutation(len(faces))]
    mesh = bpy.data.meshes.new("shuffled")
    mesh.from_pydata(points[order].tolist(), [], faces)
    model.data = mesh


def write(model, target: str) -> None:
    bpy.ops.object.select_all(action="DESELECT")
    model.select_set(True)
    bpy.context.view_layer.objects.active = model
    stem, ending = target.rsplit(".", 1)
    # Under a name of its own until it is whole.
    partial = f"{stem}.partial.{ending}"
    match ending:
        case "glb":
            bpy.ops.export_scene.gltf(filepath=partial, export_format="GLB", use_selection=True)
        case "obj":
            bpy.ops.wm.obj_export(filepath=partial, export_selected_objects=True, export_materials=False)
        case "stl":
            bpy.ops.wm.stl_export(filepath=partial, export_selected_objects=True)
        case "ply":
            bpy.ops.wm.ply_export(filepath=partial, export_selected_objects=True)
    os.replace(partial, target)


if __name__ == "__main__":
    sys.exit(main())
