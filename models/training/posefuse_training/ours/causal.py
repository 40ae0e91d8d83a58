"""The causal model: a window of the last two seconds in, the newest pose out.

Every hidden joint has several continuations: it stays where it was in the room or against the person, it goes on and slows down, it
follows the mean of poses given the joints that are seen, with an offset that fades, or the mean given these and how all moved when
it was last seen. All begin where the joint was last seen. The network says which to believe and what to add; what it adds grows
with the time since the joint was seen.
"""

from typing import NamedTuple

import torch
from torch import Tensor, nn

from .. import RATE_HZ
from ..joints import COUNT
from .committee import Committee
from .frames import Frames, frames
from .network import Perceptron
from .prior import PosePrior
from .side import CORE, SPEED_OVER, group_matrix, history, side_of

POSES = 64
SPEED_LAGS = (2, 5, 10, 20, 40)
POSE_LAGS = (8, 16, 24, 32, 44, 60)
CONTINUATIONS = 8
BLOCKS = [
    ("vectors", 8 + len(SPEED_OVER) + len(SPEED_LAGS) + len(POSE_LAGS)), ("ways", len(SPEED_LAGS)), ("turns", len(SPEED_LAGS)),
    ("scalars", 5), ("same", 2),
]
"""What the features are, in their order; see `committee.mirror_of`."""
REACH_M = 0.3


class Told(NamedTuple):
    """What the network is given of each window."""

    features: Tensor
    ways: Tensor
    """(n, 25, continuations, 3) own coordinates."""
    seconds: Tensor
    """(n, 25) since each joint was measured."""
    sure: Tensor
    """(n, 25) how far each joint is measured."""


class Causal(nn.Module):
    """Common interface: pose (n, 64, 25, 3), mask and age (n, 64, 25) to filled (n, 1, 25, 3) and sigma (n, 1, 25)."""

    def __init__(self, width: int = 320, blocks: int = 2, dropout: float = 0.2, dropped_features: float = 0.1, latents: int = 28):
        super().__init__()
        self.prior = PosePrior(latents)
        core = len(CORE)
        features = 3 * core * (8 + len(SPEED_OVER) + len(SPEED_LAGS) + len(POSE_LAGS)) + 5 * core + 5 * len(SPEED_LAGS) + 2
        self.network = Perceptron(features, width, blocks, COUNT * (3 + CONTINUATIONS + 1), dropout, dropped_features)
        self.register_buffer("group", group_matrix(), persistent=False)
        self.members = 1

    def seat(self, networks: list[nn.Module]) -> None:
        """From now on these networks answer together, each also about the mirror image."""
        self.network = Committee(networks, BLOCKS, COUNT * (3 + CONTINUATIONS + 1))
        self.members = 2 * len(networks)

    def begin(self, features: Tensor) -> None:
        """Before training: standardises by these features, and leans on the continuation that is best by itself."""
        self.network.standardise.fit(features)
        with torch.no_grad():
            self.network.last[1].bias.view(COUNT, -1)[:, 3 + CONTINUATIONS - 1] = 2.0

    def forward(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Tensor, Tensor]:
        told, newest = self.told(pose, mask, age)
        own, sigma = self.answer(told)
        return newest.room(own[:, None]), (sigma * newest.size[:, 0, 0])[:, None]

    def told(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple["Told", Frames]:
        """What the network is given, and the frame of the newest pose; nothing in it is trained."""
        whole = frames(pose, mask, self.prior.usual)
        ways, features = self.continuations(whole, whole.own(pose), pose, mask, age)
        newest = Frames(whole.forward[:, -1:], whole.origin[:, -1:], whole.size)
        return Told(torch.cat(features, -1), ways, age[:, -1], mask[:, -1]), newest

    def answer(self, told: "Told") -> tuple[Tensor, Tensor]:
        """The newest pose (n, 25, 3) and its deviations (n, 25), own units."""
        # One answer, or those of a committee.
        answers = self.network(told.features).reshape(-1, self.members, COUNT, 3 + CONTINUATIONS + 1)
        belief = torch.softmax(answers[..., 3:-1], -1).mean(1)
        freedom = torch.maximum(1 - torch.exp(-told.seconds / 0.15), 1 - told.sure)
        added = REACH_M * freedom[..., None] * torch.tanh(answers[..., :3]).mean(1)
        scale = 0.008 + 0.15 * (1 - torch.exp(-told.seconds / 0.5)) + 0.01 * (1 - told.sure)
        return (told.ways * belief[..., None]).sum(2) + added, scale * torch.exp(answers[..., -1].mean(1).clamp(-2.5, 2.5))

    def continuations(self, whole: Frames, own: Tensor, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Tensor, list[Tensor]]:
        """((n, 25, continuations, 3) in own coordinates, what the network is told)."""
        now, seen = own[:, -1], (mask[:, -1] > 0).float()
        hidden = (1 - seen)[..., None]
        side = side_of(self.prior, self.group, whole, own, pose, mask, age[:, -1] * RATE_HZ)
        seconds = age[:, -1][..., None]
        ways = torch.stack(
            [
                side.last,
                side.in_room,
                side.last + coasted(side.speeds[0], seconds, 0.3),
                side.last + coasted(side.speeds[1], seconds, 0.12),
                side.in_room + coasted(side.room_speed, seconds, 0.2),
                side.mean + side.offset * torch.exp(-seconds / 0.4),
                side.mean + side.offset * torch.exp(-seconds / 2),
                side.carried,
            ],
            2,
        )
        # What is measured stays what it is, in every continuation.
        ways = seen[..., None, None] * now[:, :, None] + (1 - seen[..., None, None]) * ways
        told = [now * (1 - hidden), side.last * hidden, side.mean * hidden, side.offset * hidden, (side.carried - side.last) * hidden]
        told += [(side.in_room - side.last) * hidden, side.room_speed * hidden * 0.2, (side.mean - now) * (1 - hidden)]
        told += [speed * hidden * 0.2 for speed in side.speeds]
        features = [part[:, CORE].flatten(1) for part in told]
        features += history(self.prior.usual, whole, own, mask, SPEED_LAGS, POSE_LAGS)
        features += [mask[:, -1, CORE], torch.exp(-age[:, -1, CORE] / 0.15), torch.exp(-age[:, -1, CORE] / 0.6)]
        features += [age[:, -1, CORE].clamp(max=3), (side.deviation * hidden[..., 0])[:, CORE]]
        features += [whole.origin[:, -1, 2:3], whole.size[:, 0, 0]]
        return ways, features


def coasted(speed: Tensor, seconds: Tensor, fades: float) -> Tensor:
    """How far a joint comes that had this speed and slows down over `fades` seconds."""
    return speed * (fades * (1 - torch.exp(-seconds / fades)))
