"""People live by VMC and plain OSC, read by python-osc, and as samples of the Lab Streaming Layer, read by pylsl, against
what gRPC and the WebSocket say of the same frames."""
import concurrent.futures
import importlib.util
import os
import pathlib
import re
import socket
import threading
import time
import xml.etree.ElementTree

import numpy as np
import pytest
from conftest import Room, free_port
from pythonosc.osc_packet import OscPacket
from test_sinks_net import MOST_M, PEOPLE, SENSORS, assert_stands_and_walks, bodies, import_calibration, matrix, read_websocket, told

SECONDS = 7
NAME = f"Posefuse test {os.getpid()}"
#: Which bone carries which, as Unity's humanoid has it.
CARRIERS = {"Hips": "root", "Spine": "Hips", "UpperLeg": "Hips", "Chest": "Spine", "Neck": "Chest", "Shoulder": "Chest",
            "Head": "Neck", "UpperArm": "Shoulder", "LowerArm": "UpperArm", "Hand": "LowerArm", "LowerLeg": "UpperLeg",
            "Foot": "LowerLeg", "Toes": "Foot"}


def liblsl():
    """The library that pylsl brings, if it is there."""
    spec = importlib.util.find_spec("pylsl")
    found = spec and sorted(pathlib.Path(spec.origin).parent.glob("lib/*lsl*.so*"))
    return found[0] if found else None


class StreamingRoom(Room):
    """A room that sends to sockets of the test."""

    def __init__(self, folder):
        self.websocket = free_port()
        self.osc = bound(0)
        self.vmc = neighbours(PEOPLE)
        # Lab streams are looked for on this machine only.
        scope = folder / "lsl_api.cfg"
        scope.write_text("[multicast]\nResolveScope = machine\n")
        os.environ["LSLAPICFG"] = str(scope)
        sections = [
            "[sinks]\nallow_remote = true",
            f'[sinks.osc]\nenabled = true\ntargets = ["{address(self.osc)}"]\nrate_hz = 0.0\nconfidence = true',
            f'[sinks.vmc]\nenabled = true\ntarget = "{address(self.vmc[0])}"\npeople = {PEOPLE}\nrate_hz = 0.0',
            f'[sinks.websocket]\nenabled = true\nlisten = "127.0.0.1:{self.websocket}"\nrate_hz = 0.0',
            f'[sinks.lsl]\nenabled = true\nname = "{NAME}"\npeople = {PEOPLE}\nlibrary = "{liblsl() or "/nowhere"}"',
        ]
        self.config = folder / "server.toml"
        self.config.write_text("\n".join(sections))
        super().__init__(folder)

    def start(self, name, *arguments):
        if arguments[0] == "server":
            arguments = (*arguments, "--config", self.config)
        return super().start(name, *arguments)

    def stream(self, kind, rest=""):
        return f"ws://127.0.0.1:{self.websocket}/{rest}"


def bound(port):
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", port))
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
    receiver.settimeout(0.2)
    return receiver


def neighbours(count):
    for _ in range(200):
        sockets = [bound(0)]
        try:
            while len(sockets) < count:
                sockets.append(bound(sockets[0].getsockname()[1] + len(sockets)))
            return sockets
        except (OSError, OverflowError):
            for each in sockets:
                each.close()
    raise AssertionError("no free ports that follow each other")


def address(receiver):
    return "{}:{}".format(*receiver.getsockname())


def read_datagrams(receiver, over):
    datagrams = []
    while not over.is_set():
        try:
            datagrams.append(receiver.recv(65536))
        except TimeoutError:
            pass
    return datagrams


def watch(room, over):
    import posefuse

    frames = []
    with posefuse.Room(room.address) as reader:
        while not over.is_set():
            # Anew every few seconds: an empty room sends nothing, also not the end.
            frames.extend(reader.watch(seconds=3))
    return frames


def read_samples(slot, over):
    """Samples of one slot's stream, its description, and each sample's civil time, nanoseconds."""
    import pylsl

    found = pylsl.resolve_byprop("name", f"{NAME} {slot + 1}", timeout=15)
    assert found, "no stream is found"
    inlet = pylsl.StreamInlet(found[0], processing_flags=pylsl.proc_clocksync)
    description = inlet.info(timeout=10).as_xml()
    samples = []
    while not over.is_set():
        sample, stamp = inlet.pull_sample(timeout=0.2)
        if sample is not None:
            samples.append((stamp, np.array(sample, dtype=float)))
    unix_ns = time.time_ns() - pylsl.local_clock() * 1e9
    return description, [(unix_ns + stamp * 1e9, sample) for stamp, sample in samples]


