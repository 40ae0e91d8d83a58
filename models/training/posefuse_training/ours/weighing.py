"""What both of our models do with the continuations of hidden joints: a network says which to believe and what to add.

Subclasses say which continuations there are and what the network is told of them.
"""

from typing import NamedTuple

import torch
from torch import Tensor, nn

from ..joints import COUNT
from .committee import Committee
from .frames import Frames
from .network import Perceptron
from .prior import PosePrior, weak_sigma_m
from .side import group_matrix

REACH_M = 0.3
"""What is added goes no further."""
TRUSTED = 0.8
"""Joints of this weight and above are never filled by the engine."""
MOST_OUTWEIGHED = 2.0
"""Of the variance of what is said of a weakly measured joint, over the measurement's own."""


class Told(NamedTuple):
    """What the network is given of each window."""

    features: Tensor
    ways: Tensor
    """(n, 25, continuations, 3) own coordinates."""
    seconds: Tensor
    """(n, 25) since (or until) each joint was measured."""
    sure: Tensor
    """(n, 25) how far each joint is measured."""


class Weighing(nn.Module):
    """Common interface: pose (n, t, 25, 3), mask and age (n, t, 25) to filled (n, 1, 25, 3) and sigma (n, 1, 25)."""

    BEFORE: int
    AFTER: int
    """Poses before and after the one that is filled."""
    CONTINUATIONS: int
    LEANS_ON: int
    """The continuation that is best by itself."""
    BLOCKS: list[tuple[str, int]]
    """What the features are, in their order; see `committee.mirror_of`."""
    FREE_S: float
    """Time constant with which what is added may grow."""
    LEAST: float
    """Deviation of a joint that was measured a moment ago, own units."""

    def __init__(self, features: int, width: int, blocks: int, dropout: float, dropped_features: float, latents: int):
        super().__init__()
        self.prior = PosePrior(latents)
        self.network = Perceptron(features, width, blocks, self.outputs(), dropout, dropped_features)
        self.register_buffer("group", group_matrix(), persistent=False)
        self.members = 1

    @classmethod
    def outputs(cls) -> int:
        """Of the network: for each joint what to add, how far to believe each continuation, and the deviation."""
        return COUNT * (3 + cls.CONTINUATIONS + 1)

    def seat(self, networks: list[nn.Module]) -> None:
        """From now on these networks answer together, each also about the mirror image."""
        self.network = Committee(networks, self.BLOCKS, self.outputs())
        self.members = 2 * len(networks)

    def begin(self, features: Tensor) -> None:
        """Before training: standardises by these features, and leans on the continuation that is best by itself."""
        self.network.standardise.fit(features)
        with torch.no_grad():
            self.network.last[1].bias.view(COUNT, -1)[:, 3 + self.LEANS_ON] = 2.0

    def forward(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Tensor, Tensor]:
        told, frame = self.told(pose, mask, age)
        own, sigma = self.answer(told)
        filled, sigma = frame.room(own[:, None]), (sigma * frame.size[:, 0, 0])[:, None]
        now = slice(self.BEFORE, self.BEFORE + 1)
        return without_measurement(filled, sigma, pose[:, now], mask[:, now])

    def told(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Told, Frames]:
        """What the network is given, and the frame of the filled pose; nothing in it is trained."""
        raise NotImplementedError

    def answer(self, told: Told) -> tuple[Tensor, Tensor]:
        """The filled pose (n, 25, 3) and its deviations (n, 25), own units; weak measurements count in it."""
        # One answer, or those of a committee.
        answers = self.network(told.features).reshape(-1, self.members, COUNT, 3 + self.CONTINUATIONS + 1)
        belief = torch.softmax(answers[..., 3:-1], -1).mean(1)
        freedom = torch.maximum(1 - torch.exp(-told.seconds / self.FREE_S), 1 - told.sure)
        added = REACH_M * freedom[..., None] * torch.tanh(answers[..., :3]).mean(1)
        scale = self.LEAST + 0.15 * (1 - torch.exp(-told.seconds / 0.5)) + 0.01 * (1 - told.sure)
        return (told.ways * belief[..., None]).sum(2) + added, scale * torch.exp(answers[..., -1].mean(1).clamp(-2.5, 2.5))


def without_measurement(filled: Tensor, sigma: Tensor, pose: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
    """What has to be said beside a weak measurement so that both together are `filled` with `sigma`.

    The engine puts the measurement in once, by its covariance; here it is taken out.
    """
    weak = ((mask > 0) & (mask < TRUSTED)).float()
    own = weak_sigma_m(mask) ** 2
    # Of two that are multiplied, the variance of the other one over the measurement's.
    odds = (sigma**2 / (own - sigma**2).clamp(min=1e-6)).clamp(max=MOST_OUTWEIGHED)
    beside = pose + (filled - pose) * (1 + odds)[..., None]
    return filled + weak[..., None] * (beside - filled), sigma + weak * (torch.sqrt(odds * own) - sigma)
