"""People live over WebSocket and in Foxglove, read by other people's clients, against what gRPC says of the same frames."""
import concurrent.futures
import json
import shutil
import subprocess
import threading
import time

import numpy as np
import pytest
from conftest import ROOT, Room, free_port
from mcap.reader import make_reader

SENSORS, PEOPLE, SECONDS = 2, 2, 7
#: The largest distance between a place as received and as gRPC has it.
MOST_M = 1e-3
MODULES = ROOT / "web/node_modules"
PROTOCOLS = ["foxglove.websocket.v1", "foxglove.sdk.v1"]


class StreamingRoom(Room):
    """A room whose sinks listen on ports of their own."""

    def __init__(self, folder):
        self.ports = {kind: free_port() for kind in ("websocket", "foxglove")}
        self.config = folder / "server.toml"
        sections = [f'[sinks.{kind}]\nenabled = true\nlisten = "127.0.0.1:{port}"\nrate_hz = 0.0\n' for kind, port in self.ports.items()]
        self.config.write_text("\n".join(sections))
        super().__init__(folder)

    def start(self, name, *arguments):
        if arguments[0] == "server":
            arguments = (*arguments, "--config", self.config)
        return super().start(name, *arguments)

    def stream(self, kind, rest=""):
        return f"ws://127.0.0.1:{self.ports[kind]}/{rest}"


def has_node():
    return shutil.which("node") and (MODULES / "@foxglove/ws-protocol").exists()


def watch(room, over):
    import posefuse

    frames = {}
    with posefuse.Room(room.address) as reader:
        for frame in reader.watch(seconds=SECONDS + 3):
            frames[frame.number] = frame
            if over.is_set():
                break
    return frames


def read_websocket(room, rest, over):
    from websockets.sync.client import connect

    messages = []
    with connect(room.stream("websocket", rest)) as client:
        while not over.is_set():
            try:
                messages.append(json.loads(client.recv(timeout=0.2)))
            except TimeoutError:
                pass
    return messages


def read_foxglove(room, protocol):
    command = ["node", ROOT / "tests/python/read_foxglove.mjs", MODULES, room.stream("foxglove"), str(SECONDS), protocol]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def import_calibration(room):
    room.run("simulate", "--out", "true", "--seconds", 1, "--sensors", SENSORS, "--true-calibration", "--takes", room.folder)
    with (room.folder / "true.mcap").open("rb") as stream:
        attachments = make_reader(stream).iter_attachments()
        calibration = next(each.data.decode() for each in attachments if each.name.endswith("calibration.toml"))
    file = room.folder / "true.toml"
    file.write_text(calibration)
    room.run("calibrations", "import", file, "--server", room.url)


@pytest.fixture(scope="module")
def streamed(tmp_path_factory, client):
    """Two people come into a room, walk, and are gone: what each client got."""
    room = StreamingRoom(tmp_path_factory.mktemp("streams"))
    import_calibration(room)
    over = threading.Event()
    with concurrent.futures.ThreadPoolExecutor() as pool:
        begun = time.monotonic()
        jobs = {"grpc": pool.submit(watch, room, over)}
        jobs["plain"] = pool.submit(read_websocket, room, "", over)
        jobs["bodies"] = pool.submit(read_websocket, room, "?bodies=1", over)
        jobs["slow"] = pool.submit(read_websocket, room, "?rate=5", over)
        if has_node():
            jobs |= {protocol: pool.submit(read_foxglove, room, protocol) for protocol in PROTOCOLS}
        agents = []
        # From the beginning of their round, where they stand and walk; later they sit and crouch, too.
        epoch = time.time_ns()
        for number in range(1, SENSORS + 1):
            words = ["--sensor", number, "--sensors", SENSORS, "--people", PEOPLE, "--epoch-ns", epoch]
            agents.append(room.start(f"sim{number}", "agent", "--name", f"sim{number}", "--server", room.url, "sim", *words))
        room.wait_for(lambda: room.status().people == PEOPLE, "two people")
        time.sleep(max(0.0, SECONDS - 2.0 - (time.monotonic() - begun)))
        for agent in agents:
            agent.stop()
        room.wait_for(lambda: room.status().people == 0, "everybody to be gone")
        time.sleep(max(0.5, SECONDS + 0.5 - (time.monotonic() - begun)))
        statuses = {sink.name: sink for sink in room.status().sinks}
        over.set()
        found = {name: job.result(timeout=60) for name, job in jobs.items()}
    yield found | {"room": room, "statuses": statuses}
    room.close()


