"""Clients and agents in Python against a real server: what anyone can build from the .proto files alone."""
import pathlib
import subprocess
import sys

import grpc
import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "docs/examples"


def run_example(generated, name, *arguments):
    environment = {"PYTHONPATH": str(generated), "PATH": "/usr/bin:/bin"}
    command = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def test_the_example_agent_joins_and_is_seen(room, generated):
    agent = run_example(generated, "agent.py", room.address, "mine", 120)
    room.wait_for(lambda: any(s.frames_received > 30 for s in room.status().sensors), "frames of the example agent")
    sensor = room.status().sensors[0]
    assert (sensor.info.name, sensor.info.joint_set, sensor.frames_lost) == ("mine", "nite", 0)
    assert sensor.HasField("clock_offset_ms") and sensor.clock_error_ms < 50
    output = agent.communicate(timeout=20)[0]
    assert agent.returncode == 0 and "joined as sensor" in output, output


def test_a_second_agent_of_the_same_name_is_refused_by_name(room, generated):
    first = run_example(generated, "agent.py", room.address, "twin", 150)
    room.wait_for(lambda: len(room.status().sensors) == 1, "the first agent")
    output = run_example(generated, "agent.py", room.address, "twin", 30).communicate(timeout=20)[0]
    assert "ALREADY_EXISTS" in output and "twin" in output, output
    first.communicate(timeout=20)
    assert room.status().sensors[0].frames_lost == 0


@pytest.mark.parametrize(
    "change, words",
    [
        ({"joint_set": "kinect-v9"}, ["kinect-v9", "kinect-v2"]),
        ({"sensor": "../etc"}, ["../etc", "letters"]),
        ({"protocol": 99}, ["99"]),
    ],
)
def test_a_wrong_greeting_is_answered_with_what_was_expected(room, change, words):
    from posefuse.v1 import ingest_pb2, ingest_pb2_grpc

    hello = {"sensor": "a", "model": "m", "joint_set": "nite", "protocol": 1, "run_id": 7} | change
    with grpc.insecure_channel(room.address) as channel:
        message = ingest_pb2.AgentMessage(hello=ingest_pb2.Hello(**hello))
        with pytest.raises(grpc.RpcError) as refusal:
            next(ingest_pb2_grpc.IngestStub(channel).Stream(iter([message]), timeout=5))
    for word in words:
        assert word in refusal.value.details()
