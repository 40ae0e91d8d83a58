"""A Gaussian of poses over time, in own coordinates: the mean of hidden joints given what is measured now and what was before.

A pose is mean + basis x latents + noise (principal components, a noise for each coordinate). Latents after a time follow from those
at its begin and from how they were changing, linearly, with a spread; both were fitted for a few times. Whatever has to be
inverted is small and near enough to the identity for Newton and Schulz's iteration, which takes products alone and so runs in every
runtime.
"""

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from ..joints import COUNT, mirrored
from ..person import person_frame, sizes
from ..recordings import Prepared, kind_of

ITERATIONS = 9
LAGS = (1, 2, 4, 8, 15, 30, 60)
"""Poses."""
CHANGE = 2
"""Poses over which the change of latents is taken."""
FADES = 15.0
"""What the latents do not describe of a pose fades over so many poses."""


def own_spans(prepared: Prepared) -> list[tuple[np.ndarray, float]]:
    """(span (n, 75) in own coordinates, weight of each of its poses), as recorded and mirrored; even over kinds of motion."""
    kinds = [kind_of(name) for name in prepared.names]
    frames_of = {kind: 0 for kind in kinds}
    for kind, (_, span) in zip(kinds, prepared.spans()):
        frames_of[kind] += len(span)
    spans = []
    for kind, (_, span) in zip(kinds, prepared.spans()):
        for one in (span, mirrored(span)):
            own, _, _ = person_frame(one)
            spans.append(((own / sizes(one).mean()).reshape(len(one), -1).astype(np.float64), frames_of[kind] ** -0.25))
    return spans


class Anchor(NamedTuple):
    """Poses at which joints were seen, for m groups of joints."""

    pose: Tensor
    """(n, m, 75) own coordinates."""
    earlier: Tensor
    """(n, m, 75) `CHANGE` poses further away."""
    lag: Tensor
    """(n, m) how many poses away."""


