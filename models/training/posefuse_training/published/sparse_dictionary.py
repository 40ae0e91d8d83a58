"""Sparse dictionary with bone lengths: six poses as a sum of few remembered movements, whose bones cannot stretch.

After Wang, Lu and Han, "Recovery of distorted motion capture data with a bone constraint" (Computer Systems &
Applications 2018). A skeleton is told by the differences along its bones, divided by the bones' lengths, then squared with the
sign kept: of such a triple the absolute values add up to one, so that a bone's length is a linear constraint. The body
has five parts; three at a time share a dictionary, and a part's answers are averaged. A window of six poses is coded over 1000
atoms by proximal gradient: half the squared distance to what was measured, plus `LAMBDA_SPARSE` times the code's
absolute sum, plus half `LAMBDA_BONE` times the squared excess of the bones' length. Positions follow from bones, from the
trunk outward; where a joint further out was measured, the chain is pulled to it without stretching.

How the five parts are joined is not told; here the trunk is in every triple, with two of the four limbs. Bones are told in
the person's own heading.
"""

import sys

import numpy as np
import torch
from torch import nn

from ..fitting import Schedule, device
from ..recordings import Prepared
from . import geometry as g
from . import shipping
from .bone_code import (
    BONES,
    CHILDREN,
    FEATURES,
    IN_TRIPLE,
    JOINTS,
    LAMBDA_BONE,
    OTHER,
    PARENTS,
    PARTS,
    TRIPLES,
    WINDOW,
    bones_of,
    code,
    placed,
    recovered,
    signed_squares,
    split,
    strides,
)
from .experiment import Experiment, body_proportions, in_mirror, table, windows
from .matrix_completion import completed

NAME = "sparse-dictionary"

ATOMS = 1000


class Dictionary(nn.Module):
    """Six dictionaries: a mean `[6, 1, 216]` and atoms no longer than one `[6, 216, atoms]`, which begin as windows of
    motion (`examples` `[6, N, 216]`) without it."""

    def __init__(self, atoms=ATOMS, examples=None):
        super().__init__()
        examples = torch.randn(len(TRIPLES), atoms, FEATURES) if examples is None else examples
        mean = examples.mean(1, keepdim=True)
        self.register_buffer("mean", mean)
        self.atoms = nn.Parameter(g.unit(examples[:, :atoms] - mean).transpose(1, 2).contiguous())

    @torch.no_grad()
    def normalise(self):
        """Atoms longer than one are cut back to it."""
        self.atoms /= torch.sqrt(self.atoms.square().sum(1, keepdim=True)).clamp(min=1.0)


# --- the paper's experiment -------------------------------------------------------------------------------------------

BATCH, STEPS, CODING = 128, 80, 30
TEST_STEPS = 40
MISSING_FRAMES = 0.4
MARKERS = (3, 6)
PUBLISHED_BONE_CM = 1e-4


def own_heading(pose, seen):
    """Windows `[N, 6, J, 3]` turned so that the person faces forward in the last pose, and that frame."""
    frame = g.upright_frame(g.leftward(pose[:, -1:], seen[:, -1:]))
    return torch.matmul(pose, frame.transpose(-1, -2)), frame


def motion(prepared: Prepared, stride):
    """Directions of bones `[N, 6, 20, 3]` of all windows of recordings."""
    pose = windows(prepared, WINDOW, stride)
    turned, _ = own_heading(pose, torch.ones(pose.shape[:3]))
    return bones_of(turned)[0]


def train(run: Experiment, what, atoms):
    """Dictionaries of so many atoms: code a batch, then go down the slope of what is left, bones' lengths included."""
    teach = torch.cat([motion(run.teaching(), 3), motion(in_mirror(run.teaching()), 3)])
    vectors = split(signed_squares(teach))
    order = torch.randperm(vectors.shape[1], generator=torch.Generator().manual_seed(9))
    checked = split(signed_squares(motion(run.validating(), 40)))
    place = device()

    def left(model, x, steps):
        """The objective without the code's part."""
        model.normalise()
        with torch.no_grad():
            alpha = code(x, torch.ones_like(x), model.atoms, model.mean, steps, strides(model.atoms))
        y = model.mean + torch.matmul(alpha, model.atoms.transpose(1, 2))
        excess = y.reshape(len(y), -1, WINDOW * IN_TRIPLE, 3).abs().sum(-1) - 1.0
        return 0.5 * ((y - x).square().sum(-1) + LAMBDA_BONE * excess.square().sum(-1)).mean()

    def losses(model):
        return left(model, vectors[:, torch.randint(vectors.shape[1], (BATCH,))].to(place), CODING)

    def score(model):
        return left(model, checked.to(place), CODING).item()

    schedule = Schedule(steps=STEPS, rate=2e-3, weight_decay=0.0, warm_up=10, averaging=0.9, check_every=20, patience=4, adam_w=False)
    return run.fit(what, Dictionary(atoms, vectors[:, order]), losses, score, schedule)


