#!/usr/bin/env python3
"""A Posefuse agent in a few lines: pushes one swaying stick figure. Put your own tracker's joints in `joints_at`.

    pip install grpcio grpcio-tools
    python -m grpc_tools.protoc -I proto --python_out=. --grpc_python_out=. proto/posefuse/v1/*.proto
    python agent.py 127.0.0.1:7400 my-sensor
"""
import itertools
import math
import queue
import random
import sys
import threading
import time

import grpc

from posefuse.v1 import ingest_pb2 as pb
from posefuse.v1 import ingest_pb2_grpc
from posefuse.v1 import types_pb2

# NiTE's 15 joints, metres, in the sensor's optical frame (x right, y down, z forward) for somebody at the origin.
FIGURE = {
    "Head": (0.0, -0.65, 0.0), "Neck": (0.0, -0.45, 0.0),
    "LeftShoulder": (0.18, -0.42, 0.0), "RightShoulder": (-0.18, -0.42, 0.0),
    "LeftElbow": (0.25, -0.15, 0.0), "RightElbow": (-0.25, -0.15, 0.0),
    "LeftHand": (0.28, 0.10, 0.0), "RightHand": (-0.28, 0.10, 0.0), "Torso": (0.0, -0.15, 0.0),
    "LeftHip": (0.10, 0.05, 0.0), "RightHip": (-0.10, 0.05, 0.0),
    "LeftKnee": (0.12, 0.50, 0.0), "RightKnee": (-0.12, 0.50, 0.0),
    "LeftFoot": (0.12, 0.92, 0.0), "RightFoot": (-0.12, 0.92, 0.0),
}


def joints_at(seconds: float) -> list[float]:
    sway = 0.3 * math.sin(seconds)
    return [value for x, y, z in FIGURE.values() for value in (x + sway, y, z + 2.5)]


def frame(sequence: int, captured_ns: int) -> pb.AgentMessage:
    body = types_pb2.Body(tracking_id=1, positions=joints_at(captured_ns / 1e9), confidences=[1.0] * len(FIGURE))
    return pb.AgentMessage(frame=pb.Frame(sequence=sequence, captured_ns=captured_ns, bodies=[body]))


def main(address: str, name: str, most_frames: int) -> None:
    outbox: queue.Queue = queue.Queue(maxsize=300)
    hello = pb.Hello(sensor=name, model="example", joint_set="nite", protocol=1, run_id=random.getrandbits(64))
    outbox.put(pb.AgentMessage(hello=hello))
    with grpc.insecure_channel(address) as channel:
        answers = ingest_pb2_grpc.IngestStub(channel).Stream(iter(outbox.get, None))
        welcome = next(answers).welcome
        print(f"joined as sensor {welcome.sensor_id} of server {welcome.server_version}", flush=True)

        def answer_probes() -> None:
            try:
                for message in answers:
                    received = time.monotonic_ns()
                    if message.HasField("clock_probe"):
                        echo = pb.ClockEcho(
                            probe=message.clock_probe.probe,
                            agent_received_ns=received,
                            agent_sent_ns=time.monotonic_ns(),
                        )
                        outbox.put(pb.AgentMessage(clock_echo=echo))
            except grpc.RpcError as error:
                print(f"the server ended the stream: {error.details()}", file=sys.stderr)

        threading.Thread(target=answer_probes, name="clock", daemon=True).start()
        for sequence in range(most_frames) if most_frames else itertools.count():
            outbox.put(frame(sequence, time.monotonic_ns()))
            time.sleep(1 / 30)
        outbox.put(None)
        time.sleep(0.5)


if __name__ == "__main__":
    main(
        sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7400",
        sys.argv[2] if len(sys.argv) > 2 else "example",
        int(sys.argv[3]) if len(sys.argv) > 3 else 0,
    )
