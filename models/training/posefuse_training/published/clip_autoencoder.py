"""Clip auto-encoder: two seconds of motion as a small image, from which the legs are guessed.

As described: 64 frames x 11 joints x 3 coordinates as an image of three channels; the four leg joints (knees and ankles)
are taken away and have to come back; five strided convolutions, two 1x1, five transposed ones, each with batch
normalisation and ReLU; every epoch each clip is turned to a heading of its own. Measured by the mean Euclidean distance
of the four joints. The size of kernels and layers is not told; ours are below.

An image's rows are frames, its columns joints in an order in which neighbours are near each other on the body.
"""

import torch
from torch import nn

from . import geometry as g

NAME = "clip-autoencoder"

FRAMES = 64
# What goes in, and what comes out: down one side, up the other.
GIVEN = (6, 5, 4, 12, 0, 20, 3, 16, 8, 9, 10)
LEGS = (13, 14, 17, 18)
OUT = (6, 5, 4, 14, 13, 12, 0, 20, 3, 16, 17, 18, 8, 9, 10)
LEG_COLUMNS = tuple(OUT.index(joint) for joint in LEGS)
BONES = ((20, 0), (3, 20), (4, 20), (5, 4), (6, 5), (8, 20), (9, 8), (10, 9), (12, 0), (16, 0))
CHANNELS = (32, 64, 96, 128, 128)


def _down(inside, outside):
    return [nn.Conv2d(inside, outside, 3, stride=2, padding=1), nn.BatchNorm2d(outside), nn.ReLU()]


def _point(inside, outside):
    return [nn.Conv2d(inside, outside, 1), nn.BatchNorm2d(outside), nn.ReLU()]


def _up(inside, outside, stride):
    kernel = tuple(s + 2 for s in stride)
    return [nn.ConvTranspose2d(inside, outside, kernel, stride=stride, padding=1), nn.BatchNorm2d(outside), nn.ReLU()]


class ClipAutoencoder(nn.Module):
    """`[N, 3, 64, 11]` to `[N, 3, 64, 15]`: the joints of [GIVEN] in, of [OUT] out, both as the image tells them."""

    def __init__(self, channels=CHANNELS):
        super().__init__()
        a, b, c, d, e = channels
        self.encode = nn.Sequential(*_down(3, a), *_down(a, b), *_down(b, c), *_down(c, d), *_down(d, e))
        self.between = nn.Sequential(*_point(e, e), *_point(e, e))
        # Columns 1, 1, 2, 4, 8, 16, of which 15 are joints; rows 2, 4, ... 64.
        widen = (2, 2)
        self.decode = nn.Sequential(
            *_up(e, d, (2, 1)),
            *_up(d, c, widen),
            *_up(c, b, widen),
            *_up(b, a, widen),
            nn.ConvTranspose2d(a, 3, 4, stride=2, padding=1),
        )

    def forward(self, image):
        return self.decode(self.between(self.encode(image)))[..., : len(OUT)]


def to_image(points):
    """`[N, T, J, 3]` as the image `[N, 3, T, J]`."""
    return points.permute(0, 3, 1, 2)


def from_image(image):
    """The way back of [to_image]."""
    return image.permute(0, 2, 3, 1)


def told(pose, seen, proportions, usual):
    """A clip `[N, 64, 25, 3]` as the network sees it, with the ways back: each joint from the pelvis of its frame, the
    pelvis from the clip's middle, all at size one. Columns of [OUT]; the heading is the room's.

    Returns points `[N, 64, 15, 3]`, the clip's middle `[N, 1, 3]` on the floor, and the size `[N, 1]`.
    """
    size = g.scale_of(pose, seen, BONES, proportions, usual).mean(-1, keepdim=True)
    pelvis = pose[..., g.SPINE_BASE, :]
    middle = pelvis.mean(1, keepdim=True) * torch.tensor((1.0, 1.0, 0.0))
    root = OUT.index(g.SPINE_BASE)
    points = pose[..., list(OUT), :] - pelvis.unsqueeze(-2)
    moving = (pelvis - middle).unsqueeze(-2)
    points = torch.cat([points[..., :root, :], moving, points[..., root + 1 :, :]], -2)
    return points / size.unsqueeze(-1).unsqueeze(-1), middle, size


def given(points):
    """The columns of [GIVEN] of points with the columns of [OUT]."""
    return points[..., [OUT.index(joint) for joint in GIVEN], :]


def turned(points, angles):
    """Clips `[N, T, J, 3]` turned about the vertical by `angles` `[N]`, radians."""
    c, s = torch.cos(angles), torch.sin(angles)
    zero, one = torch.zeros_like(c), torch.ones_like(c)
    turn = torch.stack([c, -s, zero, s, c, zero, zero, zero, one], -1).view(-1, 1, 3, 3)
    return torch.matmul(points, turn.transpose(-1, -2))


def leg_distance(out, points, size):
    """The paper's measure: mean Euclidean distance of the four joints, metres. All `[N, T, 15, 3]`, `size` `[N, 1]`."""
    legs = list(LEG_COLUMNS)
    away = g.length(out[..., legs, :] - points[..., legs, :])
    return (away * size.unsqueeze(-1)).mean()