class PosePrior(nn.Module):
    """Conditional means and deviations; its numbers are fitted, not trained."""

    def __init__(self, latents: int = 28):
        super().__init__()
        self.register_buffer("mean", torch.zeros(3 * COUNT))
        self.register_buffer("basis", torch.zeros(3 * COUNT, latents))
        self.register_buffer("root_variance", torch.ones(latents))
        self.register_buffer("precision", torch.ones(3 * COUNT))
        self.register_buffer("carry", torch.zeros(len(LAGS), latents, 2 * latents))
        self.register_buffer("spread", torch.zeros(len(LAGS), latents, latents))
        self.register_buffer("said", torch.zeros(len(LAGS), latents, latents))
        self.register_buffer("first_guess", torch.ones(()))

    def fit(self, spans: list[tuple[np.ndarray, float]], noise_m: float = 0.015) -> None:
        """From complete poses, see `own_spans`."""
        flat = np.concatenate([span for span, _ in spans])
        weights = np.concatenate([np.full(len(span), weight) for span, weight in spans])
        weights /= weights.sum()
        mean = weights @ flat
        covariance = ((flat - mean) * weights[:, None]).T @ (flat - mean)
        latents = self.basis.shape[1]
        values, vectors = np.linalg.eigh(covariance)
        basis, variance = vectors[:, -latents:], values[-latents:]
        noise = np.diag(covariance) - (basis**2 * variance).sum(axis=1) + noise_m**2
        self.mean.copy_(torch.from_numpy(mean))
        self.basis.copy_(torch.from_numpy(basis))
        self.root_variance.copy_(torch.from_numpy(np.sqrt(variance)))
        self.precision.copy_(torch.from_numpy(1 / noise))
        # Backwards, motion looks as natural to a Gaussian, and there is twice as much of it.
        ways = [((span - mean) @ basis, weight) for span, weight in spans]
        ways += [(way[::-1], weight) for way, weight in ways]
        largest = 1.0
        seen = (basis / noise[:, None]).T @ basis
        for index, lag in enumerate(LAGS):
            carry, spread = _carried(ways, lag)
            root = np.linalg.cholesky(spread)
            self.carry[index] = torch.from_numpy(carry)
            self.spread[index] = torch.from_numpy(root)
            # What a pose says of another that far away, beyond what is known of any pose.
            strength, axes = np.linalg.eigh(np.linalg.inv(spread) - np.diag(1 / variance))
            self.said[index] = torch.from_numpy((axes * strength.clip(0)) @ axes.T)
            largest = max(largest, np.linalg.eigvalsh(root.T @ seen @ root)[-1])
        whole = np.sqrt(variance)
        largest = max(largest, np.linalg.eigvalsh(whole[:, None] * seen * whole)[-1])
        # Between two fitted times the roots are interpolated; a little room is left for that.
        self.first_guess.copy_(torch.tensor(2 / (2 + 1.1 * largest)))

    @property
    def usual(self) -> Tensor:
        """(25, 3) the mean pose."""
        return self.mean.reshape(COUNT, 3)

    def information(self, mask: Tensor) -> tuple[Tensor, Tensor]:
        """(precision of each coordinate as it is measured (n, 75), what that says of the latents (n, latents, latents))."""
        variance = weak_sigma_m(mask) ** 2
        trust = torch.stack(3 * [(mask > 0).float()], -1).flatten(1) / (1 / self.precision + torch.stack(3 * [variance], -1).flatten(1))
        return trust, torch.matmul(self.basis.T, trust[..., None] * self.basis)

    def given(self, trust: Tensor, information: Tensor, own: Tensor) -> Tensor:
        """Mean of all joints (n, m, 75) given the measured ones of poses `own` (n, m, 75), each for itself."""
        inner = self._eye() + self.root_variance[:, None] * information * self.root_variance
        pull = torch.matmul((own - self.mean) * trust[:, None], self.basis) * self.root_variance
        return self.mean + torch.matmul(torch.matmul(pull, self._inverse(inner)) * self.root_variance, self.basis.T)

    def carried(self, trust: Tensor, information: Tensor, now: Tensor, anchor: "Anchor") -> tuple[Tensor, Tensor]:
        """(mean (n, m, 75), deviation (n, m, 25)) of the pose `now` (n, 75), some joints of which `trust` says are measured, given
        also what was at the anchor."""
        expected, left = self.expected(anchor)
        root = self._at(self.spread, anchor.lag)
        inverse = self._inverse(self._eye() + torch.matmul(torch.matmul(root.transpose(-1, -2), information[:, None]), root))
        missed = (now - self.mean)[:, None] - torch.matmul(expected, self.basis.T)
        return self._settled(expected, left * torch.exp(-anchor.lag / FADES)[..., None], root, inverse, torch.matmul(missed * trust[:, None], self.basis))

    def between(self, trust: Tensor, information: Tensor, now: Tensor, past: "Anchor", next_: "Anchor", ends: Tensor) -> tuple[Tensor, Tensor]:
        """The same given anchors on both sides; `ends` (n, m) is 0 where there is none to come.

        The nearer anchor is what is expected beforehand, the other one counts as a measurement: so what is inverted stays near the
        identity.
        """
        (from_past, left_past), (from_next, left_next) = self.expected(past), self.expected(next_)
        ends = ends[..., None]
        first = torch.maximum((past.lag <= next_.lag).float()[..., None], 1 - ends)
        near, far = first * from_past + (1 - first) * from_next, first * from_next + (1 - first) * from_past
        lag_near = first[..., 0] * past.lag + (1 - first[..., 0]) * next_.lag
        root = self._at(self.spread, lag_near)
        said = self._at(self.said, past.lag + next_.lag - lag_near) * ends[..., None]
        known = information[:, None] + said
        inverse = self._inverse(self._eye() + torch.matmul(torch.matmul(root.transpose(-1, -2), known), root))
        missed = (now - self.mean)[:, None] - torch.matmul(near, self.basis.T)
        pull = torch.matmul(missed * trust[:, None], self.basis)
        pull = pull + torch.matmul(said, (far - near)[..., None])[..., 0] + ends * far / self.root_variance**2
        share = (past.lag / (past.lag + next_.lag).clamp(min=1e-3))[..., None]
        left = ends * (left_past * (1 - share) + left_next * share) + (1 - ends) * left_past * torch.exp(-past.lag / FADES)[..., None]
        return self._settled(near, left, root, inverse, pull)

    def expected(self, anchor: "Anchor") -> tuple[Tensor, Tensor]:
        """(latents (n, m, latents) that follow from an anchor, what latents do not describe of it (n, m, 75))."""
        latents = self.basis.shape[1]
        before, change = torch.matmul(anchor.pose - self.mean, self.basis), torch.matmul(anchor.pose - anchor.earlier, self.basis)
        share = _shares(anchor.lag)
        carry = torch.matmul(share, self.carry.flatten(1)).reshape(*share.shape[:2], latents, 2 * latents)
        left = anchor.pose - self.mean - torch.matmul(before, self.basis.T)
        return torch.matmul(carry, torch.cat([before, change], -1)[..., None])[..., 0], left

    def _settled(self, expected: Tensor, left: Tensor, root: Tensor, inverse: Tensor, pull: Tensor) -> tuple[Tensor, Tensor]:
        gained = torch.matmul(root, torch.matmul(inverse, torch.matmul(root.transpose(-1, -2), pull[..., None])))[..., 0]
        mean = self.mean + torch.matmul(expected + gained, self.basis.T) + left
        spans = torch.matmul(self.basis, root)
        variance = (torch.matmul(spans, inverse) * spans).sum(-1).clamp(min=0) + 1 / self.precision
        return mean, torch.sqrt(variance.reshape(*expected.shape[:2], COUNT, 3).mean(-1))

    def _at(self, matrices: Tensor, lag: Tensor) -> Tensor:
        """Of matrices fitted at `LAGS` what holds at `lag` (n, m): (n, m, latents, latents)."""
        share = _shares(lag)
        return torch.matmul(share, matrices.flatten(1)).reshape(*share.shape[:2], *matrices.shape[1:])

    def _eye(self) -> Tensor:
        return torch.eye(self.basis.shape[1], device=self.basis.device)

    def _inverse(self, inner: Tensor) -> Tensor:
        """Of identity + something of which `first_guess` knows how large it can be.

        Each step is scaled so that the largest errors to either side are the same, which halves the steps needed.
        """
        eye = self._eye()
        guess, error = self.first_guess * eye, 1 - self.first_guess
        for _ in range(ITERATIONS):
            stretch = 2 / (2 - error * error)
            guess = stretch * torch.matmul(guess, 2 * eye - torch.matmul(inner, guess))
            error = error * error * stretch / 2
        return guess


