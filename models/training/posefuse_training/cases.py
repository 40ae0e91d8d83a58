"""The cases of the table: gaps of .2/.5/1/2 s of an arm, a leg, both legs or a side, in recordings that did not train.

The official table is `posefuse evaluate repair`; this one serves during training. Both use the same split, parts, lengths and
measure: mean distance from the truth of the joints that were hidden, millimetres, over all poses of the gap.
"""

from dataclasses import dataclass

import numpy as np

from . import RATE_HZ
from .corrupt import Window, window
from .joints import COUNT, PARTS
from .recordings import Prepared

GAPS_S = (0.2, 0.5, 1.0, 2.0)
EVERY_FRAMES = 30
HISTORY_FRAMES = 30
"""So much is seen before each gap at least, and half of it after."""


@dataclass
class Cases:
    """Stretches with one gap each, all of one length: pose number `before` is the first hidden one.

    `truth` (n, before + gap + after, 25, 3); `mask` alike; where a recording had not begun yet or was over, `there` is false.
    """

    truth: np.ndarray
    mask: np.ndarray
    there: np.ndarray
    before: int
    gap: int
    hidden: list[tuple[int, ...]]

    def every(self, step: int) -> "Cases":
        """Every `step`-th of them; with an odd step the left and the right side still alternate."""
        rows = slice(None, None, step)
        return Cases(self.truth[rows], self.mask[rows], self.there[rows], self.before, self.gap, self.hidden[rows])

    def window(self) -> Window:
        """As the engine would make it, over the whole stretch."""
        made = window(self.truth, self.mask, self.truth)
        first = self.there.argmax(axis=1)
        for index in np.flatnonzero(first > 0):
            made.pose[index, : first[index]] = made.pose[index, first[index]]
        return made


def cases(prepared: Prepared, part: str, gap_s: float, before: int, after: int = 15) -> Cases:
    """All cases of one kind, one gap every second of recording; the variants (left, right) alternate."""
    gap = round(gap_s * RATE_HZ)
    truth, there, hidden = [], [], []
    number = 0
    for _, span in prepared.spans():
        for start in range(HISTORY_FRAMES, len(span) - gap - HISTORY_FRAMES // 2 + 1, EVERY_FRAMES):
            index = np.arange(start - before, start + gap + after)
            inside = (index >= 0) & (index < len(span))
            truth.append(span[np.clip(index, 0, len(span) - 1)])
            there.append(inside)
            hidden.append(PARTS[part][number % len(PARTS[part])])
            number += 1
    there = np.array(there)
    mask = np.repeat(there[:, :, None], COUNT, axis=2).astype(np.float32)
    for row, joints in enumerate(hidden):
        mask[row, before : before + gap, list(joints)] = 0
    return Cases(np.array(truth, np.float32), mask, there, before, gap, hidden)


def error_mm(filled: np.ndarray, case: Cases) -> float:
    """Mean over hidden joints and poses; `filled` (n, gap, 25, 3) room metres."""
    inside = slice(case.before, case.before + case.gap)
    distance = np.linalg.norm(filled - case.truth[:, inside], axis=-1)
    gone = case.mask[:, inside] == 0
    return float(1000 * distance[gone].mean())
