"""A person made by formula, for tests: walks along and swings arms and legs."""

import numpy as np

STANDING = np.array([
    [0, 0, .95], [0, 0, 1.2], [0, 0, 1.55], [0, 0, 1.7], [0, .18, 1.4], [.02, .24, 1.13], [.1, .25, .9], [.13, .25, .83],
    [0, -.18, 1.4], [.02, -.24, 1.13], [.1, -.25, .9], [.13, -.25, .83], [0, .09, .9], [.03, .1, .5], [-.02, .1, .1], [.1, .1, .05],
    [0, -.09, .9], [.03, -.1, .5], [-.02, -.1, .1], [.1, -.1, .05], [0, 0, 1.42], [.15, .25, .76], [.16, .22, .82], [.15, -.25, .76],
    [.16, -.22, .82]], np.float32)
LIMBS = {4: (5, 6, 7, 21, 22), 8: (9, 10, 11, 23, 24), 12: (13, 14, 15), 16: (17, 18, 19)}


def walking(frames: int, phase: float = 0.0) -> np.ndarray:
    """(frames, 25, 3) metres; limbs turn stiffly about shoulders and hips, so that bones keep their lengths."""
    time = np.arange(frames) / 30
    poses = np.repeat(STANDING[None], frames, axis=0)
    for number, (pivot, joints) in enumerate(LIMBS.items()):
        angle = 0.5 * np.sin(2 * np.pi * time + phase + np.pi * number)[:, None]
        arm = poses[:, list(joints)] - poses[:, [pivot]]
        x = arm[..., 0] * np.cos(angle) + arm[..., 2] * np.sin(angle)
        z = -arm[..., 0] * np.sin(angle) + arm[..., 2] * np.cos(angle)
        poses[:, list(joints)] = np.stack([x, arm[..., 1], z], -1) + poses[:, [pivot]]
    return (poses + np.array([1.0, 0.2, 0]) * time[:, None, None]).astype(np.float32)