def frames_of(messages):
    return [message for message in messages if message["type"] == "frame"]


def told(person):
    return {joint: np.array([at.x, at.y, at.z]) for joint, at in person.joints.items()}


def assert_stands_and_walks(tracks):
    """tracks: of each person, a list of places by joint, one a frame."""
    assert len(tracks) == PEOPLE
    for places in tracks.values():
        whole = [each for each in places if len(each) == 25]
        assert len(whole) > 20, f"{len(whole)} whole skeletons of {len(places)}"
        of = {joint: np.array([each[joint] for each in whole]) for joint in whole[0]}
        feet = np.minimum(of["AnkleLeft"][:, 2], of["AnkleRight"][:, 2])
        trunk = of["Neck"] - of["SpineBase"]
        # Of when they stand: whoever is watched for longer sees them sit and crouch, too.
        assert 1.1 < np.quantile(of["Neck"][:, 2] - feet, 0.9) < 1.7, "height"
        assert np.median(trunk[:, 2] / np.linalg.norm(trunk, axis=1)) > 0.9, "upright"
        across = of["ShoulderLeft"] - of["ShoulderRight"]
        ahead = np.stack([across[:, 1], -across[:, 0]], axis=1)
        toes = (of["FootLeft"] - of["AnkleLeft"] + of["FootRight"] - of["AnkleRight"])[:, :2]
        assert np.median(np.sum(ahead * toes, axis=1)) > 0, "the chest faces where the toes point"
        moved = max(np.ptp(of[joint], axis=0).max() for joint in ("WristLeft", "WristRight", "SpineBase", "AnkleLeft"))
        assert moved > 0.1, "moving"


def test_a_websocket_says_what_grpc_says(streamed):
    hello, *messages = streamed["plain"]
    assert hello["type"] == "hello" and hello["units"] == "metres" and hello["axes"]["z"] == "up"
    frames = frames_of(messages)
    joined = [each for frame in frames for each in frame["joined"]]
    left = [each for frame in frames for each in frame["left"]]
    assert len(joined) >= PEOPLE and sorted(joined) == sorted(left), "everybody who came is gone"
    compared, tracks = 0, {}
    for frame in frames:
        reference = streamed["grpc"].get(frame["number"])
        if reference is None:
            continue
        people = {person.id: person for person in reference.people}
        assert {person["id"] for person in frame["people"]} == set(people)
        # Each sink reads by itself how far the server's clock is from civil time.
        assert abs(int(frame["unix_ns"]) - reference.unix_ns) < 1_000_000
        for person in frame["people"]:
            same = people[person["id"]]
            assert set(person["joints"]) == set(same.joints)
            for joint, at in told(same).items():
                assert np.abs(at - person["joints"][joint]).max() < MOST_M
                assert person["provenance"][joint] == same.joints[joint].provenance
                assert abs(person["confidence"][joint] - same.joints[joint].confidence) < 1e-3
                compared += 1
            tracks.setdefault(person["id"], []).append({joint: np.array(at) for joint, at in person["joints"].items()})
    assert compared > 2000
    assert_stands_and_walks({who: places for who, places in tracks.items() if len(places) > 20})
    numbers = [frame["number"] for frame in frames]
    assert numbers == sorted(set(numbers))
    status = streamed["statuses"]["websocket"]
    assert status.delivered > len(frames) and not status.trouble
    assert 0 < status.p99_ms < 250


def test_a_client_that_asks_for_few_frames_gets_few(streamed):
    few, all_of_them = frames_of(streamed["slow"]), frames_of(streamed["plain"])
    assert 5 < len(few) < len(all_of_them) / 2
    assert {each for frame in few for each in frame["joined"]} <= {each for frame in all_of_them for each in frame["joined"]}


def matrix(x, y, z, w):
    """Of a unit quaternion."""
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def placed(rig, body):
    """The origins of all bones, by name."""
    origins, axes = {}, {}
    for bone in rig["bones"]:
        name, parent = bone["name"], bone["parent"]
        turn = matrix(*body["rotations"][name])
        origins[name] = np.array(body["root"]) if parent is None else origins[parent] + axes[parent] @ bone["offset"]
        axes[name] = turn if parent is None else axes[parent] @ turn
    return origins


