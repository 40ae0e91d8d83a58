"""Takes the same ten seconds of two simulated people through other people's readers, and prints how far off each finds them.

    run.py POSEFUSE TOOLS FOLDER [READER...]

POSEFUSE: the program; TOOLS: where readers are installed, kept between runs; FOLDER: where the files are made.
Exit code 0: every reader found what was sent; 1: one did not, or could not be run.
"""
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

from environments import Unavailable, example, node_modules, python
from judge import Verdict, judge
from make import make

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]


@dataclasses.dataclass
class Reader:
    """A program that reads files of ours with somebody else's library."""

    name: str
    script: str
    #: What it has an environment of its own for: a file of `pip` requirements, or the folder of a Node package. None: that of
    #: `tests/python` or of `web`.
    needs: str | None = None

    def command(self, tools: pathlib.Path, *arguments) -> list:
        """What runs it; installs what that needs."""
        if self.script.endswith(".mjs"):
            modules = [node_modules(tools, HERE / self.needs)] if self.needs else []
            return ["node", HERE / self.script, *arguments, *modules]
        if self.script.endswith(".rs"):
            return [example(self.script.removesuffix(".rs")), *arguments]
        interpreter = sys.executable if self.needs is None else python(tools, HERE / self.needs)
        return [interpreter, HERE / self.script, *arguments]


#: A reader that takes longer hangs, seconds.
LONGEST_S = 180
#: The slow ones first, because two run at a time.
READERS = [
    Reader("blender", "read_blender.py", "blender.txt"),
    Reader("addon", "read_addon.py", "blender.txt"),
    Reader("live", "read_live.py", "blender.txt"),
    Reader("opensim", "read_opensim.py", "opensim.txt"),
    Reader("light", "read_light.py"),
    Reader("grpc", "read_grpc.py"),
    Reader("mcap", "read_mcap.py", "mcap.txt"),
    Reader("validator", "read_validator.mjs", "node"),
    Reader("ufbx", "read_fbx.rs"),
    Reader("three", "read_three.mjs"),
]


def read(reader: Reader, described: pathlib.Path, posefuse: str, tools: pathlib.Path) -> list[dict]:
    """What a reader found."""
    out = described.with_name(f"found-{reader.name}.json")
    out.unlink(missing_ok=True)
    command = reader.command(tools, described, out, posefuse)
    environment = os.environ | {"PYTHONPATH": str(HERE), "PYTHONDONTWRITEBYTECODE": "1"}
    with described.with_name(f"{reader.name}.log").open("w+") as log:
        done = subprocess.run(list(map(str, command)), cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment, timeout=LONGEST_S)
        log.seek(0)
        if done.returncode != 0 or not out.exists():
            raise RuntimeError(f"{reader.name} gave {done.returncode}:\n{log.read()[-4000:]}")
    return json.loads(out.read_text())


def line(verdict: Verdict) -> str:
    if verdict.said:
        return f"{verdict.what:46} {verdict.said}"
    posture, state = verdict.posture, "ok" if not verdict.troubles else "WRONG"
    stands = f"{posture.height_m:6.3f} {posture.lean_deg:5.1f} {posture.path_m:6.2f}" if posture else " " * 19
    return f"{verdict.what:46} {verdict.people:6} {verdict.places:7} {verdict.worst_mm:9.4f} {stands}  {state}"


def outcome(reader: Reader, described: pathlib.Path, expected: dict, posefuse: str, tools: pathlib.Path) -> tuple[list[str], list[str]]:
    """The reader's lines of the table, and what is wrong."""
    began = time.monotonic()
    try:
        verdicts = [judge(expected, reading) for reading in read(reader, described, posefuse, tools)]
    except Unavailable as error:
        return [f"SKIPPED: {reader.name}: {error}"], []
    except (RuntimeError, AssertionError, subprocess.SubprocessError, OSError) as error:
        return [f"{reader.name}: FAILED"], [str(error)]
    lines = [*map(line, verdicts), f"  ({reader.name}: {time.monotonic() - began:.0f} s)"]
    return lines, [f"{verdict.what}: {trouble}" for verdict in verdicts for trouble in verdict.troubles]


def main(posefuse: str, tools: pathlib.Path, folder: pathlib.Path, wanted: list[str]) -> int:
    unknown = set(wanted) - {reader.name for reader in READERS}
    if unknown:
        print(f"no reader is called {', '.join(sorted(unknown))}; there are {', '.join(reader.name for reader in READERS)}", file=sys.stderr)
        return 2
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    described = make(posefuse, folder)
    expected = json.loads(described.read_text())
    readers = [reader for reader in READERS if not wanted or reader.name in wanted]
    # Installing waits for the network, reading for the processor.
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(lambda reader: outcome(reader, described, expected, posefuse, tools), readers))
    print(f"{'what, by whom':46} {'people':>6} {'places':>7} {'worst mm':>9} {'neck m':>6} {'lean':>5} {'path m':>6}")
    for lines, _ in outcomes:
        print("\n".join(lines))
    skipped = [reader.name for reader, (lines, _) in zip(readers, outcomes) if lines[0].startswith("SKIPPED")]
    print(f"readers: {len(readers) - len(skipped)} ran" + (f", SKIPPED: {', '.join(skipped)}" if skipped else ""))
    troubles = [trouble for _, found in outcomes for trouble in found]
    print("\n".join(troubles), end="\n" if troubles else "")
    return 1 if troubles else 0


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, tools, folder = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
    sys.exit(main(str(program), tools, folder, sys.argv[4:]))
