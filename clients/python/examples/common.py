"""What the examples share: their options, and playing a file or following a stream into the room."""
from __future__ import annotations

import argparse
import contextlib
import logging
import sys
from collections.abc import Iterable, Iterator
from typing import TextIO

import posefuse

#: Seconds by the tracker's clock, and everybody it saw then.
Frame = tuple[float, list[posefuse.Body]]


def options(description: str, name: str) -> argparse.ArgumentParser:
    """An argument parser with what every example takes."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--name", default=name, help=f"the sensor's name, unique in the room [{name}]")
    parser.add_argument("--server", help="host and port of the room [POSEFUSE_SERVER, else this machine]")
    parser.add_argument("--speed", type=float, default=1.0, help="files: how many times faster than recorded [1]")
    return parser


@contextlib.contextmanager
def lines_of(path: str) -> Iterator[TextIO]:
    """The lines of a file, or of standard input for `-`."""
    if path == "-":
        yield sys.stdin
    else:
        try:
            file = open(path, encoding="utf-8-sig")
        except OSError as error:
            sys.exit(f"{path}: {error.strerror}")
        with file:
            yield file


def push(agent: posefuse.Agent, frames: Iterable[Frame], *, live: bool, speed: float = 1.0) -> None:
    """Sends `frames`: as they come, their times mapped to this machine's clock, or paced like a recording."""
    clock = posefuse.DeviceClock()
    timed = frames if live else posefuse.paced(frames, speed)
    for when, bodies in timed:
        agent.send(bodies, captured_ns=clock.captured_ns(round(when * 1e9)) if live else when)


def run(args: argparse.Namespace, frames: Iterable[Frame], *, joint_set: str, model: str, live: bool) -> None:
    """An agent from the first frame to the last."""
    try:
        with posefuse.Agent(args.name, args.server, joint_set=joint_set, model=model) as agent:
            push(agent, frames, live=live, speed=args.speed)
    except (posefuse.PosefuseError, ValueError, OSError) as error:
        sys.exit(f"{args.name}: {error}")
    except KeyboardInterrupt:
        pass
    report = agent.report
    print(f"{args.name}: {report.captured} frames captured, {report.delivered} delivered")
    if report.dropped or report.unacknowledged:
        sys.exit(f"{report.dropped} dropped, {report.unacknowledged} not acknowledged: {report.trouble or 'the server was too slow'}")
