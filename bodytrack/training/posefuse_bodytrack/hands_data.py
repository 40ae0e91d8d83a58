"""Crops of hands as `bodytrack/examples/crops ... hands` writes them, and batches of them."""

import glob
import os

import numpy as np
import torch

# bodytrack/src/hand.rs
SIZE, CHANNELS, WINDOW_M = 32, 2, 0.25
KNOWN = 3
UNITS = 100.0
TRUTH = 10
FARTHEST_SHIFT = 3
CAMERAS = ("structured light 640 x 480", "structured light 320 x 240", "time of flight 512 x 424")


class Truth:
    """The columns of truths [N, TRUTH]."""

    def __init__(self, numbers):
        names = "closed distance sharp said_visible sigma visible tracked_off off camera smeared".split()
        for column, name in enumerate(names):
            setattr(self, name, numbers[:, column])


def known(truth):
    """What the network is told beside the crop, as the tracker tells it: [N, 3]."""
    return np.stack([np.log(truth.sharp), truth.said_visible, np.log(truth.sigma)], 1).astype(np.float32)


def load(folder, subset):
    """Crops [N, 2, 32, 32] (i8, 100 is 1) and their truth of a subset below a folder."""
    crops, truths = [], []
    for path in sorted(glob.glob(os.path.join(folder, f"{subset}-*.grips"))):
        numbers = np.fromfile(path, np.float32)
        images = np.fromfile(path[: -len(".grips")] + ".hands", np.int8)
        count = min(len(numbers) // TRUTH, len(images) // (CHANNELS * SIZE * SIZE))
        truths.append(numbers[: count * TRUTH].reshape(-1, TRUTH))
        crops.append(images[: count * CHANNELS * SIZE * SIZE].reshape(-1, CHANNELS, SIZE, SIZE))
    if not crops:
        raise SystemExit(f"expected hands of `{subset}` in {folder}, found none; see README.md")
    return np.concatenate(crops), Truth(np.concatenate(truths))


def numbers(crops):
    """Crops as the network is given them."""
    return crops.astype(np.float32) / UNITS


def augmented(crops, random):
    """Mirrored, moved, nearer and further, with pieces lost. Mirrored, a hand shows its other side: as open or closed as before."""
    count = len(crops)
    mirror = random.random(count) < 0.5
    crops[mirror] = crops[mirror][..., ::-1]
    held = crops[:, 1] > 0
    away = random.normal(0, 0.08, (count, 1, 1)).astype(np.float32)
    crops[:, 0] = np.where(held, np.clip(crops[:, 0] + away, -1, 1), crops[:, 0])
    moved = np.clip(np.round(random.normal(0, 1.0, (count, 2))), -FARTHEST_SHIFT, FARTHEST_SHIFT).astype(int)
    padded = np.pad(crops, ((0, 0), (0, 0), (FARTHEST_SHIFT,) * 2, (FARTHEST_SHIFT,) * 2), "edge")
    for i, (down, right) in enumerate(moved):
        y, x = FARTHEST_SHIFT - down, FARTHEST_SHIFT - right
        crops[i] = padded[i, :, y : y + SIZE, x : x + SIZE]
        if random.random() < 0.15:
            top, left = random.integers(0, SIZE - 4, 2)
            height, width = random.integers(2, 9, 2)
            crops[i, 0, top : top + height, left : left + width] = 1
            crops[i, 1, top : top + height, left : left + width] = -1
    return torch.from_numpy(crops)
