"""The 112 features of Pose ResNet: 16 joints in the waist's frame, each with its position and its bone's rotation.

Our skeletons carry positions, so rotations are derived from them: a bone's direction, and the bend plane of its limb for the
twist.
"""

import torch

from . import geometry as g

JOINTS = (0, 1, 20, 3, 4, 5, 6, 8, 9, 10, 12, 13, 14, 16, 17, 18)
# Parents as places in JOINTS.
PARENT = (-1, 0, 1, 2, 2, 4, 5, 2, 7, 8, 0, 10, 11, 0, 13, 14)
# Where a joint's bone ends; the ends of limbs turn with the bone that leads to them.
CHILD = (1, 2, 3, -1, 5, 6, -1, 8, 9, -1, 11, 12, -1, 14, 15, -1)
# Limbs as (start, middle, end, sign): their two bones' bend plane, whose normal points up for arms, left for legs.
LIMBS = ((4, 5, 6, -1.0), (7, 8, 9, 1.0), (10, 11, 12, 1.0), (13, 14, 15, 1.0))
ARMS = range(4, 10)
FEATURES = len(JOINTS) * 7
# A limb bent less than about ten degrees says little about its plane.
STRAIGHT = 0.15

BONES = tuple((JOINTS[j], JOINTS[PARENT[j]]) for j in range(1, len(JOINTS)))

# Rest directions of the bones that start at each joint: a T-pose in the waist frame (forward, left, up).
_UP, _DOWN, _LEFT, _RIGHT = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
REST = (_UP, _UP, _UP, _UP) + (_LEFT,) * 3 + (_RIGHT,) * 3 + (_DOWN,) * 6


def rotations(points, seen):
    """Quaternions `[..., 16, 4]` (w first) of bones in the waist frame, of `points` `[..., 16, 3]` there.

    A bone one of whose ends was not `seen` `[..., 16]` has the identity; a bend plane that was not seen decides nothing.
    """
    rest = torch.tensor(REST, dtype=points.dtype)
    left = torch.tensor(_LEFT, dtype=points.dtype)
    up = torch.tensor(_UP, dtype=points.dtype)
    joint = points.unbind(-2)
    known = seen.unsqueeze(-1).unbind(-2)
    normal = {}
    for start, middle, end, sign in LIMBS:
        upper, lower = g.unit(joint[middle] - joint[start]), g.unit(joint[end] - joint[middle])
        say = known[start] * known[middle] * known[end]
        usual = up if start in ARMS else left
        bend = (say * g.cross(upper, lower)) * sign
        normal[start] = normal[middle] = bend + STRAIGHT * usual
    identity = torch.tensor((1.0, 0.0, 0.0, 0.0), dtype=points.dtype)
    out = []
    for j, child in enumerate(CHILD):
        if child < 0:
            out.append(out[PARENT[j]])
            continue
        bone = g.unit(joint[child] - joint[j])
        # Arms rest along the left axis, so their side is up; all others rest upright, with their side to the left.
        side = up if j in ARMS else left
        q = g.bone_rotation(rest[j], side, bone, normal.get(j, left))
        say = known[j] * known[child]
        out.append(g.unit(say * q + (1.0 - say) * identity))
    return torch.stack(out, -2)


def features(points, seen):
    """`[..., 112]` of poses in the waist frame, size one: per joint its position, then its rotation."""
    there = points * seen.unsqueeze(-1)
    return torch.cat([there, rotations(there, seen)], -1).flatten(-2)


def to_waist(pose, seen, proportions, usual):
    """The 16 joints in the waist's frame at size one, with that frame `[..., 3, 3]` and size `[...]`."""
    frame = g.waist_frame(pose, seen)
    size = g.scale_of(pose, seen, BONES, proportions, usual)
    points = g.into(frame, pose[..., g.SPINE_BASE, :], pose[..., list(JOINTS), :])
    return points / size.unsqueeze(-1).unsqueeze(-1), frame, size
