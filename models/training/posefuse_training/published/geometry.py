"""Geometry that the published systems share, written so that it can live inside an exported graph.

Positions are metres, joints canonical Kinect v2 (25), the room right-handed with Z up. A frame is a matrix whose rows
are its axes (forward, left, up) told in the room, so `(p - origin) @ frame.T` leads into it and `q @ frame + origin` back.
Everything is branch-free and made of plain tensor operations: no atan2, no norm, no boolean indexing.
"""

import torch

SPINE_BASE, SPINE_MID, NECK, HEAD, SPINE_SHOULDER = 0, 1, 2, 3, 20
SHOULDER_LEFT, ELBOW_LEFT, WRIST_LEFT, HAND_LEFT = 4, 5, 6, 7
SHOULDER_RIGHT, ELBOW_RIGHT, WRIST_RIGHT, HAND_RIGHT = 8, 9, 10, 11
HIP_LEFT, KNEE_LEFT, ANKLE_LEFT, FOOT_LEFT = 12, 13, 14, 15
HIP_RIGHT, KNEE_RIGHT, ANKLE_RIGHT, FOOT_RIGHT = 16, 17, 18, 19
HAND_TIP_LEFT, THUMB_LEFT, HAND_TIP_RIGHT, THUMB_RIGHT = 21, 22, 23, 24

SMALL = 1e-9
# A joint that was not measured still has a say in a frame, for where nothing else has.
LEAST_SAY = 0.02


def dot(a, b):
    """Inner product along the last axis, which stays with length one."""
    return (a * b).sum(-1, keepdim=True)


def unit(v):
    """`v` with length one along its last axis; what is nearly zero stays nearly zero."""
    return v / torch.sqrt(dot(v, v) + SMALL)


def length(v):
    """Length along the last axis, which goes; smooth at zero."""
    return torch.sqrt((v * v).sum(-1) + SMALL)


