"""`export`: a trained model as ONNX with manifest and golden outputs, checked against PyTorch.

The format of the files is told in `models/data/README.md`.
"""

import argparse
import hashlib
from pathlib import Path

import numpy as np

from . import RATE_HZ
from .cases import GAPS_S, Cases, cases, error_mm
from .joints import PARTS
from .recipes import RECIPES, recipe
from .recordings import Prepared

OPSET = 17
CLOSE_M = 1e-4
GOLDEN_WINDOWS = 3
DATA = (
    "CMU motion capture, 20 minutes of 14 kinds of motion (models/training/split.toml), and the simulator's own motion; "
    "both also through the engine, in simulated rooms"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", choices=sorted(RECIPES))
    parser.add_argument("--run", type=Path, action="append", required=True, help="folder of a trained run; several: their ensemble")
    parser.add_argument("--name", required=True, help="name of the files, a-z 0-9 and -")
    parser.add_argument("--out", type=Path, required=True, help="folder for NAME.onnx, NAME.toml, NAME.golden.bin")
    parser.add_argument("--data", type=Path, required=True, help="folder written by `prepare`, for the figures in the manifest")
    parser.add_argument("--trained-on", default=DATA)
    parser.add_argument("--every", type=int, default=3, help="the figures come from every so many-th gap of the table")
    parser.add_argument("--no-figures", action="store_true", help="leave the table out of the manifest (quicker)")


def run(options: argparse.Namespace) -> int:
    made = recipe(options.model)
    module = made.load(options.run).eval().cpu()
    figures = {} if options.no_figures else measured(module, made, options.data, options.every)
    write(module, made, options.name, options.out, options.trained_on, figures)
    print(f"{options.out / options.name}.onnx: agrees with PyTorch, {parameters(module)} parameters")
    return 0


def parameters(module) -> int:
    return sum(p.numel() for p in module.parameters()) + sum(b.numel() for b in module.buffers())


def write(module, made, name: str, out: Path, trained_on: str, figures: dict[str, float], shrink=None) -> None:
    """Writes and checks the three files of one model; `shrink(path)` may store the ONNX file anew before it is checked."""
    import torch

    out.mkdir(parents=True, exist_ok=True)
    poses = made.BEFORE + 1 + made.AFTER
    pose, mask, age = golden_windows(poses)
    given = tuple(torch.from_numpy(array) for array in (pose, mask, age))
    path = out / f"{name}.onnx"
    names = ["pose", "mask", "age", "filled", "sigma"]
    torch.onnx.export(
        module, given, str(path), dynamo=False, opset_version=OPSET,
        input_names=names[:3], output_names=names[3:], dynamic_axes={key: {0: "N"} for key in names},
    )
    if shrink is not None:
        shrink(path)
    with torch.no_grad():
        filled, sigma = (tensor.numpy() for tensor in module(*given))
    compare(path, (pose, mask, age), (filled, sigma))
    golden = b"".join(np.ascontiguousarray(array, "<f4").tobytes() for array in (pose, mask, age, filled, sigma))
    (out / f"{name}.golden.bin").write_bytes(golden)
    text = manifest(module, made, name, filled.shape[1], digest(path.read_bytes()), digest(golden), trained_on, figures)
    (out / f"{name}.toml").write_text(text)


def golden_windows(poses: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Windows with gaps of a motion made by formula, so that no recording is shipped: somebody who walks and waves."""
    base = np.array([
        [0, 0, .95], [0, 0, 1.2], [0, 0, 1.55], [0, 0, 1.7], [0, .18, 1.4], [.02, .24, 1.13], [.1, .25, .9], [.13, .25, .83],
        [0, -.18, 1.4], [.02, -.24, 1.13], [.1, -.25, .9], [.13, -.25, .83], [0, .09, .9], [.03, .1, .5], [-.02, .1, .1], [.1, .1, .05],
        [0, -.09, .9], [.03, -.1, .5], [-.02, -.1, .1], [.1, -.1, .05], [0, 0, 1.42], [.15, .25, .76], [.16, .22, .82], [.15, -.25, .76],
        [.16, -.22, .82]])
    rng = np.random.default_rng(5)
    swing = rng.uniform(0.02, 0.12, (25, 1)) * rng.choice([-1, 1], (25, 1)) * np.array([1, 0.2, 0.3])
    time = np.arange(poses + 30)[:, None, None] / RATE_HZ
    windows = []
    for number in range(GOLDEN_WINDOWS):
        motion = base + swing * np.sin(2 * np.pi * (0.9 + 0.2 * number) * time + np.arange(25)[None, :, None]) + np.array([0.8, 0.1 * number, 0]) * time
        mask = np.ones((1, poses + 30, 25), np.float32)
        hidden = [[5, 6, 7, 21, 22], [13, 14, 15, 17, 18, 19], [9, 10, 11, 23, 24, 17, 18, 19]][number]
        middle = poses + 30 - 12 - 8 * number
        mask[0, middle:, hidden] = 0
        mask[0, poses // 2 : poses // 2 + 5, 3] = 0.5
        there = np.ones((1, poses + 30), bool)
        whole = Cases(motion[None].astype(np.float32), mask, there, middle, 12, [tuple(hidden)]).window()
        windows.append([array[:, -poses:] for array in (whole.pose, whole.mask, whole.age)])
    return tuple(np.ascontiguousarray(np.concatenate(column), np.float32) for column in zip(*windows))


def compare(path: Path, given, expected) -> None:
    """ONNX Runtime must say the same as PyTorch, all together and one by one."""
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    for rows in (slice(None), slice(0, 1)):
        got = session.run(None, {key: array[rows] for key, array in zip(("pose", "mask", "age"), given)})
        for name, ours, theirs in zip(("filled", "sigma"), got, expected):
            worst = float(np.abs(ours - theirs[rows]).max())
            if not worst < CLOSE_M:
                raise RuntimeError(f"{path}: {name} by ONNX Runtime is up to {worst} m from PyTorch's, expected below {CLOSE_M} m")


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def manifest(module, made, name, filled, onnx_digest, golden_digest, trained_on, figures) -> str:
    poses = made.BEFORE + 1 + made.AFTER
    lines = [
        "version = 1", f'name = "{name}"', f'kind = "{made.KIND}"', f"before = {made.BEFORE}", f"after = {made.AFTER}",
        f"rate_hz = {RATE_HZ}", 'joint_set = "kinect-v2-25"', 'batch = "dynamic"', f"opset = {OPSET}", f'sha256 = "{onnx_digest}"',
        "", "[inputs]",
        f'pose = {{ shape = ["N", {poses}, 25, 3], unit = "m" }}',
        f'mask = {{ shape = ["N", {poses}, 25], unit = "1" }}',
        f'age = {{ shape = ["N", {poses}, 25], unit = "s" }}',
        "", "[outputs]",
        f'filled = {{ shape = ["N", {filled}, 25, 3], unit = "m" }}',
        f'sigma = {{ shape = ["N", {filled}, 25], unit = "m" }}',
        "", "[golden]", f"windows = {GOLDEN_WINDOWS}", f'sha256 = "{golden_digest}"',
        "", "[about]", f'summary = "{made.ABOUT["summary"]}"', f'source = "{made.ABOUT["source"]}"',
        'licence = "MIT OR Apache-2.0"', f'training_data = "{trained_on}"', f"parameters = {parameters(module)}",
        "", "[figures]", *(f"{key} = {value}" for key, value in figures.items()),
    ]
    return "\n".join(lines) + "\n"


def measured(module, made, data: Path, every: int) -> dict[str, float]:
    """The table of `evaluate` for this model: split_part_gap_mm."""
    from .evaluate import fill, torch_model

    model = torch_model(module)
    figures = {}
    for split in ("held_out", "unseen"):
        prepared = Prepared.load(data, split)
        for part in PARTS:
            for gap_s in GAPS_S:
                case = cases(prepared, part, gap_s, made.BEFORE + 1, max(made.AFTER, 15)).every(every)
                filled = fill(model, case, made.BEFORE, made.AFTER)
                key = f"{split}_{part.replace(' ', '_')}_{str(gap_s).replace('.', '_')}s_mm"
                figures[key] = round(error_mm(filled, case), 1)
    return figures
