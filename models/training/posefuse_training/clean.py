"""Cuts recordings into spans without jumps: about a fifth of CMU's clips has some."""

import numpy as np

from . import RATE_HZ
from .joints import BONES, PARENTS

FASTEST_ROOT_M_S = 8.0
FASTEST_LIMB_M_S = 14.0
"""Against the pelvis; a thrown or kicking hand or foot stays below."""
BONE_CHANGE = 0.15
BONE_CHANGE_M = 0.02
SHORTEST_FRAMES = 30


def bad_frames(poses: np.ndarray) -> np.ndarray:
    """Which frames of (n, 25, 3) must not be used: a coordinate missing, a bone of the wrong length, a jump before it."""
    bad = ~np.isfinite(poses).all(axis=(1, 2))
    safe = np.nan_to_num(poses)
    lengths = np.linalg.norm(safe[:, BONES] - safe[:, PARENTS[BONES]], axis=-1)
    usual = np.median(lengths[~bad], axis=0) if (~bad).any() else lengths[0]
    bad |= (np.abs(lengths - usual) > BONE_CHANGE * usual + BONE_CHANGE_M).any(axis=1)
    root = np.linalg.norm(np.diff(safe[:, 0], axis=0), axis=-1) * RATE_HZ
    limbs = np.linalg.norm(np.diff(safe - safe[:, :1], axis=0), axis=-1).max(axis=1) * RATE_HZ
    bad[1:] |= (root > FASTEST_ROOT_M_S) | (limbs > FASTEST_LIMB_M_S)
    return bad


def clean_spans(poses: np.ndarray) -> list[np.ndarray]:
    """The stretches between bad frames that are long enough to teach something."""
    edges = np.flatnonzero(np.concatenate([[True], bad_frames(poses), [True]]))
    spans = [poses[start : end - 1] for start, end in zip(edges[:-1], edges[1:])]
    return [span for span in spans if len(span) >= SHORTEST_FRAMES]
