"""Weak measurements: a tracker's guesses, one pose after another off by nearly the same, and means of them over some time."""

import torch
from torch import Tensor

from .. import RATE_HZ
from .side import CORE
from .weighing import TRUSTED

GUESS_FADES_S = (0.2, 0.7, 3.0)
"""Weak measurements are averaged with weights that fade over so long."""
ALL_FADE_S = 0.7
"""And those with trust together with them: trackers are sure of some of their guesses."""
SEEN_OVER = (10, 40)
"""Poses over which it is told how often a joint was trusted."""
GUESSES = 1 + len(GUESS_FADES_S) + 1
SCALARS = 1 + len(SEEN_OVER)


def guesses(own: Tensor, mask: Tensor, filled: int, instead: Tensor) -> tuple[list[Tensor], list[Tensor]]:
    """(`GUESSES` continuations (n, 25, 3), features: as many vectors and `SCALARS` scalars of joints in `CORE`).

    `own` (n, t, 25, 3) own coordinates, `filled` the number of the pose that is filled. Where nobody guesses, `instead` stands
    in: belief in a guess that there is not does no harm.
    """
    sure = mask[:, filled]
    weak = ((sure > 0) & (sure < TRUSTED)).float()[..., None]
    means, evidence = averaged(own, mask, filled)
    found = [weak * guess + (1 - weak) * instead for guess in [own[:, filled], *means]]
    features = [((guess - instead) * weak)[:, CORE].flatten(1) for guess in found]
    features.append((evidence * weak[..., 0])[:, CORE])
    trusted, hidden = (mask >= TRUSTED).float(), (sure < TRUSTED).float()
    for over in SEEN_OVER:
        near = slice(max(filled + 1 - over, 0), filled + over)
        features.append((trusted[:, near].mean(1) * hidden)[:, CORE])
    return found, features


def averaged(own: Tensor, mask: Tensor, filled: int) -> tuple[list[Tensor], Tensor]:
    """(means (n, 25, 3) of the weak measurements over each of `GUESS_FADES_S` and of all measurements, how many weak ones (n, 25))."""
    away = (torch.arange(own.shape[1], dtype=torch.float32, device=own.device) - filled).abs()
    weights = mask.transpose(1, 2)
    weak = weights * (weights < TRUSTED).float()
    shares = [weak * torch.exp(-away / (fade_s * RATE_HZ)) for fade_s in GUESS_FADES_S]
    shares.append(weights * torch.exp(-away / (ALL_FADE_S * RATE_HZ)))
    share = torch.stack(shares, 2)
    total = share.sum(-1)
    # (n, 25, fades, t) with (n, 25, t, 3).
    means = torch.matmul(share, own.permute(0, 2, 1, 3)) / total.clamp(min=1e-4)[..., None]
    return [means[:, :, index] for index in range(len(shares))], 0.1 * total[..., len(GUESS_FADES_S) - 1]


def since_trusted(mask: Tensor, age: Tensor) -> Tensor:
    """(n, 25) seconds from when each joint was last measured with trust to the last pose, as far as the window says."""
    poses = mask.shape[1]
    back = torch.arange(poses - 1, -1, -1, dtype=torch.float32, device=mask.device)[None, :, None]
    steps = (back + poses * (mask < TRUSTED).float()).amin(1).clamp(max=poses)
    unknown = (steps >= poses).float()
    return (1 - unknown) * steps / RATE_HZ + unknown * age[:, -1].clamp(min=poses / RATE_HZ)
