#!/usr/bin/env python3
"""Records a take for some seconds and says where it is; with --calibrate one person walks about first.

    pip install ./clients/python
    python record.py --server 127.0.0.1:7400 --name walk --seconds 10
    posefuse export PATH --preset blender
"""
import argparse
import sys
import time

import posefuse


def show(progress: posefuse.CalibrationProgress) -> None:
    words = "solving" if progress.solving else progress.hint or "keep walking"
    print(f"{100 * progress.share:3.0f} % of what is needed; {words}", flush=True)


def main(args: argparse.Namespace) -> None:
    with posefuse.Room(args.server) as room:
        if args.calibrate:
            result = room.calibrate(on_progress=show)
            print(f"calibration {result.verdict}: {'; '.join(result.reasons)}")
            if not result.in_force:
                sys.exit(1)
        with room.recording(args.name, notes="by record.py") as begun:
            print(f"recording {begun.name}", flush=True)
            time.sleep(args.seconds)
        take = room.take(begun.name)
        print(f"{take.duration_s:.1f} s, {take.frames} frames, {take.people} people: {room.take_path(take.name)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", help="host and port of the room [POSEFUSE_SERVER, else this machine]")
    parser.add_argument("--name", default="", help="the take's name [date and time]")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long [10]")
    parser.add_argument("--calibrate", action="store_true", help="find out where the sensors stand first")
    try:
        main(parser.parse_args())
    except posefuse.ServerError as error:
        sys.exit(str(error))
