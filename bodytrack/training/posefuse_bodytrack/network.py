"""From a crop to joints: a small convolutional network whose cells vote.

After Xiong et al., "A2J: Anchor-to-Joint Regression Network for 3D Articulated Pose Estimation" (2019): every cell of a coarse map is
an anchor that says how far from it each joint is and how much it knows about that joint; a joint is the mean of what the
anchors say. Built anew and much smaller: plain convolutions, one map, and what else is asked (spread, visibility, hands) is told
from the features that the joint's own anchors look at.
"""

import torch
from torch import nn

from . import joints

ANCHORS = 8


def _conv(into, out, stride=1, kernel=3):
    return nn.Sequential(
        nn.Conv2d(into, out, kernel, stride, kernel // 2, bias=False), nn.BatchNorm2d(out), nn.ReLU(inplace=True)
    )


class Residual(nn.Module):
    """Two convolutions beside a way around them."""

    def __init__(self, width):
        super().__init__()
        self.first = _conv(width, width)
        self.second = nn.Sequential(nn.Conv2d(width, width, 3, 1, 1, bias=False), nn.BatchNorm2d(width))

    def forward(self, x):
        return torch.relu(x + self.second(self.first(x)))


class Network(nn.Module):
    """`crop` [N, 2, 64, 64] to joints [N, 25, 3] and sigma [N, 25] (metres, the error's standard deviation along an axis), logits of
    visible [N, 25], heading [N, 2] of any length, logits of hands [N, 2].
    """

    def __init__(self, width=24, blocks=(0, 1, 2)):
        super().__init__()
        self.config = {"width": width, "blocks": list(blocks)}
        w = width
        self.body = nn.Sequential(
            _conv(joints.CHANNELS, w, 2, 5),
            *[Residual(w) for _ in range(blocks[0])],
            _conv(w, 2 * w, 2),
            *[Residual(2 * w) for _ in range(blocks[1])],
            _conv(2 * w, 4 * w, 2),
            *[Residual(4 * w) for _ in range(blocks[2])],
        )
        features = 4 * w
        self.votes = nn.Conv2d(features, joints.COUNT * 4, 1)
        # All of the person, for each cell: which way they face is told far from the hand whose side depends on it.
        self.overview = nn.Sequential(nn.Linear(features * 4, features), nn.ReLU(inplace=True))
        self.spread_overview = nn.Linear(features, features)
        self.mixed = Residual(features)
        self.about = nn.Linear(features, 2 * joints.COUNT)
        self.hands = nn.Linear(features, 2)
        self.heading = nn.Sequential(nn.Linear(2 * features, features), nn.ReLU(inplace=True), nn.Linear(features, 2))
        side = (torch.arange(ANCHORS) + 0.5 - ANCHORS / 2) * (joints.WINDOW_M / ANCHORS)
        y, x = torch.meshgrid(side, side, indexing="ij")
        anchors = torch.stack([x.flatten(), y.flatten(), torch.zeros(ANCHORS * ANCHORS)])
        self.register_buffer("anchors", anchors[None, None])

    def forward(self, crop):
        map_ = self.body(crop)
        quarters = nn.functional.avg_pool2d(map_, ANCHORS // 2).flatten(1)
        overview = self.overview(quarters)
        map_ = self.mixed(torch.relu(map_ + self.spread_overview(overview)[:, :, None, None]))
        cells = map_.flatten(2)
        votes = self.votes(map_).reshape(-1, joints.COUNT, 4, ANCHORS * ANCHORS)
        weight = torch.softmax(votes[:, :, 0], dim=-1)
        points = votes[:, :, 1:] + self.anchors
        found = (points * weight[:, :, None]).sum(-1)
        # N x 25 x features: what the anchors of each joint see.
        seen = weight @ cells.transpose(1, 2)
        table = self.about.weight.reshape(2, joints.COUNT, -1)
        bias = self.about.bias.reshape(2, joints.COUNT)
        log_sigma = (seen * table[0]).sum(-1) + bias[0]
        visible = (seen * table[1]).sum(-1) + bias[1]
        palms = torch.stack([seen[:, joints.INDEX["HandLeft"]], seen[:, joints.INDEX["HandRight"]]], 1)
        hands = (palms * self.hands.weight).sum(-1) + self.hands.bias
        heading = self.heading(torch.cat([overview, cells.mean(-1)], 1))
        sigma = 0.01 + 0.6 * torch.sigmoid(log_sigma - 1.5)
        return found, sigma, visible, heading, hands


class Exported(nn.Module):
    """The network with the interface that the program knows: probabilities, and a heading of length 1.

    With `mirror` it is asked about the crop and about its mirror image, and the mean counts: nothing then depends on the side.
    """

    def __init__(self, network, mirror=False):
        super().__init__()
        self.network, self.mirror = network, mirror
        self.register_buffer("columns", torch.arange(joints.SIZE - 1, -1, -1))
        self.register_buffer("mirrored", torch.tensor(joints.MIRRORED))
        self.register_buffer("other_hand", torch.tensor([1, 0]))
        self.register_buffer("x_turned", torch.tensor([-1.0, 1.0, 1.0]))

    def forward(self, crop):
        found, sigma, visible, heading, hands = self.network(crop)
        if self.mirror:
            other = self.network(crop.index_select(3, self.columns))
            found = 0.5 * (found + other[0].index_select(1, self.mirrored) * self.x_turned)
            sigma = 0.5 * (sigma + other[1].index_select(1, self.mirrored))
            visible = 0.5 * (visible + other[2].index_select(1, self.mirrored))
            heading = heading + other[3] * self.x_turned[:2]
            hands = 0.5 * (hands + other[4].index_select(1, self.other_hand))
        visible, hands = torch.sigmoid(visible), torch.sigmoid(hands)
        heading = heading / (heading.square().sum(1, keepdim=True) + 1e-6).sqrt()
        return found, sigma, visible, heading, hands
