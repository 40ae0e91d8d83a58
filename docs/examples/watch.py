#!/usr/bin/env python3
"""Prints the fused people of a Posefuse server as they come.

    pip install grpcio grpcio-tools
    python -m grpc_tools.protoc -I proto --python_out=. --grpc_python_out=. proto/posefuse/v1/*.proto
    python watch.py 127.0.0.1:7400
"""
import os
import sys

import grpc

from posefuse.v1 import room_pb2, room_pb2_grpc

HEAD = 3  # Kinect v2 joint order, see docs/FRAMES.md


def main(address: str, most_frames: int) -> None:
    with grpc.insecure_channel(address) as channel:
        frames = room_pb2_grpc.RoomStub(channel).Watch(room_pb2.WatchRequest())
        for count, frame in enumerate(frames, start=1):
            heads = {track.id: track.positions[3 * HEAD : 3 * HEAD + 3] for track in frame.tracks}
            places = "  ".join(f"person {i}: head {x:+.2f} {y:+.2f} {z:+.2f} m" for i, (x, y, z) in heads.items())
            print(f"frame {frame.number} at {frame.time_ns / 1e9:.3f} s  {places or 'nobody'}", flush=True)
            if count == most_frames:
                break


if __name__ == "__main__":
    try:
        main(
            sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7400",
            int(sys.argv[2]) if len(sys.argv) > 2 else 0,
        )
    except BrokenPipeError:
        # Whoever read this has enough (`| head`). What Python would flush at its end has nowhere to go either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
