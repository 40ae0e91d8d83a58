"""The canonical joint set: order, parents, mirror images, and the parts of the body that gaps hide."""

import numpy as np

NAMES = (
    "SpineBase", "SpineMid", "Neck", "Head",
    "ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft",
    "ShoulderRight", "ElbowRight", "WristRight", "HandRight",
    "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft",
    "HipRight", "KneeRight", "AnkleRight", "FootRight",
    "SpineShoulder", "HandTipLeft", "ThumbLeft", "HandTipRight", "ThumbRight",
)
COUNT = len(NAMES)
INDEX = {name: index for index, name in enumerate(NAMES)}

# The root, SpineBase, is its own parent.
PARENTS = np.array([0, 0, 20, 2, 20, 4, 5, 6, 20, 8, 9, 10, 0, 12, 13, 14, 0, 16, 17, 18, 1, 7, 7, 11, 11])
BONES = np.array([joint for joint in range(COUNT) if PARENTS[joint] != joint])
TREE = (0, 1, 20, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 21, 22, 23, 24)
"""All joints, each after the one it hangs on."""


def _mirror() -> np.ndarray:
    swap = {"Left": "Right", "Right": "Left"}
    other = list(range(COUNT))
    for name, index in INDEX.items():
        for side, opposite in swap.items():
            if name.endswith(side):
                other[index] = INDEX[name.removesuffix(side) + opposite]
    return np.array(other)


MIRROR = _mirror()

ARM_LEFT, ARM_RIGHT = (5, 6, 7, 21, 22), (9, 10, 11, 23, 24)
LEG_LEFT, LEG_RIGHT = (13, 14, 15), (17, 18, 19)
LIMBS = {"arm left": ARM_LEFT, "arm right": ARM_RIGHT, "leg left": LEG_LEFT, "leg right": LEG_RIGHT}
LOWER_BODY = (0, 12, 16, *LEG_LEFT, *LEG_RIGHT)

# What the table of `posefuse evaluate repair` hides; where there are two variants they alternate.
PARTS = {
    "arm": (ARM_LEFT, ARM_RIGHT),
    "leg": (LEG_LEFT, LEG_RIGHT),
    "both legs": (LEG_LEFT + LEG_RIGHT,),
    "side": (ARM_LEFT + LEG_LEFT, ARM_RIGHT + LEG_RIGHT),
}


def mirrored(poses: np.ndarray) -> np.ndarray:
    """The poses seen in a mirror: left is right, and y changes its sign."""
    return poses[..., MIRROR, :] * np.array([1, -1, 1], poses.dtype)
