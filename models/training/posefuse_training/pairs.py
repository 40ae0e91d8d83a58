"""Pairs from simulated rooms: what the engine gives to an occlusion model there, and the truth.

Written by `evaluate/examples/pairs.rs`, which tells the format.
"""

from pathlib import Path

import numpy as np

from .corrupt import Window
from .joints import MIRROR, mirrored

ASKED_BELOW = 0.8
"""The engine asks for joints of less weight."""
TESTED = 8
"""Of so many rooms one tests."""


class Pairs:
    """Records of rooms, which stay together. `filled` is the number of the pose that is filled."""

    def __init__(self, rooms: list[np.ndarray], filled: int):
        self.rooms, self.filled = rooms, filled
        self.records = np.concatenate(rooms)

    @classmethod
    def load(cls, folder: Path, filled: int) -> "Pairs":
        files = sorted(Path(folder).glob("*.npy"))
        if not files:
            raise FileNotFoundError(f"no .npy in {folder}: run the example `pairs` of posefuse-evaluate first")
        rooms = [np.load(file) for file in files]
        # A recorded person may lack a joint.
        return cls([room[~np.isnan(room["truth"]).any((1, 2))] for room in rooms], filled)

    def divided(self) -> tuple["Pairs", "Pairs"]:
        """(rooms that teach, rooms that test)."""
        taught = [room for number, room in enumerate(self.rooms) if number % TESTED]
        return Pairs(taught, self.filled), Pairs(self.rooms[::TESTED], self.filled)

    def __len__(self) -> int:
        return len(self.records)

    def window(self, rows: slice) -> Window:
        """Some of them, every second one seen in a mirror."""
        some = self.records[rows]
        pose, mask, age, truth = (some[key].copy() for key in ("pose", "mask", "age", "truth"))
        for array in (pose, truth):
            array[1::2] = mirrored(array[1::2])
        for array in (mask, age):
            array[1::2] = array[1::2][..., MIRROR]
        return Window(pose, mask, age, truth[:, None])

    def asked(self) -> np.ndarray:
        """(n, 25): joints of the windows that the engine asks for, though it has some idea of them."""
        asked = (self.records["mask"][:, self.filled] < ASKED_BELOW) & ~np.isnan(self.records["plain"]).any(-1)
        asked[1::2] = asked[1::2][:, MIRROR]
        return asked

    def plain_mm(self) -> float:
        """How far off the engine's own places of these joints are, mean."""
        off = np.linalg.norm(self.records["plain"] - self.records["truth"], axis=-1)
        off[1::2] = off[1::2][:, MIRROR]
        return 1000 * float(off[self.asked()].mean())
