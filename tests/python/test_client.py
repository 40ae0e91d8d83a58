"""The agent of our Python package: what it promises when servers go, hang, refuse and break off in the middle."""
import concurrent.futures
import contextlib
import pathlib
import random
import signal
import subprocess
import sys
import time

import grpc
import pytest
from conftest import CLIENT, ROOT, free_port


def wait_for(condition, what, seconds=15.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"waited {seconds} s for {what} in vain"
        time.sleep(0.02)


def body(posefuse, x=0.0):
    return posefuse.Body(1, {"Head": (x, -0.6, 2.5)})


def test_what_is_checked_in_is_what_the_protos_give():
    done = subprocess.run([sys.executable, CLIENT / "generate.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_joint_sets_are_those_of_the_server():
    import re

    from posefuse import JOINT_SETS

    tables = (ROOT / "skeleton/src/joint_set/tables.rs").read_text()
    found = [re.findall(r'"(\w+)"', names) for names in re.findall(r"_NAMES: \[&str; \d+\] = \[(.*?)\];", tables, re.S)]
    assert sorted(map(list, JOINT_SETS.values())) == sorted(found)


def test_mistakes_are_answered_with_what_was_expected():
    import posefuse

    for wrong, words in [
        (dict(name="../etc"), "letters"),
        (dict(name="a", server="studio"), "expected host and port"),
        (dict(name="a", joint_set="kinect-v9"), "kinect-v2"),
    ]:
        with pytest.raises(ValueError, match=words):
            posefuse.Agent(**wrong)
    with posefuse.Agent("a", f"127.0.0.1:{free_port()}", drain_s=0) as agent:
        with pytest.raises(ValueError, match="SpineBase"):
            agent.send([posefuse.Body(1, {"Nose": (0, 0, 1)})])
        with pytest.raises(ValueError, match="expected 25 joints"):
            agent.send([posefuse.Body(1, [(0, 0, 1)] * 15)])
    with posefuse.Room(f"127.0.0.1:{free_port()}") as nowhere, pytest.raises(posefuse.ServerError, match="posefuse server"):
        nowhere.status(timeout_s=1)


def test_frames_are_accounted_for_whatever_happens():
    """The law of the resend buffer: delivered + dropped + in doubt + waiting = captured, and no frame comes twice."""
    from posefuse._buffer import ResendBuffer
    from posefuse.v1 import ingest_pb2

    for seed in range(200):
        dice, buffer = random.Random(seed), ResendBuffer(most_frames=5)
        server, wire = [], []
        for _ in range(dice.randrange(1, 300)):
            step = dice.choices(["push", "send", "ack", "reconnect"], [4, 4, 1, 1])[0]
            if step == "push":
                buffer.push(ingest_pb2.Frame())
            elif step == "send" and (frame := buffer.send_next()) is not None:
                wire.append(frame.sequence)
            elif step == "ack":
                server, wire = server + wire, []
                if server:
                    buffer.acknowledge(server[-1] - dice.randrange(4))
            elif step == "reconnect":
                server, wire = server + wire[: dice.randrange(6)], []
                buffer.welcomed(server[-1] if server else None)
            assert len(buffer) <= 5
            assert buffer.next == buffer.acknowledged + buffer.dropped + buffer.in_doubt + len(buffer)
            assert server == sorted(set(server))
        server += wire
        buffer.welcomed(server[-1] if server else None)
        while (frame := buffer.send_next()) is not None:
            server.append(frame.sequence)
        assert len(server) + buffer.dropped == buffer.next


def test_a_device_clock_takes_the_jitter_of_delivery_out():
    from posefuse import DeviceClock

    dice, clock, errors = random.Random(7), DeviceClock(), []
    for frame in range(900):
        caught = frame * 33_333_333
        arrived = caught + dice.randrange(0, 20_000_000) + 5_000_000_000
        errors.append(clock.captured_ns(caught, arrived) - caught - 5_000_000_000)
    assert max(errors[100:]) < 2_000_000 and min(errors) >= 0
    # The device is switched off and on: its time begins anew.
    assert clock.captured_ns(0, 60_000_000_000) == 60_000_000_000


def test_a_server_that_is_killed_and_comes_back_gets_every_frame(room):
    import posefuse

    with posefuse.Agent("left", room.url) as agent:
        agent.wait_connected(10)
        for index in range(120):
            if index == 30:
                room.programs[-1].process.kill()
                room.programs[-1].process.wait()
            if index == 60:
                room.start("again", "server", "--listen", room.address, "--takes", room.takes)
            agent.send([body(posefuse)])
            time.sleep(0.01)
        wait_for(lambda: agent.report.delivered == 120, "all frames to be acknowledged")
        sensor = room.status().sensors[0]
        assert sensor.frames_lost == 0 and sensor.frames_received >= 60
    report = agent.report
    assert (report.captured, report.delivered, report.dropped, report.unacknowledged) == (120, 120, 0, 0)
    assert report.connections == 2


def test_a_server_that_hangs_is_noticed_and_taken_up_again(room):
    import posefuse

    with posefuse.Agent("left", room.url) as agent:
        agent.wait_connected(10)
        room.programs[-1].process.send_signal(signal.SIGSTOP)
        try:
            began = time.monotonic()
            wait_for(lambda: agent.send([body(posefuse)]) or not agent.connected, "the agent to notice")
            assert time.monotonic() - began < 4
        finally:
            room.programs[-1].process.send_signal(signal.SIGCONT)
        wait_for(lambda: agent.connected, "the agent to come back")
        wait_for(lambda: agent.report.unacknowledged == 0, "all frames to be acknowledged")
    assert agent.report.dropped == 0 and agent.report.delivered == agent.report.captured


def test_without_a_server_the_oldest_frames_go_and_are_counted(room):
    import posefuse

    room.programs[-1].process.kill()
    room.programs[-1].process.wait()
    with posefuse.Agent("left", room.url, most_frames=10) as agent:
        for _ in range(50):
            agent.send([body(posefuse)])
        assert agent.report.dropped == 40
        wait_for(lambda: agent.report.trouble, "the trouble to be told")
        assert "posefuse server" in agent.report.trouble
        room.start("again", "server", "--listen", room.address, "--takes", room.takes)
        agent.wait_connected(15)
        agent.trouble("the lens is covered")
        wait_for(lambda: room.status().sensors[0].agent_dropped == 40, "the health message")
        wait_for(lambda: "the lens is covered" in room.status().sensors[0].trouble, "the sensor's trouble")
        assert room.status().sensors[0].frames_received == 10
    assert (agent.report.delivered, agent.report.dropped) == (10, 40)


def test_a_second_agent_of_the_name_waits_for_the_first_to_go(room):
    import posefuse

    with posefuse.Agent("twin", room.url) as first:
        first.wait_connected(10)
        with posefuse.Agent("twin", room.url, drain_s=0) as second:
            wait_for(lambda: second.report.trouble, "the refusal")
            assert "twin" in second.report.trouble and "another name" in second.report.trouble
            first.close()
            assert second.wait_connected(15)


def test_a_clock_of_ones_own_is_the_one_that_answers_probes(room):
    import posefuse

    ahead_ns = 3_600_000_000_000
    with posefuse.Agent("own", room.url, clock=lambda: time.monotonic_ns() + ahead_ns) as own, posefuse.Agent("plain", room.url) as plain:
        mapped = lambda: {s.info.name: s.clock_offset_ms for s in room.status().sensors if s.HasField("clock_offset_ms")}  # noqa: E731
        wait_for(lambda: own.send([]) or plain.send([]) or len(mapped()) == 2, "both clocks to be mapped")
        offsets = mapped()
        assert abs(offsets["own"] - offsets["plain"]) == pytest.approx(ahead_ns / 1e6, abs=50)


@contextlib.contextmanager
def fake_server(answer):
    """A server of the protocol whose stream is `answer(requests, context)`."""
    from posefuse.v1 import ingest_pb2_grpc

    class Service(ingest_pb2_grpc.IngestServicer):
        def Stream(self, requests, context):
            yield from answer(requests, context)

    server = grpc.server(concurrent.futures.ThreadPoolExecutor(4))
    ingest_pb2_grpc.add_IngestServicer_to_server(Service(), server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    yield f"127.0.0.1:{port}"
    server.stop(0).wait()


def test_a_server_that_breaks_off_at_random_has_each_frame_once_and_in_order():
    import posefuse
    from posefuse.v1 import ingest_pb2 as pb

    dice, taken, runs = random.Random(3), [], set()

    def answer(requests, context):
        hello = next(requests).hello
        runs.add(hello.run_id)
        last = taken[-1][0] if taken else None
        yield pb.ServerMessage(welcome=pb.Welcome(sensor_id=0, server_version="fake", last_sequence=last))
        left = dice.randrange(1, 40)
        for request in requests:
            if request.HasField("frame"):
                if taken and request.frame.sequence <= taken[-1][0]:
                    continue
                taken.append((request.frame.sequence, request.frame.captured_ns))
                left -= 1
                if dice.random() < 0.2:
                    yield pb.ServerMessage(ack=pb.Ack(sequence=request.frame.sequence))
                if left == 0 and len(taken) < 280:
                    context.abort(grpc.StatusCode.UNAVAILABLE, "broken off")
                if len(taken) >= 300:
                    yield pb.ServerMessage(ack=pb.Ack(sequence=request.frame.sequence))

    with fake_server(answer) as address, posefuse.Agent("a", address) as agent:
        for index in range(300):
            agent.send([body(posefuse)], captured_ns=index)
            time.sleep(0.001)
        wait_for(lambda: agent.report.delivered == 300, "everything to be delivered", 30)
    assert taken == [(index, index) for index in range(300)]
    assert len(runs) == 1 and agent.report.connections > 3


def test_a_stop_and_a_refusal_reach_whoever_sends():
    import posefuse
    from posefuse.v1 import ingest_pb2 as pb

    def stop(requests, context):
        next(requests)
        yield pb.ServerMessage(welcome=pb.Welcome(sensor_id=0))
        yield pb.ServerMessage(command=pb.Command(stop="the take is over"))

    def refuse(requests, context):
        next(requests)
        context.abort(grpc.StatusCode.FAILED_PRECONDITION, "protocol 9 is spoken here")
        yield

    for answer, error, words in [(stop, posefuse.Stopped, "the take is over"), (refuse, posefuse.Refused, "matching versions")]:
        with fake_server(answer) as address, posefuse.Agent("a", address, drain_s=0) as agent:
            with pytest.raises(error, match=words):
                wait_for(lambda: agent.send([]), "the end")


def test_the_package_is_whole(client):
    assert (client / "posefuse/py.typed").exists() and (client / "posefuse/v1/types_pb2.pyi").exists()
    assert pathlib.Path(sys.modules["posefuse"].__file__).is_relative_to(client)
