"""A Posefuse room from Python: push skeletons as one of its sensors (`Agent`); read the fused people, record, calibrate (`Room`).

Sensor frame: optical, x right, y down, z forward, metres. Room frame: x forward, y left, z up, metres. Left and right
are the person's own. Times are nanoseconds.
"""
from .agent import Agent, Report
from .body import Body, Joint
from .calibration import Calibration, CalibrationProgress, CalibrationResult, SensorPlace, StoredCalibration
from .clock import DeviceClock, paced
from .errors import PosefuseError, Refused, ServerError, Stopped
from .joints import JOINT_SETS
from .people import Person, RoomFrame, RoomJoint, SensorFrame
from .room import Room
from .takes import Take

__version__ = "0.1.0"

__all__ = [
    "JOINT_SETS",
    "Agent",
    "Body",
    "Calibration",
    "CalibrationProgress",
    "CalibrationResult",
    "DeviceClock",
    "Joint",
    "Person",
    "PosefuseError",
    "Refused",
    "Report",
    "Room",
    "RoomFrame",
    "RoomJoint",
    "SensorFrame",
    "SensorPlace",
    "ServerError",
    "Stopped",
    "StoredCalibration",
    "Take",
    "paced",
]
