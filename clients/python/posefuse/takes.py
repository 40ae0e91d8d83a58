"""Takes: what the server has recorded."""
from __future__ import annotations

from dataclasses import dataclass

from .v1 import room_pb2


@dataclass(frozen=True)
class Take:
    """One recording of the room, as the server's catalogue has it."""

    #: Unique: the file's name without `.mcap`.
    name: str
    slate: str
    notes: str
    #: recording, complete, recovered (cut off and repaired) or damaged (`trouble` says why).
    state: str
    #: Civil time of its start, RFC 3339, UTC; and in nanoseconds since 1970, 0 where that is not known.
    started: str
    start_unix_ns: int
    #: Its start as timecode; empty in old takes.
    timecode: str
    duration_s: float
    size_bytes: int
    #: Fused frames, and the most people at once.
    frames: int
    people: int
    sensors: tuple[str, ...]
    #: Inputs that did not reach the file.
    dropped: int
    trouble: str


_STATES = {
    room_pb2.TAKE_STATE_RECORDING: "recording",
    room_pb2.TAKE_STATE_COMPLETE: "complete",
    room_pb2.TAKE_STATE_RECOVERED: "recovered",
    room_pb2.TAKE_STATE_DAMAGED: "damaged",
}


def take_of(wire: room_pb2.Take) -> Take:
    """A take of a server's message."""
    return Take(
        name=wire.name, slate=wire.slate, notes=wire.notes, state=_STATES.get(wire.state, "unknown"),
        started=wire.started, start_unix_ns=wire.start_unix_ns, timecode=wire.timecode,
        duration_s=wire.duration_ns / 1e9, size_bytes=wire.size_bytes,
        frames=wire.frames, people=wire.people, sensors=tuple(wire.sensors), dropped=wire.dropped, trouble=wire.trouble,
    )
