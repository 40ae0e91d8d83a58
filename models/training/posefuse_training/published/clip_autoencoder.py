"""Clip auto-encoder: two seconds of motion as a small image, from which the legs are guessed.

As described: 64 frames x 11 joints x 3 coordinates as an image of three channels; the four leg joints (knees and ankles)
are taken away and have to come back; five strided convolutions, two 1x1, five transposed ones, each with batch
normalisation and ReLU; every epoch each clip is turned to a heading of its own. Measured by the mean Euclidean distance
of the four joints. The size of kernels and layers is not told; ours are below.

An image's rows are frames, its columns joints in an order in which neighbours are near each other on the body.
"""

import math
import sys

import torch
from torch import nn

from ..augment import Source
from ..person import GaussianConditional, person_frame, sizes
from . import geometry as g
from . import shipping
from ..fitting import device
from .experiment import AS_RECORDED, Experiment, body_proportions, early_stopping, numpy_rng, table, windows

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


# --- the paper's experiment -------------------------------------------------------------------------------------------

PUBLISHED = 3.031
BATCH, BATCHES = 64, 40
CMU_UNIT_CM = 5.644


def body(run: Experiment):
    """Proportions and usual size of the training recordings' people."""
    return body_proportions(run.train, BONES)


def clips(prepared, generator):
    """Test clips `[N, 64, 25, 3]`, a clip every half second, each turned to a heading of its own."""
    pose = windows(prepared, FRAMES, 15)
    angles = torch.rand(len(pose), generator=generator) * 2.0 * math.pi
    return turned(pose, angles)


def train(run: Experiment, shape):
    """The network, taught to give back all 15 joints of clips from 11; the legs count most."""
    source = Source([(run.teaching(), 1.0)])
    place = device()
    weight = torch.ones(len(OUT), device=place)
    weight[list(LEG_COLUMNS)] = 4.0
    seen = torch.ones(1, FRAMES, 25)

    def answered(model, pose):
        points, _, size = told(pose, seen, *shape)
        points = points.to(place)
        return from_image(model(to_image(given(points)))), points, size.to(place)

    def losses(model):
        out, points, _ = answered(model, torch.from_numpy(source.draw(numpy_rng(), BATCH, FRAMES, AS_RECORDED)))
        return (g.length(out - points) * weight).mean()

    checked = clips(run.validating(), torch.Generator().manual_seed(5))

    def score(model):
        return leg_distance(*answered(model, checked)).item()

    return run.fit("network", ClipAutoencoder(), losses, score, early_stopping(BATCHES, rate=2e-3, averaging=0.98))


@torch.no_grad()
def experiment(run: Experiment) -> str:
    """The paper's measure on recordings that did not teach, beside two that know no time: the mean pose and the Gaussian conditional."""
    shape = body(run)
    with torch.enable_grad():
        model = train(run, shape)
    legs = list(LEGS)
    conditional = GaussianConditional(run.train.poses)
    rows = []
    for split, prepared in run.tests().items():
        pose = clips(prepared, torch.Generator().manual_seed(6))
        seen = torch.ones(1, FRAMES, 25)
        points, _, size = told(pose, seen, *shape)
        ours = leg_distance(from_image(model(to_image(given(points)))), points, size).item() * 100.0
        told_by = conditional_legs(conditional, pose)
        gauss = g.length(told_by - pose[..., legs, :]).mean().item() * 100.0
        rows.append([split, len(pose), f"{ours:.2f}", f"{ours / CMU_UNIT_CM:.3f}", f"{gauss:.2f}", PUBLISHED])
        run.note(split, {"distance_cm": ours, "gaussian_cm": gauss})
    header = ["recordings", "clips", "ours, cm", "ours, CMU units", "Gaussian conditional, cm", "published (unit not told)"]
    return "Mean Euclidean distance of knees and ankles\n\n" + table(header, rows)


