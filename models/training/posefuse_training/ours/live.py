"""Recipe of the causal model; see `learning`."""

import argparse
from pathlib import Path

from torch import nn

from . import learning
from .causal import POSES, Causal

KIND, BEFORE, AFTER = "live", POSES - 1, 0
ABOUT = {
    "summary": "Causal: a network that weighs simple continuations of hidden joints and corrects them.",
    "source": "ours",
}

arguments = learning.arguments


def train(options: argparse.Namespace) -> None:
    model = Causal(options.width, options.blocks, options.dropout, options.dropped_features)
    learning.train(options, model, learning.Shape(BEFORE, AFTER))


def load(runs: list[Path]) -> nn.Module:
    return learning.load(runs, Causal)
