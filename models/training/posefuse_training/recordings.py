"""Which recordings there are, which of them teach and which test, and how they are kept once prepared."""

import tomllib
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

SPLITS = ("train", "held_out", "unseen", "made")
SPLIT_FILE = Path(__file__).resolve().parents[1] / "split.toml"
MADE_FOLDER = "made"


def split_rules(path: Path = SPLIT_FILE) -> dict[str, list[str]]:
    """Patterns of each split that tests."""
    with open(path, "rb") as file:
        return tomllib.load(file)


def split_of(place: str, rules: dict[str, list[str]]) -> str:
    """Where a recording belongs, by its path below the folder of recordings. What no pattern names trains."""
    if place.startswith(MADE_FOLDER + "/"):
        return "made"
    for split in ("unseen", "held_out"):
        if any(fnmatchcase(place, pattern) for pattern in rules[split]):
            return split
    return "train"


@dataclass
class Prepared:
    """Clean spans of one split, one after another.

    `poses` (frames, 25, 3) f32; span i is frames `starts[i]` to `starts[i + 1]`, of the recording `names[i]`.
    """

    poses: np.ndarray
    starts: np.ndarray
    names: list[str]

    @classmethod
    def load(cls, folder: Path, split: str) -> "Prepared":
        path = Path(folder) / f"{split}.npz"
        if not path.is_file():
            raise FileNotFoundError(f"{path} is missing: run `python -m posefuse_training prepare` first")
        with np.load(path) as data:
            return cls(data["poses"], data["starts"], [str(name) for name in data["names"]])

    def save(self, folder: Path, split: str) -> None:
        Path(folder).mkdir(parents=True, exist_ok=True)
        np.savez(Path(folder) / f"{split}.npz", poses=self.poses, starts=self.starts, names=np.array(self.names))

    def spans(self):
        """(name, poses of the span), in order."""
        for name, start, end in zip(self.names, self.starts[:-1], self.starts[1:]):
            yield name, self.poses[start:end]

    @property
    def minutes(self) -> float:
        return len(self.poses) / 1800

    @classmethod
    def joined(cls, parts: list[tuple[str, np.ndarray]]) -> "Prepared":
        poses = [poses for _, poses in parts]
        ends = np.cumsum([0] + [len(p) for p in poses])
        together = np.concatenate(poses) if poses else np.zeros((0, 25, 3), np.float32)
        return cls(together.astype(np.float32), ends, [name for name, _ in parts])


def kind_of(name: str) -> str:
    """What is done in a recording: its folder's last part. Batches draw evenly over these, so that forty walks do not drown one dance."""
    parts = name.split("/")
    return parts[1] if parts[0] == MADE_FOLDER and len(parts) > 2 else parts[-2]
