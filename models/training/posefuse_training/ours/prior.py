"""A Gaussian of whole poses in own coordinates: the mean of hidden joints given any set of measured ones.

A factor model (probabilistic PCA with a noise for each coordinate): poses are mean + loadings x factors + noise. The factors
given what is measured follow from one small inverse, which Newton and Schulz's iteration finds with products alone, so that it
runs in every runtime.
"""

import numpy as np
import torch
from torch import Tensor, nn

from ..joints import COUNT, mirrored
from ..person import person_frame, sizes
from ..recordings import Prepared, kind_of

ITERATIONS = 16


def own_poses(prepared: Prepared, every: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """(poses (n, 25, 3) in own coordinates, both as recorded and mirrored; weight of each, even over kinds of motion)."""
    poses, weights = [], []
    kinds = [kind_of(name) for name in prepared.names]
    frames_of = {kind: 0 for kind in kinds}
    for kind, (_, span) in zip(kinds, prepared.spans()):
        frames_of[kind] += len(span)
    for kind, (_, span) in zip(kinds, prepared.spans()):
        for chosen in (span[::every], mirrored(span[::every])):
            own, _, _ = person_frame(chosen)
            poses.append(own / sizes(chosen)[:, None, None])
            weights.append(np.full(len(chosen), frames_of[kind] ** -0.5))
    return np.concatenate(poses), np.concatenate(weights)


class PosePrior(nn.Module):
    """Conditional means and deviations; its numbers are fitted, not trained."""

    def __init__(self, factors: int = 24):
        super().__init__()
        self.register_buffer("mean", torch.zeros(3 * COUNT))
        self.register_buffer("loadings", torch.zeros(3 * COUNT, factors))
        self.register_buffer("precision", torch.ones(3 * COUNT))
        self.register_buffer("first_guess", torch.ones(()))

    def fit(self, poses: np.ndarray, weights: np.ndarray, noise_m: float = 0.012) -> None:
        """From complete poses (n, 25, 3) in own coordinates."""
        flat = poses.reshape(len(poses), -1).astype(np.float64)
        weights = weights / weights.sum()
        mean = weights @ flat
        covariance = ((flat - mean) * weights[:, None]).T @ (flat - mean)
        factors = self.loadings.shape[1]
        values, vectors = np.linalg.eigh(covariance)
        loadings = vectors[:, -factors:] * np.sqrt(values[-factors:])
        noise = np.diag(covariance) - (loadings**2).sum(axis=1) + noise_m**2
        inner = np.eye(factors) + (loadings / noise[:, None]).T @ loadings
        self.mean.copy_(torch.from_numpy(mean))
        self.loadings.copy_(torch.from_numpy(loadings))
        self.precision.copy_(torch.from_numpy(1 / noise))
        self.first_guess.copy_(torch.tensor(2 / (1 + np.linalg.eigvalsh(inner)[-1])))

    @property
    def usual(self) -> Tensor:
        """(25, 3) the mean pose."""
        return self.mean.reshape(COUNT, 3)

    def inverse(self, mask: Tensor) -> Tensor:
        """Covariance of the factors given what `mask` (n, 25) says is measured: (n, factors, factors)."""
        trust = torch.stack([mask, mask, mask], -1).flatten(1) * self.precision
        eye = torch.eye(self.loadings.shape[1], device=mask.device)
        inner = eye + torch.matmul(self.loadings.T, trust[..., None] * self.loadings)
        guess = self.first_guess * eye
        guess = 2 * guess - self.first_guess**2 * inner
        for _ in range(ITERATIONS):
            guess = torch.matmul(guess, 2 * eye - torch.matmul(inner, guess))
        return guess

    def given(self, inverse: Tensor, mask: Tensor, own: Tensor) -> Tensor:
        """Mean of all joints (n, m, 75) given the measured ones of poses `own` (n, m, 75), with one mask (n, 25) for all m."""
        trust = torch.stack([mask, mask, mask], -1).flatten(1) * self.precision
        pull = torch.matmul((own - self.mean) * trust[:, None], self.loadings)
        return self.mean + torch.matmul(torch.matmul(pull, inverse), self.loadings.T)

    def deviation(self, inverse: Tensor) -> Tensor:
        """Standard deviation of each joint along an axis (n, 25), own units."""
        spread = (torch.matmul(self.loadings, inverse) * self.loadings).sum(-1).clamp(min=0) + 1 / self.precision
        return torch.sqrt(spread.reshape(-1, COUNT, 3).mean(-1))
