"""Each example of our Python package, from files of our own making, against a real server.

One person stands 2.5 m in front of a sensor and faces it, the right hand up, the left foot forward. Each file says so in
its tracker's own axes, units and words; every sensor of the room stands in the same place, so all must agree.
"""
import json
import math
import signal
import subprocess
import sys
import time

import pytest
from conftest import CLIENT, Room

#: Optical axes (x right, y down, z forward), metres, relative to the middle of the chest. The person's left is at x > 0.
FIGURE = {
    "SpineBase": (0, 0.45, 0), "SpineMid": (0, 0.2, 0), "SpineShoulder": (0, -0.05, 0), "Neck": (0, -0.12, 0),
    "Head": (0, -0.28, -0.02), "ShoulderLeft": (0.18, -0.03, 0), "ElbowLeft": (0.24, 0.24, 0), "WristLeft": (0.27, 0.47, -0.02),
    "HandLeft": (0.28, 0.55, -0.03), "HandTipLeft": (0.28, 0.63, -0.04), "ThumbLeft": (0.24, 0.57, -0.05),
    "ShoulderRight": (-0.18, -0.03, 0), "ElbowRight": (-0.42, -0.15, 0), "WristRight": (-0.46, -0.38, -0.02),
    "HandRight": (-0.47, -0.46, -0.03), "HandTipRight": (-0.47, -0.54, -0.03), "ThumbRight": (-0.43, -0.47, -0.05),
    "HipLeft": (0.09, 0.47, 0), "KneeLeft": (0.1, 0.88, -0.04), "AnkleLeft": (0.1, 1.27, -0.1), "FootLeft": (0.11, 1.31, -0.25),
    "HipRight": (-0.09, 0.47, 0), "KneeRight": (-0.1, 0.88, 0), "AnkleRight": (-0.1, 1.28, 0), "FootRight": (-0.12, 1.32, -0.12),
}
PERSON = {name: (x + 0.4, y + 0.05, z + 2.5) for name, (x, y, z) in FIGURE.items()}
#: Nobody stands perfectly still (frames that repeat each other are taken for a stuck tracker): so far to and fro, metres.
SWAY = 0.002
#: The sensor looks along the room's x, level, 1.4 m up: optical x is the room's -y, optical y its -z.
HEIGHT = 1.4
SENSORS = ["kinect", "kinect-live", "nuitrack", "depth", "colour", "wide", "long"]
CALIBRATION = 'version = 1\nfloor = "manual"\n' + "".join(
    f'[sensors.{name}]\nposition_m = [0.0, 0.0, {HEIGHT}]\norientation_xyzw = [-0.5, 0.5, -0.5, 0.5]\n' for name in SENSORS)
FRAMES, RATE = 105, 30


def moments():
    """Time, seconds, and where everybody's joints are then."""
    for frame in range(FRAMES):
        sway = SWAY * (frame % 5) / 4
        yield frame / RATE, {name: (x, y, z + sway) for name, (x, y, z) in PERSON.items()}


def kinect_lines(separator=","):
    """As a C# program prints it: ticks, camera space x to the sensor's left and y up; the thumb is inferred."""
    for t, person in moments():
        ticks = 987_654_321_000 + round(t * 1e7)
        for name, (x, y, z) in person.items():
            state = {"ThumbLeft": "Inferred", "ThumbRight": "NotTracked"}.get(name, "Tracked")
            yield separator.join([str(ticks), "72057594037929111", name, state, f"{-x:.6f}", f"{-y:.6f}", f"{z:.6f}"])
        yield separator.join([str(ticks), "72057594037929111", "HandRightState", "Closed"])


def nuitrack_records():
    names = {
        "head": "Head", "neck": "Neck", "torso": "SpineMid", "waist": "SpineBase", "left_collar": "SpineShoulder",
        **{f"{side.lower()}_{part.lower()}": f"{part}{side}" for side in ("Left", "Right")
           for part in ("Shoulder", "Elbow", "Wrist", "Hand", "Hip", "Knee", "Ankle")},
    }
    for t, person in moments():
        joints = {theirs: person[ours] for theirs, ours in names.items()}
        skeleton = {theirs: {"real": [1000 * x, -1000 * y, 1000 * z], "confidence": 0.9} for theirs, (x, y, z) in joints.items()}
        skeleton["right_collar"] = {"real": [0, 0, 0], "confidence": 0}
        yield {"t": t, "skeletons": [{"user_id": 3, **skeleton}]}


def pose_records(depth, size=1.0):
    """The picture of the person through a camera of 70 degrees; `size`: how large the network takes people to be."""
    for t, person in moments():
        yield {"t": t, "width": 1280, "height": 720, "poses": [pose(person, depth, size)]}


def pose(person, depth, size):
    focal = 640 / math.tan(math.radians(35))
    marks = landmarks(person)
    middle = [(a + b) / 2 for a, b in zip(person["HipLeft"], person["HipRight"])]
    found = {
        "image": [[0.5 + focal * x / z / 1280, 0.5 + focal * y / z / 720, 0.98] for x, y, z in marks],
        "world": [[size * (a - b) for a, b in zip(mark, middle)] for mark in marks],
    }
    if depth:
        found["depth_mm"] = [round(1000 * z) for _, _, z in marks]
    return found


