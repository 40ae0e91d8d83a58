"""The person's own frame, in NumPy: origin at the base of the spine, x where they face, z up, sized by their bones."""

import numpy as np

from .augment import headings, rotations
from .joints import BONES, COUNT, PARENTS

USUAL_BONE_M = 0.21
"""Mean length of the bones of an adult in the canonical joint set, metres; sizes are told against it."""


def sizes(poses: np.ndarray) -> np.ndarray:
    """How large people are against `USUAL_BONE_M`: (...) of (..., 25, 3)."""
    return np.linalg.norm(poses[..., BONES, :] - poses[..., PARENTS[BONES], :], axis=-1).mean(axis=-1) / USUAL_BONE_M


def person_frame(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(poses in the person's frame, rotation to it (..., 3, 3), origin (..., 3)); metres, not yet sized."""
    turn = rotations(-headings(poses))
    origin = poses[..., 0, :]
    return np.einsum("...ij,...kj->...ki", turn, poses - origin[..., None, :]), turn, origin


class GaussianConditional:
    """Where hidden joints are on average, given those seen; every pose for itself, in the person's frame."""

    def __init__(self, poses: np.ndarray, noise_m: float = 0.015):
        """From complete poses (n, 25, 3) in room metres."""
        own, _, _ = person_frame(poses)
        own = (own / sizes(poses)[..., None, None]).reshape(len(poses), -1)
        self.mean = own.mean(axis=0)
        self.covariance = np.cov(own - self.mean, rowvar=False) + np.eye(own.shape[1]) * noise_m**2
        self._gains: dict[tuple[int, ...], tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

    def __call__(self, own: np.ndarray, hidden: tuple[int, ...]) -> np.ndarray:
        """`own` (..., 25, 3) sized, in the person's frame; the same with the `hidden` joints replaced."""
        if hidden not in self._gains:
            gone = np.array([3 * j + k for j in hidden for k in range(3)])
            seen = np.setdiff1d(np.arange(3 * COUNT), gone)
            gain = np.linalg.solve(self.covariance[np.ix_(seen, seen)], self.covariance[np.ix_(seen, gone)]).T
            self._gains[hidden] = gone, seen, gain
        gone, seen, gain = self._gains[hidden]
        flat = own.reshape(*own.shape[:-2], -1).copy()
        flat[..., gone] = self.mean[gone] + (flat[..., seen] - self.mean[seen]) @ gain.T
        return flat.reshape(own.shape)
