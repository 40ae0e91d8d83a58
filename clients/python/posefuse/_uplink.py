"""Keeps a connection to the server for as long as the agent lives; the same law as `agent/src/uplink`.

Threads: the uplink's own (`posefuse-NAME`) connects and hears; gRPC's takes what goes up out of `_Connection.outgoing`;
the user's puts frames into the buffer. They share `State`, behind one condition that is held for microseconds.
"""
from __future__ import annotations

import logging
import random
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import grpc

from ._buffer import ResendBuffer
from ._channel import open_channel
from .errors import PosefuseError, Refused, Stopped
from .v1 import ingest_pb2 as pb
from .v1 import ingest_pb2_grpc

log = logging.getLogger("posefuse")

#: How long a connection may take to be made, and the server to welcome us, seconds.
CONNECT_S = 1.0
WELCOME_S = 5.0
#: A server probes clocks once a second; one that has said nothing for this long is gone, seconds.
SILENT_SERVER_S = 2.5
#: How often health goes up, seconds.
HEALTH_S = 1.0
#: Clock echoes that may wait for the connection; a late echo is worthless, so the oldest goes.
ECHOES = 16
#: Frames are counted over this long; a sensor silent for longer than the second is in trouble, seconds.
RATE_S = 2.0
SILENT_S = 1.0
#: Pauses between attempts double from the first to the longest; longer ones once an outage is no longer young.
FIRST_PAUSE_S, LONGEST_YOUNG_S, LONGEST_S, YOUNG_S = 0.1, 0.75, 5.0, 90.0


class Lost(Exception):
    """No server, or no longer: soon again."""


class TurnedAway(Exception):
    """The server is there but cannot take us now: again without hurry."""


class State:
    """What the user's threads and the uplink share."""

    def __init__(self, buffer: ResendBuffer):
        self.changed = threading.Condition()
        self.buffer = buffer
        self.started = time.monotonic()
        self.arrivals: deque[float] = deque()
        self.sensor_trouble = ""
        self.connections = 0
        self.connected = False
        #: No more frames will come: end as soon as all are acknowledged.
        self.closing = False
        #: End at once.
        self.abandoned = False
        #: Why the server has not taken us in.
        self.trouble: str | None = None
        #: Why there will be no other connection.
        self.ended: PosefuseError | None = None

    @property
    def delivered(self) -> bool:
        return self.closing and len(self.buffer) == 0

    def arrived(self) -> None:
        """A frame came: whatever the sensor's trouble was, it is over."""
        now = time.monotonic()
        self.sensor_trouble = ""
        self.arrivals.append(now)
        while now - self.arrivals[0] > RATE_S:
            self.arrivals.popleft()

    def health(self) -> pb.Health:
        """The health message of this moment."""
        now = time.monotonic()
        lately = sum(now - at <= RATE_S for at in self.arrivals)
        silent = now - (self.arrivals[-1] if self.arrivals else self.started)
        trouble = self.sensor_trouble
        if not trouble and silent >= SILENT_S:
            trouble = f"the sensor has given no frame for {int(silent)} s" if self.arrivals else "the sensor has given no frame yet"
        return pb.Health(
            frames_per_second=lately / min(max(now - self.started, 1e-3), RATE_S),
            frames_dropped=self.buffer.dropped,
            frames_buffered=len(self.buffer),
            connections=self.connections,
            trouble=trouble,
        )