def cross(a, b):
    """Outer product along the last axis, of slices, which every runtime has."""
    ax, ay, az = a[..., 0:1], a[..., 1:2], a[..., 2:3]
    bx, by, bz = b[..., 0:1], b[..., 1:2], b[..., 2:3]
    return torch.cat([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def _said(pose, seen, to, start):
    """The way from joint `start` to joint `to`, weighted by how far both were measured."""
    say = (seen[..., to] * seen[..., start] + LEAST_SAY).unsqueeze(-1)
    return say * (pose[..., to, :] - pose[..., start, :])


def leftward(pose, seen):
    """To the person's left by hips and shoulders, `[..., 3]`, any length. `pose` `[..., 25, 3]`, `seen` `[..., 25]`."""
    return _said(pose, seen, HIP_LEFT, HIP_RIGHT) + _said(pose, seen, SHOULDER_LEFT, SHOULDER_RIGHT)


def upright_frame(left):
    """The upright frame of somebody whose left is `left` `[..., 3]`: forward, left, up, `[..., 3, 3]`."""
    x, y, zero = left[..., 0:1], left[..., 1:2], left[..., 2:3] * 0.0
    flat = unit(torch.cat([x, y, zero], -1))
    forward = torch.cat([flat[..., 1:2], -flat[..., 0:1], zero], -1)
    return torch.stack([forward, flat, torch.cat([zero, zero, zero + 1.0], -1)], -2)


def waist_frame(pose, seen):
    """The pelvis' own frame, which leans with it: left by the hips, up by the spine."""
    left = unit(leftward(pose, seen))
    spine = _said(pose, seen, SPINE_MID, SPINE_BASE) + _said(pose, seen, SPINE_SHOULDER, SPINE_BASE)
    forward = unit(cross(left, unit(spine)))
    return torch.stack([forward, left, cross(forward, left)], -2)


def into(frame, origin, points):
    """Room points `[..., J, 3]` told in a frame `[..., 3, 3]` at `origin` `[..., 3]`."""
    return torch.matmul(points - origin.unsqueeze(-2), frame.transpose(-1, -2))


def out_of(frame, origin, points):
    """The way back of [into]."""
    return torch.matmul(points, frame) + origin.unsqueeze(-2)


def shortest_turn(a, b):
    """The quaternion (w, x, y, z) that turns unit vectors `a` into `b` the short way."""
    return unit(torch.cat([1.0 + dot(a, b) + 1e-4, cross(a, b)], -1))


def multiply(p, q):
    """The quaternion that turns by `q` first, then by `p`."""
    pw, qw, pv, qv = p[..., 0:1], q[..., 0:1], p[..., 1:4], q[..., 1:4]
    return torch.cat([pw * qw - dot(pv, qv), pw * qv + qw * pv + cross(pv, qv)], -1)


def turn(q, v):
    """`v` turned by the quaternion `q`."""
    twice = 2.0 * cross(q[..., 1:4], v)
    return v + q[..., 0:1] * twice + cross(q[..., 1:4], twice)


def bone_rotation(rest, rest_side, bone, side):
    """The rotation of a bone from its rest: swing the short way, then twist until its side points to `side`.

    All but `side` are unit vectors `[..., 3]`; `side` is where the bend plane's normal points and may be short, in which
    case it decides little. The result `[..., 4]` has w first.
    """
    swing = shortest_turn(rest, bone)
    have = turn(swing, rest_side)
    want = unit(side - dot(side, bone) * bone + 1e-3 * have)
    # About the bone and nothing else, also where the side points the opposite way.
    twist = unit(torch.cat([1.0 + dot(have, want) + 1e-4, dot(cross(have, want), bone) * bone], -1))
    return multiply(twist, swing)


def scale_of(pose, seen, bones, proportions, usual):
    """The person's size `[...]`, metres: the mean length of `bones` (child, parent), from those that were measured.

    `proportions` `[B]` are the bones' usual lengths for a size of one, `usual` a usual size, which decides where no
    bone was measured.
    """
    child, parent = [c for c, _ in bones], [p for _, p in bones]
    lengths = length(pose[..., child, :] - pose[..., parent, :])
    say = seen[..., child] * seen[..., parent]
    prior = 0.05
    ours = (say * lengths).sum(-1) + prior * usual
    theirs = (say * proportions).sum(-1) + prior
    return ours / theirs


def riding(pose, seen):
    """A window `[N, T, 25, 3]` in which joints that were not `seen` `[N, T, 25]` go with the person, as they last stood in
    the person's heading, instead of staying behind in the room."""
    frame = upright_frame(leftward(pose, seen))
    pelvis = pose[..., SPINE_BASE, :]
    own = into(frame, pelvis, pose)
    say = seen.unsqueeze(-1)
    at = own[:, 0]
    carried = [at]
    for t in range(1, pose.shape[1]):
        at = say[:, t] * own[:, t] + (1.0 - say[:, t]) * at
        carried.append(at)
    return out_of(frame, pelvis, torch.stack(carried, 1))


def follow_hands(points, ratio_tip, ratio_thumb):
    """`points` `[..., 25, 3]` with hand tips and thumbs on the line of wrist and hand, at `ratio` hand lengths.

    None of the published systems has them; here they go with the hand.
    """
    joints = list(points.unbind(-2))
    for wrist, hand, tip, thumb in ((6, 7, 21, 22), (10, 11, 23, 24)):
        along = joints[hand] - joints[wrist]
        joints[tip] = joints[wrist] + ratio_tip * along
        joints[thumb] = joints[wrist] + ratio_thumb * along
    return torch.stack(joints, -2)


def hand_ratios(poses):
    """The two ratios of [follow_hands] that fit `poses` `[N, 25, 3]` (an array) best."""
    hand, tip, thumb = (torch.from_numpy(poses[:, j] - poses[:, WRIST_LEFT]) for j in (HAND_LEFT, HAND_TIP_LEFT, THUMB_LEFT))
    long = (hand * hand).sum()
    return float((tip * hand).sum() / long), float((thumb * hand).sum() / long)