def landmarks(person):
    """BlazePose's 33 points in its order: eleven of the face, then left and right in turn."""
    def near(name, dx=0.0, dy=0.0):
        x, y, z = person[name]
        return (x + dx, y + dy, z)

    def pair(part, dy=0.0):
        return [near(f"{part}Left", 0, dy), near(f"{part}Right", 0, dy)]

    face = [(0, 0), (0.02, -0.03), (0.03, -0.03), (0.04, -0.03), (-0.02, -0.03), (-0.03, -0.03), (-0.04, -0.03),
            (0.07, 0), (-0.07, 0), (0.03, 0.05), (-0.03, 0.05)]
    hands = [near(f"Hand{side}", dx) for dx in (0.02, -0.02) for side in ("Left", "Right")]
    return [*(near("Head", dx, dy) for dx, dy in face), *pair("Shoulder"), *pair("Elbow"), *pair("Wrist"), *hands,
            *pair("Thumb"), *pair("Hip"), *pair("Knee"), *pair("Ankle"), *pair("Ankle", 0.04), *pair("Foot")]


def wide_csv():
    """One row a frame, centimetres, x right, y up, z towards the viewer, with another name for the head."""
    names = {**{name: name for name in PERSON}, "Head": "skull"}
    yield ",".join(["t_ms", "person", *(f"{theirs} {axis}" for theirs in names.values() for axis in "XYZ")])
    for t, person in moments():
        values = [f"{100 * value:.4f}" for name in names for x, y, z in [person[name]] for value in (x, -y, -z)]
        yield ",".join([f"{1000 * t:.3f}", "8", *values])


def long_csv():
    """One row a joint, metres, optical; a joint is missing."""
    yield "time;name;px;py;pz;trust"
    for t, person in moments():
        for name, (x, y, z) in person.items():
            x = "nan" if name == "ThumbRight" else f"{x:.5f}"
            yield f"{t:.4f};{name};{x};{y:.5f};{z:.5f};{0.8 if name == 'HandLeft' else 1}"


@pytest.fixture(scope="module")
def example_room(tmp_path_factory):
    room = Room(tmp_path_factory.mktemp("examples"))
    file = room.folder / "place.toml"
    file.write_text(CALIBRATION)
    room.run("calibrations", "import", file, "--server", room.url)
    yield room
    room.close()


@pytest.fixture(scope="module")
def examples(example_room, client):
    """Every example, running."""
    folder, running = example_room.folder, {}

    def start(name, script, lines, *arguments, live=False):
        text = "\n".join(json.dumps(line) if isinstance(line, dict) else line for line in lines) + "\n"
        file = folder / f"{name}.txt"
        file.write_text(text)
        command = [sys.executable, CLIENT / "examples" / script, "-" if live else file, *arguments,
                   "--name", name, "--server", example_room.address]
        running[name] = subprocess.Popen(
            list(map(str, command)), stdin=subprocess.PIPE if live else subprocess.DEVNULL, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={"PYTHONPATH": str(client), "PATH": "/usr/bin:/bin"})
        return running[name]

    start("kinect", "kinect_v2_text.py", kinect_lines())
    live = start("kinect-live", "kinect_v2_text.py", kinect_lines(";"), live=True)
    start("nuitrack", "nuitrack.py", nuitrack_records())
    start("depth", "mediapipe_pose.py", pose_records(depth=True), "--fov", 70)
    start("colour", "mediapipe_pose.py", pose_records(depth=False, size=0.9), "--fov", 70)
    start("wide", "csv_skeletons.py", wide_csv(), "--time", "t_ms", "--time-unit", "ms", "--id", "person", "--unit", "cm",
          "--axes=x,-y,-z", "--rename", "skull=Head")
    start("long", "csv_skeletons.py", long_csv(), "--time", "time", "--joint", "name", "--columns", "p{axis}",
          "--confidence", "trust", "--delimiter", ";")
    feed(live, list(kinect_lines(";")))
    yield running
    for process in running.values():
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=20)


def feed(process, lines):
    """Writes lines as a live program does: a frame's at a time."""
    import itertools
    import threading

    def write():
        try:
            for _, frame in itertools.groupby(lines, key=lambda line: line.split(";")[0]):
                process.stdin.write("".join(line + "\n" for line in frame))
                process.stdin.flush()
                time.sleep(1 / RATE)
            process.stdin.close()
        except (BrokenPipeError, ValueError):
            pass

    threading.Thread(target=write, daemon=True).start()


