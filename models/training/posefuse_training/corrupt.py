"""What a room does to poses: gaps, weak measurements, shifts, noise, swaps; and the window a model is given then.

Arrays are whole batches: poses (batch, time, 25, 3) metres, masks (batch, time, 25) with 0 not measured, 1 measured
with trust, between them weakly.
"""

from dataclasses import dataclass

import numpy as np

from . import MAX_AGE_S, RATE_HZ
from .joints import ARM_LEFT, ARM_RIGHT, COUNT, LEG_LEFT, LEG_RIGHT, LIMBS, LOWER_BODY, PARENTS, TREE

WEAK_SIGMA_M = 0.05
"""Standard deviation of a measurement of weight 1/2; of weight w it is this times the root of 1 / w - 1, as in the engine."""

_HEAD = (2, 3)
_HIPS = (12, 16)
GAP_PARTS = (
    (0.22, (ARM_LEFT, ARM_RIGHT)),
    (0.18, (LEG_LEFT, LEG_RIGHT)),
    (0.17, (LEG_LEFT + LEG_RIGHT,)),
    (0.17, (ARM_LEFT + LEG_LEFT, ARM_RIGHT + LEG_RIGHT)),
    (0.07, (LOWER_BODY, LEG_LEFT + LEG_RIGHT + _HIPS)),
    (0.05, (ARM_LEFT + ARM_RIGHT,)),
    (0.05, (ARM_LEFT + LEG_RIGHT, ARM_RIGHT + LEG_LEFT)),
    (0.04, ((6, 7, 21, 22), (10, 11, 23, 24), (14, 15), (18, 19), (7, 21, 22), (11, 23, 24))),
    (0.03, ((4, *ARM_LEFT), (8, *ARM_RIGHT), (4, 12, *ARM_LEFT, *LEG_LEFT), (8, 16, *ARM_RIGHT, *LEG_RIGHT))),
    (0.02, (_HEAD,)),
    (0.04, (None,)),
    (0.02, (tuple(range(COUNT)),)),
)
"""(share, variants) of what a gap hides; None stands for joints drawn one by one."""


@dataclass
class Room:
    """How bad the room is."""

    gap_s: tuple[float, float] = (0.1, 3.0)
    """Gaps last this long, drawn evenly by logarithm."""
    more_gaps: float = 0.7
    """How many other gaps a stretch has on average."""
    long_gap: float = 0.04
    """Share of stretches in which a gap lasts through all of it (behind a desk)."""
    clean: float = 0.4
    """Share of stretches measured without noise."""
    noise_m: float = 0.012
    """Noise elsewhere has up to this standard deviation, metres; half of it wanders slowly."""
    weak: float = 0.08
    """Share of joints measured weakly, where there are any; such have noise as their weight says, or less."""
    guessed: float = 0.35
    """Share of stretches in which a tracker guesses what is hidden, instead of leaving it out."""
    guess_m: tuple[float, float] = (0.03, 0.11)
    """Its error, metres along each axis for a bone of 25 cm and longer; adds up along a limb, and wanders."""
    guess_s: tuple[float, float] = (0.3, 0.8)
    """Time constants of that."""
    claimed: float = 0.12
    """Share of half seconds in which a guess passes for a measurement."""
    shift: float = 0.05
    """Share of stretches in which a limb is seen beside where it is, weakly."""
    swap: float = 0.02
    """Share of stretches in which left and right are confused for some frames."""
    young: float = 0.06
    """Share of stretches at whose begin the person was not there yet."""
    floor_m: float = 0.02
    """The floor is not quite where the room says, standard deviation in metres."""


def variants() -> tuple[np.ndarray, np.ndarray]:
    """(chances, (n, 25) whether hidden); the row of joints one by one is all false."""
    chances, rows = [], []
    for share, options in GAP_PARTS:
        for option in options:
            row = np.zeros(COUNT, bool)
            row[list(option or ())] = True
            chances.append(share / len(options))
            rows.append(row)
    return np.array(chances) / np.sum(chances), np.array(rows)


_CHANCES, _ROWS = variants()


