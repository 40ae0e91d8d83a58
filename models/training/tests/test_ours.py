"""Our models' laws; needs PyTorch."""

import copy

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed: the models of models/training are not tested")

from people import walking
from posefuse_training.corrupt import window
from posefuse_training.joints import ARM_LEFT, LEG_LEFT, LEG_RIGHT, MIRROR, mirrored
from posefuse_training.ours.causal import POSES, Causal
from posefuse_training.ours.frames import look_back
from posefuse_training.ours.guesses import averaged, since_trusted
from posefuse_training.ours.prior import PosePrior, own_spans, weak_sigma_m
from posefuse_training.ours.two_sided import BEFORE, TwoSided
from posefuse_training.ours.two_sided import POSES as BOTH_SIDES
from posefuse_training.ours.weighing import without_measurement
from posefuse_training.recordings import Prepared

HIDDEN = {"arm": ARM_LEFT, "legs": LEG_LEFT + LEG_RIGHT}


@pytest.fixture(scope="module")
def spans():
    clips = [walking(200, phase) * size for phase in (0.0, 1.0, 2.0) for size in (0.9, 1.0)]
    rng = np.random.default_rng(0)
    noisy = [clip + rng.normal(0, 0.01, clip.shape).astype(np.float32) for clip in clips]
    return own_spans(Prepared.joined([(f"a/walk{n}/1.npy", clip) for n, clip in enumerate(noisy)]))


@pytest.fixture(scope="module", params=[Causal, TwoSided])
def model(request, spans):
    torch.manual_seed(0)
    made = request.param(64, 1, latents=12)
    made.prior.fit(spans)
    torch.nn.init.normal_(made.network.last[1].weight, std=0.05)
    return made.eval()


def windows(model, hidden=ARM_LEFT, lost=10, poses=None):
    """One window that hides joints from `lost` poses before the filled one until 10 after it."""
    count, filled = (POSES, POSES - 1) if isinstance(model, Causal) else (BOTH_SIDES, BEFORE)
    truth = (walking(count, 0.5) if poses is None else poses)[None]
    mask = np.ones((1, count, 25), np.float32)
    mask[0, filled - lost + 1 : filled + 10, list(hidden)] = 0
    made = window(truth, mask, truth)
    return [torch.from_numpy(np.ascontiguousarray(a)) for a in (made.pose, made.mask, made.age)], truth[0, filled]


@torch.no_grad()
@pytest.mark.parametrize("hidden", HIDDEN)
def test_what_is_measured_stays(model, hidden):
    given, truth = windows(model, HIDDEN[hidden])
    filled, sigma = model(*given)
    seen = [joint for joint in range(25) if joint not in HIDDEN[hidden]]
    assert np.abs(filled[0, 0, seen].numpy() - truth[seen]).max() < 1e-4
    assert (sigma > 0).all() and (sigma[0, 0, list(HIDDEN[hidden])] > sigma[0, 0, seen].max()).all()


@torch.no_grad()
def test_every_continuation_begins_where_the_joint_was(model):
    given, truth = windows(model, lost=1)
    untrained = copy.deepcopy(model)
    untrained.network.last[1].weight.zero_()
    filled, _ = untrained(*given)
    assert np.abs(filled[0, 0].numpy() - truth)[list(ARM_LEFT)].max() < 0.08


@torch.no_grad()
def test_it_does_not_matter_where_in_the_room_somebody_is_and_faces(model):
    given, _ = windows(model)
    filled, sigma = model(*given)
    angle = 1.1
    turn = torch.tensor([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]], dtype=torch.float32)
    way = torch.tensor([2.0, -1.0, 0])
    elsewhere, same = model(given[0] @ turn.T + way, *given[1:])
    assert torch.allclose(elsewhere, filled @ turn.T + way, atol=2e-3)
    assert torch.allclose(sigma, same, atol=2e-3)


@torch.no_grad()
def test_degenerate_windows_give_finite_answers(model):
    (pose, mask, age), _ = windows(model)
    for given in (
        (torch.zeros_like(pose), mask, age),
        (torch.zeros_like(pose), torch.zeros_like(mask), torch.full_like(age, 10.0)),
        (pose, torch.zeros_like(mask), torch.full_like(age, 10.0)),
    ):
        filled, sigma = model(*given)
        assert torch.isfinite(filled).all() and torch.isfinite(sigma).all()


