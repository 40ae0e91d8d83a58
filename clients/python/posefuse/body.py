"""One body as a tracker sees it, and how it goes over the wire."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Union

from .v1 import types_pb2


class Joint(NamedTuple):
    """One joint: metres in the sensor's optical frame (x right, y down, z forward), confidence 0 to 1.

    From 0.75 on the room takes a joint as measured; 0.5 is a tracker's usual guess; 0 is a missing joint.
    """

    x: float
    y: float
    z: float
    confidence: float = 1.0


#: A joint, or (x, y, z), or (x, y, z, confidence).
AnyJoint = Union[Joint, tuple[float, float, float], tuple[float, float, float, float]]


@dataclass
class Body:
    """One person of one frame. A joint that is not given is missing."""

    #: The tracker's own number for this person, 0 to 2^64 - 1.
    id: int
    #: Joints by their names in the agent's joint set, or all of them in its order with `None` for what is missing.
    joints: Mapping[str, AnyJoint] | Sequence[AnyJoint | None]
    #: Unit quaternions (x, y, z, w) by joint, where the tracker gives them.
    orientations: Mapping[str, tuple[float, float, float, float]] | None = None
    #: The probability that the left and the right hand is closed, `None` where the tracker does not tell.
    hands_closed: tuple[float | None, float | None] = (None, None)


def to_wire(body: Body, names: tuple[str, ...]) -> types_pb2.Body:
    """The message for `body`; `names` are the joints of the agent's set. Non-finite numbers pass: the room counts them."""
    wire = types_pb2.Body(tracking_id=body.id)
    for joint in _ordered(body.joints, names):
        x, y, z, *confidence = joint if joint is not None else (0.0, 0.0, 0.0, 0.0)
        wire.positions.extend((x, y, z))
        wire.confidences.append(confidence[0] if confidence else 1.0)
    if body.orientations:
        for turn in _ordered(body.orientations, names):
            wire.orientations.extend(turn if turn is not None else (0.0, 0.0, 0.0, 0.0))
    if any(hand is not None for hand in body.hands_closed):
        wire.hands_closed.extend(-1.0 if hand is None else hand for hand in body.hands_closed)
    return wire


def _ordered(given: Mapping[str, Any] | Sequence[Any], names: tuple[str, ...]) -> list[Any]:
    if not isinstance(given, Mapping):
        if len(given) != len(names):
            raise ValueError(f"expected {len(names)} joints in the order {', '.join(names[:3])} ..., found {len(given)}")
        return list(given)
    if unknown := [name for name in given if name not in names]:
        raise ValueError(f"no joint is called {unknown[0]!r} in this agent's joint set; there are {', '.join(names)}")
    return [given.get(name) for name in names]
