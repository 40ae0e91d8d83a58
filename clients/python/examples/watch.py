#!/usr/bin/env python3
"""Prints the fused people of a Posefuse server as they come.

    pip install ./clients/python
    python watch.py 127.0.0.1:7400
"""
import os
import sys

import posefuse


def main(address: str, most_frames: int) -> None:
    with posefuse.Room(address) as room:
        for count, frame in enumerate(room.watch(), start=1):
            heads = {person.id: person.joints["Head"] for person in frame.people if "Head" in person.joints}
            places = "  ".join(f"person {i}: head {h.x:+.2f} {h.y:+.2f} {h.z:+.2f} m" for i, h in heads.items())
            print(f"frame {frame.number} at {frame.time_ns / 1e9:.3f} s  {places or 'nobody'}", flush=True)
            if count == most_frames:
                break


if __name__ == "__main__":
    try:
        main(
            sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7400",
            int(sys.argv[2]) if len(sys.argv) > 2 else 0,
        )
    except posefuse.ServerError as error:
        sys.exit(str(error))
    except BrokenPipeError:
        # Whoever read this has enough (`| head`). What Python would flush at its end has nowhere to go either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