@pytest.fixture(scope="module")
def streamed(tmp_path_factory, client):
    """Two people come into a room, walk, and are gone: what each receiver got."""
    room = StreamingRoom(tmp_path_factory.mktemp("datagrams"))
    import_calibration(room)
    over = threading.Event()
    with concurrent.futures.ThreadPoolExecutor(16) as pool:
        jobs = {"grpc": pool.submit(watch, room, over), "websocket": pool.submit(read_websocket, room, "?bodies=1", over)}
        jobs["osc"] = pool.submit(read_datagrams, room.osc, over)
        jobs |= {f"vmc{slot}": pool.submit(read_datagrams, each, over) for slot, each in enumerate(room.vmc)}
        if liblsl():
            jobs |= {f"lsl{slot}": pool.submit(read_samples, slot, over) for slot in range(PEOPLE)}
        agents = []
        try:
            for number in range(1, SENSORS + 1):
                words = ["--sensor", number, "--sensors", SENSORS, "--people", PEOPLE]
                agents.append(room.start(f"sim{number}", "agent", "--name", f"sim{number}", "--server", room.url, "sim", *words))
            room.wait_for(lambda: room.status().people == PEOPLE, "two people")
            time.sleep(SECONDS - 3)
            for agent in agents:
                agent.stop()
            room.wait_for(lambda: room.status().people == 0, "everybody to be gone")
            time.sleep(2)
            statuses = {sink.name: sink for sink in room.status().sinks}
        finally:
            over.set()
        found = {name: job.result(timeout=60) for name, job in jobs.items()}
    yield found | {"statuses": statuses}
    room.close()


def messages_of(datagrams):
    """In order: address and values."""
    for datagram in datagrams:
        assert len(datagram) <= 1500
        for timed in OscPacket(datagram).messages:
            yield timed.message.address, timed.message.params


def osc_frames(datagrams):
    """Values by address, of each frame that came whole; and the numbers of all."""
    frames, numbers, parts = [], [], {}
    for datagram in datagrams:
        told_here = dict(messages_of([datagram]))
        number, part, of = told_here.pop("/skel/packet")
        parts = told_here if part == 1 else parts | told_here
        if part == of:
            frames.append(parts)
            numbers.append(number)
    return frames, numbers


def near(unix_ns, frames):
    """The frame of gRPC of that instant, or None."""
    frame = min(frames, key=lambda frame: abs(frame.unix_ns - unix_ns))
    return frame if abs(frame.unix_ns - unix_ns) < 2_000_000 else None


def test_osc_says_what_grpc_says_in_floats_only(streamed):
    frames, numbers = osc_frames(streamed["osc"])
    assert numbers == list(range(int(numbers[0]), int(numbers[0]) + len(numbers))), "none is lost on this machine"
    entered = [address.split("/")[2] for frame in frames for address in frame if address.endswith("/enter")]
    left = [address.split("/")[2] for frame in frames for address in frame if address.endswith("/leave")]
    assert len(entered) >= PEOPLE and sorted(entered) == sorted(left), "everybody who came is gone"
    assert frames[-1]["/skel/count"] == [0]
    compared, tracks = 0, {}
    for frame in frames:
        assert all(isinstance(value, float) for values in frame.values() for value in values)
        if "/skel/time" not in frame:
            continue
        day, second, rest = frame["/skel/time"]
        same = near((day * 86400 + second) * 1e9 + rest * 1e9, streamed["grpc"])
        if same is None:
            continue
        assert frame["/skel/people"] == [person.id for person in same.people]
        assert frame["/skel/count"] == [len(same.people)]
        for person in same.people:
            places = {}
            for joint, at in told(person).items():
                places[joint] = np.array(frame[f"/skel/{person.id}/{joint}/pos"])
                assert np.abs(places[joint] - at).max() < MOST_M
                assert abs(frame[f"/skel/{person.id}/{joint}/confidence"][0] - person.joints[joint].confidence) < 1e-6
                compared += 1
            tracks.setdefault(person.id, []).append(places)
    assert compared > 2000
    assert_stands_and_walks({who: places for who, places in tracks.items() if len(places) > 20})
    assert not streamed["statuses"]["osc"].trouble


def poses(datagrams):
    """Of one port: what is said until each `T`, and what is said of the model's state."""
    pose, found, states = {}, [], []
    for address, values in messages_of(datagrams):
        if address in ("/VMC/Ext/Root/Pos", "/VMC/Ext/Bone/Pos"):
            name, *numbers = values
            assert len(numbers) == 7 and (name == "root") == (address == "/VMC/Ext/Root/Pos")
            pose[name] = np.array(numbers)
        elif address == "/VMC/Ext/OK":
            assert all(type(value) is int for value in values)
            states.append(values)
        elif address == "/VMC/Ext/T":
            if pose:
                found.append((values[0], pose))
            pose = {}
        else:
            raise AssertionError(f"{address} is none of VMC's")
    return found, states


def placed(pose):
    """Where the bones of a pose begin, in the room's axes, by the chain of those that carry them."""
    origins, axes = {}, {}
    for name in ["root", *(name for name in pose if name != "root")]:
        at, turn = pose[name][:3], matrix(*pose[name][3:])
        if name == "root":
            origins[name], axes[name] = at, turn
            continue
        side = next((side for side in ("Left", "Right") if name.startswith(side)), "")
        carrier = CARRIERS[name.removeprefix(side)]
        carrier = side + carrier if side + carrier in pose else carrier
        origins[name], axes[name] = origins[carrier] + axes[carrier] @ at, axes[carrier] @ turn
    # Unity: X right, Y up, Z forward.
    return {name: np.array([at[2], -at[0], at[1]]) for name, at in origins.items()}