class Backoff:
    """How long to wait before the next attempt, each pause shortened by up to half at random."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """A connection stood: the next outage starts afresh."""
        self._failures, self._waited = 0, 0.0

    def next(self, turned_away: bool, attempt_took: float) -> float:
        """The pause after one more failure, seconds."""
        longest = LONGEST_S if turned_away or self._waited > YOUNG_S else LONGEST_YOUNG_S
        full = min(FIRST_PAUSE_S * 2 ** min(self._failures, 16), longest)
        self._failures += 1
        pause = full * random.uniform(0.5, 1.0)
        self._waited += pause + attempt_took
        return pause


class Uplink(threading.Thread):
    """Connects, serves, and connects again, until there is a reason to end."""

    def __init__(self, server: str, hello: pb.Hello, state: State, clock: Callable[[], int]):
        super().__init__(name=f"posefuse-{hello.sensor}", daemon=True)
        self._server, self._hello, self._state, self._clock = server, hello, state, clock
        self._call: grpc.Call | None = None

    def abandon(self) -> None:
        """Ends without delivering the rest."""
        with self._state.changed:
            self._state.abandoned = True
            self._state.changed.notify_all()
            call = self._call
        if call is not None:
            call.cancel()

    def run(self) -> None:
        state, backoff = self._state, Backoff()
        while True:
            began, before = time.monotonic(), state.connections
            failure: Exception | None = None
            try:
                self._attempt()
            except (Lost, TurnedAway) as error:
                failure = error
            except PosefuseError as error:
                state.ended = error
            except Exception as error:  # Whatever it is, who sends must hear of it.
                log.exception("the uplink of %s failed", self._hello.sensor)
                state.ended = PosefuseError(f"the uplink failed: {error!r}")
            with state.changed:
                state.connected = False
                state.changed.notify_all()
                if failure is None or state.abandoned:
                    return
                if state.connections > before:
                    backoff.reset()
                pause = backoff.next(isinstance(failure, TurnedAway), time.monotonic() - began)
                self._tell(str(failure))
                state.changed.wait_for(lambda: state.abandoned, timeout=pause)
                if state.abandoned:
                    return

    def _tell(self, reason: str) -> None:
        # The same sentence over and over would bury everything else.
        if self._state.trouble != reason:
            log.warning("%s is not connected to %s, trying again: %s", self._hello.sensor, self._server, reason)
            self._state.trouble = reason

    def _attempt(self) -> None:
        with open_channel(self._server) as channel:
            try:
                grpc.channel_ready_future(channel).result(timeout=CONNECT_S)
            except grpc.FutureTimeoutError:
                raise Lost(f"nothing answers at {self._server}; is `posefuse server` running there?") from None
            connection = _Connection(self._state, self._hello, self._clock)
            call = ingest_pb2_grpc.IngestStub(channel).Stream(connection.outgoing())
            with self._state.changed:
                self._call = call
            try:
                connection.serve(call)
            except grpc.RpcError as error:
                if not self._state.abandoned:
                    raise self._judge(error) from None

    def _judge(self, error: grpc.RpcError) -> Exception:
        name, code, said = self._hello.sensor, error.code(), error.details() or ""
        if code is grpc.StatusCode.ALREADY_EXISTS:
            return TurnedAway(f"another agent is called `{name}`; stop it or give this one another name ({said})")
        if code is grpc.StatusCode.RESOURCE_EXHAUSTED:
            return TurnedAway(f"the room is full ({said})")
        if code is grpc.StatusCode.UNIMPLEMENTED:
            return TurnedAway(f"what answers at {self._server} is no Posefuse server; check the address ({said})")
        if code is grpc.StatusCode.INVALID_ARGUMENT:
            return Refused(f"the server refuses `{name}`: {said}")
        if code is grpc.StatusCode.FAILED_PRECONDITION:
            return Refused(f"the server refuses `{name}`: {said}; agent and server must be of matching versions")
        return Lost(f"the connection broke: {said}" if said else "the connection broke")


class _Connection:
    """One connection: greeting, frames up, acknowledgements and probes down."""

    def __init__(self, state: State, hello: pb.Hello, clock: Callable[[], int]):
        self._state, self._hello, self._clock = state, hello, clock
        self._echoes: deque[pb.ClockEcho] = deque(maxlen=ECHOES)
        self._welcomed = False
        self._over = False
        self._health_due = 0.0
        self._heard = time.monotonic()
        self._silent = ""

    def outgoing(self) -> Iterator[pb.AgentMessage]:
        """What goes up, in the order of its hurry: greeting, clock echoes, health, frames. Ends when all is delivered."""
        yield pb.AgentMessage(hello=self._hello)
        while (message := self._next()) is not None:
            if message.HasField("clock_echo"):
                message.clock_echo.agent_sent_ns = self._clock()
            yield message

    def _next(self) -> pb.AgentMessage | None:
        state = self._state
        with state.changed:
            while True:
                now = time.monotonic()
                if self._over or state.abandoned or (self._welcomed and state.delivered):
                    return None
                if self._echoes:
                    return pb.AgentMessage(clock_echo=self._echoes.popleft())
                if self._welcomed and now >= self._health_due:
                    self._health_due = now + HEALTH_S
                    return pb.AgentMessage(health=state.health())
                if self._welcomed and state.buffer.has_unsent:
                    return pb.AgentMessage(frame=state.buffer.send_next())
                state.changed.wait(self._health_due - now if self._welcomed else None)

    def serve(self, call: Any) -> None:
        """Hears the server until the stream ends. An error is why it broke; a plain return is for good."""
        watchdog = threading.Thread(target=self._watch, args=(call,), name="posefuse-watchdog", daemon=True)
        watchdog.start()
        try:
            for message in call:
                self._hear(message)
        except grpc.RpcError:
            if self._silent:
                raise Lost(self._silent) from None
            raise
        finally:
            with self._state.changed:
                self._over = True
                self._state.changed.notify_all()
            call.cancel()
        if not self._state.delivered:
            raise Lost("the server ended the stream")

    def _watch(self, call: Any) -> None:
        """Breaks a connection off whose server says nothing: TCP alone would wait for many seconds."""
        while not self._over:
            patience = SILENT_SERVER_S if self._welcomed else WELCOME_S
            left = self._heard + patience - time.monotonic()
            if left <= 0:
                said = "nothing" if self._welcomed else "no welcome"
                self._silent = f"the server has said {said} for {patience:g} s"
                call.cancel()
                return
            with self._state.changed:
                if not self._over:
                    self._state.changed.wait(left)

    def _hear(self, message: pb.ServerMessage) -> None:
        received_ns, self._heard = self._clock(), time.monotonic()
        kind = message.WhichOneof("message")
        if kind == "command" and message.command.WhichOneof("command") == "stop":
            raise Stopped(message.command.stop)
        with self._state.changed:
            if kind == "clock_probe":
                self._echoes.append(pb.ClockEcho(probe=message.clock_probe.probe, agent_received_ns=received_ns))
            elif kind == "ack":
                self._state.buffer.acknowledge(message.ack.sequence)
            elif kind == "welcome" and not self._welcomed:
                self._greeted(message.welcome)
            self._state.changed.notify_all()

    def _greeted(self, welcome: pb.Welcome) -> None:
        state = self._state
        self._welcomed = True
        state.connections += 1
        state.connected, state.trouble = True, None
        state.buffer.welcomed(welcome.last_sequence if welcome.HasField("last_sequence") else None)
        log.info("%s is sensor %d of server %s", self._hello.sensor, welcome.sensor_id, welcome.server_version)
