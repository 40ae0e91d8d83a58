"""What the poses on one side of a hidden joint say of it: where it was, how it moved, what follows from that.

Windows here end with the pose that is filled; for what comes after a gap they are turned round in time.
"""

from typing import NamedTuple

import torch
from torch import Tensor

from .. import RATE_HZ
from ..joints import ARM_LEFT, ARM_RIGHT, COUNT, LEG_LEFT, LEG_RIGHT
from .frames import Frames, look_back, turned_in
from .prior import CHANGE, Anchor, PosePrior

CORE = list(range(21))
"""Thumbs and finger tips follow the hand: they are filled, but nothing is learned from them."""
GROUPS = (ARM_LEFT, ARM_RIGHT, LEG_LEFT, LEG_RIGHT, (0, 1, 2, 3, 4, 8, 12, 16, 20))
"""Joints that are taken to be lost together."""
SPEED_OVER = (2, 5)
"""Poses before a joint was lost against which its speed is measured."""


class Side(NamedTuple):
    """Each (n, 25, 3) in own coordinates of the filled pose, but for the deviation (n, 25)."""

    last: Tensor
    """Where it was seen, against the person."""
    in_room: Tensor
    """The same place in the room."""
    speeds: list[Tensor]
    """Against the person, per second, over each of `SPEED_OVER`; away from the side."""
    room_speed: Tensor
    mean: Tensor
    """Given what is measured in the filled pose."""
    offset: Tensor
    """How far it was from such a mean when it was seen."""
    carried: Tensor
    """Mean given what is measured and how all moved when it was seen."""
    deviation: Tensor
    """Of that."""
    anchor: Anchor
    """The poses in which each group was seen."""


def group_matrix() -> Tensor:
    """(groups, 25)."""
    matrix = torch.zeros(len(GROUPS), COUNT)
    for index, joints in enumerate(GROUPS):
        matrix[index, list(joints)] = 1
    return matrix


def side_of(prior: PosePrior, group: Tensor, whole: Frames, own: Tensor, pose: Tensor, mask: Tensor, steps: Tensor) -> Side:
    """What a window (n, t, 25, 3) says whose last pose is filled; `steps` (n, 25) poses ago each joint was seen."""
    poses = own.shape[1]
    backs = torch.stack([steps] + [steps + back for back in SPEED_OVER], -1)
    measured = (mask > 0).float()[..., None]
    # One product for all: own place, place in the room, whether it was measured.
    looks = torch.matmul(look_back(backs, poses), torch.cat([own, pose, measured], -1).transpose(1, 2))
    last, place = looks[:, :, 0, :3], looks[:, :, 0, 3:6]
    in_room = turned_in(whole.forward[:, -1:], place - whole.origin[:, -1:]) / whole.size[:, 0]
    speeds, room_speed = [], None
    for index, back in enumerate(SPEED_OVER, start=1):
        known = (looks[:, :, index, 6:] > 0.5).float() * (RATE_HZ / back)
        speeds.append((last - looks[:, :, index, :3]) * known)
        if room_speed is None:
            moved = (place - looks[:, :, index, 3:6]) * known
            room_speed = turned_in(whole.forward[:, -1:], moved) / whole.size[:, 0]
    return Side(last, in_room, speeds, room_speed, *_conditional(prior, group, own, mask[:, -1], steps))


def _conditional(prior: PosePrior, group: Tensor, own: Tensor, mask: Tensor, steps: Tensor) -> tuple:
    poses = own.shape[1]
    flat = own.flatten(2)
    now = flat[:, -1]
    lost = (steps[:, None] * group).amax(-1)
    anchor = Anchor(torch.matmul(look_back(lost, poses), flat), torch.matmul(look_back(lost + CHANGE, poses), flat), lost)
    trust, information = prior.information(mask)
    means = prior.given(trust, information, torch.cat([now[:, None], anchor.pose], 1))
    carried, deviation = prior.carried(trust, information, now, anchor)
    offset = of_own_group(group, anchor.pose - means[:, 1:])
    return means[:, 0].reshape(-1, COUNT, 3), offset, of_own_group(group, carried), (deviation * group).sum(1), anchor


def of_own_group(group: Tensor, poses: Tensor) -> Tensor:
    """For each joint what the pose of its own group says: (n, groups, 75) to (n, 25, 3)."""
    return (poses.reshape(-1, len(GROUPS), COUNT, 3) * group[None, :, :, None]).sum(1)


def history(usual: Tensor, whole: Frames, own: Tensor, mask: Tensor, speed_lags, pose_lags) -> list[Tensor]:
    """How the joints, the person and their heading changed up to the last pose, and earlier poses; zero where not measured."""
    newest = own.shape[1] - 1
    speeds = [newest - lag for lag in speed_lags]
    both = mask[:, speeds][..., CORE] * mask[:, -1:, CORE]
    changed = (own[:, -1:, CORE] - own[:, speeds][:, :, CORE]) * both[..., None]
    poses = [newest - lag for lag in pose_lags]
    earlier = (own[:, poses][:, :, CORE] - usual[CORE]) * mask[:, poses][..., CORE][..., None]
    forward = whole.forward[:, -1:]
    way = turned_in(forward, whole.origin[:, -1:] - whole.origin[:, speeds]) / whole.size[:, :, 0]
    then = whole.forward[:, speeds]
    turn = torch.stack([(then * forward).sum(-1), then[..., 0] * forward[..., 1] - then[..., 1] * forward[..., 0]], -1)
    return [changed.flatten(1), earlier.flatten(1), way.flatten(1), turn.flatten(1)]

