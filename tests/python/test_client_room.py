"""What our Python package reads of a room and does to it: takes, calibration, state; against a real server with simulated sensors."""
import json
import pathlib
import socket
import subprocess
import sys
import time

import pytest
from conftest import CLIENT, Room
from mcap.reader import make_reader

SENSORS = ["sim1", "sim2", "sim3", "sim4"]


@pytest.fixture(scope="module")
def live(tmp_path_factory, client):
    """A room with simulated sensors, where they truly stand; one person walks, the same way each time."""
    room = Room(tmp_path_factory.mktemp("live"))
    room.run("simulate", "--out", "true", "--seconds", 1, "--sensors", len(SENSORS), "--true-calibration", "--takes", room.folder)
    with (room.folder / "true.mcap").open("rb") as stream:
        attachments = make_reader(stream).iter_attachments()
        calibration = next(each.data.decode() for each in attachments if each.name.endswith("calibration.toml"))
    sim = ["sim", "--sensors", len(SENSORS), "--epoch-ns", time.time_ns()]
    for number, name in enumerate(SENSORS, 1):
        room.start(name, "agent", "--name", name, "--server", room.url, *sim, "--sensor", number)
    room.wait_for(lambda: sorted(s.info.name for s in room.status().sensors if s.frames_received > 30) == SENSORS, "the sensors")
    yield room, calibration
    room.close()


@pytest.fixture
def reader(live):
    import posefuse

    with posefuse.Room(live[0].url) as room:
        yield room


def code_of(call):
    import posefuse

    with pytest.raises(posefuse.ServerError) as refused:
        call()
    return refused.value.code, str(refused.value)


def test_a_calibration_is_gathered_called_off_imported_and_restored(live, reader):
    assert code_of(reader.calibration)[0] == "NOT_FOUND"
    progress = []
    result = reader.calibrate(3, dry_run=True, on_progress=progress.append)
    assert result.verdict in ("passed", "weak", "failed") and result.reasons and not result.in_force
    assert progress[-1].solving and set(progress[-1].sensors) == set(SENSORS) and 2 < progress[-1].elapsed_s < 10

    class Enough(Exception):
        pass

    def enough(_):
        raise Enough

    with pytest.raises(Enough):
        reader.calibrate(60, on_progress=enough)
    live[0].wait_for(lambda: not reader.status().calibrating, "the calibration to be called off", 5)

    checked = reader.import_calibration(live[1], dry_run=True)
    assert code_of(reader.calibration)[0] == "NOT_FOUND", "a dry run changed something"
    assert reader.import_calibration(live[1]) == checked == reader.calibration()
    assert set(checked.sensors) == set(SENSORS)
    place = checked.sensors["sim1"]
    assert 1 < place.position_m[2] < 3 and sum(part**2 for part in place.orientation_xyzw) == pytest.approx(1)
    # Over another form and back.
    assert json.loads(reader.export_calibration("json"))
    again = reader.import_calibration(reader.export_calibration("tf2-yaml"))
    assert again.sensors["sim2"].position_m == pytest.approx(checked.sensors["sim2"].position_m, abs=1e-5)
    kept = reader.calibrations()
    assert [calibration.in_force for calibration in kept].count(True) == 1 and len(kept) == 2
    old = next(calibration for calibration in kept if not calibration.in_force)
    assert reader.restore_calibration(old.name).sensors["sim1"] == place
    with pytest.raises(ValueError, match="tf2-yaml"):
        reader.export_calibration("xml")
    assert code_of(lambda: reader.restore_calibration("nothing"))[0] == "NOT_FOUND"


