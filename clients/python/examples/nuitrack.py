#!/usr/bin/env python3
"""Nuitrack: pushes its 19 joints, from its Python package (PyNuitrack) or from a recording of it.

    python nuitrack.py --live --name front            # needs PyNuitrack, its licence and a sensor
    python nuitrack.py --live --record skeletons.jsonl
    python nuitrack.py skeletons.jsonl

A recording has one JSON object a line:
  {"t": 12.345, "skeletons": [{"user_id": 1, "head": {"real": [x, y, z], "confidence": 0.9}, ...}]}
t: seconds. Joints: Nuitrack's names (head, neck, torso, waist, left_collar, left_shoulder, ... right_ankle); real: mm,
x right, y up, z forward, as Nuitrack gives them ("projective" coordinates are pixels and are not used).

Nuitrack's real coordinates are mirrored where its image is: then give --mirrored, or left is right in the room. (A
calibration against another sensor says so: "left and right were exchanged".)
"""
import json
import time
from collections.abc import Iterable, Iterator

import common
from posefuse import Body, Joint

#: Nuitrack's names and ours. Left and right collar are one point.
JOINTS = {
    "head": "Head", "neck": "Neck", "torso": "Torso", "waist": "Waist", "left_collar": "Collar",
    "left_shoulder": "LeftShoulder", "left_elbow": "LeftElbow", "left_wrist": "LeftWrist", "left_hand": "LeftHand",
    "right_shoulder": "RightShoulder", "right_elbow": "RightElbow", "right_wrist": "RightWrist", "right_hand": "RightHand",
    "left_hip": "LeftHip", "left_knee": "LeftKnee", "left_ankle": "LeftAnkle",
    "right_hip": "RightHip", "right_knee": "RightKnee", "right_ankle": "RightAnkle",
}


def body(skeleton: dict, mirrored: bool) -> Body:
    """One skeleton in optical axes, metres."""
    joints = {}
    for theirs, ours in JOINTS.items():
        joint = skeleton.get(theirs)
        # A joint that Nuitrack does not see stands at the origin with confidence 0.
        if joint and joint["real"][2] > 0 and joint.get("confidence", 1.0) > 0:
            x, y, z = (value / 1000 for value in joint["real"])
            joints[ours] = Joint(-x if mirrored else x, -y, z, min(joint.get("confidence", 1.0), 1.0))
    return Body(int(skeleton["user_id"]), joints)


def frames(records: Iterable[dict], mirrored: bool) -> Iterator[common.Frame]:
    """Frames from records as in a recording."""
    for record in records:
        yield record["t"], [body(skeleton, mirrored) for skeleton in record["skeletons"]]


def live_records(record_to: str | None) -> Iterator[dict]:
    """Records from a sensor, for ever. Nuitrack tells no time of capture: it is taken to be now."""
    from PyNuitrack import py_nuitrack  # from Nuitrack's own SDK; not on PyPI

    tracker = py_nuitrack.Nuitrack()
    tracker.init()
    devices = tracker.get_device_list()
    if not devices:
        raise OSError("Nuitrack sees no sensor: plug one in and check it with Nuitrack's own viewer")
    tracker.set_device(devices[0])
    tracker.create_modules()
    tracker.run()
    file = open(record_to, "w", encoding="utf-8") if record_to else None
    try:
        while True:
            tracker.update()
            data = tracker.get_skeleton()
            record = {"t": time.monotonic(), "skeletons": [as_record(skeleton) for skeleton in data.skeletons]}
            if file:
                file.write(json.dumps(record) + "\n")
            yield record
    finally:
        if file:
            file.close()
        tracker.release()


def as_record(skeleton) -> dict:
    """PyNuitrack's named tuple as a record."""
    record = {"user_id": int(skeleton.user_id)}
    for name in JOINTS:
        joint = getattr(skeleton, name, None)
        if joint is not None:
            confidence = float(getattr(joint, "confidence", 1.0))
            record[name] = {"real": [float(value) for value in joint.real], "confidence": confidence}
    return record


def main() -> None:
    parser = common.options(__doc__, "nuitrack")
    parser.add_argument("file", nargs="?", help="a recording; `-`: records on standard input, live")
    parser.add_argument("--live", action="store_true", help="from the sensor, through PyNuitrack")
    parser.add_argument("--record", metavar="FILE", help="with --live: keep what came")
    parser.add_argument("--mirrored", action="store_true", help="Nuitrack's image is mirrored")
    args = parser.parse_args()
    if args.live == bool(args.file):
        parser.error("give either a recording or --live")
    if args.live:
        common.run(args, frames(live_records(args.record), args.mirrored), joint_set="nuitrack", model="Nuitrack", live=True)
        return
    with common.lines_of(args.file) as lines:
        records = (json.loads(line) for line in lines if line.strip())
        common.run(args, frames(records, args.mirrored), joint_set="nuitrack", model="Nuitrack", live=args.file == "-")


if __name__ == "__main__":
    main()
