"""Several trained networks, each asked about the window and about its mirror image, as one.

What a network says should not depend on which side is left; trained on both it nearly does, and the mean of both answers is better
than either. The mirror image of the features is a permutation with signs, so it costs one more pass through a small network.
"""

import torch
from torch import Tensor, nn

from ..joints import COUNT, MIRROR
from .side import CORE

_SIZES = {"vectors": 3 * len(CORE), "scalars": len(CORE), "ways": 3, "turns": 2, "same": 1}


def mirror_of(blocks: list[tuple[str, int]]) -> tuple[Tensor, Tensor]:
    """(where each mirrored feature is taken from, its sign), of features made of `blocks`: (kind, how many of it).

    vectors: joints x (x, y, z); scalars: one for each joint; ways: (x, y, z); turns: (cosine, sine); same: as it is.
    """
    order, signs, offset = [], [], 0
    across = torch.tensor([1.0, -1.0, 1.0])
    swapped = torch.tensor([int(MIRROR[joint]) for joint in CORE])
    for kind, count in blocks:
        size = _SIZES[kind]
        own = torch.arange(size)
        sign = torch.ones(size)
        if kind == "vectors":
            own = (3 * swapped[:, None] + torch.arange(3)).flatten()
            sign = across.repeat(len(CORE))
        elif kind == "scalars":
            own = swapped
        elif kind == "ways":
            sign = across
        elif kind == "turns":
            sign = torch.tensor([1.0, -1.0])
        for _ in range(count):
            order.append(own + offset)
            signs.append(sign)
            offset += size
    return torch.cat(order), torch.cat(signs)


class Committee(nn.Module):
    """Answers of all members side by side: (n, members x outputs), two for each network."""

    def __init__(self, networks: list[nn.Module], blocks: list[tuple[str, int]], outputs: int):
        super().__init__()
        self.networks = nn.ModuleList(networks)
        order, signs = mirror_of(blocks)
        self.register_buffer("order", order, persistent=False)
        self.register_buffer("signs", signs, persistent=False)
        self.register_buffer("joints", torch.from_numpy(MIRROR.copy()), persistent=False)
        across = torch.ones(outputs // COUNT)
        across[1] = -1
        self.register_buffer("across", across, persistent=False)

    def forward(self, features: Tensor) -> Tensor:
        mirrored = features.index_select(-1, self.order) * self.signs
        answers = []
        for network in self.networks:
            answers.append(network(features))
            other = network(mirrored).reshape(-1, COUNT, len(self.across))
            answers.append((other.index_select(1, self.joints) * self.across).flatten(1))
        return torch.cat(answers, -1)