@torch.no_grad()
def test_several_windows_at_once_are_the_same_as_one_by_one(model):
    first, _ = windows(model)
    second, _ = windows(model, LEG_LEFT, lost=30, poses=mirrored(walking(len(first[0][0]))))
    together = model(*(torch.cat(pair) for pair in zip(first, second)))
    for row, given in enumerate((first, second)):
        for both, one in zip(together, model(*given)):
            assert torch.allclose(both[row : row + 1], one, atol=1e-4)


@torch.no_grad()
def test_a_committee_does_not_know_left_from_right(model):
    seated = copy.deepcopy(model)
    seated.seat([seated.network])
    (pose, mask, age), _ = windows(model)
    filled, sigma = seated(pose, mask, age)
    image = torch.from_numpy(mirrored(pose.numpy()))
    other, same = seated(image, mask[..., MIRROR], age[..., MIRROR])
    assert np.abs(mirrored(other.numpy()) - filled.numpy()).max() < 1e-3
    assert torch.allclose(same[..., MIRROR], sigma, atol=1e-3)
    # One network alone does.
    alone, _ = model(image, mask[..., MIRROR], age[..., MIRROR])
    assert np.abs(mirrored(alone.numpy()) - model(pose, mask, age)[0].numpy()).max() > 1e-2


@torch.no_grad()
def test_the_prior_agrees_with_the_textbook(spans):
    prior = PosePrior(12)
    prior.fit(spans)
    mask = torch.ones(1, 25)
    mask[0, list(ARM_LEFT)] = 0
    pose = torch.from_numpy(spans[0][0][:1].astype(np.float32))
    trust, information = prior.information(mask)
    mean = prior.given(trust, information, pose[:, None])[0, 0].double()
    seen = trust[0] > 0
    loadings = (prior.basis * prior.root_variance).double()
    covariance = loadings @ loadings.T + torch.diag(1 / prior.precision.double())
    away = (pose[0] - prior.mean).double()[seen]
    gain = torch.linalg.solve(covariance[seen][:, seen], (loadings @ loadings[seen].T).T).T
    assert torch.allclose(mean, prior.mean.double() + gain @ away, atol=2e-3)


def test_a_fill_and_the_measurement_it_is_put_beside_make_what_was_meant():
    measured, meant = torch.zeros(1, 1, 3, 3), torch.full((1, 1, 3, 3), 0.1)
    mask, sigma = torch.tensor([[[0.3, 0.0, 1.0]]]), torch.full((1, 1, 3), 0.04)
    fill, said = without_measurement(meant, sigma, measured, mask)
    # The engine's own rule: by covariances.
    own = weak_sigma_m(mask)[0, 0, 0] ** 2
    gain = own / (own + said[0, 0, 0] ** 2)
    assert torch.allclose(gain * fill[0, 0, 0], meant[0, 0, 0], atol=1e-5)
    assert abs(torch.sqrt(gain) * said[0, 0, 0] - 0.04) < 1e-5
    # Where nothing is measured, or with trust, it is said as it is.
    assert torch.equal(fill[0, 0, 1:], meant[0, 0, 1:]) and torch.equal(said[0, 0, 1:], sigma[0, 0, 1:])


def test_guesses_are_averaged_in_time_and_do_not_count_as_trust():
    own, mask = torch.zeros(1, 64, 25, 3), torch.ones(1, 64, 25)
    mask[0, 40:, 5] = 0.3
    own[0, 40:, 5, 0] = 1.0
    assert since_trusted(mask, 0 * mask)[0, [4, 5]].tolist() == pytest.approx([0, 24 / 30])
    mask[0, :40, 5] = 0
    assert since_trusted(mask, 0 * mask)[0, 5] == pytest.approx(64 / 30)
    means, evidence = averaged(own, mask, 63)
    assert all(mean[0, 5, 0] == pytest.approx(1.0) for mean in means)
    assert evidence[0, 5] > 0 and evidence[0, 4] == 0


def test_a_look_back_may_fall_between_two_poses():
    weights = look_back(torch.tensor([0.0, 2.25, 99.0]), 5)
    assert torch.allclose(weights, torch.tensor([[0, 0, 0, 0, 1.0], [0, 0.25, 0.75, 0, 0], [1.0, 0, 0, 0, 0]]))


def test_an_exported_model_says_the_same(model, tmp_path):
    pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: exported models are not compared")
    from posefuse_training.export import write
    from posefuse_training.ours import live, offline

    recipe = live if isinstance(model, Causal) else offline
    # It compares with ONNX Runtime itself and raises where they differ.
    write(model, recipe, "tried", tmp_path, "a test", {"arm_mm": 1.0})
    assert {path.name for path in tmp_path.iterdir()} == {"tried.onnx", "tried.toml", "tried.golden.bin"}
