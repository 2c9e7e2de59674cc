"""Takes a model through another program: python convert.py TOOL INPUT OUTPUT [FOLDER OF NPM'S PROGRAMS]."""

import os
import shutil
import subprocess
import sys

OPTIMISE = ["--compress", "false", "--texture-compress", "false", "--simplify", "false"]
NPM = {
    "gltf-transform copy": ["gltf-transform", "copy", "IN", "OUT"],
    "gltf-transform weld": ["gltf-transform", "weld", "IN", "OUT"],
    "gltf-transform optimize": ["gltf-transform", "optimize", "IN", "OUT", *OPTIMISE],
    "gltf-transform quantize": ["gltf-transform", "quantize", "IN", "OUT"],
    "gltfpack": ["gltfpack", "-i", "IN", "-o", "OUT"],
    "gltfpack -noq": ["gltfpack", "-noq", "-i", "IN", "-o", "OUT"],
}


def main() -> int:
    tool, source, target, *npm = sys.argv[1:]
    ending = target.rsplit(".", 1)[1]
    if tool == "Blender":
        through_blender(source, target, ending)
    elif tool == "trimesh":
        through_trimesh(source, target, ending)
    elif tool == "assimp":
        program = shutil.which("assimp")
        if program is None:
            raise SystemExit("assimp is not installed (Debian: apt-get install assimp-utils)")
        run([program, "export", source, target])
    else:
        named = {"IN": source, "OUT": target}
        program, *arguments = [named.get(word, word) for word in NPM[tool]]
        run([os.path.join(npm[0], program), *arguments])
    return 0


def run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        raise SystemExit(" ".join((done.stderr or done.stdout).split())[-300:])


def through_trimesh(source: str, target: str, ending: str) -> None:
    import trimesh

    scene = trimesh.load(source, force="scene")
    (scene if ending == "glb" else scene.to_geometry()).export(target)


def through_blender(source: str, target: str, ending: str) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    load = {"glb": bpy.ops.import_scene.gltf, "gltf": bpy.ops.import_scene.gltf, "obj": bpy.ops.wm.obj_import}
    load[source.rsplit(".", 1)[1]](filepath=source)
    # At rest: an animation that the file brings would pose the figure.
    for armature in bpy.data.armatures:
        armature.pose_position = "REST"
    match ending:
        case "glb":
            bpy.ops.export_scene.gltf(filepath=target, export_format="GLB")
        case "obj":
            bpy.ops.wm.obj_export(filepath=target)
        case "stl":
            bpy.ops.wm.stl_export(filepath=target)
        case "ply":
            bpy.ops.wm.ply_export(filepath=target)


if __name__ == "__main__":
    sys.exit(main())
