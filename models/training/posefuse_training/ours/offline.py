"""Recipe of the model for takes; see `learning`."""

import argparse
from pathlib import Path

from torch import nn

from . import learning
from .two_sided import TwoSided
from .two_sided import AFTER as POSES_AFTER
from .two_sided import BEFORE as POSES_BEFORE

KIND, BEFORE, AFTER = "offline", POSES_BEFORE, POSES_AFTER
ABOUT = {
    "summary": "Two-sided, for takes: a network that weighs ways from where joints were hidden to where they are seen again, and corrects them.",
    "source": "ours",
}

arguments = learning.arguments


def train(options: argparse.Namespace) -> None:
    model = TwoSided(options.width, options.blocks, options.dropout, options.dropped_features)
    learning.train(options, model, learning.Shape(BEFORE, AFTER))


def load(runs: list[Path]) -> nn.Module:
    return learning.load(runs, TwoSided)
