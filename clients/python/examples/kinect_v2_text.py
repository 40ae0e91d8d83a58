#!/usr/bin/env python3
"""Kinect v2: pushes what a program with the Kinect SDK prints, one line a joint.

    YourKinectProgram.exe | python kinect_v2_text.py - --name kinect-left
    python kinect_v2_text.py recorded.txt

A line is `time,id,joint,state,x,y,z`, separated by `,`, `;` or blanks:
  time   RelativeTime: whole 100 ns ticks, seconds with a point, or a TimeSpan such as 00:01:02.5000000
  id     TrackingId
  joint  a JointType by name (SpineBase ...) or number (0 to 24); HandLeftState and HandRightState with the hand's
         state instead of numbers
  state  TrackingState: Tracked, Inferred or NotTracked (or 2, 1, 0); hands: Open, Closed, Lasso, Unknown, NotTracked
  x y z  CameraSpacePoint: metres, x to the sensor's left, y up, z forward
Lines of one time are one frame; a line with a time alone says that nobody was seen. With `;` numbers may have decimal
commas. A frame goes out when the next one begins.
"""
import re
import sys
from collections.abc import Iterable, Iterator

import common
import posefuse
from posefuse import Body, Joint

NAMES = posefuse.JOINT_SETS["kinect-v2"]
#: Tracked is measured; inferred is the SDK's guess; what is not tracked is missing.
CONFIDENCE = {"tracked": 1.0, "2": 1.0, "inferred": 0.5, "1": 0.5, "nottracked": 0.0, "0": 0.0}
HANDS = {"HandLeftState": 0, "HandRightState": 1}
HAND_CLOSED = {"closed": 1.0, "open": 0.0, "lasso": 0.0}


def seconds(text: str) -> float:
    """A time of the SDK in any of its spellings."""
    if span := re.fullmatch(r"(?:(\d+)\.)?(\d+):(\d+):(\d+(?:\.\d+)?)", text):
        days, hours, minutes, rest = (float(part or 0) for part in span.groups())
        return ((days * 24 + hours) * 60 + minutes) * 60 + rest
    return float(text) if "." in text else int(text) * 1e-7


def cells(line: str) -> list[str]:
    """The line's parts, whatever separates them."""
    if ";" in line:
        return [cell.strip().replace(",", ".") for cell in line.split(";")]
    return line.replace(",", " ").split()


def frames(lines: Iterable[str]) -> Iterator[common.Frame]:
    """Frames of Kinect v2 bodies in optical axes. A line that is none is told and passed over."""
    now, bodies, broken = None, {}, 0
    for number, line in enumerate(lines, start=1):
        parts = cells(line)
        if not parts or parts[0].startswith("#"):
            continue
        try:
            at = seconds(parts[0])
            if at != now:
                if now is not None:
                    yield now, list(bodies.values())
                now, bodies = at, {}
            if len(parts) > 1:
                read_joint(parts, bodies)
        except (ValueError, KeyError) as error:
            broken += 1
            if broken <= 10:
                print(f"line {number} is none of time,id,joint,state,x,y,z: {line.strip()[:80]!r} ({error})", file=sys.stderr)
    if now is not None:
        yield now, list(bodies.values())


def read_joint(parts: list[str], bodies: dict[int, Body]) -> None:
    """Puts one line into its body. Camera space (x left, y up, z forward) becomes optical (x right, y down, z forward)."""
    _, identity, joint, state, *numbers = parts
    body = bodies.setdefault(int(identity), Body(int(identity), {}))
    if joint in HANDS:
        hands = list(body.hands_closed)
        hands[HANDS[joint]] = HAND_CLOSED.get(state.lower())
        body.hands_closed = tuple(hands)
        return
    name = NAMES[int(joint)] if joint.isdigit() and int(joint) < len(NAMES) else joint
    if name not in NAMES:
        raise ValueError(f"no joint {joint}")
    x, y, z = map(float, numbers)
    if confidence := CONFIDENCE[state.lower()]:
        body.joints[name] = Joint(-x, -y, z, confidence)


def main() -> None:
    parser = common.options(__doc__, "kinect")
    parser.add_argument("file", help="the lines; `-`: standard input, live")
    args = parser.parse_args()
    with common.lines_of(args.file) as lines:
        common.run(args, frames(lines), joint_set="kinect-v2", model="Kinect v2 (SDK)", live=args.file == "-")


if __name__ == "__main__":
    main()