def test_the_fused_person_stands_upright_in_the_right_place_and_faces_the_sensor(example_room, examples, client):
    import posefuse

    wanted = {name: (z, -x, HEIGHT - y) for name, (x, y, z) in PERSON.items()}
    best, shown = 1.0, None
    with posefuse.Room(example_room.address) as room:
        for frame in room.watch(seconds=20):
            for person in frame.people:
                off = [max(abs(joint.x - w[0]), abs(joint.y - w[1]), abs(joint.z - w[2]))
                       for name, w in wanted.items() for joint in [person.joints.get(name)] if joint]
                if len(off) == 25 and bin(person.sensors).count("1") >= len(SENSORS) - 1 and max(off) < best:
                    best, shown = max(off), person
            if best < 0.03:
                break
    assert shown and best < 0.03, f"the nearest was {best} m off: {shown}"
    left, right = shown.joints["ShoulderLeft"], shown.joints["ShoulderRight"]
    assert left.y < right.y - 0.3, "who looks along -x has the left at -y"
    assert shown.joints["Head"].z > shown.joints["FootLeft"].z + 1.4
    assert shown.joints["HandRight"].z > shown.joints["Head"].z
    assert shown.joints["FootLeft"].x < shown.joints["SpineBase"].x - 0.2, "the foot points away from the sensor"

    watch = subprocess.run([sys.executable, CLIENT / "examples/watch.py", example_room.address, "2"], capture_output=True, text=True,
                           env={"PYTHONPATH": str(client), "PATH": "/usr/bin:/bin"}, timeout=20)
    assert watch.stdout.count(" -0.40 +1.6") == 2, watch.stdout + watch.stderr


@pytest.mark.parametrize("name, identity, joints, off_m", [
    ("kinect", 72057594037929111, 24, 1e-4),
    ("kinect-live", 72057594037929111, 24, 1e-4),
    ("nuitrack", 3, 19, 1e-4),
    ("depth", 1, 23, 3e-3),
    ("wide", 8, 25, 1e-4),
    ("long", 1, 24, 1e-4),
])
def test_each_sensor_sees_the_person_where_the_file_says(example_room, examples, name, identity, joints, off_m):
    body = seen(example_room, name)[identity]
    # BlazePose's head is the middle of the ears and its pelvis the middle of the hips, which differ by centimetres.
    apart = {"SpineBase", "SpineShoulder", "Head", "HandTipLeft", "HandTipRight"} if name == "depth" else set()
    assert len(body) == joints
    for joint, (x, y, z) in PERSON.items():
        if joint in body and joint not in apart:
            assert body[joint][:3] == pytest.approx((x, y, z), abs=off_m + SWAY), joint
    if name.startswith("kinect"):
        assert body["ThumbLeft"].confidence == 0.5 and body["Head"].confidence == 1.0 and "ThumbRight" not in body
    if name == "long":
        assert body["HandLeft"].confidence == pytest.approx(0.8) and "ThumbRight" not in body


def test_a_colour_camera_gives_directions_and_a_distance_by_the_bodys_assumed_size(example_room, examples):
    body = seen(example_room, "colour")[1]
    x, y, z = body["ShoulderLeft"][:3]
    true = PERSON["ShoulderLeft"]
    assert (x / z, y / z) == pytest.approx((true[0] / true[2], true[1] / true[2]), abs=2e-3)
    assert z == pytest.approx(0.9 * true[2], abs=0.02), "taken to be 10 % smaller, 10 % nearer"
    assert max(joint.confidence for joint in body.values()) <= 0.5, "a guess that passes for a measurement"


def seen(room, name):
    import posefuse

    with posefuse.Room(room.address) as reader:
        for frame in reader.watch_sensors(name, seconds=10):
            if frame.bodies:
                return frame.bodies
    raise AssertionError(f"{name} saw nobody")


def test_every_example_delivers_all_of_its_file(example_room, examples):
    for name, process in examples.items():
        output = process.communicate(timeout=30)[0] if name != "kinect-live" else process.stdout.read()
        process.wait(timeout=10)
        assert process.returncode == 0 and f"{name}: {FRAMES} frames captured, {FRAMES} delivered" in output, output


@pytest.mark.parametrize("script, arguments, words", [
    ("csv_skeletons.py", ["--time", "t", "--axes", "x,y"], "expected x, y and z"),
    ("csv_skeletons.py", ["--time", "when"], "no column"),
    ("csv_skeletons.py", ["--time", "a"], "no column like 'SpineBase_x'; it has a, b"),
    ("csv_skeletons.py", ["--time", "a", "--joint", "b"], "no joint was understood"),
    ("kinect_v2_text.py", [], "line 1 is none of time,id,joint"),
    ("mediapipe_pose.py", [], "--fov"),
])
def test_mistakes_say_what_was_expected(client, tmp_path, script, arguments, words):
    file = tmp_path / "input.txt"
    file.write_text("a,b\n1,2\n")
    command = [sys.executable, CLIENT / "examples" / script, file, *arguments, "--server", "127.0.0.1:9", "--name", "x"]
    if script == "kinect_v2_text.py":
        command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(CLIENT / 'examples')!r}); import kinect_v2_text as k; list(k.frames(open({str(file)!r})))"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=30, env={"PYTHONPATH": str(client), "PATH": "/usr/bin:/bin"})
    assert words in done.stderr, done.stderr
