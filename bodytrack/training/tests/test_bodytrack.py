"""Data, measures and the network, on made-up crops."""

import numpy as np
import pytest

from posefuse_bodytrack import data, joints, metrics


def written(folder, count, subset="train"):
    random = np.random.default_rng(1)
    crops = random.integers(-9000, 9000, (count, joints.SIZE, joints.SIZE)).astype("<i2")
    crops[:, :8], crops[:, -8:] = data.NOTHING, data.UNKNOWN
    truths = random.normal(0, 0.3, (count, data.TRUTH)).astype("<f4")
    truth = data.Truth(truths)
    truth.visible[:] = random.random(truth.visible.shape) < 0.7
    truth.heading[:] /= np.linalg.norm(truth.heading, axis=1, keepdims=True)
    truth.hands[:] = random.random(truth.hands.shape) < 0.5
    crops.tofile(folder / f"{subset}-1.crops")
    truths.tofile(folder / f"{subset}-1.truth")
    return crops, truth


def test_joints_mirror_onto_themselves():
    assert [joints.MIRRORED[m] for m in joints.MIRRORED] == list(range(joints.COUNT))
    assert joints.NAMES[joints.MIRRORED[joints.INDEX["WristLeft"]]] == "WristRight"
    assert joints.MIRRORED[joints.INDEX["Head"]] == joints.INDEX["Head"]


def test_channels_tell_person_nothing_and_unknown(tmp_path):
    crops, _ = written(tmp_path, 3)
    both = data.channels(crops)
    assert both.shape == (3, joints.CHANNELS, joints.SIZE, joints.SIZE)
    assert (both[:, 1, :8] == 0).all() and (both[:, 1, -8:] == -1).all() and (both[:, 1, 8:-8] == 1).all()
    assert np.allclose(both[:, 0, 20], crops[:, 20] / data.UNITS) and (both[:, 0, :8] == 0).all()


def test_a_stream_finds_what_was_written_since(tmp_path):
    written(tmp_path, 10)
    files = data.Files(tmp_path, "train")
    assert len(files.scan()) == 10 and files.scan() == []
    written(tmp_path, 14)
    assert len(files.scan()) == 4


def test_augmentation_moves_crop_and_joints_together():
    # A person of one cell, with a joint in it.
    random = np.random.default_rng(3)
    count = 60
    crops = np.full((count, joints.SIZE, joints.SIZE), data.NOTHING, np.int16)
    crops[:, 20:44, 20] = 1000
    truths = np.zeros((count, data.TRUTH), np.float32)
    middle = (20 + 0.5 - joints.SIZE / 2) * joints.CELL_M
    truth = data.Truth(truths)
    truth.joints[:, :, 0], truth.joints[:, :, 2] = middle, 0.1
    truth.heading[:] = [1, 0]
    moved, truth = data.augmented(data.channels(crops), truths, random)
    mirrored = 0
    for crop, found, heading in zip(moved.numpy(), truth.joints.numpy(), truth.heading.numpy()):
        rows, columns = np.nonzero(crop[1] == 1)
        if len(columns) == 0:
            continue
        x = (columns.mean() + 0.5 - joints.SIZE / 2) * joints.CELL_M
        assert abs(found[0, 0] - x) < 1e-5
        assert abs(found[0, 2] - crop[0][rows[0], columns[0]]) < 1e-5
        assert heading[0] == (1 if x < 0 else -1)
        mirrored += x > 0
    assert 15 < mirrored < 45


def test_measures_know_right_from_wrong():
    random = np.random.default_rng(5)
    true = random.normal(0, 0.3, (50, joints.COUNT, 3))
    assert metrics.sides_right(true, true).all()
    assert not metrics.sides_right(true[:, joints.MIRRORED], true).any()
    sigma = np.full(20_000, 0.05)
    error = np.linalg.norm(random.normal(0, 0.05, (20_000, 3)), axis=1)
    assert abs(metrics.probability(sigma).mean() - (error < metrics.NEAR_M).mean()) < 0.01


def test_a_network_learns_goes_on_and_is_exported(tmp_path):
    pytest.importorskip("torch")
    import argparse

    from posefuse_bodytrack import export, train

    written(tmp_path, 40)
    written(tmp_path, 8, "unseen")
    parser = argparse.ArgumentParser()
    train.arguments(parser)
    folders = ["--data", str(tmp_path), "--run", str(tmp_path / "run"), "--batch", "8", "--width", "4"]
    train.train(parser.parse_args([*folders, "--minutes", "0.02"]))
    first = train.Run(parser.parse_args(folders))
    assert first.steps > 0 and first.samples == 8 * first.steps
    train.train(parser.parse_args([*folders, "--minutes", "0.03"]))
    assert train.Run(parser.parse_args(folders)).steps > first.steps
    pytest.importorskip("onnxruntime")
    parser = argparse.ArgumentParser()
    export.arguments(parser)
    out = tmp_path / "out"
    export.export(parser.parse_args(["--run", str(tmp_path / "run"), "--data", str(tmp_path), "--out", str(out)]))
    numbers = joints.CHANNELS * joints.SIZE**2 + 75 + 25 + 25 + 2 + 2
    assert (out / "depth-joints.golden.bin").stat().st_size == 4 * export.GOLDEN * numbers
    assert "sha256" in (out / "depth-joints.toml").read_text()
