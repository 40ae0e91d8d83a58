"""The model for takes: two seconds before and two after in, the pose between them out.

Like the causal one it weighs continuations and corrects them, but it knows both ends of a gap: straight lines and curves between
them, in the room and against the person, and what poses before and poses after say of the pose between. What it adds vanishes at
both ends.
"""

import torch
from torch import Tensor

from .. import RATE_HZ
from .frames import Frames, frames
from .guesses import GUESSES, SCALARS, guesses, since_trusted
from .side import CORE, SPEED_OVER, Side, history, of_own_group, side_of
from .weighing import TRUSTED, Told, Weighing

BEFORE = AFTER = 63
POSES = BEFORE + 1 + AFTER
SPEED_LAGS = (2, 5, 12, 25)
POSE_LAGS = (8, 16, 32, 56)
FAR_S = 10.0
"""Taken for the time to the next measurement where the window has none."""


class TwoSided(Weighing):
    """See `Weighing`; t is 127, the pose in the middle is filled."""

    BEFORE, AFTER = BEFORE, AFTER
    CONTINUATIONS = 10 + GUESSES
    LEANS_ON = 9
    BLOCKS = [("vectors", 4 + 2 * (4 + len(SPEED_OVER)))]
    BLOCKS += 2 * [("vectors", len(SPEED_LAGS) + len(POSE_LAGS)), ("ways", len(SPEED_LAGS)), ("turns", len(SPEED_LAGS))]
    BLOCKS += [("scalars", 7), ("same", 2), ("vectors", GUESSES), ("scalars", SCALARS)]
    FREE_S = 0.2
    LEAST = 0.006

    def __init__(self, width: int = 256, blocks: int = 2, dropout: float = 0.4, dropped_features: float = 0.3, latents: int = 28):
        core = len(CORE)
        by_side = 3 * core * (4 + len(SPEED_OVER) + len(SPEED_LAGS) + len(POSE_LAGS)) + 5 * len(SPEED_LAGS)
        features = 2 * by_side + 3 * core * (4 + GUESSES) + (7 + SCALARS) * core + 2
        super().__init__(features, width, blocks, dropout, dropped_features, latents)

    def told(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Told, Frames]:
        whole = frames(pose, mask, self.prior.usual)
        own = whole.own(pose)
        ahead = torch.arange(1, AFTER + 1, dtype=torch.float32, device=pose.device)[None, :, None]
        hidden_ahead = (mask[:, BEFORE + 1 :] < TRUSTED).float()
        steps_left = (ahead + 10 * FAR_S * RATE_HZ * hidden_ahead).amin(1).clamp(max=FAR_S * RATE_HZ)
        steps_left = steps_left * (mask[:, BEFORE] < TRUSTED).float()
        since = since_trusted(mask[:, : BEFORE + 1], age[:, : BEFORE + 1])
        halves = []
        for picked, steps in ((range(BEFORE + 1), since * RATE_HZ), (range(POSES - 1, BEFORE - 1, -1), steps_left)):
            order = list(picked)
            half = Frames(whole.forward[:, order], whole.origin[:, order], whole.size)
            sided = (half, own[:, order], mask[:, order])
            halves.append((side_of(self.prior, self.group, half, own[:, order], pose[:, order], mask[:, order], steps), sided))
        middle = Frames(whole.forward[:, BEFORE : BEFORE + 1], whole.origin[:, BEFORE : BEFORE + 1], whole.size)
        return self.between(halves, own, mask, since, steps_left / RATE_HZ, middle), middle

    def between(self, halves, own: Tensor, mask: Tensor, since: Tensor, until: Tensor, middle: Frames) -> Told:
        """Continuations and features of the pose in the middle, from both sides."""
        (past, past_poses), (next_, next_poses) = halves
        now, sure = own[:, BEFORE], mask[:, BEFORE]
        hidden = (sure < TRUSTED).float()[..., None]
        # Without an end in sight the past alone counts.
        near = (until < FAR_S).float() * (since < FAR_S).float() + 1e-6 * (since < FAR_S).float()
        only_next = (since >= FAR_S).float() * (until < FAR_S).float()
        share = (near * since / (since + until).clamp(min=1e-3) + only_next)[..., None]
        together, deviation = self.settled(past, next_, now, sure, until)
        guessed, told_of_them = guesses(own, mask, BEFORE, together)
        ways = torch.stack([*continued(past, next_, share, since[..., None], until[..., None]), together, *guessed], 2)
        ways = (1 - hidden)[..., None] * now[:, :, None] + hidden[..., None] * ways
        features = [((past.mean - now) * (1 - hidden)), now * (1 - hidden), past.mean * hidden, (together - ways[:, :, 0]) * hidden]
        for side, seen in ((past, 1.0), (next_, (until < FAR_S).float()[..., None])):
            told = [side.last - past.mean, side.offset, side.carried - past.mean, side.in_room - side.last]
            told += [speed * 0.2 for speed in side.speeds]
            features += [part * hidden * seen for part in told]
        features = [part[:, CORE].flatten(1) for part in features]
        for sided in (past_poses, next_poses):
            features += history(self.prior.usual, *sided, SPEED_LAGS, POSE_LAGS)
        nearest = torch.where(until < FAR_S, torch.minimum(since, until), since)
        features += [sure[:, CORE], torch.exp(-nearest[:, CORE] / 0.2), torch.exp(-since[:, CORE] / 0.6), torch.exp(-until[:, CORE] / 0.6)]
        features += [share[:, CORE, 0], (since.clamp(max=3) + until.clamp(max=3))[:, CORE], (deviation * hidden[..., 0])[:, CORE]]
        features += [middle.origin[:, 0, 2:3], middle.size[:, 0, 0], *told_of_them]
        return Told(torch.cat(features, -1), ways, nearest, sure)

    def settled(self, past: Side, next_: Side, now: Tensor, sure: Tensor, until: Tensor) -> tuple[Tensor, Tensor]:
        """(mean (n, 25, 3), deviation (n, 25)) given what is measured now and how all moved on both sides."""
        trust, information = self.prior.information(sure)
        ends = ((until < FAR_S).float()[:, None] * self.group + (1 - self.group)).amin(-1)
        mean, deviation = self.prior.between(trust, information, now.flatten(1), past.anchor, next_.anchor, ends)
        return of_own_group(self.group, mean), (deviation * self.group).sum(1)


