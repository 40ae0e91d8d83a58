"""Says whether what a reader found is what was sent, and whether it shows people who stand, face and walk as they truly did."""
import dataclasses

import numpy as np

#: Rows take places of these axes to the room's (X forward, Y left, Z up).
ROOM_OF = {
    "room": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "y-up": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    "opensim": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    "blender": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
}
#: Who is upright is told by these; bones begin at the joint that is named third.
ROLES = {
    "head": {"joints": "Neck", "bones": "Head", "truth": "Neck"},
    "pelvis": {"joints": "SpineBase", "bones": "Spine", "truth": "SpineBase"},
    "left": {"joints": "ShoulderLeft", "bones": "LeftUpperArm", "truth": "ShoulderLeft"},
    "right": {"joints": "ShoulderRight", "bones": "RightUpperArm", "truth": "ShoulderRight"},
    "left foot": {"joints": "AnkleLeft", "bones": "LeftFoot", "truth": "AnkleLeft"},
    "right foot": {"joints": "AnkleRight", "bones": "RightFoot", "truth": "AnkleRight"},
}
#: The largest distance between a place as found and as sent.
MOST_M = 1e-3
#: A body of constant measures, and one that was fused, are not quite where the true one is.
MOST_HEIGHT_M, MOST_FACING_DEG, MOST_LEAN_DEG, MOST_PATH = 0.03, 10.0, 10.0, 0.15


@dataclasses.dataclass
class Verdict:
    """One line of the table."""

    what: str
    people: int = 0
    places: int = 0
    worst_mm: float = 0.0
    posture: "Posture | None" = None
    troubles: list[str] = dataclasses.field(default_factory=list)
    #: The words of a reader that says itself whether a file is right.
    said: str = ""


@dataclasses.dataclass
class Posture:
    """How a person stands and goes, from the places of a few joints."""

    height_m: float
    lean_deg: float
    path_m: float
    #: Frames x 2, unit length: where the chest faces, on the floor.
    facing: np.ndarray

    @classmethod
    def of(cls, places: dict[str, np.ndarray]) -> "Posture":
        """places: by role, frames x 3, room metres."""
        feet = np.minimum(places["left foot"][:, 2], places["right foot"][:, 2])
        trunk = places["head"] - places["pelvis"]
        across = places["left"] - places["right"]
        ahead = np.stack([across[:, 1], -across[:, 0]], axis=1)
        return cls(
            height_m=float(np.median(places["head"][:, 2] - feet)),
            lean_deg=float(np.median(np.degrees(np.arccos(trunk[:, 2] / np.linalg.norm(trunk, axis=1))))),
            path_m=float(np.linalg.norm(np.diff(places["pelvis"][:, :2], axis=0), axis=1).sum()),
            facing=ahead / np.linalg.norm(ahead, axis=1, keepdims=True),
        )

    def off_deg(self, true: "Posture") -> float:
        """The median angle between where both face."""
        return float(np.median(np.degrees(np.arccos(np.clip(np.sum(self.facing * true.facing, axis=1), -1, 1)))))

    def troubles(self, true: "Posture") -> list[str]:
        """What is wrong with it, if it is to be the other one."""
        found = []
        if abs(self.height_m - true.height_m) > MOST_HEIGHT_M:
            found.append(f"neck {self.height_m:.3f} m above the feet, truly {true.height_m:.3f} m")
        if abs(self.lean_deg - true.lean_deg) > MOST_LEAN_DEG:
            found.append(f"not upright: trunk {self.lean_deg:.0f} deg off the vertical, truly {true.lean_deg:.0f} deg")
        if (off := self.off_deg(true)) > MOST_FACING_DEG:
            found.append(f"faces {off:.0f} deg away from where it truly does")
        if true.path_m < 0.5 or abs(self.path_m / true.path_m - 1) > MOST_PATH:
            found.append(f"goes {self.path_m:.2f} m, truly {true.path_m:.2f} m")
        return found


def judge(expected: dict, reading: dict) -> Verdict:
    """One reading against what was sent and against the truth."""
    if "check" in reading:
        return Verdict(reading["what"], said=reading["check"])
    kind, frames = reading["kind"], reading["frames"]
    turn = np.array(ROOM_OF[reading["axes"]], float).T * reading["metres"]
    frames = list(range(len(expected["sampled"]))) if frames is None else frames
    verdict = Verdict(reading["what"], len(reading["people"]))
    if len(frames) < 0.9 * len(expected["sampled"]):
        verdict.troubles.append(f"{len(frames)} of {len(expected['sampled'])} frames are there")
    if len(reading["people"]) != len(expected["people"]) and reading["sent"] is None:
        verdict.troubles.append(f"{len(reading['people'])} people are there, {len(expected['people'])} were sent")
    for who, theirs in reading["people"].items():
        found = {name: np.array(places, float) @ turn for name, places in theirs.items()}
        if any(places.shape != (len(frames), 3) for places in found.values()):
            verdict.troubles.append(f"{who}: places of {len(frames)} frames were expected")
            continue
        if reading["sent"] is None:
            order = expected["names"][kind]
            all_sent = np.array(expected["people"][who][kind])[frames]
            sent = {name: all_sent[:, order.index(name)] for name in found}
            # Ends of the last bones have no name in some formats.
            left_out = set(order) - set(found) - set(expected["names"]["ends"])
        else:
            sent = {name: np.array(places, float) for name, places in reading["sent"][who].items()}
            left_out = set(sent) - set(found)
        if left_out:
            verdict.troubles.append(f"{who}: without {', '.join(sorted(left_out))}")
            continue
        off = max(float(np.linalg.norm(found[name] - sent[name], axis=1).max()) for name in found)
        verdict.places += sum(map(len, found.values()))
        verdict.worst_mm = max(verdict.worst_mm, off * 1000) if off == off else float("nan")
        if not off <= MOST_M:
            worst = max(found, key=lambda name: np.linalg.norm(found[name] - sent[name], axis=1).max())
            verdict.troubles.append(f"{who}: {worst} is {off * 1000:.2f} mm from where it was sent")
        posture = Posture.of({role: found[names[kind]] for role, names in ROLES.items()})
        verdict.posture = verdict.posture or posture
        verdict.troubles += [f"{who}: {trouble}" for trouble in posture.troubles(true_posture(expected, posture, found[ROLES["pelvis"][kind]], frames))]
    return verdict


def true_posture(expected: dict, posture: Posture, pelvis: np.ndarray, frames: list[int]) -> Posture:
    """That of the simulated person who is where this one is."""
    order = expected["names"]["joints"]
    people = [np.array(person["joints"])[frames] for person in expected["people"].values()]
    nearest = min(people, key=lambda joints: np.linalg.norm(joints[:, order.index("SpineBase"), :2] - pelvis[:, :2], axis=1).mean())
    return Posture.of({role: nearest[:, order.index(names["truth"])] for role, names in ROLES.items()})
