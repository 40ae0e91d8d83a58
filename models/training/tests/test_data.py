"""Cleaning, splitting, variation, corruption and the cases of the table; needs NumPy only."""

import numpy as np
import pytest

from people import walking
from posefuse_training.augment import Source, Variation, headings, turned, with_arms_of
from posefuse_training.cases import cases, error_mm
from posefuse_training.clean import bad_frames, clean_spans
from posefuse_training.corrupt import Room, gaps, hidden_joints, measured, window
from posefuse_training.joints import ARM_LEFT, BONES, MIRROR, NAMES, PARENTS, mirrored
from posefuse_training.pairs import Pairs
from posefuse_training.person import GaussianConditional, person_frame
from posefuse_training.recordings import Prepared, split_of, split_rules
from posefuse_training.simple import gaussian, hold, linear


def bone_lengths(poses):
    return np.linalg.norm(poses[..., BONES, :] - poses[..., PARENTS[BONES], :], axis=-1)


def test_a_mirror_swaps_sides_and_twice_is_nothing():
    assert NAMES[MIRROR[NAMES.index("WristLeft")]] == "WristRight"
    poses = walking(20)
    assert np.allclose(mirrored(mirrored(poses)), poses)
    assert np.allclose(headings(mirrored(poses)), -headings(poses))


def test_jumps_and_broken_bones_cut_a_recording():
    poses = walking(200)
    assert not bad_frames(poses).any()
    poses[80] += np.array([0.6, 0, 0])
    poses[150, 7] += np.array([0, 0.3, 0])
    poses[10, 3] = np.nan
    bad = np.flatnonzero(bad_frames(poses))
    assert set(bad) >= {10, 80, 81, 150}
    spans = clean_spans(poses)
    assert [len(span) for span in spans] == [68, 68, 49]


@pytest.mark.parametrize(
    ("place", "split"),
    [
        ("cmu_bvh/salsa/03.npy", "held_out"), ("cmu_bvh/salsa/04.npy", "train"), ("cmu_bvh/indian/06.npy", "unseen"),
        ("cmu_asfamc/35/35_01.npy", "unseen"), ("cmu_asfamc/01/01_02.npy", "held_out"), ("made/lying_0_0.npy", "made"),
    ],
)
def test_recordings_go_where_the_split_file_says(place, split):
    assert split_of(place, split_rules()) == split


def test_partners_of_one_take_are_never_on_both_sides_of_the_split():
    rules = split_rules()
    for number in range(1, 16):
        sides = {split_of(f"cmu_bvh/salsa/{n:02}.npy", rules) for n in (number, number + 15)}
        assert len(sides) == 1


def test_drawn_stretches_keep_bones_and_speed_within_bounds():
    source = Source([(Prepared.joined([("a/walk/1.npy", walking(100)), ("a/run/1.npy", walking(40, 1.0))]), 1.0)])
    variation = Variation(size=(1.0, 1.0), mixed_arms=0.0)
    drawn = source.draw(np.random.default_rng(3), 32, 90, variation)
    assert drawn.shape == (32, 90, 25, 3)
    # Straight lines between poses shorten a swinging limb a little.
    assert np.abs(bone_lengths(drawn) - bone_lengths(walking(1))).max() < 0.005
    speed = np.linalg.norm(np.diff(drawn[:, :, 0], axis=1), axis=-1) * 30
    assert speed.max() < np.hypot(1.0, 0.2) * 1.35


def test_arms_of_another_hang_on_the_own_shoulders():
    poses, others = turned(walking(50)[None], np.array([0.0])), turned(walking(50, 2.0)[None], np.array([1.0]))
    mixed = with_arms_of(poses, others, np.random.default_rng(0))
    assert np.allclose(bone_lengths(mixed), bone_lengths(poses), atol=1e-5)
    changed = np.abs(mixed - poses).max(axis=(0, 1, 3)) > 0.01
    assert changed.any() and set(np.flatnonzero(changed)) <= {5, 6, 7, 21, 22, 9, 10, 11, 23, 24}


def test_a_gap_hides_the_pose_it_is_asked_to():
    rng = np.random.default_rng(1)
    mask = gaps(rng, 200, 120, Room(), ends=110)
    assert (mask[:, 110] == 0).any(axis=1).all()
    assert hidden_joints(rng, 500).any(axis=1).all()


def test_a_window_keeps_last_places_and_tells_their_age():
    truth = walking(60)[None]
    mask = np.ones((1, 60, 25), np.float32)
    mask[0, 40:55, 6] = 0
    mask[0, :20, 3] = 0
    made = window(truth, mask, truth, slice(10, 60))
    assert np.allclose(made.pose[0, 54 - 10, 6], truth[0, 39, 6])
    assert made.age[0, 54 - 10, 6] == pytest.approx(15 / 30)
    assert made.age[0, 55 - 10, 6] == 0 and np.allclose(made.pose[0, 55 - 10, 6], truth[0, 55, 6])
    # A joint that was never seen is in the middle of the others, and as old as can be.
    assert made.age[0, 0, 3] == 10
    others = [joint for joint in range(25) if joint != 3]
    assert np.allclose(made.pose[0, 0, 3], truth[0, 10, others].mean(axis=0), atol=1e-5)