def hidden_joints(rng: np.random.Generator, count: int) -> np.ndarray:
    """(count, 25): what each of `count` gaps hides."""
    rows = _ROWS[rng.choice(len(_ROWS), size=count, p=_CHANCES)]
    empty = ~rows.any(axis=1)
    single = rng.random((count, COUNT)) < 0.25
    single[np.arange(count), rng.integers(0, COUNT, count)] = True
    return np.where(empty[:, None], single, rows)


def gaps(rng: np.random.Generator, batch: int, frames: int, room: Room, ends: int | None = None) -> np.ndarray:
    """(batch, frames, 25) 0 or 1. Each stretch has one gap; with `ends` one that hides pose number `ends`."""
    mask = np.ones((batch, frames, COUNT), np.float32)
    time = np.arange(frames)

    def hide(which: np.ndarray, begin: np.ndarray, length: np.ndarray) -> None:
        inside = (time >= begin[:, None]) & (time < (begin + length)[:, None])
        mask[which] *= 1 - (inside[:, :, None] & hidden_joints(rng, len(which))[:, None]).astype(np.float32)

    def lengths(count: int) -> np.ndarray:
        low, high = np.log(room.gap_s)
        return np.maximum(1, np.round(RATE_HZ * np.exp(rng.uniform(low, high, count)))).astype(int)

    everyone, length = np.arange(batch), lengths(batch)
    length = np.where(rng.random(batch) < room.long_gap, 10 * frames, length)
    if ends is None:
        begin = rng.integers(0, frames, batch)
    else:
        begin = ends - (rng.random(batch) * length).astype(int)
    hide(everyone, begin, length)
    for _ in range(3):
        which = np.flatnonzero(rng.random(batch) < room.more_gaps / 3)
        hide(which, rng.integers(-15, frames, len(which)), lengths(len(which)))
    return mask


