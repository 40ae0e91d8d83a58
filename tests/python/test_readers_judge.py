"""What says whether other people's readers found what was sent (`tests/readers/judge.py`) finds what is wrong with it."""
import copy
import sys

import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests/readers"))
JOINTS = {
    "SpineBase": (0, 0, 0.95), "Neck": (0, 0, 1.5), "ShoulderLeft": (0, 0.2, 1.4), "ShoulderRight": (0, -0.2, 1.4),
    "AnkleLeft": (0, 0.1, 0.08), "AnkleRight": (0, -0.1, 0.08),
}


def walk(start, turn_deg):
    """Frames x joints x 3: two metres ahead, in the direction that the person faces."""
    turn = np.radians(turn_deg)
    axes = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    ahead = np.linspace(0, 2, 20)[:, None, None] * np.array([1.0, 0, 0])
    return (np.array(list(JOINTS.values())) + ahead) @ axes.T + start


@pytest.fixture
def sent():
    people = {"a": walk((0, 0, 0), 20), "b": walk((1, 2, 0), -100)}
    names = {"joints": list(JOINTS), "bones": [], "ends": []}
    people = {who: {"joints": places.tolist()} for who, places in people.items()}
    return {"sampled": list(range(20)), "names": names, "people": people}


def reading(sent, change=lambda places: places):
    """What a reader would find, had its places been changed so: frames x joints x 3."""
    people = {}
    for who, person in sent["people"].items():
        places = change(np.array(person["joints"]))
        people[who] = {name: places[:, index].tolist() for index, name in enumerate(JOINTS)}
    return {"what": "a test", "kind": "joints", "people": people, "axes": "room", "metres": 1.0, "frames": None, "sent": None}


def verdict(sent, found):
    from judge import judge

    return " ".join(judge(sent, found).troubles)


def test_what_was_sent_is_right_in_any_axes_and_unit(sent):
    assert verdict(sent, reading(sent)) == ""
    in_cm = reading(sent, lambda places: places[..., [1, 2, 0]] * 100) | {"axes": "y-up", "metres": 0.01}
    assert verdict(sent, in_cm) == ""
    assert "faces 90 deg" in verdict(sent, in_cm | {"axes": "opensim"})


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda places: places + [0, 0.002, 0], "2.00 mm"),
        (lambda places: places * [1, -1, 1], "faces"),
        (lambda places: places * [1, 1, -1], "neck"),
        (lambda places: places * 1.05, "neck"),
        (lambda places: places[..., [2, 1, 0]], "not upright"),
        (lambda places: np.tile(places[:1], (20, 1, 1)), "goes 0.00 m"),
        (lambda places: places[:, [0, 1, 3, 2, 5, 4]], "faces 180 deg"),
        (lambda places: places * np.nan, "nan mm"),
    ],
)
def test_what_is_wrong_is_told(sent, change, words):
    assert words in verdict(sent, reading(sent, change))


def test_who_and_what_is_missing_is_told(sent):
    found = reading(sent)
    without = copy.deepcopy(found)
    del without["people"]["b"]
    assert "1 people are there, 2 were sent" in verdict(sent, without)
    without = copy.deepcopy(found)
    del without["people"]["a"]["Neck"]
    assert "without Neck" in verdict(sent, without)
    assert "5 of 20 frames" in verdict(sent, reading(sent, lambda places: places[:5]) | {"frames": list(range(5))})
