"""`evaluate`: the table of gaps, parts and splits; trained models beside the simple methods, mean millimetres."""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from . import simple
from .cases import GAPS_S, Cases, cases, error_mm
from .joints import PARTS, mirrored
from .person import GaussianConditional
from .recordings import Prepared

Filler = Callable[[Cases], np.ndarray]


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--data", type=Path, required=True, help="folder written by `prepare`")
    parser.add_argument("--model", action="append", default=[], help="NAME.onnx with NAME.toml beside it; may be repeated")
    parser.add_argument("--offline", action="store_true", help="the offline table: simple methods may look at both sides of a gap")


def run(options: argparse.Namespace) -> int:
    conditional = conditional_of(Prepared.load(options.data, "train"))
    methods = simple_methods(conditional, options.offline)
    before = 45
    for path in options.model:
        name, model, poses = onnx_model(Path(path))
        methods[name] = lambda case, model=model, poses=poses: fill_offline(model, case, poses) if options.offline else fill_live(model, case, poses)
        before = max(before, poses - 1)
    for split in ("held_out", "unseen"):
        print(f"\n{split}: mean mm after gaps of {', '.join(map(str, GAPS_S))} s")
        print(as_text(table(Prepared.load(options.data, split), methods, before)))
    return 0


def conditional_of(train: Prepared) -> GaussianConditional:
    return GaussianConditional(np.concatenate([train.poses, mirrored(train.poses)]))


def simple_methods(conditional: GaussianConditional, offline: bool = False) -> dict[str, Filler]:
    if offline:
        return {**simple.OFFLINE, "gaussian, two-sided": lambda case: simple.gaussian_two_sided(case, conditional)}
    return {**simple.LIVE, "gaussian + continuity": lambda case: simple.gaussian(case, conditional)}


def table(prepared: Prepared, methods: dict[str, Filler], before: int = 63, after: int = 15) -> dict[tuple[str, str], list[float]]:
    """Mean mm for each (part, method), one number for each of `GAPS_S`."""
    result: dict[tuple[str, str], list[float]] = {}
    for part in PARTS:
        for gap_s in GAPS_S:
            case = cases(prepared, part, gap_s, before, after)
            for name, fill in methods.items():
                result.setdefault((part, name), []).append(error_mm(fill(case), case))
    return result


def as_text(result: dict[tuple[str, str], list[float]]) -> str:
    lines = [f"{part:10} {name:24}" + "".join(f"{value:7.0f}" for value in row) for (part, name), row in result.items()]
    return "\n".join(lines)


def against_best(result: dict[tuple[str, str], list[float]], name: str, simple_names: list[str]) -> dict[str, np.ndarray]:
    """For each part: the errors of `name` over those of the best simple method, gap for gap."""
    parts = dict.fromkeys(part for part, _ in result)
    best = {part: np.min([result[part, other] for other in simple_names], axis=0) for part in parts}
    return {part: np.array(result[part, name]) / best[part] for part in parts}


def fill_live(model, case: Cases, poses: int, every: int = 1) -> np.ndarray:
    """Runs a live model pose by pose through the gaps, as the engine does; between `every`-th poses straight lines."""
    made = case.window()
    chosen = list(range(0, case.gap, every))
    if chosen[-1] != case.gap - 1:
        chosen.append(case.gap - 1)
    filled = []
    for step in chosen:
        window = slice(case.before + step + 1 - poses, case.before + step + 1)
        filled.append(model(made.pose[:, window], made.mask[:, window], made.age[:, window])[0][:, 0])
    filled = np.stack(filled, axis=1)
    if every == 1:
        return filled
    at = np.arange(case.gap)
    right = np.clip(np.searchsorted(chosen, at), 1, len(chosen) - 1)
    low, high = np.array(chosen)[right - 1], np.array(chosen)[right]
    part = ((at - low) / (high - low))[None, :, None, None]
    return filled[:, right - 1] * (1 - part) + filled[:, right] * part


def fill_offline(model, case: Cases, poses: int) -> np.ndarray:
    """Runs an offline model once per stretch, with the gap in the middle of its window as far as the stretch allows."""
    made = case.window()
    start = int(np.clip(case.before + case.gap // 2 - poses // 2, 0, made.mask.shape[1] - poses))
    window = slice(start, start + poses)
    filled = model(made.pose[:, window], made.mask[:, window], made.age[:, window])[0]
    return filled[:, case.before - start : case.before - start + case.gap]


def onnx_model(path: Path):
    """(name, function of (pose, mask, age), poses in its window) of an exported model."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    poses = session.get_inputs()[0].shape[1]

    def model(pose: np.ndarray, mask: np.ndarray, age: np.ndarray):
        parts = []
        for begin in range(0, len(pose), 256):
            rows = slice(begin, begin + 256)
            parts.append(session.run(None, {"pose": pose[rows], "mask": mask[rows], "age": age[rows]}))
        return [np.concatenate(column) for column in zip(*parts)]

    return path.stem, model, poses


def torch_model(module):
    """A module of the common interface as a function of arrays."""
    import torch

    place = next(module.parameters()).device

    def model(pose: np.ndarray, mask: np.ndarray, age: np.ndarray):
        parts = []
        with torch.no_grad():
            for begin in range(0, len(pose), 512):
                rows = slice(begin, begin + 512)
                given = [torch.from_numpy(np.ascontiguousarray(array[rows])).to(place) for array in (pose, mask, age)]
                parts.append([tensor.cpu().numpy() for tensor in module(*given)])
        return [np.concatenate(column) for column in zip(*parts)]

    return model
