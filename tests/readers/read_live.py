"""A real server with simulated sensors, live in Blender by our add-on: its VMC output, beside what `posefuse watch` prints.

Two people come in, move and leave; each figure is where the fused person is, upright, of their height.
"""
import json
import math
import os
import pathlib
import queue
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import traceback

os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp()
import bpy
from reading import Readings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients/blender"))
import posefuse_live  # noqa: E402
from posefuse_live import panel  # noqa: E402

POSEFUSE = sys.argv[3]
PEOPLE, SECONDS = 2, 6.0
#: Which joint each of these bones begins at.
JOINTS = {"Head": "Neck", "LeftUpperLeg": "HipLeft", "RightUpperArm": "ShoulderRight", "LeftLowerArm": "ElbowLeft", "RightLowerLeg": "KneeRight", "LeftFoot": "AnkleLeft"}
#: A body of constant measures a few frames away from what was fused: median and most of a person's distances, metres.
MEDIAN_M, MOST_M = 0.08, 0.5


def free_ports(kind: int, count: int) -> int:
    """The first of so many ports in a row that nobody has."""
    for first in range(41000 + os.getpid() % 1000 * 10, 60000, count):
        taken = [socket.socket(socket.AF_INET, kind) for _ in range(count)]
        try:
            for number, each in enumerate(taken):
                each.bind(("127.0.0.1", first + number))
            return first
        except OSError:
            continue
        finally:
            for each in taken:
                each.close()
    raise AssertionError("no free ports")


class House:
    """A server, its agents and a watcher; all end with it."""

    def __init__(self, folder: pathlib.Path, calibration: str, vmc: int):
        self.url = f"http://127.0.0.1:{free_ports(socket.SOCK_STREAM, 1)}"
        self.folder, self.programs = folder, []
        (folder / "calibration.toml").write_text(calibration)
        config = f'[sinks.vmc]\nenabled = true\ntarget = "127.0.0.1:{vmc}"\n'
        (folder / "server.toml").write_text(config)
        self.start("server", "server", "--config", folder / "server.toml", "--listen", self.url.removeprefix("http://"),
                   "--takes", folder / "takes", "--calibration", folder / "calibration.toml", "--repair", "none")
        self.wait(self.answers)

    def answers(self) -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", int(self.url.rsplit(":", 1)[1]))) == 0

    def start(self, name: str, *arguments, stdout=None) -> subprocess.Popen:
        log = (self.folder / f"{name}.log").open("w")
        program = subprocess.Popen([POSEFUSE, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=stdout or log, stderr=log, text=True)
        self.programs.append(program)
        return program

    def agents(self, sensors: int) -> list[subprocess.Popen]:
        """The same people as in the take, from their first step on."""
        sim = ["sim", "--sensors", sensors, "--people", PEOPLE, "--epoch-ns", time.time_ns()]
        common = ["--server", self.url, "--drain", 1, *sim]
        return [self.start(f"sim{n}", "agent", "--name", f"sim{n}", *common, "--sensor", n) for n in range(1, sensors + 1)]

    def wait(self, condition, seconds: float = 20):
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, self.logs()
            time.sleep(0.05)

    def end(self, programs: list):
        for program in programs:
            program.send_signal(signal.SIGINT)
        for program in programs:
            program.wait(20)

    def logs(self) -> str:
        return "\n".join(f"--- {log.name}\n{log.read_text()[-2000:]}" for log in sorted(self.folder.glob("*.log")))

    def close(self):
        self.end([program for program in reversed(self.programs) if program.poll() is None])


def watch(house: House) -> queue.Queue:
    """The newest fused frames as `posefuse watch` prints them."""
    frames, watcher = queue.Queue(), house.start("watch", "watch", "--server", house.url, "--json", stdout=subprocess.PIPE)

    def read():
        for line in watcher.stdout:
            frames.put(json.loads(line))

    threading.Thread(target=read, daemon=True).start()
    return frames


def room_place(armature, bone: str) -> tuple:
    """Where a bone begins, room axes: Blender's figures face -Y."""
    at = armature.matrix_world @ armature.pose.bones[bone].head
    return -at.y, at.x, at.z


def follow(stream, frames: queue.Queue, seconds: float) -> tuple[dict, list[int], dict]:
    """Steps the add-on as Blender's timer would, and compares.

    Gives by figure how far its bones are from the joints of the nearest person, how many figures were there, and by figure how
    far its neck is above its left foot.
    """
    off, counts, heights, frame, end = {}, [], {}, None, time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(1 / 60)
        stream.step()
        while not frames.empty():
            frame = frames.get()
        there = stream.present()
        counts.append(len(there))
        bpy.context.view_layer.update()
        for name in there if frame else ():
            armature = bpy.data.objects[name]
            heights.setdefault(name, []).append(room_place(armature, "Head")[2] - room_place(armature, "LeftFoot")[2])
            people = [{joint: state["position_m"] for joint, state in person["joints"].items()} for person in frame["people"]]
            distances = [[math.dist(person[joint], room_place(armature, bone)) for bone, joint in JOINTS.items() if joint in person] for person in people]
            if distances := [each for each in distances if each]:
                off.setdefault(name, []).append(statistics.mean(min(distances, key=statistics.mean)))
    return off, counts, heights


def main():
    readings, vmc = Readings(), free_ports(socket.SOCK_DGRAM, 4)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    posefuse_live.register()
    bpy.context.scene.posefuse.port = vmc
    assert bpy.ops.posefuse.start() == {"FINISHED"}
    stream = panel.stream
    with tempfile.TemporaryDirectory() as folder:
        house = House(pathlib.Path(folder), readings.expected["calibration"], vmc)
        try:
            frames, agents = watch(house), house.agents(readings.expected["sensors"])
            deadline = time.monotonic() + 30
            while len(stream.present()) < PEOPLE:
                assert time.monotonic() < deadline, f"{stream.present()}\n{panel.status()}\n{house.logs()}"
                follow(stream, frames, 0.2)
            off, counts, heights = follow(stream, frames, SECONDS)
            assert statistics.median(counts) == PEOPLE and len(off) >= PEOPLE, counts
            median, most = max(map(statistics.median, off.values())), max(map(max, off.values()))
            assert median < MEDIAN_M and most < MOST_M, f"{median:.3f} m off, at most {most:.3f} m"
            assert stream.malformed == stream.people.ignored == 0, panel.status()
            # People crouch, too, but nobody does nothing else.
            for name, tall in heights.items():
                assert min(tall) > 0.4 and 1.2 < max(tall) < 1.8, (name, min(tall), max(tall))
            rate = stream.packet_rate()
            house.end(agents)
            follow(stream, frames, 2.5)
            assert stream.present() == [] and all(thing.hide_viewport for thing in bpy.data.objects if thing.type == "ARMATURE")
        finally:
            house.close()
    posefuse_live.unregister()
    said = f"{PEOPLE} people came, moved and left; {median * 1000:.0f} mm (median) from the fused joints of that moment; {rate} packets/s"
    readings.add_check("a server, live in Blender by our add-on", said)
    readings.save()


try:
    main()
except BaseException:
    traceback.print_exc()
    os._exit(1)
# Blender as a module can hang in its own end where other threads have been.
os._exit(0)