def weak_sigma_m(mask: Tensor) -> Tensor:
    """The standard deviation that a weight stands for, metres: 0 for 1; see `WindowJoint` of the engine."""
    return 0.05 * torch.sqrt((1 / mask.clamp(0.05, 1) - 1).clamp(min=0))


def _carried(ways: list[tuple[np.ndarray, float]], lag: int) -> tuple[np.ndarray, np.ndarray]:
    """Least squares from latents and their change to the latents `lag` poses later, and the covariance of what is left."""
    begin, end, weights = [], [], []
    for way, weight in ways:
        if len(way) > lag + CHANGE:
            start = way[CHANGE:-lag]
            begin.append(np.concatenate([start, start - way[: -lag - CHANGE]], axis=1))
            end.append(way[lag + CHANGE :])
            weights.append(np.full(len(start), weight))
    begin, end, weights = np.concatenate(begin), np.concatenate(end), np.concatenate(weights)
    weighted = begin * weights[:, None]
    little = 1e-6 * weights.sum() * np.eye(begin.shape[1])
    carry = np.linalg.solve(weighted.T @ begin + little, weighted.T @ end).T
    left = end - begin @ carry.T
    spread = (left * weights[:, None]).T @ left / weights.sum()
    return carry, spread + 1e-7 * np.eye(len(spread))


def _shares(lag: Tensor) -> Tensor:
    """Weights (..., times) with which what was fitted at `LAGS` makes up what holds at `lag`."""
    lag = lag.clamp(LAGS[0], LAGS[-1])[..., None]
    parts = []
    for index, own in enumerate(LAGS):
        part = torch.ones_like(lag)
        if index > 0:
            part = torch.minimum(part, (lag - LAGS[index - 1]) / (own - LAGS[index - 1]))
        if index + 1 < len(LAGS):
            part = torch.minimum(part, (LAGS[index + 1] - lag) / (LAGS[index + 1] - own))
        parts.append(part.clamp(min=0))
    return torch.cat(parts, -1)
