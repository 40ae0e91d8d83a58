"""Trains, exports and measures Posefuse's occlusion models.

Poses are arrays of shape (..., 25, 3): metres, room axes (x forward, y left, z up, floor at z = 0), 30 poses a second,
joints in the order of `joints.NAMES`. Whatever needs no gradient is NumPy, so that it can be tested without PyTorch.
"""

RATE_HZ = 30.0
MAX_AGE_S = 10.0
