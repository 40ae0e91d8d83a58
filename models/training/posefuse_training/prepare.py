"""`prepare`: from motion files to clean, split arrays.

The files are read by Posefuse's own loaders (`simulator/examples/clips.rs`), never by a second reader.
"""

import argparse
import subprocess
from pathlib import Path

import numpy as np

from .clean import clean_spans
from .recordings import SPLITS, Prepared, split_of, split_rules

REPOSITORY = Path(__file__).resolve().parents[3]


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--motion", type=Path, help="folder of motion files (BVH, ASF/AMC, exponential maps), any depth")
    parser.add_argument("--clips", type=Path, required=True, help="folder of arrays: written from --motion, or already there")
    parser.add_argument("--out", type=Path, required=True, help="folder for the prepared splits")
    parser.add_argument("--made", type=int, default=8, help="seeds of the simulator's own motion per situation (with --motion)")


def run(options: argparse.Namespace) -> int:
    if options.motion:
        convert(options.motion, options.clips, options.made)
    report = prepare(options.clips, options.out)
    print("\n".join(report))
    return 0


def convert(motion: Path, clips: Path, made: int) -> None:
    """Runs the loaders. They tell on stdout which files were skipped and why; that is not a failure (exit code 3)."""
    command = ["cargo", "run", "--release", "-q", "-p", "posefuse-simulator", "--example", "clips", "--"]
    command += [str(motion.resolve()), str(clips.resolve()), str(made)]
    done = subprocess.run(command, cwd=REPOSITORY, check=False)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"the motion files could not be converted: `{' '.join(command)}` ended with {done.returncode}")


def prepare(clips: Path, out: Path) -> list[str]:
    """Cleans and splits the arrays below `clips`; returns lines that say what came of it."""
    rules = split_rules()
    files = sorted(clips.rglob("*.npy"))
    if not files:
        raise FileNotFoundError(f"no .npy below {clips}: give --motion, or run the example `clips` first")
    parts: dict[str, list] = {split: [] for split in SPLITS}
    lines = []
    for file in files:
        place = file.relative_to(clips).as_posix()
        poses = np.load(file)
        spans = clean_spans(poses)
        kept = sum(len(span) for span in spans)
        if kept < len(poses):
            lines.append(f"{place}: {kept} of {len(poses)} frames kept, {len(spans)} spans")
        parts[split_of(place, rules)] += [(place, span) for span in spans]
    for split, spans in parts.items():
        prepared = Prepared.joined(spans)
        prepared.save(out, split)
        lines.append(f"{split}: {len(spans)} spans, {prepared.minutes:.1f} minutes")
    return lines
