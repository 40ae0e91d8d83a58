"""The simple methods that a model has to beat; they look at no data but a table. See `cases` for the arrays."""

import numpy as np

from . import RATE_HZ
from .cases import Cases
from .person import GaussianConditional, person_frame, sizes

VELOCITY_FADES_S = 0.2
OFFSET_FADES_S = 0.4


def hold(case: Cases) -> np.ndarray:
    """Every joint stays where it was in the room."""
    return np.repeat(case.truth[:, case.before - 1][:, None], case.gap, axis=1)


def ride(case: Cases) -> np.ndarray:
    """Every joint stays where it was against the person."""
    own, _, _ = person_frame(case.truth[:, case.before - 1])
    return _to_room(np.repeat(own[:, None], case.gap, axis=1), case)


def damped_velocity(case: Cases) -> np.ndarray:
    """Every joint goes on in the room, slower and slower."""
    last = case.truth[:, case.before - 1]
    return last[:, None] + _coasted(last - case.truth[:, case.before - 3], case)


def riding_velocity(case: Cases) -> np.ndarray:
    """Every joint goes on against the person, slower and slower."""
    own, _, _ = person_frame(case.truth[:, case.before - 3 : case.before])
    return _to_room(own[:, -1:] + _coasted(own[:, -1] - own[:, 0], case), case)


def gaussian(case: Cases, conditional: GaussianConditional) -> np.ndarray:
    """Average given the joints that are seen, in the person's frame, and an offset that fades so that nothing jumps."""
    average, off = _average(case, conditional, slice(case.before - 1, case.before + case.gap))
    age = np.arange(1, case.gap + 1)[None, :, None, None] / RATE_HZ
    return _to_room(average[:, 1:] + off[:, :1] * np.exp(-age / OFFSET_FADES_S), case)


def linear(case: Cases) -> np.ndarray:
    """Offline: straight in the room from the last seen place to the next."""
    part = (np.arange(1, case.gap + 1) / (case.gap + 1))[None, :, None, None]
    return case.truth[:, case.before - 1][:, None] * (1 - part) + case.truth[:, case.before + case.gap][:, None] * part


def linear_riding(case: Cases) -> np.ndarray:
    """Offline: the same against the person."""
    own, _, _ = person_frame(case.truth)
    part = (np.arange(1, case.gap + 1) / (case.gap + 1))[None, :, None, None]
    return _to_room(own[:, case.before - 1][:, None] * (1 - part) + own[:, case.before + case.gap][:, None] * part, case)


def gaussian_two_sided(case: Cases, conditional: GaussianConditional) -> np.ndarray:
    """Offline: the conditional average with the offsets of both ends, one fading into the other."""
    average, off = _average(case, conditional, slice(case.before - 1, case.before + case.gap + 1))
    part = (np.arange(1, case.gap + 1) / (case.gap + 1))[None, :, None, None]
    return _to_room(average[:, 1:-1] + off[:, :1] * (1 - part) + off[:, -1:] * part, case)


def _average(case: Cases, conditional: GaussianConditional, inside: slice) -> tuple[np.ndarray, np.ndarray]:
    """(poses `inside` with the hidden joints where they are on average, how far the truth is from that), in the person's frame."""
    truth = case.truth[:, inside]
    own, _, _ = person_frame(truth)
    size = sizes(truth)[..., None, None]
    average = own.copy()
    for hidden in sorted(set(case.hidden)):
        rows = [row for row, joints in enumerate(case.hidden) if joints == hidden]
        average[rows] = conditional(own[rows] / size[rows], hidden) * size[rows]
    return average, own - average


def _coasted(step: np.ndarray, case: Cases) -> np.ndarray:
    """How far a joint that moved by `step` in two poses comes after the gap's poses."""
    age = np.arange(1, case.gap + 1)[None, :, None, None] / RATE_HZ
    velocity = step[:, None] / (2 / RATE_HZ)
    return velocity * VELOCITY_FADES_S * (1 - np.exp(-age / VELOCITY_FADES_S))


def _to_room(own: np.ndarray, case: Cases) -> np.ndarray:
    inside = slice(case.before, case.before + case.gap)
    _, turn, origin = person_frame(case.truth[:, inside])
    return np.einsum("...ji,...kj->...ki", turn, own) + origin[..., None, :]


LIVE = {"hold": hold, "ride": ride, "damped velocity": damped_velocity, "riding velocity": riding_velocity}
OFFLINE = {"linear": linear, "linear, riding": linear_riding}
