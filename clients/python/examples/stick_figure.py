#!/usr/bin/env python3
"""A Posefuse agent in a few lines: pushes one swaying stick figure. Put your own tracker's joints in `joints_at`.

    pip install ./clients/python
    python stick_figure.py 127.0.0.1:7400 my-sensor
"""
import itertools
import math
import sys
import time

import posefuse

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


def joints_at(seconds: float) -> dict[str, tuple[float, float, float]]:
    sway = 0.3 * math.sin(seconds)
    return {name: (x + sway, y, z + 2.5) for name, (x, y, z) in FIGURE.items()}


def main(address: str, name: str, most_frames: int) -> None:
    with posefuse.Agent(name, address, joint_set="nite", model="example") as agent:
        for _ in range(most_frames) if most_frames else itertools.count():
            now_ns = time.monotonic_ns()
            agent.send([posefuse.Body(1, joints_at(now_ns / 1e9))], captured_ns=now_ns)
            time.sleep(1 / 30)
    print(agent.report)


if __name__ == "__main__":
    main(
        sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7400",
        sys.argv[2] if len(sys.argv) > 2 else "example",
        int(sys.argv[3]) if len(sys.argv) > 3 else 0,
    )
