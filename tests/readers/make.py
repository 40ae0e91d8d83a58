"""The same ten seconds of two simulated people as every kind of file, and what is in them: `expected.json`.

What was sent is told by our plainest writers: the joints by a table of joints, the bones of each person's rig by a table of
bones. The joints are the truth of the simulation. Room axes (X forward, Y left, Z up), metres.
"""
import csv
import json
import pathlib
import subprocess

from mcap.reader import make_reader

SECONDS, PEOPLE, SENSORS = 10, 2, 4
#: Every so many frames one is looked at.
STRIDE = 10
#: Exports under one name each: what they are asked for beside the source. Every preset with a rig or markers is among them.
EXPORTS = {
    "plain": ["--format", "csv,csv-bones,parquet,c3d,bvh,glb", "--names", "humanoid"],
    "blender": ["--preset", "blender"],
    "blender-bvh": ["--preset", "blender", "--format", "bvh"],
    "unity": ["--preset", "unity"],
    "unreal": ["--preset", "unreal"],
    "motionbuilder": ["--preset", "motionbuilder"],
    "mixamo": ["--preset", "mixamo"],
    "opensim": ["--preset", "opensim"],
    # What VMC speaks: Unity's axes.
    "vmc": ["--format", "csv-bones", "--names", "humanoid", "--axes", "unity"],
}
TAKE = "walk"


def make(posefuse: pathlib.Path, folder: pathlib.Path) -> pathlib.Path:
    """Fills `folder`, and returns the path of the description."""

    def run(*arguments) -> str:
        done = subprocess.run([posefuse, *map(str, arguments)], capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise SystemExit(f"posefuse {' '.join(map(str, arguments))} gave {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done.stdout

    takes = folder / "takes"
    run("simulate", "--out", TAKE, "--seconds", SECONDS, "--people", PEOPLE, "--sensors", SENSORS, "--true-calibration", "--takes", takes)
    files, names = {}, {}
    for export, options in EXPORTS.items():
        out = folder / export
        common = ["export", TAKE, "--takes", takes, "--out", out, "--source", "truth", "--whole"]
        report = json.loads(run(*common, *options, "--json"))[0]
        if report["rate_hz"] != 30:
            raise SystemExit(f"{export}: expected 30 frames a second, found {report['rate_hz']}")
        files[export] = [{"path": str(out / file["path"]), "people": file["people"]} for file in report["files"]]
        if "--preset" in options and export != "opensim":
            # What this preset calls the bones, in the order of the rig.
            names[export] = bone_names(run, common, options, folder / "names" / export)
    expected = {
        "take": str(takes / f"{TAKE}.mcap"), "rate_hz": 30, "stride": STRIDE, "files": files,
        **people(folder / "plain"), "bone_names": names, "calibration": calibration(takes / f"{TAKE}.mcap"),
        "sensors": SENSORS,
    }
    for called in names.values():
        if len(called) != len(expected["names"]["bones"]):
            raise SystemExit(f"expected {len(expected['names']['bones'])} bones, found {called}")
    path = folder / "expected.json"
    path.write_text(json.dumps(expected))
    return path


def calibration(take: pathlib.Path) -> str:
    """Where the simulated sensors truly stand, as the take keeps that: a live room of as many has them there, too."""
    with take.open("rb") as stream:
        attachments = make_reader(stream).iter_attachments()
        return next(each.data.decode() for each in attachments if each.name.endswith("calibration.toml"))


def bone_names(run, common: list, options: list, out: pathlib.Path) -> list[str]:
    common = [out if index and common[index - 1] == "--out" else value for index, value in enumerate(common)]
    run(*common, *options[:2], "--format", "csv-bones", "--axes", "room", "--unit", "m", "--to", "0.5", "--least", "0")
    with next(out.glob("*.csv")).open(newline="") as file:
        return list(dict.fromkeys(row["bone"] for row in csv.DictReader(file)))


def people(plain: pathlib.Path) -> dict:
    """The joints and the bones of everybody at the frames that are looked at."""
    found, names = {}, {"joints": [], "bones": [], "ends": []}
    frames, instants = {}, {}
    with (plain / f"{TAKE}-truth.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            names["joints"] = [name[: -len("_x_m")] for name in row if name.endswith("_x_m")]
            frames.setdefault(row["person"], []).append(int(row["frame"]))
            if int(row["frame"]) % STRIDE == 0:
                places = [[float(row[f"{joint}_{axis}_m"]) for axis in "xyz"] for joint in names["joints"]]
                found.setdefault(row["person"], {"joints": [], "bones": []})["joints"].append(places)
                instants[int(row["frame"])] = int(row["unix_ns"])
    parents = set()
    with (plain / f"{TAKE}-truth.bones.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            if row["bone"] not in names["bones"]:
                names["bones"].append(row["bone"])
            parents.add(row["parent"])
            if int(row["frame"]) % STRIDE == 0:
                bones = found[row["person"]]["bones"]
                if row["bone"] == names["bones"][0]:
                    bones.append([])
                bones[-1].append([float(row[f"{axis}_m"]) for axis in "xyz"])
    names["ends"] = [bone for bone in names["bones"] if bone not in parents]
    if len(found) != PEOPLE:
        raise SystemExit(f"expected {PEOPLE} people, found {list(found)}")
    for who, theirs in frames.items():
        # Then frame n of every file is frame n of this.
        if theirs != list(range(len(theirs))) or len(theirs) < 30 * (SECONDS - 1):
            raise SystemExit(f"{who}: expected every frame of {SECONDS} s, found {len(theirs)} from {theirs[0]} to {theirs[-1]}")
    count = min(map(len, frames.values()))
    sampled = [frame for frame in instants if frame < count]
    return {"frames": count, "sampled": sampled, "unix_ns": [instants[frame] for frame in sampled], "names": names, "people": found}
