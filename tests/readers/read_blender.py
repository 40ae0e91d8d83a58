"""Imports GLB, BVH and FBX into Blender as its users do, and says where the heads of the bones are in its world."""
import bpy
from reading import Readings


def empty_scene(rate_hz: float):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(rate_hz)


def armatures() -> list:
    return [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]


def places(armature, frames: list[int], first_frame: int, bone_of: dict[str, str]) -> dict[str, list]:
    """For each bone of the rig its head in Blender's world, one a frame."""
    found = {}
    for frame in frames:
        bpy.context.scene.frame_set(first_frame + frame)
        # As it is drawn: with parents, animation and scale in it.
        drawn = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        for bone in drawn.pose.bones:
            if bone.name in bone_of:
                found.setdefault(bone_of[bone.name], []).append(list(drawn.matrix_world @ bone.head))
    return found


def read_each(readings: Readings, what: str, export: str, ending: str, load, first_frame: int):
    """Files of one person each, one after the other into a scene of its own."""
    people = {}
    for file in readings.files(export, ending):
        empty_scene(readings.expected["rate_hz"])
        load(file["path"])
        (armature,) = armatures()
        people[file["people"][0]] = places(armature, readings.expected["sampled"], first_frame, readings.bone_of(export))
    readings.add(what, "bones", people, "blender")


def read_glb(readings: Readings):
    (file,) = readings.files("blender", ".glb")
    empty_scene(readings.expected["rate_hz"])
    bpy.ops.import_scene.gltf(filepath=file["path"])
    found = sorted(armatures(), key=lambda armature: armature.name)
    assert len(found) == len(file["people"]), [armature.name for armature in found]
    people = {}
    for who, armature in zip(file["people"], found):
        assert who in armature.name, (who, armature.name)
        people[who] = places(armature, readings.expected["sampled"], 0, readings.bone_of("blender"))
    readings.add("GLB in Blender", "bones", people, "blender")
    meshes = [thing for thing in bpy.data.objects if thing.type == "MESH" and thing.find_armature()]
    assert len(meshes) >= len(people), "no figure is skinned to the armatures"


readings = Readings()
read_glb(readings)
read_each(readings, "BVH in Blender", "blender-bvh", ".bvh", lambda path: bpy.ops.import_anim.bvh(filepath=path), 1)
for export in ("motionbuilder", "mixamo"):
    read_each(readings, f"FBX ({export}) in Blender", export, ".fbx", lambda path: bpy.ops.import_scene.fbx(filepath=path), 1)
if hasattr(bpy.ops.wm, "fbx_import"):
    read_each(readings, "FBX (unity) in Blender, by its newer importer", "unity", ".fbx", lambda path: bpy.ops.wm.fbx_import(filepath=path), 1)
readings.save()
