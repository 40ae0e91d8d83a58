"""Where the sensors stand, and how that is found out."""
from __future__ import annotations

from dataclasses import dataclass

from .v1 import room_pb2, types_pb2


@dataclass(frozen=True)
class SensorPlace:
    """Where a sensor stands, and how well that is known.

    A point of the sensor's optical frame is turned by `orientation_xyzw`, then moved by `position_m`: then it is the room's.
    """

    position_m: tuple[float, float, float]
    orientation_xyzw: tuple[float, float, float, float]
    #: Added to its capture times.
    time_offset_ms: float
    #: How far its joints are from those of the other sensors, median, on frames that the solving never saw.
    residual_mm: float


@dataclass(frozen=True)
class Calibration:
    """One calibration of a room."""

    #: When it was made, RFC 3339, UTC, and how.
    created: str
    method: str
    #: passed or weak; empty where nobody judged it.
    verdict: str
    #: By the sensor's name.
    sensors: dict[str, SensorPlace]


@dataclass(frozen=True)
class CalibrationProgress:
    """How far a walk is."""

    elapsed_s: float
    #: How long it takes at most.
    total_s: float
    #: How much of what is needed has been seen, 0 to 1: that of the sensor that needs most, and that of each.
    share: float
    sensors: dict[str, float]
    #: What to do next, in plain words; empty when nothing is missing.
    hint: str
    #: The walk is over and is being solved.
    solving: bool


@dataclass(frozen=True)
class CalibrationResult:
    """What came of a walk."""

    #: passed, weak or failed.
    verdict: str
    #: What was found and what to do, in words.
    reasons: tuple[str, ...]
    #: None: it failed.
    calibration: Calibration | None
    #: Whether it is in force now.
    in_force: bool


@dataclass(frozen=True)
class StoredCalibration:
    """A calibration that the server keeps."""

    name: str
    in_force: bool
    #: None: it cannot be read, and `trouble` says why.
    calibration: Calibration | None
    trouble: str


#: The forms in which calibrations are exchanged with other programs.
FORMATS = {
    "toml": room_pb2.CALIBRATION_FORMAT_TOML,
    "json": room_pb2.CALIBRATION_FORMAT_JSON,
    "tf2-yaml": room_pb2.CALIBRATION_FORMAT_TF2_YAML,
    "opencv-yaml": room_pb2.CALIBRATION_FORMAT_OPENCV_YAML,
}
_VERDICTS = {room_pb2.VERDICT_PASSED: "passed", room_pb2.VERDICT_WEAK: "weak", room_pb2.VERDICT_FAILED: "failed"}


def format_of(name: str) -> room_pb2.CalibrationFormat:
    """The format of this name. Raises ValueError where there is none."""
    if name not in FORMATS:
        raise ValueError(f"no form of a calibration is called {name!r}; there are {', '.join(FORMATS)}")
    return FORMATS[name]


def calibration_of(wire: types_pb2.Calibration) -> Calibration:
    """A calibration of a server's message."""
    return Calibration(wire.created, wire.method, wire.verdict, {sensor.sensor: _place(sensor) for sensor in wire.sensors})


def progress_of(wire: room_pb2.CalibrateProgress) -> CalibrationProgress:
    """A walk's progress of a server's message."""
    shares = {sensor.sensor: sensor.share for sensor in wire.sensors}
    return CalibrationProgress(wire.elapsed_seconds, wire.total_seconds, wire.share, shares, wire.hint, wire.solving)


def result_of(wire: room_pb2.CalibrateResult) -> CalibrationResult:
    """A result of a server's message."""
    found = calibration_of(wire.calibration) if wire.HasField("calibration") else None
    return CalibrationResult(_VERDICTS.get(wire.verdict, "unknown"), tuple(wire.reasons), found, wire.in_force)


def stored_of(wire: room_pb2.StoredCalibration) -> StoredCalibration:
    """A kept calibration of a server's message."""
    found = calibration_of(wire.calibration) if wire.HasField("calibration") else None
    return StoredCalibration(wire.name, wire.in_force, found, wire.trouble)


def _place(wire: types_pb2.SensorPose) -> SensorPlace:
    at, turn = wire.room_from_sensor.translation, wire.room_from_sensor.rotation
    return SensorPlace(
        (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w), wire.time_offset_ns / 1e6, wire.residual_median_m * 1000,
    )
