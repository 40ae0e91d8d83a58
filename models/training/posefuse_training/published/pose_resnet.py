"""Pose ResNet: one pose in, one pose out, a residual block wide enough to remember poses.

After D. Holden, "Robust solving of optical motion capture data by denoising" (ACM Trans. Graph. 2018), in the form that
Goncalves gave it for several Kinects: 16 joints, each with position and rotation (112 features) told in the waist's frame,
divided by the mean bone length, the bones' axes aligned, z-scored; one residual block of 1000 ReLU units; mean absolute
error; Adam, batches of 512, stopped when 20 epochs brought nothing; then a Savitzky-Golay filter over the sequence.

Our skeletons carry positions, so the rotations are derived from them: a bone's direction, and the bend plane of its limb
for the twist. The exported graph does that, too. What it cannot know is how a joint moved: it sees a single pose.
"""

import sys
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from ..corrupt import hidden_joints
from ..fitting import device
from ..recordings import Prepared
from . import geometry as g
from . import shipping
from .experiment import Experiment, body_proportions, early_stopping, in_mirror, numpy_rng, savitzky_golay, table
from .pose_features import BONES, FEATURES, JOINTS, PARENT, features, to_waist

NAME = "pose-resnet"

WIDTH = 1000


class PoseResNet(nn.Module):
    """112 features to 112: a dense layer, one residual block of 1000 ReLU units, a dense layer."""

    def __init__(self, width=WIDTH):
        super().__init__()
        self.widen = nn.Linear(FEATURES, width)
        self.block = nn.Linear(width, width)
        self.narrow = nn.Linear(width, FEATURES)
        for layer in (self.widen, self.block, self.narrow):
            nn.init.xavier_uniform_(layer.weight)
            nn.init.zeros_(layer.bias)

    def forward(self, z):
        h = torch.relu(self.widen(z))
        h = h + torch.relu(self.block(h))
        return self.narrow(h)


# --- his corruption ---------------------------------------------------------------------------------------------------


@dataclass
class Rates:
    """How hard [corrupt] hits: the share of poses that suffer, and sigmas of the chances per joint and per feature.
    A shift is at most `amount` standard deviations (`spread` `[112]`) of its feature."""

    spread: torch.Tensor
    poses: float = 0.5
    occlusion: float = 0.1
    shift: float = 0.1
    amount: float = 1.0


def corrupt(x, occlusion, shift, generator, rates):
    """Features `x` `[N, 112]` (not yet z-scored) as a bad tracker would tell them.

    A Bernoulli trial picks the poses that suffer. In such a pose each joint is occluded, and each feature shifted, with
    chances drawn anew for the pose (the absolute value of a normal, as Holden has it). An occluded joint is zero and its
    parent's rotation, which led to it, is the identity.
    """
    n = len(x)

    def uniform(*shape):
        return torch.rand(shape, generator=generator)

    def chance(sigma):
        return torch.randn((n, 1), generator=generator).mul(sigma).abs().clamp(max=2.0 * sigma)

    suffers = (uniform(n, 1) < rates.poses).float()
    out = x
    if shift:
        hit = (uniform(n, FEATURES) < chance(rates.shift)).float() * suffers
        out = out + hit * (uniform(n, FEATURES) * 2.0 - 1.0) * rates.amount * rates.spread
    if occlusion:
        gone = (uniform(n, len(JOINTS)) < chance(rates.occlusion)).float() * suffers
        gone[:, 0] = 0.0
        out = hide(out, gone)
    return out


def hide(x, gone):
    """`x` `[N, 112]` with the joints that are `gone` `[N, 16]` occluded."""
    y = x.view(len(x), len(JOINTS), 7)
    identity = torch.tensor((1.0, 0.0, 0.0, 0.0))
    lost = torch.zeros_like(gone)
    for j in range(1, len(JOINTS)):
        parent = PARENT[j]
        lost[:, parent] = torch.maximum(lost[:, parent], gone[:, j])
    place = y[..., :3] * (1.0 - gone).unsqueeze(-1)
    turn = y[..., 3:] * (1.0 - lost).unsqueeze(-1) + identity * lost.unsqueeze(-1)
    return torch.cat([place, turn], -1).flatten(-2)


# --- his experiment ---------------------------------------------------------------------------------------------------

KINDS = {"occlusion + shift": (True, True), "occlusion": (True, False), "shift": (False, True)}
# His figures: how far off the corrupted poses are, his best network, and that after the filter.
HIS = {"occlusion + shift": (0.0724, 0.0383, 0.0289), "occlusion": (0.0618, 0.0239, 0.0218), "shift": (0.0127, 0.0225, 0.0172)}
FILTERS = ((29, 4), (7, 4))
BATCH, BATCHES = 512, 64


class Norm:
    """The z-score. Deviations are at least half their kind's mean: a joint that hardly moves against the waist would count
    a hundredfold else, once it is zero."""

    def __init__(self, x):
        self.mean = x.mean(0)
        spread = x.std(0).view(len(JOINTS), 7)
        place, turn = spread[:, :3], spread[:, 3:]
        floored = [torch.maximum(part, part.mean() / 2.0) for part in (place, turn)]
        self.spread = torch.cat(floored, -1).flatten()

    def __call__(self, x):
        return (x - self.mean) / self.spread