def measured(rng: np.random.Generator, truth: np.ndarray, mask: np.ndarray, room: Room) -> tuple[np.ndarray, np.ndarray]:
    """What is measured of `truth` where `mask` says so, and the mask with weak measurements in it."""
    batch, frames = truth.shape[:2]
    seen, mask = truth.copy(), mask.copy()
    noisy = np.flatnonzero(rng.random(batch) >= room.clean)
    if len(noisy):
        level = (room.noise_m * rng.random((len(noisy), 1, 1, 1)) ** 1.5).astype(np.float32)
        honest = rng.uniform(0.2, 1, (len(noisy), 1, 1, 1)).astype(np.float32)
        shape = (len(noisy), frames, COUNT)
        weak = (rng.random((len(noisy), 1, COUNT)) < room.weak) & (rng.random(shape) < 0.7)
        strength = np.where(weak, rng.uniform(0.1, 0.9, shape), 1.0).astype(np.float32)
        knots = rng.standard_normal((len(noisy), frames // 10 + 2, COUNT, 3), np.float32)
        at = np.arange(frames) / 10
        low = at.astype(int)
        part = (at - low).astype(np.float32)[:, None, None]
        slow = knots[:, low] * (1 - part) + knots[:, low + 1] * part
        fast = rng.standard_normal((*shape, 3), np.float32)
        weak_m = WEAK_SIGMA_M * np.sqrt(1 / strength[..., None] - 1)
        seen[noisy] += (level + honest * weak_m) * (0.6 * fast + 0.8 * slow)
        mask[noisy] *= strength
    _guess(rng, truth, seen, mask, room)
    _shift(rng, seen, mask, room)
    _swap(rng, seen, room)
    seen[..., 2] += rng.normal(0, room.floor_m, (batch, 1, 1)).astype(np.float32)
    return seen, mask


def _guess(rng, truth, seen, mask, room) -> None:
    """Joints that are hidden are guessed: their errors wander, and a joint inherits that of the one it hangs on."""
    which = np.flatnonzero(rng.random(len(seen)) < room.guessed)
    hidden = (mask[which] == 0) & (rng.random((len(which), 1, COUNT)) < 0.9)
    shape = (len(which), 1, 1)
    kept = np.exp(-1 / RATE_HZ / rng.uniform(*room.guess_s, shape)).astype(np.float32)
    level = rng.uniform(*room.guess_m, shape).astype(np.float32)
    bones = np.linalg.norm(truth[which, 0] - truth[which, 0][:, PARENTS], axis=-1)
    share = np.minimum(np.where(np.arange(COUNT) == 0, 1, bones / 0.25), 1)[..., None].astype(np.float32)
    sure_m = rng.uniform(0.015, 0.05, (len(which), 1)).astype(np.float32)
    own = rng.standard_normal((len(which), COUNT, 3), np.float32)
    since = np.zeros((len(which), COUNT), np.float32)
    for time in range(seen.shape[1]):
        own = kept * own + np.sqrt(1 - kept**2) * rng.standard_normal(own.shape, np.float32)
        gone = hidden[:, time]
        since = np.where(gone, since + 1 / RATE_HZ, 0)
        off = np.zeros_like(own)
        for joint in TREE:
            off[:, joint] = gone[:, joint, None] * (level[:, 0] * share[:, joint] * own[:, joint] + (joint > 0) * off[:, PARENTS[joint]])
        # The filter forgets what it knew within a few frames; how sure it may be is told by the time since.
        fading = (1 - np.exp(-since / 0.1))[..., None]
        seen[which, time] += off * fading
        odd = np.hypot(sure_m, np.minimum(0.3 * since, 0.08)) / WEAK_SIGMA_M
        mask[which, time] = np.where(gone, 1 / (1 + odd**2), mask[which, time])
    # Now and then a tracker is sure of its guess.
    spells = rng.random((len(which), seen.shape[1] // 15 + 1, COUNT)) < room.claimed
    claimed = np.repeat(spells, 15, axis=1)[:, : seen.shape[1]] & hidden
    mask[which] = np.where(claimed, 1, mask[which])


def _shift(rng, seen, mask, room) -> None:
    limbs = list(LIMBS.values())
    for index in np.flatnonzero(rng.random(len(seen)) < room.shift):
        limb = list(limbs[rng.integers(len(limbs))])
        begin = rng.integers(0, seen.shape[1])
        inside = slice(begin, begin + rng.integers(3, 30))
        seen[index, inside, limb] += rng.normal(0, 0.08, 3).astype(np.float32)
        mask[index, inside, limb] *= np.float32(rng.uniform(0.1, 0.5))


def _swap(rng, seen, room) -> None:
    pairs = (ARM_LEFT, ARM_RIGHT), (LEG_LEFT, LEG_RIGHT)
    for index in np.flatnonzero(rng.random(len(seen)) < room.swap):
        left, right = (list(limb) for limb in pairs[rng.integers(2)])
        begin = rng.integers(0, seen.shape[1])
        inside = slice(begin, begin + rng.integers(1, 6))
        seen[index, inside, left + right] = seen[index, inside, right + left]


@dataclass
class Window:
    """What an occlusion model is given, and the truth of it."""

    pose: np.ndarray
    mask: np.ndarray
    age: np.ndarray
    truth: np.ndarray


def window(seen: np.ndarray, mask: np.ndarray, truth: np.ndarray, keep: slice = slice(None)) -> Window:
    """The window as the engine makes it, cut to the poses `keep` after everything before has left its trace.

    A joint that is not measured stays where it was last; one that never was is in the middle of those that were.
    """
    frames = mask.shape[1]
    time = np.arange(frames)[None, :, None]
    last = np.maximum.accumulate(np.where(mask > 0, time, -1), axis=1)[:, keep]
    pose = np.take_along_axis(seen, np.maximum(last, 0)[..., None], axis=1)
    age = np.where(last < 0, MAX_AGE_S, np.minimum((time[:, keep] - last) / RATE_HZ, MAX_AGE_S))
    never = last < 0
    if never.any():
        known = (~never).astype(np.float32)[..., None]
        middle = (pose * known).sum(axis=2, keepdims=True) / np.maximum(known.sum(axis=2, keepdims=True), 1)
        pose = np.where(never[..., None], middle, pose)
    return Window(pose.astype(np.float32), mask[:, keep], age.astype(np.float32), truth[:, keep])


def newcomers(rng: np.random.Generator, made: Window, room: Room, before: int) -> None:
    """Makes some of the windows of people who came late: up to `before` first poses are repeated ones, with weight 0."""
    for index in np.flatnonzero(rng.random(len(made.mask)) < room.young):
        first = rng.integers(1, before + 1)
        made.pose[index, :first] = made.pose[index, first]
        made.mask[index, :first] = 0
        made.age[index, :first] = MAX_AGE_S