def test_people_are_watched_and_a_muted_sensor_is_left_out(live, reader):
    frames = list(reader.watch(seconds=3))
    people = [person for frame in frames for person in frame.people]
    assert len(people) > 20
    head, foot = people[-1].joints["Head"], people[-1].joints["AnkleLeft"]
    assert 1.0 < head.z - foot.z < 2.0 and head.provenance == "measured" and 0 < head.sigma_m < 0.3
    assert all(later.unix_ns > frame.unix_ns > 1.7e18 for frame, later in zip(frames, frames[1:]))
    assert frames[-1].timecode.count(":") == 3 or ";" in frames[-1].timecode
    names = [sensor.info.name for sensor in reader.status().sensors]
    bit = 1 << next(sensor.info.id for sensor in reader.status().sensors if sensor.info.name == names[0])
    assert any(person.sensors & bit for person in people)
    reader.mute(names[0])
    try:
        later = [person for frame in reader.watch(seconds=2) for person in frame.people][-10:]
        assert later and not any(person.sensors & bit for person in later)
        seen = next(reader.watch_sensors(names[0], seconds=5))
        assert seen.captured_ns > 0
    finally:
        reader.mute(names[0], False)
    states = reader.watch_status(max_rate_hz=20, seconds=5)
    assert next(states).server_version and next(states).people >= 0
    states.close()


def test_outputs_are_switched(reader):
    from posefuse.v1 import room_pb2

    def state():
        return next(sink.state for sink in reader.status().sinks if sink.name == "vmc")

    assert state() == room_pb2.SINK_STATE_OFF
    assert reader.switch_output("vmc", True).state == state() == room_pb2.SINK_STATE_RUNNING
    reader.switch_output("vmc", False)
    assert state() == room_pb2.SINK_STATE_OFF
    assert code_of(lambda: reader.switch_output("fax", True))[0] == "NOT_FOUND"


def test_a_machine_that_says_nothing_is_not_an_empty_room(client):
    import posefuse

    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        with posefuse.Room(f"127.0.0.1:{silent.getsockname()[1]}") as nobody:
            code, words = code_of(lambda: list(nobody.watch(seconds=0.5)))
    assert code in ("DEADLINE_EXCEEDED", "UNAVAILABLE") and "nothing answers" in words


def test_takes_are_recorded_described_listed_and_replayed(live, reader):
    room, _ = live
    assert reader.takes() == [] and code_of(lambda: reader.take("walk"))[0] == "NOT_FOUND"
    assert code_of(reader.stop_take)[0] == "FAILED_PRECONDITION"
    with reader.recording("walk", slate="1A") as begun:
        assert (begun.name, begun.state) == ("walk", "recording")
        code, words = code_of(reader.start_take)
        assert code == "FAILED_PRECONDITION" and "recorded" in words
        watched = list(reader.watch(seconds=2))
    take = reader.take("walk")
    assert take.state == "complete" and 1.5 < take.duration_s < 6 and take.frames >= len(watched) > 20
    assert (take.slate, take.dropped, set(take.sensors)) == ("1A", 0, set(SENSORS))
    assert take.start_unix_ns > 1.7e18 and take.started.endswith("Z")
    assert reader.describe_take("walk", notes="the door was open") == reader.takes()[0]
    assert (reader.take("walk").slate, reader.take("walk").notes) == ("1A", "the door was open")
    # What was watched is what is replayed.
    replayed = {frame.number: frame for frame in reader.replay("walk")}
    shared = [frame for frame in watched if frame.number in replayed]
    # The first frames of a take can be of an instant before its start.
    assert 0 <= take.frames - len(replayed) <= 5 and len(shared) > 20
    for frame in shared:
        assert [person.joints for person in frame.people] == [person.joints for person in replayed[frame.number].people]
    late = list(reader.replay("walk", start_s=1))
    assert 0 < len(late) < len(replayed)
    # An exception ends a recording, too; a name that is taken gets a number.
    with pytest.raises(KeyError), reader.recording("walk") as second:
        raise KeyError
    assert second.name != "walk" and reader.take(second.name).state == "complete"
    # The program finds it where the client says it is.
    path = reader.take_path("walk")
    assert pathlib.Path(path) == room.takes / "walk.mcap"
    room.run("export", path, "--format", "csv", "--out", room.folder / "out")
    assert (room.folder / "out/walk.csv").stat().st_size > 1000


def test_the_example_records_a_take(live, client):
    room, _ = live
    command = [sys.executable, CLIENT / "examples/record.py", "--server", room.address, "--name", "example", "--seconds", "1"]
    done = subprocess.run(list(map(str, command)), env={"PYTHONPATH": str(client)}, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert str(room.takes / "example.mcap") in done.stdout