def conditional_legs(conditional, pose):
    """Knees and ankles as the Gaussian conditional has them, each pose for itself; feet count as hidden, too."""
    hidden = (*LEGS, g.FOOT_LEFT, g.FOOT_RIGHT)
    flat = pose.reshape(-1, 25, 3).numpy()
    own, turn, origin = person_frame(flat)
    size = sizes(flat)[:, None, None]
    filled = conditional(own / size, tuple(sorted(hidden))) * size
    room = torch.from_numpy(filled @ turn + origin[:, None])
    return room.view(*pose.shape)[..., list(LEGS), :].float()


# --- what ships -------------------------------------------------------------------------------------------------------

KIND, BEFORE, AFTER = "offline", FRAMES // 2 - 1, FRAMES // 2
ABOUT = {
    "summary": "Clip auto-encoder: knees and ankles of two seconds of motion from the rest of the body; other joints stay where they were on the body.",
    "source": "Convolutional auto-encoder over 64 frames x 11 joints as an image, four leg joints removed",
}


class Fills(nn.Module):
    """Knees and ankles by the network, feet in front of the ankles; everything else stays where it was last on the body."""

    def __init__(self, model, shape, foot):
        super().__init__()
        self.model = model
        self.register_buffer("proportions", shape[0])
        self.register_buffer("usual", shape[1])
        self.register_buffer("foot", foot)

    def forward(self, pose, mask, age):
        seen = (mask > 0.0).to(pose.dtype)
        pose = g.riding(pose, seen)
        points, _, size = told(pose, seen, self.proportions, self.usual)
        out = from_image(self.model(to_image(given(points)))) * size.unsqueeze(-1).unsqueeze(-1)
        pelvis = pose[..., g.SPINE_BASE, :]
        joints = list(pose.unbind(-2))
        ahead = g.upright_frame(g.leftward(pose, seen))
        toes = torch.matmul(self.foot * size.unsqueeze(-1).unsqueeze(-1), ahead).squeeze(-2)
        for joint, column in zip(LEGS, LEG_COLUMNS):
            joints[joint] = pelvis + out[..., column, :]
        for ankle, foot in ((g.ANKLE_LEFT, g.FOOT_LEFT), (g.ANKLE_RIGHT, g.FOOT_RIGHT)):
            say = mask[..., ankle].unsqueeze(-1)
            joints[foot] = say * pose[..., ankle, :] + (1.0 - say) * joints[ankle] + toes
        return torch.stack(joints, -2)


def foot_offset(prepared, shape):
    """From ankle to foot in the person's heading at size one, on average, `[1, 3]`."""
    pose = torch.from_numpy(prepared.poses)
    seen = torch.ones(pose.shape[:2])
    frame = g.upright_frame(g.leftward(pose, seen))
    way = torch.stack([pose[:, 15] - pose[:, 14], pose[:, 19] - pose[:, 18]], 1)
    own = torch.matmul(way, frame.transpose(-1, -2)) / g.scale_of(pose, seen, BONES, *shape).view(-1, 1, 1)
    return own.mean((0, 1)).view(1, 3) * torch.tensor((1.0, 0.0, 1.0))


def fused(layers):
    """The same layers with batch normalisation drawn into the convolutions, as an exporter would."""
    out = []
    for layer in layers:
        if isinstance(layer, nn.BatchNorm2d):
            out[-1] = nn.utils.fusion.fuse_conv_bn_eval(out[-1], layer, transpose=isinstance(out[-1], nn.ConvTranspose2d))
        else:
            out.append(layer)
    return nn.Sequential(*out)


def ship(run: Experiment, out) -> None:
    """Writes the model that ships."""
    shape = body(run)
    model = train(run, shape).requires_grad_(False)
    model.encode, model.between, model.decode = fused(model.encode), fused(model.between), fused(model.decode)
    figures = {f"{split}_four_joints_cm".replace(" ", "_"): round(run.noted(split)["distance_cm"], 2) for split in run.tests()}
    shipping.ship(Fills(model, shape, foot_offset(run.train, shape)), sys.modules[__name__], run, out, figures)