def neighbours(rng, count):
    """`count` joints that hang together, the pelvis and the chest not among them."""
    tree = {joint: set() for joint in range(JOINTS)}
    for child, parent in BONES:
        tree[child].add(parent)
        tree[parent].add(child)
    limbs = [j for part in PARTS[1:] for j in part]
    chosen = {int(rng.choice(limbs))}
    while len(chosen) < count:
        edge = sorted({n for j in chosen for n in tree[j]} - chosen - {g.SPINE_BASE, g.SPINE_SHOULDER})
        if not edge:
            # A whole limb is gone: the next one begins beside it.
            edge = [j for j in limbs if j not in chosen]
        chosen.add(int(rng.choice(edge)))
    return sorted(chosen)


def gap(rng, frames, joints):
    """`[T, 25]` with `joints` missing in 40 % of the frames, one after another."""
    known = torch.ones(frames, 25)
    long = round(MISSING_FRAMES * frames)
    start = int(rng.integers(1, frames - long))
    known[start : start + long, joints] = 0.0
    return known


@torch.no_grad()
def by_dictionary(model, poses, known, lengths):
    """A clip `[T, 25, 3]` repaired, six frames at a time: positions `[T, 21, 3]`."""
    frames = len(poses)
    starts = sorted({*range(0, frames - WINDOW + 1, WINDOW), frames - WINDOW})
    starts = [start for start in starts if known[start : start + WINDOW].min() < 1.0]
    pose = torch.stack([poses[s : s + WINDOW] for s in starts])
    seen = torch.stack([known[s : s + WINDOW] for s in starts])
    turned, frame = own_heading(pose, seen)
    bones, _ = bones_of(turned)
    both = seen[..., list(CHILDREN)] * seen[..., list(PARENTS)]
    along = torch.matmul(recovered(bones, both, model.atoms, model.mean, TEST_STEPS, strides(model.atoms)), frame)
    out = poses[:, :JOINTS].clone()
    whole = placed(pose, seen, along, lengths.expand(*pose.shape[:2], -1), rounds=60)
    for start, repaired in zip(starts, whole):
        out[start : start + WINDOW] = repaired
    return out


def straight(poses, known):
    """Missing values on the line between the last known and the next, about the pelvis."""
    body = (poses - poses[:, :1]).numpy().copy()
    time = np.arange(len(body))
    for joint in range(JOINTS):
        seen = known[:, joint].numpy() > 0
        for axis in range(3):
            body[:, joint, axis] = np.interp(time, time[seen], body[seen, joint, axis])
    return torch.from_numpy(body) + poses[:, :1]


def errors(out, poses, known, lengths):
    """RMSE over missing coordinates and mean error of lengths of bones that a missing joint has, both cm."""
    gone = known[:, :JOINTS] < 0.5
    off = (out[:, :JOINTS] - poses[:, :JOINTS])[gone]
    touched = gone[:, list(CHILDREN)] | gone[:, list(PARENTS)]
    bone = (bones_of(out)[1] - lengths).abs()[touched]
    return off.square().sum().item(), off.numel(), bone.sum().item(), bone.numel()


