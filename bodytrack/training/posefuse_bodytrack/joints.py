"""The canonical joints (Kinect v2's 25) and the crop's measures, as in the Rust code."""

NAMES = (
    "SpineBase SpineMid Neck Head "
    "ShoulderLeft ElbowLeft WristLeft HandLeft ShoulderRight ElbowRight WristRight HandRight "
    "HipLeft KneeLeft AnkleLeft FootLeft HipRight KneeRight AnkleRight FootRight "
    "SpineShoulder HandTipLeft ThumbLeft HandTipRight ThumbRight"
).split()
COUNT = len(NAMES)
INDEX = {name: index for index, name in enumerate(NAMES)}


def _mirrored(name):
    if name.endswith("Left"):
        return name[:-4] + "Right"
    return name[:-5] + "Left" if name.endswith("Right") else name


MIRRORED = [INDEX[_mirrored(name)] for name in NAMES]
PAIRS = [(INDEX[n], INDEX[_mirrored(n)]) for n in NAMES if n.endswith("Left")]
# Fingers are not among the joints that trackers are compared on.
MAIN = [i for i, n in enumerate(NAMES) if not n.startswith(("HandTip", "Thumb"))]

# bodytrack/src/crop.rs
SIZE = 64
CHANNELS = 2
WINDOW_M = 2.24
CELL_M = WINDOW_M / SIZE
DEPTH_M = 1.0
