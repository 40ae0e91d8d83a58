"""Bones as numbers of which a sparse code is made, the code, and the way back to joints; see `sparse_dictionary`."""

import torch

from ..joints import PARENTS as PARENT
from . import geometry as g

WINDOW = 6
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


def code(x, known, atoms, mean, steps, stride):
    """Codes `[G, N, K]` of vectors `x` `[G, N, 216]` where `known` (0 to 1, same shape), over `atoms` `[G, 216, K]` beside
    the `mean` `[G, 1, 216]`, which costs nothing: without it most steps go into finding it.

    `steps` accelerated proximal steps (Beck and Teboulle 2009) of `stride` `[G, 1, 1]`, at most one over the largest
    eigenvalue of the smooth part.
    """
    across = atoms.transpose(1, 2)
    now = torch.matmul(x * 0.0, atoms)
    ahead = now
    momentum = 1.0
    for _ in range(steps):
        slope = torch.matmul(objective_slope(mean + torch.matmul(ahead, across), x, known), atoms)
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


def recovered(bones, known, atoms, mean, steps, stride):
    """Directions `[N, 6, 20, 3]`: what the dictionaries say, of `bones` (directions) where `known` `[N, 6, 20]`."""
    x = split(signed_squares(bones))
    seen = split(known.unsqueeze(-1).expand(-1, -1, -1, 3))
    alpha = code(x, seen, atoms, mean, steps, stride)
    return directions(joined(mean + torch.matmul(alpha, atoms.transpose(1, 2))))


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
