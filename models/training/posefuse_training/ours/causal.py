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
from ..joints import ARM_LEFT, ARM_RIGHT, COUNT, LEG_LEFT, LEG_RIGHT
from .frames import Frames, frames, look_back, turned_in
from .network import Perceptron
from .prior import CHANGE, PosePrior

POSES = 64
CORE = list(range(21))
"""Thumbs and finger tips follow the hand: they are filled, but nothing is learned from them."""
GROUPS = (ARM_LEFT, ARM_RIGHT, LEG_LEFT, LEG_RIGHT, (0, 1, 2, 3, 4, 8, 12, 16, 20))
SPEED_LAGS = (2, 5, 10, 20, 40)
POSE_LAGS = (8, 16, 24, 32, 44, 60)
BEFORE_LOSS = (2, 5)
"""Poses before a joint was lost against which its speed is measured."""
CONTINUATIONS = 8
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
        features = 3 * core * (8 + len(BEFORE_LOSS) + len(SPEED_LAGS) + len(POSE_LAGS)) + 5 * core + 5 * len(SPEED_LAGS) + 2
        self.network = Perceptron(features, width, blocks, COUNT * (3 + CONTINUATIONS + 1), dropout, dropped_features)
        group = torch.zeros(len(GROUPS), COUNT)
        for index, joints in enumerate(GROUPS):
            group[index, list(joints)] = 1
        self.register_buffer("group", group, persistent=False)

    def begin(self, features: Tensor) -> None:
        """Before training: standardises by these features, and leans on the continuation that is best by itself."""
        self.network.standardise.fit(features)
        with torch.no_grad():
            self.network.last[1].bias.view(COUNT, -1)[:, 3 + CONTINUATIONS - 1] = 2.0

    def forward(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Tensor, Tensor]:
        told, whole = self.told(pose, mask, age)
        newest, sigma = self.answer(told)
        newest_frame = whole._replace(forward=whole.forward[:, -1:], origin=whole.origin[:, -1:])
        return newest_frame.room(newest[:, None]), (sigma * whole.size[:, 0, 0])[:, None]

    def told(self, pose: Tensor, mask: Tensor, age: Tensor) -> tuple["Told", Frames]:
        """What the network is given; nothing in it is trained."""
        whole = frames(pose, mask, self.prior.usual)
        ways, features = self.continuations(whole, whole.own(pose), pose, mask, age)
        return Told(torch.cat(features, -1), ways, age[:, -1], mask[:, -1]), whole

    def answer(self, told: "Told") -> tuple[Tensor, Tensor]:
        """The newest pose (n, 25, 3) and its deviations (n, 25), own units."""
        answer = self.network(told.features).reshape(-1, COUNT, 3 + CONTINUATIONS + 1)
        belief = torch.softmax(answer[..., 3:-1], -1)
        freedom = torch.maximum(1 - torch.exp(-told.seconds / 0.15), 1 - told.sure)
        added = REACH_M * freedom[..., None] * torch.tanh(answer[..., :3])
        scale = 0.008 + 0.15 * (1 - torch.exp(-told.seconds / 0.5)) + 0.01 * (1 - told.sure)
        return (told.ways * belief[..., None]).sum(2) + added, scale * torch.exp(answer[..., -1].clamp(-2.5, 2.5))

    def continuations(self, whole, own: Tensor, pose: Tensor, mask: Tensor, age: Tensor) -> tuple[Tensor, list[Tensor]]:
        """((n, 25, continuations, 3) in own coordinates, what the network is told)."""
        poses = own.shape[1]
        now, seen = own[:, -1], (mask[:, -1] > 0).float()
        hidden = (1 - seen)[..., None]
        steps = age[:, -1] * RATE_HZ
        last = _pick(look_back(steps, poses), own)
        in_room = now
        speeds, room_speed = [], None
        measured = (mask > 0).float()
        for back in BEFORE_LOSS:
            earlier = look_back(steps + back, poses)
            known = (torch.matmul(earlier[:, :, None], measured.transpose(1, 2)[..., None])[..., 0] > 0.5).float()
            speeds.append((last - _pick(earlier, own)) * known * (RATE_HZ / back))
            if room_speed is None:
                moved = (pose[:, -1] - _pick(earlier, pose)) * known * (RATE_HZ / back)
                room_speed = turned_in(whole.forward[:, -1:], moved) / whole.size[:, 0]
        mean, offset, carried, deviation = self.conditional(own, mask[:, -1], steps)
        seconds = age[:, -1][..., None]
        short, long = (1 - torch.exp(-seconds / fade) for fade in (0.12, 0.3))
        following = mean + offset * torch.exp(-seconds / 0.4)
        ways = torch.stack(
            [
                last,
                in_room,
                last + 0.3 * long * speeds[0],
                last + 0.12 * short * speeds[1],
                in_room + 0.2 * (1 - torch.exp(-seconds / 0.2)) * room_speed,
                following,
                mean + offset * torch.exp(-seconds / 2),
                carried,
            ],
            2,
        )
        # What is measured stays what it is, in every continuation.
        ways = seen[..., None, None] * now[:, :, None] + (1 - seen[..., None, None]) * ways
        told = [now * (1 - hidden), last * hidden, mean * hidden, offset * hidden, (carried - last) * hidden]
        told += [(in_room - last) * hidden, room_speed * hidden * 0.2, (mean - now) * (1 - hidden)]
        told += [speed * hidden * 0.2 for speed in speeds]
        features = [part[:, CORE].flatten(1) for part in told]
        features += self.history(whole, own, mask)
        features += [mask[:, -1, CORE], torch.exp(-age[:, -1, CORE] / 0.15), torch.exp(-age[:, -1, CORE] / 0.6)]
        features += [age[:, -1, CORE].clamp(max=3), (deviation * hidden[..., 0])[:, CORE]]
        features += [whole.origin[:, -1, 2:3], whole.size[:, 0, 0]]
        return ways, features

    def conditional(self, own: Tensor, mask: Tensor, steps: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Mean given what is seen now; how far each joint was from that when it was last seen; mean and deviation given what was seen
        then, too. Joints of one limb are taken to have been lost together."""
        poses = own.shape[1]
        flat = own.flatten(2)
        now = flat[:, -1]
        lost = (steps[:, None] * self.group).amax(-1)
        then = torch.matmul(look_back(lost, poses), flat)
        earlier = torch.matmul(look_back(lost + CHANGE, poses), flat)
        trust, information = self.prior.information(mask)
        means = self.prior.given(trust, information, torch.cat([now[:, None], then], 1))
        carried, deviation = self.prior.carried(trust, information, now, then, earlier, lost)
        offset = self._of_groups((then - means[:, 1:]).reshape(-1, len(GROUPS), COUNT, 3))
        carried = self._of_groups(carried.reshape(-1, len(GROUPS), COUNT, 3))
        return means[:, 0].reshape(-1, COUNT, 3), offset, carried, self._of_groups(deviation[..., None])[..., 0]

    def _of_groups(self, values: Tensor) -> Tensor:
        """For each joint what its own limb says: (n, groups, 25, c) to (n, 25, c)."""
        return (values * self.group[None, :, :, None]).sum(1)

    def history(self, whole, own: Tensor, mask: Tensor) -> list[Tensor]:
        """How the joints, the person and their heading changed, and some earlier poses; zero where not measured."""
        newest = own.shape[1] - 1
        speeds = [newest - lag for lag in SPEED_LAGS]
        both = mask[:, speeds][..., CORE] * mask[:, -1:, CORE]
        changed = (own[:, -1:, CORE] - own[:, speeds][:, :, CORE]) * both[..., None]
        poses = [newest - lag for lag in POSE_LAGS]
        earlier = (own[:, poses][:, :, CORE] - self.prior.usual[CORE]) * mask[:, poses][..., CORE][..., None]
        forward = whole.forward[:, -1:]
        way = turned_in(forward, whole.origin[:, -1:] - whole.origin[:, speeds]) / whole.size[:, :, 0]
        then = whole.forward[:, speeds]
        turn = torch.stack([(then * forward).sum(-1), then[..., 0] * forward[..., 1] - then[..., 1] * forward[..., 0]], -1)
        return [changed.flatten(1), earlier.flatten(1), way.flatten(1), turn.flatten(1)]


def _pick(weights: Tensor, values: Tensor) -> Tensor:
    """For each joint its own pose: weights (n, 25, t), values (n, t, 25, 3) to (n, 25, 3)."""
    return torch.matmul(weights[:, :, None], values.transpose(1, 2))[:, :, 0]
