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
from ..joints import PARENTS as PARENT
from ..recordings import Prepared
from . import geometry as g
from . import shipping
from .experiment import Experiment, body_proportions, in_mirror, table, windows
from .matrix_completion import completed

NAME = "sparse-dictionary"

WINDOW = 6
ATOMS = 1000
LAMBDA_SPARSE = 1e-4
LAMBDA_BONE = 0.4

JOINTS = 21
# Parts as child joints of bones; every list of 20 bones is in this order, which is also an order from the trunk outward.
PARTS = ((1, 20, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11), (12, 13, 14, 15), (16, 17, 18, 19))
CHILDREN = sum(PARTS, ())
PARENTS = tuple(int(PARENT[child]) for child in CHILDREN)
BONES = tuple(zip(CHILDREN, PARENTS))
# The other side's bone, whose length is as good as one's own.
OTHER = (0, 1, 2, 3, 8, 9, 10, 11, 4, 5, 6, 7, 16, 17, 18, 19, 12, 13, 14, 15)
TRIPLES = ((0, 1, 2), (0, 1, 3), (0, 1, 4), (0, 2, 3), (0, 2, 4), (0, 3, 4))
IN_TRIPLE = 12
FEATURES = WINDOW * IN_TRIPLE * 3
# How often each bone is coded: the trunk by all triples, a limb by three.
SHARES = tuple(sum(part in triple for triple in TRIPLES) for part in range(5) for _ in range(4))


def columns(triple):
    """Places in the list of 20 bones that a triple of parts holds."""
    return [4 * part + k for part in triple for k in range(4)]


def signed_squares(directions):
    """Unit vectors `[..., 3]` with each part squared, its sign kept."""
    return directions * directions.abs()


def directions(squares):
    """The way back of [signed_squares], to length one whatever the squares add up to. Softened at zero, where a root is
    infinitely steep and two runtimes' rounding would become millimetres."""
    return g.unit(squares / torch.sqrt(torch.sqrt(squares * squares + 1e-6)))


def sign(values):
    """The sign, softened within a hundredth of zero for the same reason."""
    return values / torch.sqrt(values * values + 1e-4)


def bones_of(points):
    """Directions `[..., 20, 3]` and lengths `[..., 20]` of the bones of `points` `[..., 25 or 21, 3]`."""
    along = points[..., list(CHILDREN), :] - points[..., list(PARENTS), :]
    return g.unit(along), g.length(along)


def split(bones):
    """`[N, 6, 20, 3]` as the triples' vectors `[6 triples, N, 216]`."""
    return torch.stack([bones[:, :, columns(triple)].flatten(1) for triple in TRIPLES])


def joined(vectors):
    """The way back of [split]: each bone the mean of its triples' answers, `[N, 6, 20, 3]`."""
    total = [0.0] * 20
    for t, triple in enumerate(TRIPLES):
        part = vectors[t].reshape(-1, WINDOW, IN_TRIPLE, 3)
        for k, bone in enumerate(columns(triple)):
            total[bone] = total[bone] + part[:, :, k]
    return torch.stack([total[bone] / SHARES[bone] for bone in range(20)], 2)


def shrunk(code, by):
    """Soft threshold."""
    return torch.relu(code - by) - torch.relu(-code - by)


def objective_slope(y, x, known):
    """The slope with respect to the reconstruction `y` of the smooth part, all `[G, N, 216]`."""
    triple = y.reshape(len(y), -1, WINDOW * IN_TRIPLE, 3)
    excess = triple.abs().sum(-1, keepdim=True) - 1.0
    bone = (sign(triple) * excess).reshape(y.shape)
    return known * (y - x) + LAMBDA_BONE * bone


def code(x, known, atoms, steps, stride):
    """Codes `[G, N, K]` of vectors `x` `[G, N, 216]` where `known` (0 to 1, same shape), over `atoms` `[G, 216, K]`.

    `steps` accelerated proximal steps (Beck and Teboulle 2009) of `stride` `[G, 1, 1]`, at most one over the largest
    eigenvalue of the smooth part.
    """
    across = atoms.transpose(1, 2)
    now = torch.matmul(x * 0.0, atoms)
    ahead = now
    momentum = 1.0
    for _ in range(steps):
        slope = torch.matmul(objective_slope(torch.matmul(ahead, across), x, known), atoms)
        after = shrunk(ahead - stride * slope, stride * LAMBDA_SPARSE)
        following = (1.0 + (1.0 + 4.0 * momentum * momentum) ** 0.5) / 2.0
        ahead = after + (momentum - 1.0) / following * (after - now)
        now, momentum = after, following
    return now


