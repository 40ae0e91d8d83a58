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

import torch
from torch import nn

from . import geometry as g

NAME = "sparse-dictionary"

WINDOW = 6
ATOMS = 1000
LAMBDA_SPARSE = 1e-4
LAMBDA_BONE = 0.4

JOINTS = 21
PARENT = (-1, 0, 20, 2, 20, 4, 5, 6, 20, 8, 9, 10, 0, 12, 13, 14, 0, 16, 17, 18, 1)
# Parts as child joints of bones; every list of 20 bones is in this order, which is also an order from the trunk outward.
PARTS = ((1, 20, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11), (12, 13, 14, 15), (16, 17, 18, 19))
CHILDREN = sum(PARTS, ())
PARENTS = tuple(PARENT[child] for child in CHILDREN)
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
    """The way back of [signed_squares], to length one whatever the squares add up to."""
    return g.unit(torch.sign(squares) * torch.sqrt(squares.abs() + 1e-12))


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
    bone = (torch.sign(triple) * excess).reshape(y.shape)
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
    top = torch.linalg.matrix_norm(atoms, ord=2)
    # The bone term's curvature is three at most: a triple's signs against themselves.
    return (1.0 / (top.square() * (1.0 + 3.0 * LAMBDA_BONE))).view(-1, 1, 1)


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
    """Six dictionaries of unit atoms, `[6, 216, atoms]`."""

    def __init__(self, atoms=ATOMS, generator=None):
        super().__init__()
        start = torch.randn((len(TRIPLES), FEATURES, atoms), generator=generator)
        self.atoms = nn.Parameter(g.unit(start.transpose(1, 2)).transpose(1, 2))

    @torch.no_grad()
    def normalise(self):
        """Atoms longer than one are cut back to it."""
        self.atoms /= torch.linalg.vector_norm(self.atoms, dim=1, keepdim=True).clamp(min=1.0)


# --- matrix completion, what the paper compares with --------------------------------------------------------------------


def completed(points, known, rank_weight=None, rounds=200):
    """A clip `[T, J, 3]` with what is not `known` `[T, J]` made up so that the matrix of frames has low rank.

    Soft-impute (Mazumder, Hastie and Tibshirani 2010): fill in, shrink the singular values, again. `rank_weight` is told in
    parts of the largest singular value; it falls over the rounds.
    """
    flat = points.flatten(1)
    mask = known.unsqueeze(-1).expand_as(points).flatten(1)
    mean = (flat * mask).sum(0) / mask.sum(0).clamp(min=1.0)
    x = (flat - mean) * mask
    weight = 0.2 if rank_weight is None else rank_weight
    for k in range(rounds):
        u, s, v = torch.linalg.svd(x, full_matrices=False)
        keep = torch.relu(s - s[0] * max(weight * 0.95**k, 1e-3))
        low = (u * keep) @ v
        after = torch.where(mask > 0, (flat - mean), low)
        if (after - x).abs().max() < 1e-5:
            break
        x = after
    return (x + mean).view_as(points)
