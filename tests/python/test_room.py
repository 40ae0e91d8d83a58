"""Clients and agents in Python against a real server: our package's simplest examples, and the bare protocol."""
import subprocess
import sys

import grpc
import pytest
from conftest import CLIENT


def run_example(client, name, *arguments):
    environment = {"PYTHONPATH": str(client), "PATH": "/usr/bin:/bin"}
    command = [sys.executable, str(CLIENT / "examples" / name), *map(str, arguments)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def test_the_example_agent_joins_and_is_seen(room, client):
    agent = run_example(client, "stick_figure.py", room.address, "mine", 120)
    room.wait_for(lambda: any(s.frames_received > 30 for s in room.status().sensors), "frames of the example agent")
    sensor = room.status().sensors[0]
    assert (sensor.info.name, sensor.info.joint_set, sensor.frames_lost) == ("mine", "nite", 0)
    assert sensor.HasField("clock_offset_ms") and sensor.clock_error_ms < 50
    output = agent.communicate(timeout=20)[0]
    assert agent.returncode == 0 and "delivered=120, dropped=0" in output, output


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
