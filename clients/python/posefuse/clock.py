"""Times of devices and recordings as times of this machine's monotonic clock."""
from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")

#: How long a quick frame vouches for the device's clock, ns; short against its drift, long against its jitter.
_WINDOW_NS = 10_000_000_000


class DeviceClock:
    """Maps a device's time stamps to `time.monotonic_ns`, so that frames do not jitter with the computer's load.

    The quickest frame of the last 10 s counts as having taken `delay_ns`, which is the shortest delay of the tracker
    itself if you know it. A device whose time steps back or far away begins afresh.
    """

    def __init__(self, delay_ns: int = 0):
        self._delay_ns = delay_ns
        #: (arrival, offset) with offsets rising: the first is the least.
        self._quickest: deque[tuple[int, int]] = deque()
        self._last_ns: int | None = None

    def captured_ns(self, device_ns: int, arrived_ns: int | None = None) -> int:
        """When the frame stamped `device_ns` was caught, if it came at `arrived_ns` (now)."""
        arrived = time.monotonic_ns() if arrived_ns is None else arrived_ns
        if self._last_ns is not None and not 0 <= device_ns - self._last_ns < _WINDOW_NS:
            self._quickest.clear()
        self._last_ns = device_ns
        offset = arrived - device_ns
        while self._quickest and self._quickest[-1][1] >= offset:
            self._quickest.pop()
        self._quickest.append((arrived, offset))
        while arrived - self._quickest[0][0] > _WINDOW_NS:
            self._quickest.popleft()
        return device_ns + self._quickest[0][1] - self._delay_ns


def paced(frames: Iterable[tuple[float, T]], speed: float = 1.0) -> Iterator[tuple[int, T]]:
    """Plays (seconds, anything) of a recording: gives (captured_ns, anything) when each is due, `speed` times as fast."""
    start_ns: int | None = None
    first = 0.0
    for seconds, item in frames:
        if start_ns is None:
            start_ns, first = time.monotonic_ns(), seconds
        due_ns = start_ns + round((seconds - first) / speed * 1e9)
        wait_ns = due_ns - time.monotonic_ns()
        if wait_ns > 0:
            time.sleep(wait_ns / 1e9)
        yield due_ns, item
