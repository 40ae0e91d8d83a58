"""Takes started and stopped from outside, over HTTP, OSC and capture packets; and civil time in what a room gives."""
import contextlib
import json
import pathlib
import re
import socket
import time
import urllib.error
import urllib.request

import pytest
from conftest import Program, Room
from pythonosc import osc_message, osc_message_builder

TIMECODE = re.compile(r"\d\d:\d\d:\d\d[:;]\d\d")


def request(room, method, path, body=None, headers=None):
    """Status and JSON of an answer."""
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    call = urllib.request.Request(room.url + path, data=data, method=method, headers=headers or {})
    try:
        with urllib.request.urlopen(call, timeout=10) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        text = error.read().decode()
        return error.code, json.loads(text) if text.startswith("{") else text


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A server with both UDP ports, drop-frame timecode, and one simulated sensor."""
    folder = tmp_path_factory.mktemp("trigger")
    ports = {"osc": free_udp_port(), "capture": free_udp_port()}
    config = folder / "server.toml"
    lines = [f'{way} = "127.0.0.1:{port}"' for way, port in ports.items()]
    config.write_text('[timecode]\nrate = "29.97df"\n\n[trigger]\n' + "\n".join(lines) + "\n")
    room = ConfiguredRoom(folder, config)
    room.ports = ports
    room.start("agent", "agent", "sim", "--sensor", 1, "--server", room.url)
    room.wait_for(lambda: any(s.frames_received > 10 for s in room.status().sensors), "frames")
    yield room
    room.close()


class ConfiguredRoom(Room):
    def __init__(self, folder, config):
        self.config = config
        super().__init__(folder)

    def start(self, name, *arguments):
        if name == "server":
            arguments = (*arguments, "--config", self.config)
        return super().start(name, *arguments)


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(autouse=True)
def nothing_runs(room):
    yield
    request(room, "POST", "/api/takes/stop")


def recording(room):
    return request(room, "GET", "/api/status")[1]["recording"]


def trigger(room, name):
    return next(t for t in room.status().triggers if t.name == name)


@contextlib.contextmanager
def udp(room, way):
    """A socket to the port of `way`, which also hears its answers."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", room.ports[way]))
        sender.settimeout(5)
        yield sender


def osc(sender, address, *arguments):
    """Sends an order; the answer's last word of its address, and what it says."""
    builder = osc_message_builder.OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    sender.send(builder.build().dgram)
    answer = osc_message.OscMessage(sender.recv(4096))
    return answer.address.removeprefix("/posefuse/take/"), answer.params[0]


def test_a_take_is_started_and_stopped_over_http(room):
    before = time.time_ns()
    code, take = request(room, "POST", "/api/takes/start", {"name": "walk", "slate": "12A", "notes": "two turns"})
    assert (code, take["name"], take["slate"], take["state"]) == (200, "walk", "12A", "recording"), take
    assert before - 1_000_000_000 < take["start_unix_ns"] < time.time_ns()
    assert TIMECODE.fullmatch(take["timecode"]) and ";" in take["timecode"] and take["timecode_rate"] == "29.97df"
    assert recording(room)["name"] == "walk"
    code, refused = request(room, "POST", "/api/takes/start")
    assert code == 409 and "`walk` is being recorded" in refused["error"]
    time.sleep(0.5)
    code, take = request(room, "POST", "/api/takes/stop", b"")
    assert (code, take["state"]) == (200, "complete") and take["seconds"] > 0.4, take
    assert request(room, "POST", "/api/takes/stop") == (409, {"error": "no take is being recorded"})
    info = room.take_info("walk")
    assert (info["notes"], info["timecode"], info["start_unix_ns"]) == ("two turns", take["timecode"], take["start_unix_ns"])
    events = {event["kind"]: event["text"] for event in info["events"]}
    assert events["take-started"].startswith("started over http by 127.0.0.1:") and "take-stopped" in events
    assert trigger(room, "http").latest == "refused: no take is being recorded" and trigger(room, "http").latest_refused


@pytest.mark.parametrize("body", [b"{", b"[1]", b'{"nam": "x"}', b'{"name": 3}', b'{"name": "../x"}', b"\xff"])
def test_a_wrong_body_is_refused_with_what_was_expected(room, body):
    code, answer = request(room, "POST", "/api/takes/start", body)
    assert code == 400 and ("JSON" in answer["error"] or "name" in answer["error"]), answer
    assert recording(room) is None


