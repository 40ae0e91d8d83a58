"""Dual auto-encoder: a recurrent one puts joints where they belong, a convolutional one makes them move smoothly.

After Li, Zhu, Wang and Liu, "Dual auto-encoder network for human skeleton motion data optimisation" (Journal of Image and
Graphics 2022), and what it is compared with: the convolutional auto-encoder (CAE; Holden, Saito, Komura and Joyce 2015),
the bidirectional recurrent one (BRA; Li et al., Computers & Graphics 2019) and that with a perceptual constraint (BRA-P;
Li et al., IEEE Access 2020). Each half of the BRA has two dense layers and one bidirectional LSTM. A perceptual
auto-encoder is taught on clean motion first; then what it makes of the answer, in its hidden units, has to be what it
makes of the truth. Losses: position, bone length, smoothness, hidden units; dropout 0.2. Layer sizes are ours.

A window is 64 poses of 21 joints from their own pelvis, in the heading of the window's middle, at size one; the pelvis'
column holds its way from the window's middle. A joint that was not measured is zero.
"""

import sys

import torch
from torch import nn

from ..augment import Source
from ..joints import LIMBS, PARENTS
from . import geometry as g
from . import shipping
from ..fitting import device
from .experiment import AS_RECORDED, Experiment, body_proportions, early_stopping, numpy_rng, table, windows

NAME = "dual-autoencoder"

FRAMES = 64
JOINTS = 21
FEATURES = JOINTS * 3
# (child, parent), the order of every list of bones here.
BONES = tuple((joint, int(PARENTS[joint])) for joint in range(1, JOINTS))
# What a gap of the synthetic noise takes away.
GAPS = tuple(tuple(joint for joint in limb if joint < JOINTS) for limb in LIMBS.values())
LSTM = 96
DENSE = 96
HIDDEN = 128
KERNEL = 9
DROPOUT = 0.2


class Scaled(nn.Module):
    """A network that works on z-scores of the features it is given and gives."""

    def __init__(self, scores):
        super().__init__()
        mean, spread = scores if scores is not None else (torch.zeros(FEATURES), torch.ones(FEATURES))
        self.register_buffer("mean", mean)
        self.register_buffer("spread", spread)

    def scored(self, x):
        return (x - self.mean) / self.spread

    def unscored(self, z):
        return z * self.spread + self.mean


class Recurrent(Scaled):
    """BRA: dense, dense, bidirectional LSTM; bidirectional LSTM, dense, dense. `[N, T, 63]` to the same."""

    def __init__(self, scores=None, features=FEATURES, dense=DENSE, lstm=LSTM):
        super().__init__(scores)
        self.enter = nn.Sequential(nn.Linear(features, dense), nn.ReLU(), nn.Dropout(DROPOUT), nn.Linear(dense, dense), nn.ReLU())
        self.encode = nn.LSTM(dense, lstm, batch_first=True, bidirectional=True)
        self.between = nn.Dropout(DROPOUT)
        self.decode = nn.LSTM(2 * lstm, lstm, batch_first=True, bidirectional=True)
        self.leave = nn.Sequential(nn.Linear(2 * lstm, dense), nn.ReLU(), nn.Dropout(DROPOUT), nn.Linear(dense, features))

    def forward(self, x):
        hidden, _ = self.encode(self.enter(self.scored(x)))
        told, _ = self.decode(self.between(hidden))
        return self.unscored(self.leave(told))


