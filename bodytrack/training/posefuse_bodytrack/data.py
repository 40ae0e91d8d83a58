"""Crops and truths as `bodytrack/examples/crops` writes them, and batches of them."""

import glob
import os

import numpy as np
import torch

from . import joints

NOTHING, UNKNOWN, UNITS = 32767, -32768, 10_000.0
TRUTH = joints.COUNT * 4 + 7
CELLS = joints.SIZE**2
FARTHEST_SHIFT = 3


class Truth:
    """The columns of truths [N, TRUTH]."""

    def __init__(self, numbers):
        n = 3 * joints.COUNT
        self.joints = numbers[:, :n].reshape(-1, joints.COUNT, 3)
        self.visible = numbers[:, n : n + joints.COUNT]
        self.heading = numbers[:, -7:-5]
        self.hands = numbers[:, -5:-3]
        self.distance, self.people, self.upright = numbers[:, -3], numbers[:, -2], numbers[:, -1]


class Files:
    """All crops of a subset below a folder; files may still be growing."""

    def __init__(self, folder, subset):
        self.pattern = os.path.join(folder, f"{subset}-*.truth")
        self.subset = subset
        self.parts = {}

    def scan(self):
        """Looks for what is new; returns the (file, index) pairs that were not there before."""
        new = []
        for path in sorted(glob.glob(self.pattern)):
            crops = path[: -len(".truth")] + ".crops"
            count = min(os.path.getsize(path) // (4 * TRUTH), os.path.getsize(crops) // (2 * CELLS))
            before = len(self.parts[path][1]) if path in self.parts else 0
            if count > before:
                self.parts[path] = (
                    np.memmap(crops, np.int16, "r", shape=(count, joints.SIZE, joints.SIZE)),
                    np.memmap(path, np.float32, "r", shape=(count, TRUTH)),
                )
                new.extend((path, index) for index in range(before, count))
        return new

    def get(self, places):
        """Crops [N, 64, 64] and truths [N, TRUTH] of (file, index) pairs."""
        crops = np.stack([self.parts[path][0][index] for path, index in places])
        truths = np.stack([self.parts[path][1][index] for path, index in places])
        return crops, truths

    def all(self, limit=None):
        places = self.scan()
        if not places:
            raise SystemExit(f"expected crops of `{self.subset}` as {self.pattern}, found none; see README.md")
        return self.get(places[:limit])


def channels(crops):
    """What the network is given for crops as stored: [N, 2, 64, 64]."""
    seen = (crops != NOTHING) & (crops != UNKNOWN)
    depth = np.where(seen, crops, 0).astype(np.float32) / UNITS
    state = seen.astype(np.float32) - (crops == UNKNOWN)
    return np.stack([depth, state], 1)


class Stream:
    """Shuffled batches without end; what is new comes before what was seen already."""

    def __init__(self, files, batch, seed):
        self.files, self.batch = files, batch
        self.random = np.random.default_rng(seed)
        self.queue, self.taken = [], 0

    def next(self):
        if self.taken % 200 == 0:
            new = self.files.scan()
            if new:
                self.queue.extend(new)
                self.random.shuffle(self.queue)
        if len(self.queue) < self.batch:
            everything = [(p, i) for p, part in self.files.parts.items() for i in range(len(part[1]))]
            self.random.shuffle(everything)
            self.queue = everything
        self.taken += 1
        places, self.queue = self.queue[-self.batch :], self.queue[: -self.batch]
        crops, truths = self.files.get(places)
        return augmented(channels(crops), truths.copy(), self.random)


def augmented(crops, truths, random):
    """Mirrored, moved, with pieces lost: tensors of crops and of a truth's columns."""
    count = len(crops)
    mirror = random.random(count) < 0.5
    crops[mirror] = crops[mirror][..., ::-1]
    truth = Truth(truths)
    found = truth.joints
    found[mirror] = found[mirror][:, joints.MIRRORED] * np.array([-1, 1, 1], np.float32)
    truth.visible[mirror] = truth.visible[mirror][:, joints.MIRRORED]
    truth.hands[mirror] = truth.hands[mirror][:, ::-1]
    truth.heading[mirror, 0] *= -1
    # The middle of a mask is not always where it was here.
    away = (random.normal(0, 0.04, count)).astype(np.float32)
    seen = crops[:, 1] == 1
    crops[:, 0] = np.clip(crops[:, 0] + away[:, None, None] / joints.DEPTH_M, -1, 1) * seen
    found[:, :, 2] += away[:, None]
    moved = np.clip(np.round(random.normal(0, 1.3, (count, 2))), -FARTHEST_SHIFT, FARTHEST_SHIFT).astype(int)
    padded = np.pad(crops, ((0, 0), (0, 0), (FARTHEST_SHIFT,) * 2, (FARTHEST_SHIFT,) * 2), "edge")
    for i, (down, right) in enumerate(moved):
        y, x = FARTHEST_SHIFT - down, FARTHEST_SHIFT - right
        crops[i] = padded[i, :, y : y + joints.SIZE, x : x + joints.SIZE]
        if random.random() < 0.25:
            top, left = random.integers(0, joints.SIZE - 8, 2)
            height, width = random.integers(4, 18, 2)
            piece = crops[i, :, top : top + height, left : left + width]
            piece[0], piece[1] = 0, -1 if random.random() < 0.6 else 0
    found[:, :, 0] += moved[:, 1:] * joints.CELL_M
    found[:, :, 1] += moved[:, :1] * joints.CELL_M
    return torch.from_numpy(crops), Truth(torch.from_numpy(truths))