def test_a_web_page_from_elsewhere_cannot_record(room):
    foreign = [{"Origin": "http://evil.test"}, {"Sec-Fetch-Site": "cross-site"}, {"Host": "evil.test"}]
    for headers in foreign:
        # As a form or a script without leave could send it.
        code, _ = request(room, "POST", "/api/takes/start", b"{}", headers | {"Content-Type": "text/plain"})
        assert code == 403, headers
    assert recording(room) is None
    for method, path, expected in [("GET", "/api/takes/start", 405), ("POST", "/api/status", 405), ("GET", "/api/x", 404)]:
        assert request(room, method, path)[0] == expected
    assert request(room, "POST", "/api/takes/start", b" " * 70_000)[0] == 413
    # A page of our own may.
    assert request(room, "POST", "/api/takes/start", b"{}", {"Origin": room.url})[0] == 200


def test_the_state_is_told_as_json(room):
    code, status = request(room, "GET", "/api/status")
    assert code == 200 and status["sensors"][0]["state"] == "live" and status["timecode_rate"] == "29.97df"
    assert abs(status["unix_ns"] - time.time_ns()) < 2_000_000_000
    assert {"name": "osc", "state": "off"}.items() <= next(s for s in status["sinks"] if s["name"] == "osc").items()


def test_a_take_is_started_and_stopped_over_osc(room):
    with udp(room, "osc") as sender:
        assert osc(sender, "/posefuse/take/start", "Scene 4", "4C", "loud") == ("started", "Scene_4")
        assert (recording(room)["slate"], recording(room)["notes"]) == ("4C", "loud")
        what, words = osc(sender, "/posefuse/take/start", "again")
        assert what == "error" and "is being recorded" in words
        assert osc(sender, "/posefuse/take/stop") == ("stopped", "Scene_4")
        # The button of a control surface.
        what, name = osc(sender, "/posefuse/take/start", 1.0)
        assert (what, recording(room)["name"]) == ("started", name)
        what, words = osc(sender, "/posefuse/take/begin")
        assert what == "error" and "/posefuse/take/start" in words
        # Neither what is no OSC nor what is for others is answered.
        sender.send(b"GET / HTTP/1.1\r\n\r\n")
        sender.send(osc_message_builder.OscMessageBuilder("/fader/1").build().dgram)
        assert osc(sender, "/posefuse/take/stop", 1)[0] == "stopped"
    shown = trigger(room, "osc")
    assert (shown.done, shown.refused, shown.trouble) == (4, 3, "") and shown.place == f"udp 127.0.0.1:{room.ports['osc']}"


def capture(kind, name, number):
    end = ' RESULT="SUCCESS"' if kind == "Stop" else ""
    return (
        f'<?xml version="1.0" encoding="UTF-8" standalone="no" ?>\n<Capture{kind}{end}>\n<Name VALUE="{name}"/>\n'
        f'<Notes VALUE="a &amp; b"/>\n<DatabasePath VALUE="S:/x"/>\n<Delay VALUE="33"/>\n<PacketID VALUE="{number}"/>\n'
        f"</Capture{kind}>"
    ).encode()


def test_a_take_is_started_and_stopped_by_another_systems_packets(room):
    with udp(room, "capture") as sender:
        for _ in range(3):
            sender.send(capture("Start", "Trial 1", 7))
        room.wait_for(lambda: recording(room) is not None, "the take of CaptureStart", 5)
        assert {"name": "Trial_1", "slate": "Trial 1", "notes": "a & b"}.items() <= recording(room).items()
        for _ in range(3):
            sender.send(capture("Stop", "Trial 1", 8))
        room.wait_for(lambda: recording(room) is None, "the end by CaptureStop", 5)
        room.wait_for(lambda: trigger(room, "capture").done == 2, "two orders", 5)
        assert trigger(room, "capture").refused == 0
        # What somebody records by hand here is not another system's to stop.
        request(room, "POST", "/api/takes/start", {"name": "by_hand"})
        sender.send(capture("Stop", "Trial 2", 9))
        room.wait_for(lambda: trigger(room, "capture").refused == 1, "the refusal", 5)
        assert recording(room)["name"] == "by_hand" and "by_hand" in trigger(room, "capture").latest


