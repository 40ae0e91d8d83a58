"""The room's server from the outside: fused people, raw skeletons, state."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import grpc

from ._channel import open_channel, parse_server
from .body import Joint
from .errors import ServerError
from .joints import CANONICAL
from .v1 import room_pb2, room_pb2_grpc, types_pb2


@dataclass(frozen=True)
class RoomJoint:
    """One joint of a fused person: metres in the room frame (x forward, y left, z up)."""

    x: float
    y: float
    z: float
    #: Root of the covariance's trace, metres.
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


@dataclass(frozen=True)
class RoomFrame:
    """Everybody in the room at one instant of the server's clock."""

    number: int
    time_ns: int
    people: list[Person]


@dataclass(frozen=True)
class SensorFrame:
    """One sensor's frame as the server took it in: canonical joints by tracking id, the sensor's optical frame."""

    sensor: int
    sequence: int
    #: The agent's clock, and the server's when it came.
    captured_ns: int
    received_ns: int
    bodies: dict[int, dict[str, Joint]]


class Room:
    """Reads a room.

        with posefuse.Room() as room:
            for frame in room.watch():
                print(frame.people)
    """

    def __init__(self, server: str | None = None):
        """server: host and port; without one POSEFUSE_SERVER or this machine."""
        self.server = parse_server(server)
        self._channel = open_channel(self.server)
        #: Everything else that a room can do: the generated stub of `proto/posefuse/v1/room.proto`.
        self.stub = room_pb2_grpc.RoomStub(self._channel)

    def watch(self, max_rate_hz: float = 0.0, seconds: float | None = None) -> Iterator[RoomFrame]:
        """Fused people as they come, for so many seconds or for ever; 0: every frame. An empty room gives few or none."""
        request = room_pb2.WatchRequest(max_rate_hz=max_rate_hz)
        for frame in self._stream(self.stub.Watch, request, seconds):
            yield RoomFrame(frame.number, frame.time_ns, [_person(track) for track in frame.tracks])

    def watch_sensors(self, *sensors: str, max_rate_hz: float = 0.0, seconds: float | None = None) -> Iterator[SensorFrame]:
        """Raw skeletons of these sensors (all, if none is named) as they come, for so many seconds or for ever."""
        request = room_pb2.WatchSensorsRequest(sensors=sensors, max_rate_hz=max_rate_hz)
        for seen in self._stream(self.stub.WatchSensors, request, seconds):
            bodies = {body.tracking_id: _joints(body) for body in seen.bodies}
            yield SensorFrame(seen.sensor, seen.sequence, seen.captured_ns, seen.received_ns, bodies)

    def status(self, timeout_s: float = 5.0) -> room_pb2.RoomStatus:
        """The state of sensors, takes and calibration."""
        try:
            return self.stub.GetStatus(room_pb2.GetStatusRequest(), timeout=timeout_s)
        except grpc.RpcError as error:
            raise self._failed(error) from None

    def close(self) -> None:
        """Ends every stream."""
        self._channel.close()

    def __enter__(self) -> Room:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _stream(self, method, request, seconds: float | None):
        call = method(request, timeout=seconds)
        try:
            yield from call
        except grpc.RpcError as error:
            over = seconds is not None and call.code() is grpc.StatusCode.DEADLINE_EXCEEDED
            if not over and call.code() is not grpc.StatusCode.CANCELLED:
                raise self._failed(error) from None
        finally:
            call.cancel()

    def _failed(self, error: grpc.RpcError) -> ServerError:
        if error.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED):
            return ServerError(f"nothing answers at {self.server}; is `posefuse server` running there? ({error.details()})")
        return ServerError(f"{self.server}: {error.details()}")


def _person(track: types_pb2.Track) -> Person:
    joints = {}
    for index, name in enumerate(CANONICAL):
        provenance = types_pb2.Provenance.Name(track.provenances[index]).removeprefix("PROVENANCE_").lower()
        if provenance not in ("missing", "unspecified"):
            xx, _, _, yy, _, zz = track.covariances[6 * index : 6 * index + 6]
            x, y, z = track.positions[3 * index : 3 * index + 3]
            joints[name] = RoomJoint(x, y, z, (xx + yy + zz) ** 0.5, track.confidences[index], provenance)
    return Person(track.id, joints, track.sensors)


def _joints(body: types_pb2.Body) -> dict[str, Joint]:
    return {
        name: Joint(*body.positions[3 * index : 3 * index + 3], body.confidences[index])
        for index, name in enumerate(CANONICAL)
        if body.confidences[index] > 0
    }