def continued(past: Side, next_: Side, share: Tensor, since: Tensor, until: Tensor) -> list[Tensor]:
    """Ways from the last place to the next; `share` (n, 25, 1) of the time between them has gone."""
    def line(a: Tensor, b: Tensor) -> Tensor:
        return a + (b - a) * share

    # Hermite's cubic; speeds are away from their side, and do not count far into a long gap.
    span = (since + until).clamp(max=1.0)
    out, back = span * share * (1 - share) ** 2, span * share**2 * (1 - share)
    eased = share * share * (3 - 2 * share)

    def curve(a: Tensor, b: Tensor, leaving: Tensor, arriving: Tensor) -> Tensor:
        return a + (b - a) * eased + out * leaving + back * arriving

    weight_past = 1 / (past.deviation**2 + 1e-8)[..., None]
    weight_next = 1 / (next_.deviation**2 + 1e-8)[..., None] * (until < FAR_S).float()
    weighted = (past.carried * weight_past + next_.carried * weight_next) / (weight_past + weight_next)
    return [
        line(past.last, next_.last),
        line(past.in_room, next_.in_room),
        curve(past.last, next_.last, past.speeds[0], next_.speeds[0]),
        curve(past.in_room, next_.in_room, past.room_speed, next_.room_speed),
        past.mean + line(past.offset, next_.offset),
        past.carried,
        line(past.carried, next_.carried),
        curve(past.last, next_.last, past.speeds[1], next_.speeds[1]),
        weighted,
    ]
