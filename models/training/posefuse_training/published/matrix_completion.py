"""Matrix completion, what the sparse dictionary is compared with."""

import torch


def completed(points, known, weight=0.2, rounds=200):
    """A clip `[T, J, 3]` with what is not `known` `[T, J]` made up so that the matrix of frames has low rank.

    Soft-impute (Mazumder, Hastie and Tibshirani 2010): fill in, shrink the singular values by `weight` times the largest, again;
    the weight falls over the rounds.
    """
    flat = points.flatten(1)
    mask = known.unsqueeze(-1).expand_as(points).flatten(1)
    mean = (flat * mask).sum(0) / mask.sum(0).clamp(min=1.0)
    x = (flat - mean) * mask
    for k in range(rounds):
        # Of a tall matrix: the right singular vectors from its small product.
        values, v = torch.linalg.eigh(x.T @ x)
        s = values.clamp(min=1e-9).sqrt()
        keep = torch.relu(1.0 - s[-1] * max(weight * 0.95**k, 1e-3) / s)
        low = x @ (v * keep) @ v.T
        after = torch.where(mask > 0, (flat - mean), low)
        if (after - x).abs().max() < 1e-5:
            break
        x = after
    return (x + mean).view_as(points)
