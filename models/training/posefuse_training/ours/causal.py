"""The causal model: a window of the last two seconds in, the newest pose out.

Every joint that is not measured with trust has several continuations: it stays where it was in the room or against the person,
it goes on and slows down, it follows the mean of poses given the joints that are measured, with an offset that fades, or the mean
given these and how all moved when it was last trusted. All begin where the joint was last trusted. A joint that is measured
weakly (a tracker's guess) has its measurement as well, and means of it over some time. The network says which to believe and what
to add; what it adds grows with the time since the joint was trusted.
"""

import torch
from torch import Tensor

from .. import RATE_HZ
from .frames import Frames, frames
from .guesses import GUESSES, SCALARS, guesses, since_trusted
from .side import CORE, SPEED_OVER, history, side_of
from .weighing import TRUSTED, Told, Weighing

POSES = 64
SPEED_LAGS = (2, 5, 10, 20, 40)
POSE_LAGS = (8, 16, 24, 32, 44, 60)
_VECTORS = 8 + len(SPEED_OVER) + len(SPEED_LAGS) + len(POSE_LAGS)


class Causal(Weighing):
    """See `Weighing`; t is 64, the newest pose is filled."""

    BEFORE, AFTER = POSES - 1, 0
    CONTINUATIONS = 8 + GUESSES
    LEANS_ON = 7
    BLOCKS = [
        ("vectors", _VECTORS), ("ways", len(SPEED_LAGS)), ("turns", len(SPEED_LAGS)), ("scalars", 5), ("same", 2),
        ("vectors", GUESSES), ("scalars", SCALARS),
    ]
    FREE_S = 0.15
    LEAST = 0.008

    def __init__(self, width: int = 320, blocks: int = 2, dropout: float = 0.2, dropped_features: float = 0.1, latents: int = 28):
        core = len(CORE)
        features = 3 * core * (_VECTORS + GUESSES) + (5 + SCALARS) * core + 5 * len(SPEED_LAGS) + 2
        super().__init__(features, width, blocks, dropout, dropped_features, latents)

    def told(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Told, Frames]:
        whole = frames(pose, mask, self.prior.usual)
        seconds = since_trusted(mask, age)
        ways, features = self.continuations(whole, whole.own(pose), pose, mask, seconds)
        newest = Frames(whole.forward[:, -1:], whole.origin[:, -1:], whole.size)
        return Told(torch.cat(features, -1), ways, seconds, mask[:, -1]), newest

    def continuations(self, whole: Frames, own: Tensor, pose: Tensor, mask: Tensor, since: Tensor) -> tuple[Tensor, list[Tensor]]:
        """((n, 25, continuations, 3) in own coordinates, what the network is told)."""
        now, seen = own[:, -1], (mask[:, -1] >= TRUSTED).float()
        hidden = (1 - seen)[..., None]
        side = side_of(self.prior, self.group, whole, own, pose, mask, since * RATE_HZ)
        seconds = since[..., None]
        ways = [
            side.last,
            side.in_room,
            side.last + coasted(side.speeds[0], seconds, 0.3),
            side.last + coasted(side.speeds[1], seconds, 0.12),
            side.in_room + coasted(side.room_speed, seconds, 0.2),
            side.mean + side.offset * torch.exp(-seconds / 0.4),
            side.mean + side.offset * torch.exp(-seconds / 2),
            side.carried,
        ]
        guessed, told_of_them = guesses(own, mask, POSES - 1, side.carried)
        # What is measured with trust stays what it is, in every continuation.
        ways = torch.stack(ways + guessed, 2)
        ways = seen[..., None, None] * now[:, :, None] + (1 - seen[..., None, None]) * ways
        told = [now * (1 - hidden), side.last * hidden, side.mean * hidden, side.offset * hidden, (side.carried - side.last) * hidden]
        told += [(side.in_room - side.last) * hidden, side.room_speed * hidden * 0.2, (side.mean - now) * (1 - hidden)]
        told += [speed * hidden * 0.2 for speed in side.speeds]
        features = [part[:, CORE].flatten(1) for part in told]
        features += history(self.prior.usual, whole, own, mask, SPEED_LAGS, POSE_LAGS)
        features += [mask[:, -1, CORE], torch.exp(-since[:, CORE] / 0.15), torch.exp(-since[:, CORE] / 0.6)]
        features += [since[:, CORE].clamp(max=3), (side.deviation * hidden[..., 0])[:, CORE]]
        features += [whole.origin[:, -1, 2:3], whole.size[:, 0, 0]]
        features += told_of_them
        return ways, features


def coasted(speed: Tensor, seconds: Tensor, fades: float) -> Tensor:
    """How far a joint comes that had this speed and slows down over `fades` seconds."""
    return speed * (fades * (1 - torch.exp(-seconds / fades)))
