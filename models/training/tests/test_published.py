"""What must hold in the published systems whatever was trained."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from posefuse_training.export import golden_windows  # noqa: E402
from posefuse_training.published import clip_autoencoder as clip  # noqa: E402
from posefuse_training.published import dual_autoencoder as dual  # noqa: E402
from posefuse_training.published import geometry as g  # noqa: E402
from posefuse_training.published import pose_features, pose_resnet as resnet  # noqa: E402
from posefuse_training.published import bone_code as code, sparse_dictionary as sparse  # noqa: E402
from posefuse_training.published.experiment import savitzky_golay  # noqa: E402
from posefuse_training.published.matrix_completion import completed  # noqa: E402


@pytest.fixture
def walk():
    """Somebody who walks and waves, `[3, 70, 25, 3]`, all measured."""
    pose, mask, _ = golden_windows(70)
    return torch.from_numpy(pose), torch.ones(mask.shape)


def test_frames_lead_there_and_back(walk):
    pose, seen = walk
    for frame in (g.waist_frame(pose, seen), g.upright_frame(g.leftward(pose, seen))):
        origin = pose[..., 0, :]
        assert torch.allclose(frame @ frame.transpose(-1, -2), torch.eye(3).expand_as(frame), atol=1e-4)
        assert torch.allclose(g.out_of(frame, origin, g.into(frame, origin, pose)), pose, atol=1e-4)


def test_rotations_turn_rest_bones_into_bones(walk):
    pose, seen = walk
    points, _, _ = resnet.to_waist(pose, seen, torch.ones(15), torch.tensor(0.25))
    turns = pose_features.rotations(points, torch.ones(points.shape[:-1]))
    for joint, child in enumerate(pose_features.CHILD):
        if child < 0:
            continue
        bone = g.unit(points[..., child, :] - points[..., joint, :])
        rest = torch.tensor(pose_features.REST[joint]).expand_as(bone)
        assert torch.allclose(g.turn(turns[..., joint, :], rest), bone, atol=2e-3), resnet.JOINTS[joint]


def test_poses_do_not_depend_on_place_heading_or_size(walk):
    pose, seen = walk
    angle = torch.full((3,), 1.1)
    moved = clip.turned(pose, angle) * 1.3 + torch.tensor((2.0, -1.0, 0.4))
    # Usual proportions of somebody whose mean bone is a size of one.
    lengths = g.length(pose[0, 0, [c for c, _ in resnet.BONES]] - pose[0, 0, [p for _, p in resnet.BONES]])
    shape = lengths / lengths.mean(), lengths.mean()
    before, after = (resnet.features(resnet.to_waist(p, seen, *shape)[0], seen[..., list(resnet.JOINTS)]) for p in (pose, moved))
    # The usual size has a small say in the size, so that scaling is not exact.
    assert (before - after).abs().max() < 0.02


def test_an_occluded_joint_is_zero_and_its_parents_rotation_the_identity():
    x = torch.rand(4, resnet.FEATURES) + 1.0
    gone = torch.zeros(4, 16)
    gone[:, 6] = 1.0
    y = resnet.hide(x, gone).view(4, 16, 7)
    assert (y[:, 6, :3] == 0).all()
    assert (y[:, 5, 3:] == torch.tensor((1.0, 0.0, 0.0, 0.0))).all()
    assert (y[:, 5, :3] == x.view(4, 16, 7)[:, 5, :3]).all()


def test_the_filter_keeps_polynomials_of_its_order_and_calms_noise():
    time = np.linspace(-1, 1, 80)
    smooth = np.stack([1 + time - 2 * time**2 + time**4, time**3], 1)
    assert np.allclose(savitzky_golay(smooth, 29, 4), smooth, atol=1e-9)
    noise = np.random.default_rng(0).normal(size=(400, 1))
    assert savitzky_golay(noise, 29, 4).std() < 0.6 * noise.std()


def test_signed_squares_add_up_to_one_and_lead_back(walk):
    bones, _ = code.bones_of(walk[0])
    squares = code.signed_squares(bones)
    assert torch.allclose(squares.abs().sum(-1), torch.ones(squares.shape[:-1]), atol=1e-4)
    assert torch.allclose(code.directions(squares), bones, atol=0.04)


def test_parts_joined_in_threes_come_apart_again():
    bones = torch.randn(5, code.WINDOW, 20, 3)
    assert torch.allclose(code.joined(code.split(bones)), bones, atol=1e-5)


def test_proximal_steps_go_down(walk):
    bones, _ = code.bones_of(walk[0][:, :6])
    x = code.split(code.signed_squares(bones))
    dictionary = sparse.Dictionary(40)
    atoms, mean = dictionary.atoms.detach(), dictionary.mean
    known = torch.ones_like(x)

    def objective(steps):
        alpha = code.code(x, known, atoms, mean, steps, code.strides(atoms))
        y = mean + alpha @ atoms.transpose(1, 2)
        excess = y.reshape(len(y), -1, 72, 3).abs().sum(-1) - 1
        return (0.5 * (y - x).square().sum() + 0.2 * excess.square().sum() + 1e-4 * alpha.abs().sum()).item()

    assert objective(60) < objective(10) < objective(0)


@pytest.mark.parametrize("gone", [[6, 7], [5], [5, 6, 7, 9, 10, 11], [0, 12, 16], [13, 14, 15]])
def test_placed_joints_keep_bones_and_measurements(walk, gone):
    pose = walk[0][:, 0]
    along, lengths = code.bones_of(pose)
    seen = torch.ones(3, 25)
    seen[:, gone] = 0.0
    wrong = g.unit(along + 0.3 * torch.randn(along.shape, generator=torch.Generator().manual_seed(1)))
    out = code.placed(pose, seen, wrong, lengths, rounds=200)
    still = [j for j in range(21) if j not in gone]
    assert torch.equal(out[:, still], pose[:, still])
    assert (code.bones_of(out)[1] - lengths).abs().max() < 1e-3


def test_matrix_completion_completes_what_has_low_rank():
    rng = np.random.default_rng(2)
    truth = torch.from_numpy((rng.normal(size=(120, 3)) @ rng.normal(size=(3, 30))).astype(np.float32)).view(120, 10, 3)
    known = (torch.rand(120, 10, generator=torch.Generator().manual_seed(3)) > 0.3).float()
    out = completed(truth * known.unsqueeze(-1), known)
    gone = known < 0.5
    assert (out - truth)[gone].abs().mean() < 0.1 * truth[gone].abs().mean()


def test_riding_joints_keep_their_place_on_a_body_that_turns_and_goes(walk):
    still = walk[0][:1, :1].expand(1, 40, -1, -1)
    step = torch.arange(40.0)
    moved = torch.cat([clip.turned(still[:, t : t + 1], step[t : t + 1] * 0.05) for t in range(40)], 1) + step.view(1, -1, 1, 1) * 0.02
    seen = torch.ones(1, 40, 25)
    seen[:, 10:, [5, 6, 7]] = 0.0
    lost = moved.clone()
    lost[:, 10:, [5, 6, 7]] = moved[:, 9:10, [5, 6, 7]]
    assert torch.allclose(g.riding(lost, seen), moved, atol=1e-3)


def test_networks_give_back_what_they_are_given_in_shape():
    image = clip.to_image(torch.zeros(2, clip.FRAMES, len(clip.GIVEN), 3))
    assert clip.from_image(clip.ClipAutoencoder().eval()(image)).shape == (2, clip.FRAMES, len(clip.OUT), 3)
    window = torch.zeros(2, dual.FRAMES, dual.FEATURES)
    for network in (dual.Recurrent(), dual.Convolutional()):
        assert network.eval()(window).shape == window.shape
    widths = (resnet.FEATURES * resnet.WIDTH, resnet.WIDTH * resnet.WIDTH)
    assert sum(p.numel() for p in resnet.PoseResNet().parameters() if p.dim() == 2) == 2 * widths[0] + widths[1]


def test_synthetic_noise_leaves_gaps_of_zeros():
    points = torch.ones(8, dual.FRAMES, dual.JOINTS, 3)
    noisy = dual.synthetic_noise(points, torch.Generator().manual_seed(4))
    gone = (noisy == 0).all(-1)
    assert gone.any() and not gone[:, :, 0].any()
    assert (noisy[~gone] - 1).abs().max() < 1.0
