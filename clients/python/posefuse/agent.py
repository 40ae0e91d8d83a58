"""A tracker as a sensor of the room."""
from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ._buffer import ResendBuffer
from ._channel import parse_server
from ._uplink import State, Uplink
from .body import Body, to_wire
from .joints import names_of
from .v1 import ingest_pb2 as pb

#: The version of the protocol that this package speaks.
PROTOCOL = 1
VERSION = "python 0.1.0"
#: How long an agent that ends by an exception goes on to deliver what it has, seconds.
LAST_WORDS_S = 1.0


@dataclass(frozen=True)
class Report:
    """What an agent has done."""

    #: Frames given to `send`.
    captured: int
    #: Frames that the server has acknowledged.
    delivered: int
    #: Frames lost because the server was away for too long.
    dropped: int
    #: Frames that nobody has acknowledged yet.
    unacknowledged: int
    #: Times the agent was connected.
    connections: int
    #: Why it is not connected, if it is not.
    trouble: str | None


class Agent:
    """Pushes one sensor's skeletons to the room's server, for as long as the `with` block lasts.

    The server may come later, go and come back: frames wait in a bounded buffer (68 s at 60 frames a second), are sent
    again after a break, and the oldest are dropped and counted when it is full. `send` never waits for the network.

        with posefuse.Agent("left", joint_set="nite") as agent:
            agent.send([posefuse.Body(1, {"Head": (0.1, -0.6, 2.5)})])
    """

    def __init__(
        self,
        name: str,
        server: str | None = None,
        *,
        joint_set: str = "kinect-v2",
        model: str = "",
        clock: Callable[[], int] = time.monotonic_ns,
        camera: tuple[float, float, float, float] | None = None,
        drain_s: float = 10.0,
        most_frames: int = 4096,
    ):
        """Starts connecting. Raises `ValueError` for a name, address or joint set that cannot be.

        name: unique in the room, letters, digits, `.`, `_`, `-`. server: host and port; without one POSEFUSE_SERVER or
        this machine. model: the device, for people. clock: what stamps the frames, ns; it also answers the server's
        clock probes, so `captured_ns` must be of this very clock. camera: horizontal and vertical field of view,
        degrees, and from where to where it measures, metres. drain_s: how long leaving the block waits for frames
        to be acknowledged. most_frames: the buffer's bound.
        """
        if not 1 <= len(name) <= 64 or name.startswith(".") or not all(c.isascii() and (c.isalnum() or c in "._-") for c in name):
            raise ValueError(f"name {name!r}: expected 1 to 64 letters, digits, `.`, `_`, `-`, not beginning with `.`")
        if most_frames < 1:
            raise ValueError(f"most_frames {most_frames}: the buffer needs room for at least one frame")
        self.name = name
        self.server = parse_server(server)
        self.joint_names = names_of(joint_set)
        self._clock, self._drain_s = lambda: int(clock()), drain_s
        hello = pb.Hello(
            sensor=name, model=model or "Python agent", joint_set=joint_set, protocol=PROTOCOL, agent_version=VERSION,
            run_id=random.SystemRandom().getrandbits(64),
        )
        if camera is not None:
            horizontal, vertical, near, far = camera
            hello.camera.CopyFrom(pb.CameraInfo(
                fov_horizontal_deg=horizontal, fov_vertical_deg=vertical, near_m=near, far_m=far))
        self._state = State(ResendBuffer(most_frames))
        self._uplink = Uplink(self.server, hello, self._state, self._clock)
        self._uplink.start()

    def send(self, bodies: Iterable[Body], captured_ns: int | None = None) -> None:
        """Hands on one frame; an empty one says that nobody is in view.

        captured_ns: when the light was caught, by the agent's clock; now, if it is not known. Raises `Stopped` when the
        server has told the agent to end, `Refused` when it will never take it, `ValueError` for joints that are none.
        """
        if self._state.ended is not None:
            raise self._state.ended
        at = self._clock() if captured_ns is None else int(captured_ns)
        frame = pb.Frame(captured_ns=at, bodies=[to_wire(body, self.joint_names) for body in bodies])
        with self._state.changed:
            if self._state.closing:
                raise ValueError(f"the agent {self.name} is closed; send inside its `with` block")
            self._state.buffer.push(frame)
            self._state.arrived()
            self._state.changed.notify_all()

    def trouble(self, why: str) -> None:
        """Says why the sensor gives no frames, for the operator to see; the next frame ends it."""
        with self._state.changed:
            self._state.sensor_trouble = why

    def wait_connected(self, timeout_s: float | None = None) -> bool:
        """Waits until the server has taken the agent in. Nobody needs to; raises as `send` does."""
        state = self._state
        with state.changed:
            state.changed.wait_for(lambda: state.connected or state.ended is not None, timeout=timeout_s)
            if state.ended is not None:
                raise state.ended
            return state.connected

    @property
    def connected(self) -> bool:
        """Whether the server has the agent now."""
        return self._state.connected

    @property
    def report(self) -> Report:
        """What the agent has done so far."""
        with self._state.changed:
            buffer = self._state.buffer
            return Report(buffer.next, buffer.acknowledged, buffer.dropped, len(buffer) + buffer.in_doubt,
                          self._state.connections, self._state.trouble)

    def close(self, drain_s: float | None = None) -> Report:
        """Delivers what it has, within `drain_s` seconds, says goodbye and ends."""
        with self._state.changed:
            self._state.closing = True
            self._state.changed.notify_all()
        self._uplink.join(self._drain_s if drain_s is None else drain_s)
        if self._uplink.is_alive():
            self._uplink.abandon()
            self._uplink.join(2.0)
        return self.report

    def __enter__(self) -> Agent:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close(None if kind is None else min(LAST_WORDS_S, self._drain_s))
