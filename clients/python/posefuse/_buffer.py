"""Frames that the server has not acknowledged yet; the same law as `agent/src/uplink/buffer.rs`.

Every frame that was put in ends in exactly one of three ways: acknowledged, dropped (and counted), or still here. When
full, the oldest goes. If it was never sent, it is lost there and then; if it was, it is in doubt until the server says.
"""
from __future__ import annotations

from collections import deque

from .v1 import ingest_pb2


class ResendBuffer:
    """Consecutive sequence numbers, the last one is `next - 1`. Not safe for threads by itself."""

    def __init__(self, most_frames: int = 4096, most_bytes: int = 64 << 20):
        self._limits = (most_frames, most_bytes)
        self._frames: deque[tuple[ingest_pb2.Frame, int]] = deque()
        self._bytes = 0
        self._doubt: deque[int] = deque()
        #: What the present connection sends next.
        self._cursor = 0
        self.next = 0
        self.dropped = 0
        self.acknowledged = 0

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def in_doubt(self) -> int:
        """Frames sent and evicted, of which the server may or may not have taken hold."""
        return len(self._doubt)

    @property
    def has_unsent(self) -> bool:
        return self._cursor < self.next

    def push(self, frame: ingest_pb2.Frame) -> None:
        """Takes a frame in, gives it its sequence number, and makes room for it."""
        frame.sequence = self.next
        self.next += 1
        size = frame.ByteSize()
        self._bytes += size
        self._frames.append((frame, size))
        frames, most_bytes = self._limits
        while len(self._frames) > frames or (self._bytes > most_bytes and len(self._frames) > 1):
            self._evict()

    def welcomed(self, last: int | None) -> None:
        """A connection begins; `last` is the highest number that the server has of this run."""
        if last is not None:
            self.acknowledge(last)
        self.dropped += len(self._doubt)
        self._doubt.clear()
        self._cursor = self._oldest()

    def acknowledge(self, last: int) -> None:
        """The server has everything up to and including `last`."""
        while self._doubt and self._doubt[0] <= last:
            self._doubt.popleft()
            self.acknowledged += 1
        while self._frames and self._oldest() <= last:
            self._pop()
            self.acknowledged += 1
        self._cursor = max(self._cursor, self._oldest())

    def send_next(self) -> ingest_pb2.Frame | None:
        """The next frame for the present connection."""
        index = self._cursor - self._oldest()
        if not 0 <= index < len(self._frames):
            return None
        self._cursor += 1
        return self._frames[index][0]

    def _oldest(self) -> int:
        return self.next - len(self._frames)

    def _pop(self) -> None:
        _, size = self._frames.popleft()
        self._bytes -= size

    def _evict(self) -> None:
        sequence = self._oldest()
        self._pop()
        if sequence < self._cursor:
            # Bounded: what is in doubt is forgotten, and counted as dropped, long before it could fill the memory.
            self._doubt.append(sequence)
            if len(self._doubt) > 1_000_000:
                self._doubt.popleft()
                self.dropped += 1
        else:
            self.dropped += 1
        self._cursor = max(self._cursor, sequence + 1)
