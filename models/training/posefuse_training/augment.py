"""Draws stretches of motion for training, varied: speed, mirror, heading, size, arms of one with the legs of another.

Everything works on a whole batch at once: (batch, time, 25, 3).
"""

from dataclasses import dataclass

import numpy as np

from .joints import ARM_LEFT, ARM_RIGHT, MIRROR
from .recordings import Prepared, kind_of


@dataclass
class Variation:
    """How far the drawn stretches differ from the recorded ones."""

    speed: tuple[float, float] = (0.75, 1.3)
    size: tuple[float, float] = (0.85, 1.12)
    mirror: float = 0.5
    """Share that is mirrored."""
    backwards: float = 0.1
    """Share that runs backwards."""
    mixed_arms: float = 0.2
    """Share in which one or both arms come from another stretch."""


class Source:
    """Recordings to draw from. A kind of motion is drawn as often as its length to the power `evenness` says."""

    def __init__(self, prepared: list[tuple[Prepared, float]], evenness: float = 0.5):
        """`prepared`: recordings with the share of the draws each gets."""
        self.poses = np.concatenate([part.poses for part, _ in prepared])
        starts, lengths, weights = [], [], []
        offset = 0
        for part, share in prepared:
            begin, end = part.starts[:-1], part.starts[1:]
            kinds = np.array([kind_of(name) for name in part.names])
            weight = np.zeros(len(kinds))
            for kind in np.unique(kinds):
                own = (end - begin)[kinds == kind].astype(float)
                weight[kinds == kind] = own / own.sum() * own.sum() ** evenness
            starts.append(begin + offset)
            lengths.append(end - begin)
            weights.append(weight / weight.sum() * share)
            offset += len(part.poses)
        self.starts, self.lengths = np.concatenate(starts), np.concatenate(lengths)
        weights = np.concatenate(weights)
        self.chances = weights / weights.sum()

    def draw(self, rng: np.random.Generator, batch: int, frames: int, variation: Variation) -> np.ndarray:
        """(batch, frames, 25, 3) f32. Clips shorter than that play there and back."""
        poses = self._stretch(rng, batch, frames, variation)
        mixed = rng.random(batch) < variation.mixed_arms
        if mixed.any():
            others = self._stretch(rng, int(mixed.sum()), frames, variation)
            poses[mixed] = with_arms_of(poses[mixed], others, rng)
        flip = rng.random(batch) < variation.mirror
        poses[flip] = poses[flip][:, :, MIRROR] * np.array([1, -1, 1], np.float32)
        poses *= rng.uniform(*variation.size, (batch, 1, 1, 1)).astype(np.float32)
        return turned(poses, rng.uniform(0, 2 * np.pi, batch))

    def _stretch(self, rng, batch, frames, variation) -> np.ndarray:
        span = rng.choice(len(self.starts), size=batch, p=self.chances)
        speed = np.exp(rng.uniform(*np.log(variation.speed), batch))
        speed *= np.where(rng.random(batch) < variation.backwards, -1, 1)
        last = self.lengths[span] - 1.0
        # Where possible the whole stretch lies in the clip; else it turns at the clip's ends.
        way = np.abs(speed) * (frames - 1)
        begin = rng.uniform(0, np.maximum(last - way, 0) + 1e-6)
        begin = np.where(last < way, rng.uniform(0, last), begin)
        begin = np.where((speed < 0) & (last >= way), begin + way, begin)
        at = begin[:, None] + speed[:, None] * np.arange(frames)
        at = np.abs((at + last[:, None]) % (2 * last[:, None]) - last[:, None])
        low = np.minimum(np.floor(at).astype(np.int64), (last[:, None] - 1).astype(np.int64))
        part = (at - low).astype(np.float32)[..., None, None]
        index = self.starts[span][:, None] + low
        return self.poses[index] * (1 - part) + self.poses[index + 1] * part


def headings(poses: np.ndarray) -> np.ndarray:
    """Where people face, radians from x: at a right angle to hips and shoulders."""
    across = poses[..., 12, :2] - poses[..., 16, :2] + poses[..., 4, :2] - poses[..., 8, :2]
    return np.arctan2(-across[..., 0], across[..., 1])


def rotations(angles: np.ndarray) -> np.ndarray:
    """Rotations by `angles` about the vertical, (..., 3, 3)."""
    cos, sin, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [[cos, -sin, zero], [sin, cos, zero], [zero, zero, zero + 1]]
    return np.stack([np.stack(row, -1) for row in rows], -2).astype(np.float32)


def turned(poses: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Each of the batch turned about the vertical through where it begins, and moved there."""
    middle = poses[:, :1, :1] * np.array([1, 1, 0], np.float32)
    turn = rotations(angles)
    return np.matmul((poses - middle).reshape(len(poses), -1, 3), turn.transpose(0, 2, 1)).reshape(poses.shape)


def with_arms_of(poses: np.ndarray, others: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One or both arms of `others`, turned with the trunk and hung on the shoulders of `poses`."""
    turn = rotations(headings(poses) - headings(others))
    which = rng.integers(1, 4, len(poses))
    result = poses.copy()
    for bit, shoulder, arm in ((1, 4, ARM_LEFT), (2, 8, ARM_RIGHT)):
        arm = np.array(arm)
        own = poses[:, :, [shoulder]] + np.einsum("btij,btkj->btki", turn, others[:, :, arm] - others[:, :, [shoulder]])
        use = np.flatnonzero(which & bit)
        result[np.ix_(use, range(poses.shape[1]), arm)] = own[use]
    return result
