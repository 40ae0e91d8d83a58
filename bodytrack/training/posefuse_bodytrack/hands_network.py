"""From a hand's crop to the probability that it is closed: a few convolutions."""

import torch
from torch import nn

from . import hands_data
from .network import _conv


class Grip(nn.Module):
    """`hand` [N, 2, 32, 32] and `known` [N, 3] to the logit of being closed [N, 1].

    `known`: the logarithm of how many pixels a cell's side has, the probability that the hand is in sight and the logarithm of the spread
    of its place in metres, as the body's network says: from them it can tell how little it may know.
    """

    def __init__(self, width=16):
        super().__init__()
        self.config = {"width": width}
        w = width
        self.body = nn.Sequential(
            _conv(hands_data.CHANNELS, w, 2, 5),
            _conv(w, 3 * w // 2),
            _conv(3 * w // 2, 2 * w, 2),
            _conv(2 * w, 2 * w),
            _conv(2 * w, 3 * w, 2),
        )
        cells = 3 * w * (hands_data.SIZE // 8) ** 2
        self.drop = nn.Dropout(0.2)
        self.joined = nn.Linear(cells + hands_data.KNOWN, 3 * w)
        self.closed = nn.Linear(3 * w, 1)

    def forward(self, hand, known):
        seen = self.drop(self.body(hand).flatten(1))
        return self.closed(torch.relu(self.joined(torch.cat([seen, known], 1))))


class ExportedGrip(nn.Module):
    """The network with the interface that the program knows: a probability.

    `factor` and `offset` put its logits right on people whom it was not trained on (Platt 1999).
    """

    def __init__(self, network, factor=1.0, offset=0.0):
        super().__init__()
        self.network, self.factor, self.offset = network, factor, offset

    def forward(self, hand, known):
        return torch.sigmoid(self.network(hand, known) * self.factor + self.offset)
