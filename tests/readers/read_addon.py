"""Our add-on in real Blender, fed over UDP by python-osc with the same people: live, recorded, joining and leaving.

Blender as a module has no event loop, so what its timer would call is called here.
"""
import csv
import os
import pathlib
import random
import shutil
import socket
import sys
import tempfile
import time

HOME = tempfile.TemporaryDirectory()
# What is installed into Blender here is not to be found by its user later.
os.environ["BLENDER_USER_RESOURCES"] = HOME.name
import bpy
import addon_utils  # Blender's own; it is to be found once Blender is there.
from mathutils import Quaternion, Vector
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from reading import Readings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients/blender"))
from posefuse_live import panel  # noqa: E402

#: Bones of the rig that Unity calls otherwise.
UNITY = {f"{side}{ours}": f"{side}{theirs}" for side in ("Left", "Right") for ours, theirs in (("Fingers", "MiddleProximal"), ("Thumb", "ThumbProximal"))}
RIG = {theirs: ours for ours, theirs in UNITY.items()}
#: The most messages that fit a packet.
MESSAGES = 18


def local_poses(path: str, ends: list[str]) -> dict:
    """For each person and frame the bones as VMC tells them: place and rotation (x y z w) against the parent."""
    worlds, poses = {}, {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            key = row["person"], int(row["frame"])
            at = Vector([float(row[f"{axis}_m"]) for axis in "xyz"])
            turned = Quaternion([float(row[part]) for part in ("qw", "qx", "qy", "qz")])
            worlds.setdefault(key, {})[row["bone"]] = at, turned
            origin, axes = worlds[key].get(row["parent"], (Vector(), Quaternion()))
            if row["bone"] in ends:
                continue
            offset, local = axes.inverted() @ (at - origin), axes.inverted() @ turned
            pose = poses.setdefault(row["person"], {}).setdefault(int(row["frame"]), {})
            pose[UNITY.get(row["bone"], row["bone"])] = [*offset, local.x, local.y, local.z, local.w]
    return poses


def message(address: str, *arguments):
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build()


def send(port: int, messages: list):
    """Bundles of a few messages each, as a sender on a real network must."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for first in range(0, len(messages), MESSAGES):
            bundle = OscBundleBuilder(IMMEDIATELY)
            for each in messages[first : first + MESSAGES]:
                bundle.add_content(each)
            out.sendto(bundle.build().dgram, ("127.0.0.1", port))


def send_body(port: int, pose: dict, seconds: float):
    still = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    head = [message("/VMC/Ext/OK", 1), message("/VMC/Ext/T", seconds), message("/VMC/Ext/Root/Pos", "root", *still)]
    send(port, head + [message("/VMC/Ext/Bone/Pos", bone, *numbers) for bone, numbers in pose.items()])


def free_ports(count: int) -> int:
    """The first of so many ports in a row that nobody has."""
    while True:
        first = random.randrange(20000, 60000)
        taken = []
        try:
            for port in range(first, first + count):
                taken.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
                taken[-1].bind(("127.0.0.1", port))
            return first
        except OSError:
            continue
        finally:
            for each in taken:
                each.close()


def add_places(found: dict, armature):
    bpy.context.view_layer.update()
    drawn = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    for bone in drawn.pose.bones:
        found.setdefault(RIG.get(bone.name, bone.name), []).append(list(drawn.matrix_world @ bone.head))


def figure(number: int):
    return bpy.data.objects[f"Posefuse person {number}"]


def begin(port: int):
    """A new file with the stream of the add-on on two ports."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("posefuse_live")
    settings = bpy.context.scene.posefuse
    settings.port, settings.people = port, 2
    assert bpy.ops.posefuse.start() == {"FINISHED"}
    return panel.stream


class Layout:
    """Stands in for the window that Blender has not here: takes what the panel draws, and looks whether Blender knows it."""

    ICONS = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items.keys()

    def __init__(self, words: list):
        self.words = words

    def column(self, **_):
        return Layout(self.words)

    row = column

    def prop(self, settings, name):
        assert name in settings.bl_rna.properties, name

    def operator(self, name, text="", icon="NONE", depress=False):
        group, operator = name.split(".")
        assert getattr(getattr(bpy.ops, group), operator).get_rna_type().name and icon in self.ICONS, (name, icon)
        self.words.append(text)

    def label(self, text):
        self.words.append(text)


def drawn() -> str:
    """What the panel says now."""
    layout = Layout([])
    panel.POSEFUSE_PT_panel.draw(type("Panel", (), {"layout": layout})(), bpy.context)
    return " | ".join(layout.words)


def joins_leaves_and_recovers(port: int, poses: list[dict]):
    stream, now = begin(port), time.monotonic()
    assert "Nothing comes" in drawn() and str(port) in drawn()
    for number in range(3):
        send_body(port, poses[0][10 * number], number)
        stream.step(now + number / 30)
    assert stream.present(now + 0.1) == ["Posefuse person 1"] and len(figure(1).data.bones) == len(poses[0][0])
    for number in range(3):
        send_body(port, poses[0][0], number)
        send_body(port + 1, poses[1][0], number)
        stream.step(now + 0.5 + number / 30)
    assert stream.present(now + 0.6) == ["Posefuse person 1", "Posefuse person 2"]
    # One goes.
    send_body(port, poses[0][0], 3)
    stream.step(now + 2)
    assert stream.present(now + 2) == ["Posefuse person 1"]
    assert figure(2).hide_viewport and not figure(1).hide_viewport
    # And comes back.
    for number in range(3):
        send_body(port + 1, poses[1][0], number)
        stream.step(now + 2.5)
    assert not figure(2).hide_viewport
    # Somebody new waits until their user is done with what they edit.
    bpy.data.objects.remove(figure(2))
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    stream.step(now + 2.5)
    assert stream.waiting and bpy.context.mode == "EDIT_MESH" and "Posefuse person 2" not in bpy.data.objects and "Object Mode" in drawn()
    bpy.ops.object.mode_set(mode="OBJECT")
    stream.step(now + 2.5)
    assert not figure(2).hide_viewport and bpy.context.object.name == "Cube"
    # Who is said to be gone has left at once.
    send(port + 1, [message("/VMC/Ext/OK", 0)])
    stream.step(now + 2.51)
    assert figure(2).hide_viewport and stream.present(now + 2.51) == ["Posefuse person 1"]
    for number in range(3):
        send_body(port + 1, poses[1][0], number)
        stream.step(now + 2.52)
    # Whoever deletes a figure sees it again; whoever sends rubbish is not heard.
    bpy.data.objects.remove(figure(2))
    dice = random.Random(5)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for size in range(0, 200):
            out.sendto(dice.randbytes(size), ("127.0.0.1", port))
            out.sendto(b"#bundle\0" + dice.randbytes(size), ("127.0.0.1", port))
        whole = message("/VMC/Ext/Bone/Pos", "Hips", *[float("nan")] * 7).dgram
        for size in range(len(whole) + 1):
            out.sendto(whole[:size], ("127.0.0.1", port))
    send_body(port + 1, poses[1][0], 4)
    stream.step(now + 2.6)
    assert stream.malformed > 300 and stream.people.ignored >= 1
    assert not figure(2).hide_viewport and len([thing for thing in bpy.data.objects if thing.type == "ARMATURE"]) == 2
    assert bpy.ops.posefuse.stop() == {"FINISHED"}
    # A port that is taken is said.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port + 1))
        try:
            bpy.ops.posefuse.start()
        except RuntimeError as error:
            assert "choose another port" in str(error)
        else:
            raise AssertionError("a port that is taken was taken")
    assert panel.stream is None


def live_and_recorded(readings: Readings, port: int, names: list[str], poses: list[dict]):
    stream, now = begin(port), time.monotonic()
    for number in range(2):
        for index, person in enumerate(poses):
            send_body(port + index, person[0], 0)
        stream.step(now)
    live, recorded = [{}, {}], [{}, {}]
    stream.start_recording(1, readings.expected["rate_hz"], now)
    for frame in range(readings.expected["frames"]):
        seconds = frame / readings.expected["rate_hz"]
        for index, person in enumerate(poses):
            send_body(port + index, person[frame], seconds)
        stream.step(now + seconds)
        if frame in readings.expected["sampled"]:
            for index, found in enumerate(live):
                add_places(found, figure(index + 1))
    assert stream.packet_rate() > 50 and "Stop recording" in drawn() and "2 people" in panel.status(now + seconds)[0]
    bpy.ops.posefuse.record()
    bpy.ops.posefuse.stop()
    assert "Stopped" in drawn()
    bpy.context.scene.render.fps = readings.expected["rate_hz"]
    for frame in readings.expected["sampled"]:
        bpy.context.scene.frame_set(1 + frame)
        for index, found in enumerate(recorded):
            add_places(found, figure(index + 1))
    readings.add("VMC by our add-on in Blender, live", "bones", dict(zip(names, live)), "blender")
    readings.add("the same, as keys that it recorded", "bones", dict(zip(names, recorded)), "blender")


def plain_osc(readings: Readings, port: int):
    stream, now = begin(port), time.monotonic()
    joints, people = readings.expected["names"]["joints"], {}
    for index in range(len(readings.expected["sampled"])):
        for number, (who, person) in enumerate(readings.expected["people"].items()):
            places = zip(joints, person["joints"][index])
            send(port, [message(f"/skel/{number}/{joint}/pos", *map(float, at)) for joint, at in places])
        stream.step(now + index / 3)
        bpy.context.view_layer.update()
        for number, who in enumerate(readings.expected["people"]):
            for joint in joints:
                empty = bpy.data.objects[f"Posefuse skeleton {number} {joint}"]
                people.setdefault(who, {}).setdefault(joint, []).append(list(empty.matrix_world.translation))
    assert len(stream.present(now + index / 3)) == 2
    stream.step(now + 100)
    assert stream.present(now + 100) == [] and all(thing.hide_viewport for thing in bpy.data.objects)
    readings.add("plain OSC by our add-on in Blender", "joints", people, "blender")


def unregisters():
    addon_utils.disable("posefuse_live")
    assert panel.stream is None and not bpy.app.timers.is_registered(panel._tick)
    assert not hasattr(bpy.types.Scene, "posefuse") and not hasattr(bpy.types, "POSEFUSE_PT_panel")
    assert not any(handler in getattr(bpy.app.handlers, name) for name, handler in panel.HANDLERS)


def installs():
    """From a zip, as its users do: Preferences > Get Extensions > Install from Disk."""
    folder = pathlib.Path(HOME.name)
    source = pathlib.Path(panel.__file__).parent
    shutil.copytree(source, folder / "zip/posefuse_live", ignore=shutil.ignore_patterns("__pycache__"))
    package = shutil.make_archive(str(folder / "posefuse_live"), "zip", folder / "zip", "posefuse_live")
    bpy.ops.extensions.package_install_files(filepath=package, repo="user_default", enable_on_install=True)
    assert "bl_ext.user_default.posefuse_live" in bpy.context.preferences.addons
    assert hasattr(bpy.types, "POSEFUSE_PT_panel") and hasattr(bpy.types.Scene, "posefuse")
    addon_utils.disable("bl_ext.user_default.posefuse_live")
    assert not hasattr(bpy.types.Scene, "posefuse")


def main():
    readings = Readings()
    (file,) = readings.files("vmc", ".csv")
    poses = local_poses(file["path"], readings.expected["names"]["ends"])
    port = free_ports(2)
    joins_leaves_and_recovers(port, list(poses.values()))
    live_and_recorded(readings, port, list(poses), list(poses.values()))
    plain_osc(readings, port)
    unregisters()
    installs()
    readings.add_check("our add-on in Blender", "joins, leaves, ports that are taken, rubbish, unregistering, installing from a zip")
    readings.save()


main()