def bodies(messages):
    """By frame number and person: the origins of bones, and the joints of the same frame."""
    rigs, found = {}, {}
    for message in messages:
        if message["type"] == "rig":
            rigs[message["person"]] = message
        for person in message.get("people", []):
            if "body" in person:
                rig = rigs[person["id"]]
                assert rig["revision"] == person["body"]["revision"]
                found[message["number"], person["id"]] = placed(rig, person["body"]), person["joints"]
    return found


def test_bodies_stand_where_the_joints_are(streamed):
    found = bodies(streamed["bodies"])
    assert len(found) > 50
    off = [np.linalg.norm(origins["LeftHand"] - joints["WristLeft"]) for origins, joints in found.values() if "WristLeft" in joints]
    assert np.median(off) < 0.06
    assert not any("body" in person for frame in frames_of(streamed["plain"]) for person in frame["people"])


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_foxglove_shows_people_bones_and_frames(streamed, protocol):
    if not has_node():
        pytest.skip("SKIPPED: node or Foxglove's client is not there; `./test web` installs both")
    found = streamed[protocol]
    assert found["protocol"] == protocol and found["server"]["name"] == "Posefuse"
    assert not found["errors"] and not found["statuses"]
    assert found["topics"] == {"/scene": "foxglove.SceneUpdate", "/tf": "foxglove.FrameTransforms", "/frames": "posefuse.v1.RoomFrame"}
    of_topic = {topic: [each for each in found["messages"] if each["topic"] == topic] for topic in found["topics"]}
    number_at = {each["time"]: int(each["message"]["number"]) for each in of_topic["/frames"]}
    assert set(number_at) <= set(found["times"]), "the client's clock follows the frames"
    assert_scenes_are_right(streamed["grpc"], of_topic["/scene"], number_at)
    reference, compared = bodies(streamed["bodies"]), 0
    for each in of_topic["/tf"][::5]:
        origins = chained(each["message"].get("transforms", []))
        for (frame, person), (expected, _) in reference.items():
            # Channels are subscribed to one after the other, so the first frame may lack some.
            if frame != number_at.get(each["time"]):
                continue
            for bone, at in expected.items():
                assert np.abs(origins[f"person-{person}/{bone}"] - at).max() < MOST_M
                compared += 1
    assert compared > 200


def assert_scenes_are_right(reference, scenes, number_at):
    shown, gone, tracks = set(), set(), {}
    for each in scenes:
        frame = reference.get(number_at.get(each["time"]))
        gone |= {deletion["id"] for deletion in each["message"].get("deletions", [])}
        for entity in each["message"].get("entities", []):
            shown.add(entity["id"])
            assert entity["frameId"] == "room" and entity["lifetime"] == "0.300s"
            if frame is None:
                continue
            person = next(person for person in frame.people if entity["id"] == f"person-{person.id}")
            spheres = [place(sphere["pose"]["position"]) for sphere in entity["spheres"]]
            joints = told(person)
            assert len(spheres) == len(joints)
            assert max(np.abs(a - b).max() for a, b in zip(spheres, joints.values())) < MOST_M
            tracks.setdefault(person.id, []).append(dict(zip(joints, spheres)))
    assert len(shown) >= PEOPLE and shown == gone, "who left is taken out of the scene"
    assert_stands_and_walks({who: places for who, places in tracks.items() if len(places) > 20})


def place(vector):
    return np.array([vector.get(axis, 0.0) for axis in "xyz"])


def chained(transforms):
    """Where each frame's origin is in the room, by name."""
    origins, axes = {"room": np.zeros(3)}, {"room": np.eye(3)}
    for each in transforms:
        turn = matrix(*(each["rotation"].get(axis, 0.0) for axis in "xyzw"))
        parent = each["parentFrameId"]
        origins[each["childFrameId"]] = origins[parent] + axes[parent] @ place(each["translation"])
        axes[each["childFrameId"]] = axes[parent] @ turn
    return origins


def test_a_page_of_another_site_is_refused_and_one_of_this_machine_is_not(streamed):
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    for kind in ("websocket", "foxglove"):
        url = streamed["room"].stream(kind)
        with pytest.raises(InvalidStatus) as refused:
            connect(url, origin="https://evil.example", subprotocols=PROTOCOLS[:1])
        assert refused.value.response.status_code == 403 and b"allowed_origins" in refused.value.response.body
    with connect(streamed["room"].stream("websocket"), origin="http://localhost:8080") as own:
        assert json.loads(own.recv(timeout=5))["type"] == "hello"