def read(prepared: Prepared, proportions, usual, chosen=None):
    """Features `[N, 112]` of recordings, span by span (those whose numbers are `chosen`, or all)."""
    out = []
    for number, (_, poses) in enumerate(prepared.spans()):
        if chosen is None or number in chosen:
            pose = torch.from_numpy(poses)
            points, _, _ = to_waist(pose, torch.ones(pose.shape[:2]), proportions, usual)
            out.append(features(points, torch.ones(points.shape[:2])))
    return out


def calibrated(x, norm):
    """Rates at which poses `x` come to be as far off as his: the shares by the occluded ones, the amount by the shifted."""
    rates = Rates(norm.spread)

    def off(occlusion, shift):
        bad = corrupt(x, occlusion, shift, torch.Generator().manual_seed(2), rates)
        return (norm(bad) - norm(x)).abs().mean().item()

    for _ in range(4):
        rates.occlusion *= HIS["occlusion"][0] / off(True, False)
        rates.amount *= HIS["shift"][0] / off(False, True)
    return rates


def train(run: Experiment, what, norm, teach, check, rates):
    """A network taught on one kind of corruption."""
    occlusion, shift = KINDS[what]
    checked = torch.cat(check)
    bad, truth = norm(corrupt(checked, occlusion, shift, torch.Generator().manual_seed(3), rates)), norm(checked)
    place = device()

    def losses(model):
        x = teach[torch.randint(len(teach), (BATCH,))]
        return (model(norm(corrupt(x, occlusion, shift, None, rates)).to(place)) - norm(x).to(place)).abs().mean()

    def score(model):
        return (model(bad.to(place)) - truth.to(place)).abs().mean().item()

    return run.fit(what.replace(" + ", "-"), PoseResNet(), losses, score, early_stopping(BATCHES))


@torch.no_grad()
def tested(model, norm, spans, kind, rates):
    """Mean absolute errors in z-scores on one kind of corruption: corrupted, told by the network, and filtered."""
    generator = torch.Generator().manual_seed(4)
    off = {"corrupted": [], "network": [], **{f"filter {w}/{o}": [] for w, o in FILTERS}}
    for x in spans:
        bad, truth = norm(corrupt(x, *KINDS[kind], generator, rates)), norm(x)
        out = model(bad)
        off["corrupted"].append((bad - truth).abs().mean(1))
        off["network"].append((out - truth).abs().mean(1))
        for window, order in FILTERS:
            smooth = torch.from_numpy(savitzky_golay(out.numpy(), window, order))
            off[f"filter {window}/{order}"].append((smooth - truth).abs().mean(1))
    return {name: torch.cat(parts).mean().item() for name, parts in off.items()}


def body(run: Experiment):
    """Proportions and usual size of the training recordings' people."""
    return body_proportions(run.train, BONES)


def prepared_features(run: Experiment):
    """What all networks share: body shape, z-score, features that teach and that check, rates of corruption."""
    shape = body(run)
    teach, check = read(run.teaching(), *shape), read(run.validating(), *shape)
    teach = torch.cat(teach + read(in_mirror(run.teaching()), *shape))
    norm = Norm(teach)
    return shape, norm, teach, check, calibrated(teach[::7], norm)


def experiment(run: Experiment) -> str:
    """His table: taught on each corruption, tested on each, with and without the filter."""
    shape, norm, teach, check, rates = prepared_features(run)
    models = {what: train(run, what, norm, teach, check, rates) for what in KINDS}
    lines = []
    for split, prepared in run.tests().items():
        spans = read(prepared, *shape)
        rows = []
        for kind, his in HIS.items():
            for what, model in models.items():
                off = tested(model, norm, spans, kind, rates)
                rows.append([kind, what, *(f"{value:.4f}" for value in off.values()), "/".join(f"{h:.4f}" for h in his)])
                run.note(f"{split}: {what} on {kind}", off)
        header = ["tested on", "taught on", "corrupted", "network", *(f"filter {w}/{o}" for w, o in FILTERS), "his: corrupt/best/filtered"]
        lines.append(f"Mean absolute error of 112 z-scored features, {split} recordings\n\n" + table(header, rows))
    return "\n\n".join(lines)


# --- what ships -------------------------------------------------------------------------------------------------------

KIND, BEFORE, AFTER = "live", 0, 0
ABOUT = {
    "summary": "Pose ResNet: one pose to one pose, a residual block of 1000 units; knows no time.",
    "source": "Goncalves, multi-Kinect motion capture, after D. Holden, Robust solving of optical motion capture data by denoising, 2018",
}