def experiment(run: Experiment) -> str:
    """The paper's measures, beside matrix completion and straight lines."""
    model = train(run, "dictionary", ATOMS)
    parts = []
    for split_name, prepared in run.tests().items():
        rows = []
        for count in MARKERS:
            sums = {"dictionary": np.zeros(4), "matrix completion": np.zeros(4), "straight lines": np.zeros(4)}
            rng = np.random.default_rng(count)
            for _, span in prepared.spans():
                poses = torch.from_numpy(span)
                known = gap(rng, len(poses), neighbours(rng, count))
                lengths = bones_of(poses)[1].median(0).values
                body = poses[:, :JOINTS] - poses[:, :1]
                answers = {
                    "dictionary": by_dictionary(model, poses * known.unsqueeze(-1) + poses[:, :1] * (1 - known).unsqueeze(-1), known, lengths),
                    "matrix completion": completed(body, known[:, :JOINTS]) + poses[:, :1],
                    "straight lines": straight(poses, known),
                }
                for name, out in answers.items():
                    sums[name] += errors(out, poses, known, lengths)
            for name, (square, n, bone, m) in sums.items():
                rmse, length = 100.0 * (square / n) ** 0.5, 100.0 * bone / m
                run.note(f"{split_name}: {name}, {count} markers", {"rmse_cm": rmse, "bone_cm": length})
                rows.append([count, name, f"{rmse:.2f}", f"{length:.1e}", f"{PUBLISHED_BONE_CM:.0e}" if name == "dictionary" else ""])
        header = ["markers missing in 40 % of frames", "method", "RMSE, cm", "bone length error, cm", "published bone error, cm"]
        parts.append(f"{split_name} recordings\n\n" + table(header, rows))
    return "\n\n".join(parts)


# --- what ships -------------------------------------------------------------------------------------------------------

KIND, BEFORE, AFTER = "live", WINDOW - 1, 0
ABOUT = {
    "summary": "Sparse dictionary with bone lengths: six poses coded over 300 atoms for each three parts of the body, bones keep their lengths.",
    "source": "Wang, Lu and Han, Recovery of distorted motion capture data with a bone constraint, 2018",
}
SHIPPED_ATOMS, SHIPPED_STEPS, SHIPPED_ROUNDS = 300, 24, 2
"""A thousand atoms would be 2.6 MB in half precision and take three times as long; steps are unrolled in the graph."""


class Fills(nn.Module):
    """The newest pose: bones by the dictionary, lengths by what was measured of them, positions outward."""

    def __init__(self, model, shape, tip, thumb):
        super().__init__()
        self.atoms = nn.Parameter(model.atoms.detach().half().float(), requires_grad=False)
        self.register_buffer("mean", model.mean)
        self.register_buffer("stride", strides(self.atoms))
        self.register_buffer("proportions", shape[0])
        self.register_buffer("usual", shape[1])
        self.tip, self.thumb = tip, thumb

    def forward(self, pose, mask, age):
        seen = (mask > 0.0).to(pose.dtype)
        turned, frame = own_heading(pose, seen)
        bones, _ = bones_of(turned)
        both = seen[..., list(CHILDREN)] * seen[..., list(PARENTS)]
        along = recovered(bones, both, self.atoms, self.mean, SHIPPED_STEPS, self.stride)[:, -1:]
        lengths = self.lengths(pose, age).unsqueeze(1)
        out = placed(pose[:, -1:], mask[:, -1:], torch.matmul(along, frame), lengths, SHIPPED_ROUNDS)
        return g.follow_hands(torch.cat([out, pose[:, -1:, JOINTS:]], -2), self.tip, self.thumb)

    def lengths(self, pose, age):
        """Lengths `[N, 20]` of the bones. Joints that were lost together still tell their bone's; the other side's bone helps,
        the usual proportions fill in."""
        child, parent = list(CHILDREN), list(PARENTS)
        _, length = bones_of(pose)
        ever = torch.clamp(9.9 - torch.maximum(age[..., child], age[..., parent]), 0.0, 0.1) * 10.0
        say = ever * torch.exp(-10.0 * (age[..., child] - age[..., parent]).abs())
        weight, total = say.sum(1), (say * length).sum(1)
        weight, total = weight + 0.2 * weight[..., list(OTHER)], total + 0.2 * total[..., list(OTHER)]
        size = (total.sum(-1, keepdim=True) + 0.05 * self.usual) / ((weight * self.proportions).sum(-1, keepdim=True) + 0.05)
        return (total + 0.1 * size * self.proportions) / (weight + 0.1)


def ship(run: Experiment, out) -> None:
    """Trains a smaller dictionary and writes the model that ships."""
    model = train(run, "shipped", SHIPPED_ATOMS)
    figures = {
        f"{split}_{count}_markers_{name}".replace(" ", "_"): float(f"{value:.3g}")
        for split in run.tests()
        for count in MARKERS
        for name, value in run.noted(f"{split}: dictionary, {count} markers").items()
    }
    shape = body_proportions(run.train, BONES)
    shipping.ship(Fills(model, shape, *g.hand_ratios(run.train.poses)), sys.modules[__name__], run, out, figures)
