"""The small network behind both models: features in, features out, with fixed standardisation of what comes in."""

import torch
from torch import Tensor, nn


class Standardise(nn.Module):
    """Subtracts the mean and divides by the deviation seen in a first batch, and keeps outliers at bay."""

    def __init__(self, features: int):
        super().__init__()
        self.register_buffer("mean", torch.zeros(features))
        self.register_buffer("scale", torch.ones(features))

    def fit(self, given: Tensor) -> None:
        self.mean.copy_(given.mean(0))
        self.scale.copy_(1 / given.std(0).clamp(min=0.01))

    def forward(self, given: Tensor) -> Tensor:
        return ((given - self.mean) * self.scale).clamp(-6, 6)


class Block(nn.Module):
    """Adds to its input what two layers make of it."""

    def __init__(self, width: int, dropout: float):
        super().__init__()
        self.layers = nn.Sequential(
            nn.LayerNorm(width), nn.Linear(width, width), nn.SiLU(), nn.Dropout(dropout), nn.Linear(width, width), nn.Dropout(dropout)
        )

    def forward(self, given: Tensor) -> Tensor:
        return given + self.layers(given)


class Perceptron(nn.Module):
    """Standardised features through `blocks` residual blocks; the last layer begins at zero."""

    def __init__(self, features: int, width: int, blocks: int, outputs: int, dropout: float, dropped_features: float):
        super().__init__()
        self.standardise = Standardise(features)
        self.thin = nn.Dropout(dropped_features)
        self.first = nn.Linear(features, width)
        self.blocks = nn.Sequential(*(Block(width, dropout) for _ in range(blocks)))
        self.last = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, outputs))
        nn.init.zeros_(self.last[1].weight)
        nn.init.zeros_(self.last[1].bias)

    def forward(self, given: Tensor) -> Tensor:
        hidden = torch.nn.functional.silu(self.first(self.thin(self.standardise(given))))
        return self.last(self.blocks(hidden))