class Fills(nn.Module):
    """All 25 joints by the network; those it does not have go with those it has."""

    def __init__(self, model, norm, shape, extras):
        super().__init__()
        self.model = model
        self.register_buffer("mean", norm.mean)
        self.register_buffer("spread", norm.spread)
        self.register_buffer("proportions", shape[0])
        self.register_buffer("usual", shape[1])
        self.extras = extras

    def forward(self, pose, mask, age):
        seen = (mask > 0.0).to(pose.dtype)
        points, frame, size = to_waist(pose, seen, self.proportions, self.usual)
        z = (features(points, seen[..., list(JOINTS)]) - self.mean) / self.spread
        x = self.model(z) * self.spread + self.mean
        place = torch.stack([x[..., 7 * j : 7 * j + 3] for j in range(len(JOINTS))], -2)
        told = g.out_of(frame, pose[..., g.SPINE_BASE, :], place * size.unsqueeze(-1).unsqueeze(-1))
        # Measured joints carry what hangs on them.
        say = mask[..., list(JOINTS)].unsqueeze(-1)
        known = say * pose[..., list(JOINTS), :] + (1.0 - say) * told
        return whole(known, told, self.extras)


def whole(known, told, extras):
    """25 joints `[..., 25, 3]` from the 16: neck between chest and head, hands along the forearm, feet across the shin."""
    by = {joint: told[..., at, :] for at, joint in enumerate(JOINTS)}
    at = {joint: known[..., place, :] for place, joint in enumerate(JOINTS)}
    by[g.NECK] = at[g.SPINE_SHOULDER] + extras["neck"] * (at[g.HEAD] - at[g.SPINE_SHOULDER])
    across = g.unit(at[g.HIP_LEFT] - at[g.HIP_RIGHT])
    for elbow, wrist, hand, tip, thumb in ((5, 6, 7, 21, 22), (9, 10, 11, 23, 24)):
        along = at[wrist] - at[elbow]
        for joint, ratio in ((hand, "hand"), (tip, "tip"), (thumb, "thumb")):
            by[joint] = at[wrist] + extras[ratio] * along
    for knee, ankle, foot in ((13, 14, 15), (17, 18, 19)):
        shin = at[ankle] - at[knee]
        by[foot] = at[ankle] + extras["sole"] * shin + extras["toes"] * g.cross(shin, across)
    return torch.stack([by[joint] for joint in range(25)], -2)


def measured_extras(prepared: Prepared):
    """Where the other joints are, on average, against the 16: least squares, each as [whole] uses it."""
    p = torch.from_numpy(prepared.poses)

    def share(of, *along):
        columns = torch.stack([v.flatten() for v in along], 1)
        return [float(x) for x in torch.linalg.lstsq(columns, of.flatten().unsqueeze(1)).solution[:, 0]]

    forearm, shin = p[:, 6] - p[:, 5], p[:, 14] - p[:, 13]
    across = g.unit(p[:, g.HIP_LEFT] - p[:, g.HIP_RIGHT])
    sole, toes = share(p[:, 15] - p[:, 14], shin, g.cross(shin, across))
    return {
        "neck": share(p[:, 2] - p[:, 20], p[:, 3] - p[:, 20])[0],
        "hand": share(p[:, 7] - p[:, 6], forearm)[0],
        "tip": share(p[:, 21] - p[:, 6], forearm)[0],
        "thumb": share(p[:, 22] - p[:, 6], forearm)[0],
        "sole": sole,
        "toes": toes,
    }


def train_for_rooms(run: Experiment, start, norm, shape):
    """The network that ships: it goes on from the one taught on occlusion and shift, with whole limbs hidden as in a room
    and rotations derived from what is left, in the frame that what is left gives."""
    teach = torch.from_numpy(np.concatenate([run.teaching().poses, in_mirror(run.teaching()).poses]))
    check = torch.from_numpy(run.validating().poses[::5].copy())
    place = device()

    def lesson(pose, rng):
        seen = torch.from_numpy(1.0 - hidden_joints(rng, len(pose)).astype(np.float32))
        points, _, _ = to_waist(pose, seen, *shape)
        some = seen[:, list(JOINTS)]
        return norm(features(points, some)).to(place), norm(features(points, torch.ones_like(some))).to(place)

    checked = lesson(check, np.random.default_rng(11))

    def losses(model):
        given, wanted = lesson(teach[torch.randint(len(teach), (BATCH,))], numpy_rng())
        return (model(given) - wanted).abs().mean()

    def score(model):
        return (model(checked[0]) - checked[1]).abs().mean().item()

    model = PoseResNet()
    model.load_state_dict(start.state_dict())
    return run.fit("rooms", model, losses, score, early_stopping(BATCHES))


def ship(run: Experiment, out) -> None:
    """Trains and writes the model that ships."""
    shape, norm, teach, check, rates = prepared_features(run)
    start = train(run, "occlusion + shift", norm, teach, check, rates)
    model = train_for_rooms(run, start, norm, shape)
    figures = {
        f"{split}_{kind}_mae_zscore".replace(" + ", "_").replace(" ", "_"): round(run.noted(f"{split}: {kind} on {kind}")["network"], 4)
        for split in run.tests()
        for kind in KINDS
    }
    shipping.ship(Fills(model, norm, shape, measured_extras(run.train)), sys.modules[__name__], run, out, figures)