def strides(atoms):
    """The largest safe stride of each dictionary, `[G, 1, 1]`."""
    top = torch.linalg.eigvalsh(torch.matmul(atoms, atoms.transpose(1, 2)))[:, -1]
    # The bone term's curvature is three at most: a triple's signs against themselves.
    return (1.0 / (top * (1.0 + 3.0 * LAMBDA_BONE))).view(-1, 1, 1)


def recovered(bones, known, atoms, steps, stride):
    """Directions `[N, 6, 20, 3]`: what the dictionaries say, of `bones` (directions) where `known` `[N, 6, 20]`."""
    x = split(signed_squares(bones))
    seen = split(known.unsqueeze(-1).expand(-1, -1, -1, 3))
    alpha = code(x, seen, atoms, steps, stride)
    return directions(joined(torch.matmul(alpha, atoms.transpose(1, 2))))


def placed(pose, seen, along, lengths, rounds=8):
    """Positions `[..., 21, 3]` of one pose: measured joints stay (`seen` `[..., 21]` from 0 to 1), others follow their
    bones (`along` `[..., 20, 3]`, `lengths` `[..., 20]`) outward; then rounds of pulling take up what is left at measured joints
    further out."""
    joints = list(pose[..., :JOINTS, :].unbind(-2))
    say = list(seen[..., :JOINTS].unsqueeze(-1).unbind(-2))
    # A hidden pelvis hangs from the chest.
    spine = along[..., 0, :] * lengths[..., 0:1] + along[..., 1, :] * lengths[..., 1:2]
    joints[0] = say[0] * joints[0] + (1.0 - say[0]) * (joints[g.SPINE_SHOULDER] - spine)
    for bone, (child, parent) in enumerate(BONES):
        guess = joints[parent] + along[..., bone, :] * lengths[..., bone : bone + 1]
        joints[child] = say[child] * joints[child] + (1.0 - say[child]) * guess
    return _pulled(torch.stack(joints, -2), seen[..., :JOINTS], lengths, rounds)


def _pulled(points, seen, lengths, rounds):
    """Moves joints that were not measured until their bones have their lengths: each bone's excess is shared by its free
    ends, outward bones first and last (position-based dynamics, Mueller et al. 2007)."""
    joints = list(points.unbind(-2))
    free = list((1.0 - seen).unsqueeze(-1).unbind(-2))
    order = list(enumerate(BONES))
    for turn in range(rounds):
        for bone, (child, parent) in order[::-1] if turn % 2 == 0 else order:
            along = joints[child] - joints[parent]
            excess = g.unit(along) * (torch.sqrt(g.dot(along, along) + g.SMALL) - lengths[..., bone : bone + 1])
            share = 1.0 / (free[child] + free[parent] + 1e-6)
            joints[child] = joints[child] - excess * free[child] * share * free[child]
            joints[parent] = joints[parent] + excess * free[parent] * share * free[parent]
    return torch.stack(joints, -2)


class Dictionary(nn.Module):
    """Six dictionaries of atoms no longer than one, `[6, 216, atoms]`; they begin as windows of motion `[6, N, 216]`."""

    def __init__(self, atoms=ATOMS, examples=None):
        super().__init__()
        start = torch.randn(len(TRIPLES), atoms, FEATURES) if examples is None else examples[:, :atoms]
        self.atoms = nn.Parameter(g.unit(start).transpose(1, 2).contiguous())

    @torch.no_grad()
    def normalise(self):
        """Atoms longer than one are cut back to it."""
        self.atoms /= torch.sqrt(self.atoms.square().sum(1, keepdim=True)).clamp(min=1.0)


# --- the paper's experiment -------------------------------------------------------------------------------------------

BATCH, STEPS, CODING = 192, 80, 30
TEST_STEPS = 200
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
            alpha = code(x, torch.ones_like(x), model.atoms, steps, strides(model.atoms))
        y = torch.matmul(alpha, model.atoms.transpose(1, 2))
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
    pose = torch.stack([poses[s : s + WINDOW] for s in starts])
    seen = torch.stack([known[s : s + WINDOW] for s in starts])
    turned, frame = own_heading(pose, seen)
    bones, _ = bones_of(turned)
    both = seen[..., list(CHILDREN)] * seen[..., list(PARENTS)]
    along = torch.matmul(recovered(bones, both, model.atoms, TEST_STEPS, strides(model.atoms)), frame)
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
        self.register_buffer("stride", strides(self.atoms))
        self.register_buffer("proportions", shape[0])
        self.register_buffer("usual", shape[1])
        self.tip, self.thumb = tip, thumb

    def forward(self, pose, mask, age):
        seen = (mask > 0.0).to(pose.dtype)
        turned, frame = own_heading(pose, seen)
        bones, _ = bones_of(turned)
        both = seen[..., list(CHILDREN)] * seen[..., list(PARENTS)]
        along = recovered(bones, both, self.atoms, SHIPPED_STEPS, self.stride)[:, -1:]
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