def test_vmc_has_each_body_on_a_port_of_its_own(streamed):
    reference = bodies(streamed["websocket"])
    times = {message["number"]: int(message["unix_ns"]) for message in streamed["websocket"] if message["type"] == "frame"}
    people = sorted({person for _, person in reference})
    ports = [poses(streamed[f"vmc{slot}"]) for slot in range(PEOPLE)]
    first_s = min(found[0][0] for found, _ in ports)
    # Both sinks had the first body of all in the same frame.
    began_ns = min(times[number] for number, _ in reference) - first_s * 1e9
    compared, tracks = 0, {}
    for slot, (found, states) in enumerate(ports):
        assert states[0] == [1, 3, 0, 1] and states[-1] == [0, 0, 0, 0], "there, and gone in the end"
        for seconds, pose in found:
            assert len(pose) == 22
            number = min(times, key=lambda number: abs(times[number] - began_ns - seconds * 1e9))
            if abs(times[number] - began_ns - seconds * 1e9) > 5e6:
                continue
            origins = placed(pose)
            assert abs(origins["root"][2]) < 1e-6, "the root is on the floor"
            off = {person: max(np.abs(origins[bone] - reference[number, person][0][bone]).max() for bone in pose if bone != "root")
                   for person in people if (number, person) in reference}
            person = min(off, key=off.get)
            assert off[person] < MOST_M, f"{off[person]} m off on port {slot}"
            tracks.setdefault((slot, person), []).append(as_joints(origins))
            compared += 1
    assert compared > 100
    often = {who: places for who, places in tracks.items() if len(places) > 20}
    assert {slot for slot, _ in often} == set(range(PEOPLE))
    assert_stands_and_walks(often)
    status = streamed["statuses"]["vmc"]
    assert status.delivered > 50 and not status.trouble and 0 < status.p99_ms < 250


def as_joints(origins):
    """Bones begin at joints; those that VMC has none of are left where their carrier begins."""
    names = {"Neck": "Head", "SpineBase": "Spine", "AnkleLeft": "LeftFoot", "AnkleRight": "RightFoot", "FootLeft": "LeftToes",
             "FootRight": "RightToes", "ShoulderLeft": "LeftUpperArm", "ShoulderRight": "RightUpperArm", "WristLeft": "LeftHand",
             "WristRight": "RightHand"}
    joints = {joint: origins[bone] for joint, bone in names.items()}
    return joints | {f"other{index}": origins["Hips"] for index in range(25 - len(joints))}


def test_vmc_has_no_doubles_and_its_packets_pass_an_ethernet(streamed):
    for slot in range(PEOPLE):
        for datagram in streamed[f"vmc{slot}"]:
            assert len(datagram) <= 1472
            tags = set(re.findall(rb"\0,([a-zA-Z]+)\0", datagram))
            assert tags <= {b"sfffffff", b"iiii", b"f"}, tags


def test_labs_get_samples_stamped_with_the_time_of_capture(streamed):
    if not liblsl():
        assert "pylsl" in streamed["statuses"]["lsl"].trouble
        pytest.skip("SKIPPED: pylsl is not there; its stream is read nowhere else")
    assert not streamed["statuses"]["lsl"].trouble
    compared, tracks = 0, {}
    for slot in range(PEOPLE):
        description, samples = streamed[f"lsl{slot}"]
        root = xml.etree.ElementTree.fromstring(description)
        assert (root.findtext("type"), root.findtext("channel_count"), root.findtext("nominal_srate")) == ("MoCap", "101", "0.000000000000000")
        channels = [{each.tag: each.text for each in channel} for channel in root.iter("channel")]
        assert len(channels) == 101 and channels[0] == {
            "label": "SpineBase.X", "marker": "SpineBase", "object": f"{NAME} {slot + 1}", "type": "PositionX", "unit": "meters"}
        column = {channel["label"]: index for index, channel in enumerate(channels)}
        for unix_ns, sample in samples:
            same = near(unix_ns, streamed["grpc"])
            who = sample[column["Person"]]
            if np.isnan(who):
                assert np.isnan(sample).all()
                continue
            person = same and next((person for person in same.people if person.id == who), None)
            if not person:
                continue
            places = {}
            for joint in {channel["marker"] for channel in channels if "marker" in channel}:
                at = sample[[column[f"{joint}.{axis}"] for axis in "XYZ"]]
                if joint not in person.joints:
                    assert np.isnan(at).all()
                    continue
                assert np.abs(at - told(person)[joint]).max() < MOST_M
                places[joint] = at
                compared += 1
            tracks.setdefault(who, []).append(places)
        stamps = [unix_ns for unix_ns, _ in samples]
        assert stamps == sorted(stamps)
    assert compared > 2000
    assert_stands_and_walks({who: places for who, places in tracks.items() if len(places) > 20})
