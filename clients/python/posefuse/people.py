"""People and skeletons as a room's reader gets them."""
from __future__ import annotations

from dataclasses import dataclass

from .body import Joint
from .joints import CANONICAL
from .v1 import types_pb2


@dataclass(frozen=True)
class RoomJoint:
    """One joint of a fused person: metres in the room frame (x forward, y left, z up)."""

    x: float
    y: float
    z: float
    #: Standard deviation, root mean square of the three axes, metres.
    sigma_m: float
    #: 0 to 1.
    confidence: float
    #: measured, predicted or repaired.
    provenance: str


@dataclass(frozen=True)
class Person:
    """One person at one instant. A missing joint is not in `joints`."""

    id: int
    #: Kinect v2's names.
    joints: dict[str, RoomJoint]
    #: Bit i says that sensor i contributed.
    sensors: int
    #: The probability that the left and the right hand is closed; None where no sensor tells.
    hands_closed: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True)
class RoomFrame:
    """Everybody in the room at one instant."""

    number: int
    #: The server's own clock.
    time_ns: int
    people: list[Person]
    #: The same instant in civil time, nanoseconds since 1970, and as the room's timecode (HH:MM:SS:FF).
    unix_ns: int = 0
    timecode: str = ""


@dataclass(frozen=True)
class SensorFrame:
    """One sensor's frame as the server took it in: canonical joints by tracking id, the sensor's optical frame."""

    sensor: int
    sequence: int
    #: The agent's clock, and the server's when it came.
    captured_ns: int
    received_ns: int
    bodies: dict[int, dict[str, Joint]]


def frame_of(wire: types_pb2.RoomFrame) -> RoomFrame:
    """A frame of a server's message."""
    return RoomFrame(wire.number, wire.time_ns, [_person(track) for track in wire.tracks], wire.unix_ns, wire.timecode)


def sensor_frame_of(wire: types_pb2.Observation) -> SensorFrame:
    """A sensor's frame of a server's message."""
    bodies = {body.tracking_id: _joints(body) for body in wire.bodies}
    return SensorFrame(wire.sensor, wire.sequence, wire.captured_ns, wire.received_ns, bodies)


def _person(track: types_pb2.Track) -> Person:
    joints = {}
    for index, name in enumerate(CANONICAL):
        provenance = types_pb2.Provenance.Name(track.provenances[index]).removeprefix("PROVENANCE_").lower()
        if provenance not in ("missing", "unspecified"):
            xx, _, _, yy, _, zz = track.covariances[6 * index : 6 * index + 6]
            x, y, z = track.positions[3 * index : 3 * index + 3]
            joints[name] = RoomJoint(x, y, z, ((xx + yy + zz) / 3) ** 0.5, track.confidences[index], provenance)
    return Person(track.id, joints, track.sensors, (_closed(track, 0), _closed(track, 1)))


def _closed(track: types_pb2.Track, hand: int) -> float | None:
    told = len(track.hands_sensors) > hand and track.hands_sensors[hand] > 0
    return track.hands_closed[hand] if told else None


def _joints(body: types_pb2.Body) -> dict[str, Joint]:
    joints = {}
    for index, name in enumerate(CANONICAL):
        if body.confidences[index] > 0:
            x, y, z = body.positions[3 * index : 3 * index + 3]
            joints[name] = Joint(x, y, z, body.confidences[index])
    return joints
