"""What a reader hands back to `judge.py`; standard library only, because every reader has a Python environment of its own.

A reader is called with two paths: the description that `make.py` wrote, and where to write what it found: a list of
readings. A reading says what was read, in which axes and unit its places are (those of the tool, untouched), and for
every person the places by name at the frames that are looked at.
"""
import json
import pathlib
import sys


class Readings:
    """Collects readings; `save` them at the end."""

    def __init__(self):
        self.expected = json.loads(pathlib.Path(sys.argv[1]).read_text())
        self.out = pathlib.Path(sys.argv[2])
        self.found = []

    def files(self, export: str, ending: str) -> list[dict]:
        """The files of an export that end so, each with its people."""
        files = [file for file in self.expected["files"][export] if file["path"].endswith(ending)]
        assert files, f"{export} has no file *{ending}"
        return files

    def bone_of(self, export: str, tidy=lambda name: name) -> dict[str, str]:
        """What a bone of the export is in the rig, by the name that a reader gives it."""
        bones = self.expected["names"]["bones"]
        called = self.expected["bone_names"].get(export, bones)
        return {tidy(name): bone for name, bone in zip(called, bones, strict=True)}

    def add(self, what: str, kind: str, people: dict, axes: str, metres: float = 1.0, frames=None, sent=None):
        """people: for each person by name of joint or bone (`kind`: joints or bones) its places, one a sampled frame.

        axes: `room`, `y-up`, `opensim` or `blender`; metres: how long a unit is; frames: indices of `sampled`, where not all
        of them are there; sent: the same as `people`, room metres, where it is not what `make.py` says.
        """
        reading = {"what": what, "kind": kind, "people": people, "axes": axes, "metres": metres, "frames": frames, "sent": sent}
        self.found.append(reading)

    def add_check(self, what: str, said: str):
        """What a reader that judges files itself said of ours; one that finds something wrong ends the script instead."""
        self.found.append({"what": what, "check": said})

    def save(self):
        self.out.write_text(json.dumps(self.found))