def test_measurements_are_near_the_truth_and_weak_ones_are_marked():
    rng = np.random.default_rng(2)
    truth = np.repeat(walking(60)[None], 64, axis=0)
    room = Room(shift=0.0, swap=0.0, floor_m=0.0)
    seen, mask = measured(rng, truth, np.ones((64, 60, 25), np.float32), room)
    away = np.linalg.norm(seen - truth, axis=-1)
    assert 0 < away[mask == 1].mean() < 0.02
    assert ((mask > 0) & (mask < 1)).any() and away[(mask > 0) & (mask < 1)].mean() > away[mask == 1].mean()


def prepared():
    return Prepared.joined([("a/walk/1.npy", walking(200)), ("a/walk/2.npy", mirrored(walking(150, 1.0)))])


def test_the_measure_is_zero_for_the_truth_and_the_offset_else():
    case = cases(prepared(), "arm", 0.5, 30)
    inside = case.truth[:, case.before : case.before + case.gap]
    assert error_mm(inside, case) == 0
    assert error_mm(inside + np.array([0, 0, 0.01], np.float32), case) == pytest.approx(10, rel=1e-3)


def test_cases_hide_their_part_and_nothing_else():
    case = cases(prepared(), "side", 0.2, 30)
    assert case.gap == 6
    for row, joints in enumerate(case.hidden):
        gone = case.mask[row] == 0
        inside = np.zeros_like(gone)
        inside[case.before : case.before + case.gap, list(joints)] = True
        assert (gone[case.there[row]] == inside[case.there[row]]).all()


def test_simple_methods_begin_where_the_joint_was():
    case = cases(prepared(), "arm", 1.0, 30)
    conditional = GaussianConditional(prepared().poses)
    last = case.truth[:, case.before - 1]
    for fill in (hold, linear, lambda case: gaussian(case, conditional)):
        assert np.abs(fill(case)[:, 0] - last)[:, list(ARM_LEFT)].max() < 0.25
    # Who knows that arms swing with legs does better than who holds still.
    assert error_mm(gaussian(case, conditional), case) < error_mm(hold(case), case)


def test_the_conditional_does_not_touch_what_is_seen():
    poses = walking(100)
    own, _, _ = person_frame(poses)
    filled = GaussianConditional(poses)(own, ARM_LEFT)
    others = [joint for joint in range(25) if joint not in ARM_LEFT]
    assert np.array_equal(filled[:, others], own[:, others])


def test_a_guess_is_off_as_its_weight_says_and_more_down_a_limb():
    truth = np.repeat(walking(120)[None], 400, axis=0)
    mask = np.ones((400, 120, 25), np.float32)
    mask[:, 30:, [5, 6, 7]] = 0
    room = Room(clean=1.0, guessed=1.0, claimed=0.0, shift=0.0, swap=0.0, floor_m=0.0)
    seen, weights = measured(np.random.default_rng(0), truth, mask, room)
    assert (weights[:, 30:, [5, 6, 7]] < 0.95).all() and (np.delete(weights, [5, 6, 7], axis=2) == 1).all()
    guessed = weights[:, 60:, [5, 6, 7]] > 0
    off = np.linalg.norm(seen - truth, axis=-1)[:, 60:, [5, 6, 7]]
    along_limb = [off[..., joint][guessed[..., joint]].mean() for joint in range(3)]
    assert 0.05 < along_limb[0] < 0.9 * along_limb[1] < along_limb[2] < 0.3
    # One pose to the next it is nearly the same.
    assert np.abs(np.diff(seen - truth, axis=1))[:, 60:].mean() < 0.3 * off.mean()


def test_pairs_of_rooms_are_read_divided_and_mirrored(tmp_path):
    kinds = [("pose", (64, 25, 3)), ("mask", (64, 25)), ("age", (64, 25)), ("truth", (25, 3)), ("plain", (25, 3))]
    record = np.dtype([(name, "<f4", shape) for name, shape in kinds] + [("seen", "|u1", (25,))])
    for number in range(9):
        rows = np.zeros(3, record)
        rows["pose"], rows["truth"], rows["plain"] = walking(64), walking(64)[-1], walking(64)[-1]
        rows["mask"][:, :, 5], rows["plain"][:, 5, 0] = 0.2, rows["plain"][:, 5, 0] + 0.1
        rows["truth"][2] = np.nan
        np.save(tmp_path / f"arc2_{number}.npy", rows)
    taught, tests = Pairs.load(tmp_path, 63).divided()
    assert (len(taught), len(tests)) == (14, 4)
    made = tests.window(slice(0, 4))
    assert np.allclose(made.pose[1], mirrored(made.pose[0])) and np.allclose(made.truth[1, 0], mirrored(made.truth[0, 0]))
    assert made.mask[0, -1, 5] == made.mask[1, -1, MIRROR[5]] == np.float32(0.2)
    assert np.array_equal(tests.asked()[1], tests.asked()[0][MIRROR])
    weak = Pairs([tests.records[:1]], 63)
    assert weak.plain_mm() == pytest.approx(100 / 25, rel=1e-3)
