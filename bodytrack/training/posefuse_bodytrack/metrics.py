"""How good joints are: errors, shares within 10 cm, sides, confidence."""

import math

import numpy as np
import torch

from . import joints

NEAR_M = 0.10
# Joints by whose distances sides are told: fingers are too near each other.
SIDES = [pair for pair in joints.PAIRS if not joints.NAMES[pair[0]].startswith(("HandTip", "Thumb", "Hand", "Foot"))]


def run(network, crops, batch=256):
    """The network's outputs as arrays, in the order of `network.Exported`."""
    parts = []
    with torch.no_grad():
        for start in range(0, len(crops), batch):
            parts.append([o.numpy() for o in network(torch.from_numpy(crops[start : start + batch]))])
    return [np.concatenate(column) for column in zip(*parts)]


def facing(truth):
    """0 front (within 60 degrees), 1 side, 2 back."""
    cosine = truth.heading[:, 1]
    return np.where(cosine > 0.5, 0, np.where(cosine < -0.5, 2, 1))


def probability(sigma):
    """That an error with this standard deviation along each axis is within 10 cm (Maxwell's distribution)."""
    x = NEAR_M / sigma
    erf = np.vectorize(math.erf)
    return erf(x / math.sqrt(2)) - math.sqrt(2 / math.pi) * x * np.exp(-x * x / 2)


def sides_right(found, true):
    """Per frame: whether left and right joints are nearer to themselves than to each other."""
    left, right = (list(side) for side in zip(*SIDES))

    def sum_of(a, b):
        return np.linalg.norm(found[:, a] - true[:, b], axis=-1).sum(1)

    return sum_of(left, left) + sum_of(right, right) <= sum_of(left, right) + sum_of(right, left)


def line(found, truth, keep):
    """Figures over the frames of a mask: errors in mm, shares in percent."""
    if not keep.any():
        return {}
    error = np.linalg.norm(found[keep] - truth.joints[keep], axis=-1)
    visible = truth.visible[keep] > 0.5
    main = np.zeros(joints.COUNT, bool)
    main[joints.MAIN] = True

    def share(of):
        return 100 * (error[of] < NEAR_M).mean() if of.any() else float("nan")

    return {
        "frames": int(keep.sum()),
        "mpjpe_visible_mm": 1000 * error[visible].mean(),
        "mpjpe_hidden_mm": 1000 * error[~visible].mean() if (~visible).any() else float("nan"),
        "mpjpe_mm": 1000 * error.mean(),
        "within_10cm": share(np.ones_like(visible)),
        "within_10cm_visible": share(visible),
        "within_10cm_visible_main": share(visible & main),
        "sides_right": 100 * sides_right(found[keep], truth.joints[keep]).mean(),
    }


def tables(outputs, truth):
    """`line`s by name: all, by facing, distance and number of people, upright and in full view."""
    found, sigma, visible, heading, hands = outputs
    way = facing(truth)
    clear = truth.visible.mean(1) > 0.75
    masks = {
        "all": np.ones(len(found), bool),
        "front": way == 0,
        "side": way == 1,
        "back": way == 2,
        "in full view": clear,
        "in full view, front": clear & (way == 0),
        "in full view, side": clear & (way == 1),
        "in full view, back": clear & (way == 2),
        "0.8-2 m": truth.distance < 2,
        "2-3.5 m": (truth.distance >= 2) & (truth.distance < 3.5),
        "3.5 m and more": truth.distance >= 3.5,
        "1 person": truth.people == 1,
        "2 people": truth.people == 2,
        "3 people": truth.people == 3,
        "trunk upright": truth.upright > 0.7,
        "trunk not upright": truth.upright <= 0.7,
    }
    return {name: line(found, truth, keep) for name, keep in masks.items()}


def others(outputs, truth):
    """What is not about places: heading, visibility, hands; confidence by tenths (said, true, count)."""
    found, sigma, visible, heading, hands = outputs
    error = np.linalg.norm(found - truth.joints, axis=-1)
    said = probability(sigma)
    tenths = np.minimum((said * 10).astype(int), 9)
    curve = [
        (float(said[tenths == t].mean()), float((error[tenths == t] < NEAR_M).mean()), int((tenths == t).sum()))
        for t in range(10)
        if (tenths == t).any()
    ]
    palms = [joints.INDEX["HandLeft"], joints.INDEX["HandRight"]]
    seen = truth.visible[:, palms] > 0.5
    gap = sum(count * abs(a - b) for a, b, count in curve) / said.size
    return {
        "heading_median_deg": float(np.degrees(np.median(np.arccos(np.clip((heading * truth.heading).sum(1), -1, 1))))),
        "facing_right": 100 * float(((heading[:, 1] > 0) == (truth.heading[:, 1] > 0))[facing(truth) != 1].mean()),
        "visible_right": 100 * float(((visible > 0.5) == (truth.visible > 0.5)).mean()),
        "hands_right": 100 * float(((hands > 0.5) == (truth.hands > 0.5))[seen].mean()),
        "confidence_gap": 100 * gap,
        "curve": curve,
    }