def test_frames_have_civil_time_and_timecode(room):
    from posefuse.v1 import room_pb2, types_pb2

    status = room.status()
    # One sensor at a known place is a calibrated room.
    channel, stub = room.stub()
    with channel:
        level = {"translation": {"z": 1.4}, "rotation": {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5}}
        pose = types_pb2.SensorPose(sensor=status.sensors[0].info.name, room_from_sensor=level)
        calibration = types_pb2.Calibration(method="by hand", floor="assumed", sensors=[pose])
        stub.SetCalibration(room_pb2.SetCalibrationRequest(calibration=calibration), timeout=5)
        frames = stub.Watch(room_pb2.WatchRequest(), timeout=30)
        frame = next(frames)
        offset = stub.GetStatus(room_pb2.GetStatusRequest(), timeout=5).unix_offset_ns
        frames.cancel()
    assert abs(frame.unix_ns - (frame.time_ns + offset)) < 1_000_000 and TIMECODE.fullmatch(frame.timecode)
    seconds = frame.unix_ns // 1_000_000_000 % 86_400
    said = sum(int(part) * weight for part, weight in zip(re.split("[:;]", frame.timecode), (3600, 60, 1, 0)))
    # Drop-frame labels are up to 87 ms behind the clock at the end of a day.
    assert said in (seconds, seconds - 1)
    watched = json.loads(room.run("watch", "--json", "--frames", 1, "--server", room.url))
    assert TIMECODE.fullmatch(watched["timecode"]) and watched["unix_ns"] > frame.unix_ns


def test_outputs_are_listed_and_switched_on_the_command_line(room):
    def sinks():
        return {sink["name"]: sink for sink in json.loads(room.run("sinks", "--json", "--server", room.url))}

    assert (sinks()["osc"]["state"], sinks()["watch"]["state"]) == ("off", "always")
    assert "running" in room.run("sinks", "on", "osc", "--server", room.url)
    assert sinks()["osc"]["state"] == "running" and "running" in room.run("sinks", "list", "--server", room.url)
    assert json.loads(room.run("sinks", "off", "osc", "--json", "--server", room.url))["state"] == "off"
    room.run("sinks", "on", "fax", "--server", room.url, code=1)


@pytest.mark.skipif(not pathlib.Path("/usr/share/zoneinfo/Asia/Kolkata").exists(), reason="no time zones on this machine")
def test_timecode_counts_from_the_machines_own_midnight(tmp_path, monkeypatch):
    monkeypatch.setenv("TZ", "Asia/Kolkata")
    config = tmp_path / "server.toml"
    config.write_text('[timecode]\nrate = "25"\nzone = "local"\n')
    room = ConfiguredRoom(tmp_path, config)
    try:
        status = room.status()
    finally:
        room.close()
    assert (status.timecode_rate, status.timecode_utc_offset_s) == ("25", 19_800)
    seconds = ((status.time_ns + status.unix_offset_ns) // 1_000_000_000 + 19_800) % 86_400
    assert status.timecode.startswith(time.strftime("%H:%M:%S:", time.gmtime(seconds)))


def test_a_port_in_use_is_told_and_tried_again(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        config = tmp_path / "server.toml"
        config.write_text(f'[trigger]\nosc = "127.0.0.1:{taken.getsockname()[1]}"\n')
        room = ConfiguredRoom(tmp_path, config)
        try:
            room.wait_for(lambda: "in use" in trigger(room, "osc").trouble, "the trouble", 5)
            taken.close()
            room.wait_for(lambda: trigger(room, "osc").trouble == "", "the port", 10)
        finally:
            room.close()


def test_another_machines_port_needs_leave(tmp_path):
    config = tmp_path / "server.toml"
    config.write_text('[trigger]\nosc = "0.0.0.0:7402"\n')
    server = Program(tmp_path, "server", "server", "--listen", "127.0.0.1:0", "--config", config, "--takes", tmp_path)
    assert server.process.wait(timeout=20) == 2 and "allow_remote" in server.log.read_text()
