"""Who is there, and how they stand, by the messages that come. Knows nothing of Blender.

Two kinds of people come in: bodies of the VMC protocol, one a port (`/VMC/Ext/Bone/Pos`: name, position and rotation against the
parent, Unity's axes: X right, Y up, Z forward, left-handed, metres, no rotation = T-pose), and joints of plain OSC
(`/skel/<person>/<joint>/pos` with three floats: room axes, metres).
"""
import dataclasses
import math

#: For each of Unity's humanoid bones those that may carry it: the first of them that is there does.
PARENTS = {
    "Hips": [], "Spine": ["Hips"], "Chest": ["Spine"], "UpperChest": ["Chest"],
    "Neck": ["UpperChest", "Chest", "Spine"], "Head": ["Neck", "UpperChest", "Chest", "Spine"],
    "LeftEye": ["Head"], "RightEye": ["Head"], "Jaw": ["Head"],
}
for _side in ("Left", "Right"):
    PARENTS |= {
        f"{_side}Shoulder": ["UpperChest", "Chest", "Spine"],
        f"{_side}UpperArm": [f"{_side}Shoulder", "UpperChest", "Chest", "Spine"],
        f"{_side}LowerArm": [f"{_side}UpperArm"], f"{_side}Hand": [f"{_side}LowerArm"],
        f"{_side}UpperLeg": ["Hips"], f"{_side}LowerLeg": [f"{_side}UpperLeg"],
        f"{_side}Foot": [f"{_side}LowerLeg"], f"{_side}Toes": [f"{_side}Foot"],
    }
    for _finger in ("Thumb", "Index", "Middle", "Ring", "Little"):
        PARENTS |= {
            f"{_side}{_finger}Proximal": [f"{_side}Hand"],
            f"{_side}{_finger}Intermediate": [f"{_side}{_finger}Proximal"],
            f"{_side}{_finger}Distal": [f"{_side}{_finger}Intermediate"],
        }

#: Who was not heard of for so long has left, seconds.
GONE_S = 1.0
#: Nobody has more joints, and no room more people; what goes beyond is noise on the port.
MOST_JOINTS, MOST_PEOPLE = 64, 32


@dataclasses.dataclass
class Body:
    """A person of the VMC protocol. Positions and rotations (x y z w) are Unity's, against the parent."""

    bones: dict[str, tuple[tuple, tuple]] = dataclasses.field(default_factory=dict)
    root: tuple[tuple, tuple] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    #: The sender's clock, seconds; None: it says none.
    sent_s: float | None = None
    heard_s: float = -math.inf
    #: Counts messages with bones.
    news: int = 0
    #: Counts those with hips.
    rounds: int = 0

    def parent(self, bone: str) -> str | None:
        """The bone that carries this one, among those that have come."""
        return next((parent for parent in PARENTS[bone] if parent in self.bones), None)

    def is_whole(self) -> bool:
        """Whether there is enough to show: a trunk with a head and two legs, and a second round of bones has begun."""
        return self.rounds > 1 and {"Hips", "Spine", "Head", "LeftUpperLeg", "RightUpperLeg"} <= self.bones.keys()


@dataclasses.dataclass
class Joints:
    """A person of plain OSC: places by joint, room metres."""

    places: dict[str, tuple] = dataclasses.field(default_factory=dict)
    #: When each joint was last heard of.
    heard: dict[str, float] = dataclasses.field(default_factory=dict)
    heard_s: float = -math.inf
    news: int = 0


class People:
    """Everybody. `hear` messages, then read `bodies` (by port) and `skeletons` (by the sender's name for the person)."""

    def __init__(self):
        self.bodies: dict[int, Body] = {}
        self.skeletons: dict[str, Joints] = {}
        #: Messages that are of neither kind, or not as they should be.
        self.ignored = 0

    def hear(self, port: int, address: str, arguments: list, now_s: float):
        """Takes in a message."""
        if not self._hear(port, address, arguments, now_s):
            self.ignored += 1

    def gone(self, person: Body | Joints, now_s: float) -> bool:
        """Whether a person has left."""
        return now_s - person.heard_s > GONE_S

    def _hear(self, port: int, address: str, arguments: list, now_s: float) -> bool:
        if address == "/VMC/Ext/Bone/Pos":
            return self._bone(port, arguments, now_s)
        if address == "/VMC/Ext/Root/Pos":
            if (place := _place(arguments)) is not None:
                self.bodies.setdefault(port, Body()).root = place
            return place is not None
        if address == "/VMC/Ext/OK":
            return self._state(port, arguments, now_s)
        if address == "/VMC/Ext/T":
            if (numbers := _numbers(arguments, 1)) is not None:
                self.bodies.setdefault(port, Body()).sent_s = numbers[0]
            return numbers is not None
        if address.startswith("/VMC/"):
            # Faces, cameras, keys: of others' interest.
            return True
        return address.startswith("/skel/") and self._joint(address, arguments, now_s)

    def _state(self, port: int, arguments: list, now_s: float) -> bool:
        """Whether there is anybody: who is said to be gone has left at once; who is there but not seen stays as they are."""
        if (numbers := _numbers(arguments, 1)) is None:
            return False
        if (body := self.bodies.get(port)) is not None and body.bones:
            body.heard_s = now_s if numbers[0] else -math.inf
        return True

    def _bone(self, port: int, arguments: list, now_s: float) -> bool:
        place = _place(arguments)
        if place is None or arguments[0] not in PARENTS:
            return False
        body = self.bodies.setdefault(port, Body())
        body.bones[arguments[0]] = place
        body.heard_s, body.news = now_s, body.news + 1
        body.rounds += arguments[0] == "Hips"
        return True

    def _joint(self, address: str, arguments: list, now_s: float) -> bool:
        parts, place = address.split("/"), _numbers(arguments, 3)
        if len(parts) != 5 or parts[4] != "pos" or place is None:
            return False
        who, joint = parts[2], parts[3]
        if who not in self.skeletons and len(self.skeletons) >= MOST_PEOPLE:
            for left in [name for name, person in self.skeletons.items() if self.gone(person, now_s)]:
                del self.skeletons[left]
            if len(self.skeletons) >= MOST_PEOPLE:
                return False
        person = self.skeletons.setdefault(who, Joints())
        if joint not in person.places and len(person.places) >= MOST_JOINTS:
            return False
        person.places[joint], person.heard[joint] = place, now_s
        person.heard_s, person.news = now_s, person.news + 1
        return True


def _numbers(arguments: list, count: int) -> tuple | None:
    """So many finite numbers, or None."""
    values = arguments[:count]
    right = len(values) == count and all(isinstance(value, (int, float)) and math.isfinite(value) for value in values)
    return tuple(map(float, values)) if right else None


def _place(arguments: list) -> tuple[tuple, tuple] | None:
    """The position and the rotation, of length one, of a name and seven numbers; or None."""
    if not arguments or not isinstance(arguments[0], str) or (numbers := _numbers(arguments[1:], 7)) is None:
        return None
    length = math.sqrt(sum(part * part for part in numbers[3:]))
    if length < 1e-6:
        return None
    return numbers[:3], tuple(part / length for part in numbers[3:])