class Convolutional(Scaled):
    """CAE: one convolution over time, halved, and back. `[N, T, 63]` to the same."""

    def __init__(self, scores=None, features=FEATURES, hidden=HIDDEN, kernel=KERNEL):
        super().__init__(scores)
        self.drop = nn.Dropout(DROPOUT)
        self.conv = nn.Conv1d(features, hidden, kernel, padding=kernel // 2)
        self.back = nn.ConvTranspose1d(hidden, features, kernel + 1, stride=2, padding=kernel // 2)

    def encode(self, x):
        """The hidden units, `[N, hidden, T / 2]`."""
        return torch.max_pool1d(torch.relu(self.conv(self.drop(self.scored(x)).transpose(1, 2))), 2)

    def forward(self, x):
        return self.unscored(self.back(self.encode(x)).transpose(1, 2))


class Chain(nn.Module):
    """One after the other: the dual auto-encoder, and BRA-P with the perceptual one after it."""

    def __init__(self, first, then):
        super().__init__()
        self.first = first
        self.then = then

    def forward(self, x):
        return self.then(self.first(x))


# --- what the network sees --------------------------------------------------------------------------------------------


def told(pose, seen, proportions, usual):
    """A window `[N, T, 25, 3]` as the network sees it: points `[N, T, 21, 3]`, and the way back (frame `[N, 1, 3, 3]`,
    the window's middle `[N, 1, 3]`, size `[N, 1]`). Joints that were not `seen` are zero."""
    size = g.scale_of(pose, seen, BONES, proportions, usual).mean(-1, keepdim=True)
    pelvis = pose[..., g.SPINE_BASE, :]
    middle = pelvis.mean(1, keepdim=True) * torch.tensor((1.0, 1.0, 0.0))
    frame = g.upright_frame(g.leftward(pose, seen).mean(1, keepdim=True))
    root = g.into(frame, middle, pelvis.unsqueeze(-2))
    body = g.into(frame, pelvis, pose[..., 1:JOINTS, :]) * seen[..., 1:JOINTS].unsqueeze(-1)
    points = torch.cat([root, body], -2) / size.unsqueeze(-1).unsqueeze(-1)
    return points, (frame, middle, size)


def untold(points, pelvis, back):
    """Room positions `[N, T, 21, 3]` of what the network says, from the pelvis `[N, T, 3]` in the room."""
    frame, _, size = back
    body = g.out_of(frame, pelvis, points[..., 1:, :] * size.unsqueeze(-1).unsqueeze(-1))
    return torch.cat([pelvis.unsqueeze(-2), body], -2)


# --- losses and measures ----------------------------------------------------------------------------------------------


def bone_lengths(points):
    """Lengths `[..., 20]` of [BONES] of points `[..., 21, 3]` from their pelvis; the pelvis' own column does not count."""
    joints = torch.cat([points[..., :1, :] * 0.0, points[..., 1:, :]], -2)
    child, parent = [c for c, _ in BONES], [p for _, p in BONES]
    return g.length(joints[..., child, :] - joints[..., parent, :])


def measures(out, truth, size):
    """Position, bone length and smoothness error, metres (the last per frame squared); `[N, T, 21, 3]`, `size` `[N, 1]`.

    Position: mean distance. Bone length: mean absolute difference. Smoothness: mean difference of accelerations.
    """
    each = size.unsqueeze(-1)
    position = (g.length(out - truth) * each).mean()
    bone = ((bone_lengths(out) - bone_lengths(truth)).abs() * each).mean()
    bend = second(out) - second(truth)
    return position, bone, (g.length(bend) * each).mean()


def second(points):
    """Second differences over time, `[N, T - 2, 21, 3]`."""
    return points[:, 2:] - 2.0 * points[:, 1:-1] + points[:, :-2]


def loss(out, truth, perceptual=None):
    """Position, bone length and smoothness as squares, and the hidden units' difference where a `perceptual`
    auto-encoder is given. `[N, T, 21, 3]`, size one."""
    position = (out - truth).square().sum(-1).mean()
    bone = (bone_lengths(out) - bone_lengths(truth)).square().mean()
    smooth = (second(out) - second(truth)).square().sum(-1).mean()
    total = position + 0.5 * bone + 2.0 * smooth
    if perceptual is not None:
        seen, meant = perceptual.encode(out.flatten(-2)), perceptual.encode(truth.flatten(-2))
        total = total + 0.1 * (seen - meant).square().mean()
    return total


def synthetic_noise(points, generator, rate_hz=30.0):
    """Windows as a bad tracker tells them: every joint shakes, by up to 0.1 sizes; gaps of a limb of 0.1 to 2 s are zero."""
    n, frames = points.shape[:2]
    amount = torch.rand((n, 1, 1, 1), generator=generator) * 0.1
    shaken = points + torch.randn(points.shape, generator=generator) * amount
    time = torch.arange(frames)
    shown = torch.ones(points.shape[:3])
    for _ in range(2):
        long = (rate_hz * 0.1 * 20.0 ** torch.rand((n, 1), generator=generator)).round()
        begin = torch.rand((n, 1), generator=generator) * (frames + long) - long
        gone = ((time >= begin) & (time < begin + long)).float()
        limb = torch.randint(len(GAPS), (n,), generator=generator)
        for number, joints in enumerate(GAPS):
            own = gone * (limb == number).float().unsqueeze(1)
            shown[:, :, list(joints)] *= 1.0 - own.unsqueeze(-1)
    return shaken * shown.unsqueeze(-1)


# --- the paper's experiment -------------------------------------------------------------------------------------------

GAIN = {"CAE": 33.1, "BRA": 25.5, "BRA-P": 12.2}
"""Per cent by which the dual auto-encoder was better than each, on synthetic noise, over the three measures."""
BATCH, BATCHES, EPOCHS = 32, 20, 60


def body(run: Experiment):
    """Proportions and usual size of the training recordings' people."""
    return body_proportions(run.train, BONES)


def train(run: Experiment, what, model, shape, noisy=True, perceptual=None):
    """One of the networks. A perceptual auto-encoder is taught on clean motion, all others to undo noise."""
    source = Source([(run.teaching(), 1.0)])
    seen = torch.ones(1, FRAMES, 25)

    place = device()

    def answered(model, points, generator=None):
        given = synthetic_noise(points, generator) if noisy else points
        return model(given.flatten(-2).to(place)).view(points.shape)

    def losses(model):
        points, _ = told(torch.from_numpy(source.draw(numpy_rng(), BATCH, FRAMES, AS_RECORDED)), seen, *shape)
        return loss(answered(model, points), points.to(place), perceptual)

    checked, _ = told(windows(run.validating(), FRAMES, 32), seen, *shape)

    def score(model):
        return loss(answered(model, checked, torch.Generator().manual_seed(7)), checked.to(place)).item()

    return run.fit(what, model, losses, score, early_stopping(BATCHES, epochs=EPOCHS, rate=2e-3, averaging=0.99))


def scores_of(run: Experiment, shape):
    """Mean and deviation of each feature over the windows that teach."""
    points, _ = told(windows(run.teaching(), FRAMES, 16), torch.ones(1, FRAMES, 25), *shape)
    flat = points.flatten(-2).flatten(0, 1)
    return flat.mean(0), flat.std(0).clamp(min=0.02)


def networks(run: Experiment, shape, wanted=("CAE", "BRA", "BRA-P", "dual")):
    """Those that are compared, taught."""
    scores = scores_of(run, shape)
    perceptual = train(run, "perceptual", Convolutional(scores), shape, noisy=False)
    perceptual.requires_grad_(False).to(device())
    models = {}
    if "CAE" in wanted:
        models["CAE"] = train(run, "cae", Convolutional(scores), shape)
    if "BRA" in wanted:
        models["BRA"] = train(run, "bra", Recurrent(scores), shape)
    if "BRA-P" in wanted:
        models["BRA-P"] = Chain(train(run, "bra-p", Recurrent(scores), shape, perceptual=perceptual), perceptual)
    if "dual" in wanted:
        chain = Chain(Recurrent(scores), Convolutional(scores))
        models["dual"] = train(run, "dual", chain, shape, perceptual=perceptual)
    perceptual.cpu()
    return models


def experiment(run: Experiment) -> str:
    """The three measures of the four networks on synthetic noise, and by how much the dual one is better."""
    shape = body(run)
    models = networks(run, shape)
    parts = []
    for split, prepared in run.tests().items():
        figures = {what: tested(model, prepared, shape) for what, model in models.items()}
        rows = []
        for what, own in figures.items():
            gains = [100.0 * (1.0 - best / value) for best, value in zip(figures["dual"], own)]
            against = ["", "", ""] if what == "dual" else [f"{sum(gains) / 3:.1f}", "/".join(f"{x:.1f}" for x in gains), GAIN[what]]
            rows.append([what, *(f"{1000.0 * value:.2f}" for value in own), *against])
            run.note(f"{split}: {what}", dict(zip(("position_mm", "bone_mm", "smoothness_mm"), (1000.0 * value for value in own))))
        header = ["network", "position, mm", "bone length, mm", "smoothness, mm/frame^2", "dual better by, %", "by measure, %", "published, %"]
        parts.append(f"Synthetic noise, {split} recordings\n\n" + table(header, rows))
    return "\n\n".join(parts)


@torch.no_grad()
def tested(model, prepared, shape):
    """[measures] on all windows of recordings."""
    points, (_, _, size) = told(windows(prepared, FRAMES, 16), torch.ones(1, FRAMES, 25), *shape)
    noisy = synthetic_noise(points, torch.Generator().manual_seed(8))
    return tuple(value.item() for value in measures(model(noisy.flatten(-2)).view_as(points), points, size))


# --- what ships -------------------------------------------------------------------------------------------------------

KIND, BEFORE, AFTER = "offline", FRAMES // 2 - 1, FRAMES // 2
ABOUT = {
    "summary": "Dual auto-encoder: a bidirectional recurrent one for place, a convolutional one for smoothness, over two seconds.",
    "source": "Li, Zhu, Wang and Liu, Dual auto-encoder network for human skeleton motion data optimisation, 2022",
}


class Fills(nn.Module):
    """21 joints by the network, hand tips and thumbs with the hands."""

    def __init__(self, model, shape, tip, thumb):
        super().__init__()
        self.model = model
        self.register_buffer("proportions", shape[0])
        self.register_buffer("usual", shape[1])
        self.tip, self.thumb = tip, thumb

    def forward(self, pose, mask, age):
        seen = (mask > 0.0).to(pose.dtype)
        points, back = told(pose, seen, self.proportions, self.usual)
        out = self.model(points.flatten(-2)).reshape(-1, FRAMES, JOINTS, 3)
        room = untold(out, pose[..., g.SPINE_BASE, :], back)
        say = mask[..., :JOINTS].unsqueeze(-1)
        known = say * pose[..., :JOINTS, :] + (1.0 - say) * room
        return g.follow_hands(torch.cat([known, pose[..., JOINTS:, :]], -2), self.tip, self.thumb)


def ship(run: Experiment, out) -> None:
    """Writes the model that ships."""
    shape = body(run)
    model = networks(run, shape, ("dual",))["dual"].requires_grad_(False)
    figures = {
        f"{split}_{name}".replace(" ", "_"): round(value, 2)
        for split in run.tests()
        for name, value in run.noted(f"{split}: dual").items()
    }
    shipping.ship(Fills(model, shape, *g.hand_ratios(run.train.poses)), sys.modules[__name__], run, out, figures)
