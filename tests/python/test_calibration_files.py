"""Calibrations in the forms of other programs, read and written by those programs' own readers."""
import json

import pytest

ROOM = """version = 1
floor = "walk"
[sensors.left]
position_m = [0.25, 1.5, 1.75]
orientation_xyzw = [-0.65, 0.27, -0.27, 0.65676]
[sensors."right.2"]
position_m = [3.0, -2.0, 1.0]
orientation_xyzw = [-0.5, 0.5, -0.5, 0.5]
time_offset_ms = -4.5
"""


@pytest.fixture
def calibrated(room, tmp_path):
    """A room with that calibration; gives a function that runs `posefuse calibrations`."""
    def run(*words, code=0):
        return room.run("calibrations", *words, "--server", room.url, code=code)

    file = tmp_path / "room.toml"
    file.write_text(ROOM)
    run("import", file)
    return run


def poses(run):
    return {row["sensor"]: row for row in json.loads(run("show", "--json"))}


def assert_same(found, wanted):
    assert found.keys() == wanted.keys()
    for name, row in wanted.items():
        assert found[name]["position_m"] == pytest.approx(row["position_m"], abs=1e-6)
        turn = sum(a * b for a, b in zip(found[name]["orientation_xyzw"], row["orientation_xyzw"], strict=True))
        assert abs(turn) == pytest.approx(1, abs=1e-9)


def test_ros_reads_the_message_and_what_it_writes_is_read(calibrated, tmp_path):
    yaml = pytest.importorskip("yaml")
    wanted = poses(calibrated)
    message = yaml.safe_load(calibrated("export", "--format", "tf2"))
    frames = {entry["child_frame_id"]: entry for entry in message["transforms"]}
    assert set(frames) == {"left_optical", "right.2_optical"}
    left = frames["left_optical"]
    assert left["header"]["frame_id"] == "posefuse_room"
    place = left["transform"]["translation"]
    assert [place["x"], place["y"], place["z"]] == pytest.approx([0.25, 1.5, 1.75])
    assert all(type(value) is float for value in (*place.values(), *left["transform"]["rotation"].values()))

    # As `ros2 topic echo` prints it: block style, sorted otherwise, ended by a line of dashes.
    echoed = tmp_path / "tf_static.yaml"
    echoed.write_text(yaml.safe_dump(message) + "---\n")
    calibrated("import", echoed)
    assert_same(poses(calibrated), wanted)


def test_opencv_reads_the_extrinsics_and_what_it_writes_is_read(calibrated, tmp_path):
    cv2 = pytest.importorskip("cv2", reason="SKIPPED: no OpenCV (pip install opencv-python-headless)")
    import numpy

    wanted = poses(calibrated)
    file = tmp_path / "room.yaml"
    calibrated("export", "--format", "opencv", "--output", file)
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_READ)
    sensors = storage.getNode("sensors")
    read = {}
    for index in range(sensors.size()):
        sensor = sensors.at(index)
        name, R, t = sensor.getNode("name").string(), sensor.getNode("R").mat(), sensor.getNode("t").mat()
        assert R.shape == (3, 3) and t.shape == (3, 1) and R.dtype == numpy.float64
        assert (-R.T @ t).ravel() == pytest.approx(wanted[name]["position_m"], abs=1e-9)
        # OpenCV's own projection puts a point 2 m in front of the sensor into the middle of its picture.
        ahead = (R.T @ (numpy.array([[0.0], [0.0], [2.0]]) - t)).T
        pixel, _ = cv2.projectPoints(ahead, cv2.Rodrigues(R)[0], t, numpy.diag([500.0, 500.0, 1.0]), None)
        assert pixel.ravel() == pytest.approx([0, 0], abs=1e-6)
        read[name] = (R, t)
    assert set(read) == {"left", "right.2"}

    written = tmp_path / "written.yaml"
    storage = cv2.FileStorage(str(written), cv2.FILE_STORAGE_WRITE)
    storage.startWriteStruct("sensors", cv2.FileNode_SEQ)
    for name, (R, t) in read.items():
        storage.startWriteStruct("", cv2.FileNode_MAP)
        storage.write("name", name)
        storage.write("R", R if name == "left" else cv2.Rodrigues(R)[0])
        storage.write("t", t)
        storage.endWriteStruct()
    storage.endWriteStruct()
    storage.release()
    calibrated("import", written)
    assert_same(poses(calibrated), wanted)
