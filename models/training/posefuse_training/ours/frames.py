"""The person's frame inside the exported graph: any joint may be missing.

Shapes: n windows, t poses, 25 joints. Own coordinates: origin at the base of the spine, x where the person faces, z up, divided by
the person's size.
"""

from typing import NamedTuple

import torch
from torch import Tensor

from ..joints import BONES, INDEX, PARENTS

TRUNK = [INDEX[name] for name in ("SpineBase", "SpineMid", "SpineShoulder", "Neck", "Head", "HipLeft", "HipRight", "ShoulderLeft", "ShoulderRight")]
_NEVER = 1e-3
BONE_STEP = 6
"""Poses from one in which bones are measured to the next."""


class Frames(NamedTuple):
    """How own coordinates of each pose lie in the room."""

    forward: Tensor
    """(n, t, 2) unit vector in the room."""
    origin: Tensor
    """(n, t, 3) metres."""
    size: Tensor
    """(n, 1, 1, 1)."""

    def rows(self) -> tuple[Tensor, Tensor]:
        """Where the person faces, and their left, as vectors in the room."""
        return self.forward, torch.stack([-self.forward[..., 1], self.forward[..., 0]], -1)

    def own(self, room: Tensor) -> Tensor:
        """Room places (n, t, joints, 3) in own coordinates."""
        return turned_in(self.forward[:, :, None], room - self.origin[:, :, None]) / self.size

    def room(self, own: Tensor) -> Tensor:
        """Own coordinates (n, t, joints, 3) as places in the room."""
        return turned_out(self.forward[:, :, None], own * self.size) + self.origin[:, :, None]


def turned_in(forward: Tensor, vectors: Tensor) -> Tensor:
    """Room vectors (..., 3) along (forward, left, up)."""
    x, y = forward[..., 0], forward[..., 1]
    ahead = x * vectors[..., 0] + y * vectors[..., 1]
    left = x * vectors[..., 1] - y * vectors[..., 0]
    return torch.stack([ahead, left, vectors[..., 2].expand_as(ahead)], -1)


def turned_out(forward: Tensor, vectors: Tensor) -> Tensor:
    """The inverse of `turned_in`."""
    x, y = forward[..., 0], forward[..., 1]
    first = x * vectors[..., 0] - y * vectors[..., 1]
    second = y * vectors[..., 0] + x * vectors[..., 1]
    return torch.stack([first, second, vectors[..., 2].expand_as(first)], -1)


def frames(pose: Tensor, mask: Tensor, usual: Tensor) -> Frames:
    """The frames of (n, t, 25, 3) poses.

    `usual` (25, 3) is the mean pose in own coordinates: where the base of the spine is hidden, the rest of the trunk tells
    where it is; where all is hidden, last known places do.
    """
    hips = mask[..., 12:13] * mask[..., 16:17] + _NEVER
    shoulders = mask[..., 4:5] * mask[..., 8:9] + _NEVER
    left = hips * (pose[..., 12, :2] - pose[..., 16, :2]) + shoulders * (pose[..., 4, :2] - pose[..., 8, :2])
    left = left / torch.sqrt((left * left).sum(-1, keepdim=True)).clamp(min=1e-6)
    forward = torch.stack([left[..., 1], -left[..., 0]], -1)
    size = sizes(pose[:, ::BONE_STEP], mask[:, ::BONE_STEP], usual)
    trunk = mask[..., TRUNK] + _NEVER
    offsets = turned_out(forward[:, :, None], usual[TRUNK] * size)
    implied = ((pose[..., TRUNK, :] - offsets) * trunk[..., None]).sum(2) / trunk.sum(2)[..., None]
    seen = mask[..., 0:1]
    return Frames(forward, seen * pose[..., 0, :] + (1 - seen) * implied, size)


def sizes(pose: Tensor, mask: Tensor, usual: Tensor) -> Tensor:
    """(n, 1, 1, 1): the lengths of the bones with both ends measured against their usual ones, over the whole window."""
    bones, parents = BONES.tolist(), PARENTS[BONES].tolist()
    usual_lengths = torch.sqrt(((usual[bones] - usual[parents]) ** 2).sum(-1))
    sure = mask[..., bones] * mask[..., parents]
    span = pose[..., bones, :] - pose[..., parents, :]
    lengths = torch.sqrt((span * span).sum(-1) + 1e-9)
    little = 0.01 * usual_lengths.sum()
    size = ((lengths * sure).sum((1, 2)) + little) / ((usual_lengths * sure).sum((1, 2)) + little)
    return size.clamp(0.4, 2.0)[:, None, None, None]


def look_back(lag: Tensor, poses: int) -> Tensor:
    """Weights (..., t) that pick the pose `lag` (...) poses before the newest of `poses`, the oldest if it is further back."""
    back = torch.arange(poses - 1, -1, -1, dtype=torch.float32, device=lag.device)
    return (1 - (lag.clamp(0, poses - 1)[..., None] - back).abs()).clamp(min=0)
