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
    parser.add_argument("--every", type=int, default=1, help="every so many-th gap only, for a first look; odd, so that the sides alternate")
    parser.add_argument("--offline", action="store_true", help="the offline table: simple methods may look at both sides of a gap")


def run(options: argparse.Namespace) -> int:
    conditional = conditional_of(Prepared.load(options.data, "train"))
    methods = simple_methods(conditional, options.offline)
    longest = [45, 15]
    for path in options.model:
        name, model, before, after = onnx_model(Path(path))
        methods[name] = lambda case, model=model, before=before, after=after: fill(model, case, before, after)
        longest = [max(longest[0], before + 1), max(longest[1], after)]
    for split in ("held_out", "unseen"):
        print(f"\n{split}: mean mm after gaps of {', '.join(map(str, GAPS_S))} s")
        print(as_text(table(Prepared.load(options.data, split), methods, *longest, every=options.every)))
    return 0


def conditional_of(train: Prepared) -> GaussianConditional:
    return GaussianConditional(np.concatenate([train.poses, mirrored(train.poses)]))


def simple_methods(conditional: GaussianConditional, offline: bool = False) -> dict[str, Filler]:
    if offline:
        return {**simple.OFFLINE, "gaussian, two-sided": lambda case: simple.gaussian_two_sided(case, conditional)}
    return {**simple.LIVE, "gaussian + continuity": lambda case: simple.gaussian(case, conditional)}


def table(prepared: Prepared, methods: dict[str, Filler], before: int = 63, after: int = 15, every: int = 1) -> dict[tuple[str, str], list[float]]:
    """Mean mm for each (part, method), one number for each of `GAPS_S`."""
    result: dict[tuple[str, str], list[float]] = {}
    for part in PARTS:
        for gap_s in GAPS_S:
            case = cases(prepared, part, gap_s, before, after).every(every)
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


def fill(model, case: Cases, before: int, after: int) -> np.ndarray:
    """Runs a model pose by pose through the gaps, as the engine does; of one that fills its whole window the pose numbered `before`."""
    made = case.window()
    filled = []
    for step in range(case.gap):
        inside = slice(case.before + step - before, case.before + step + after + 1)
        answer = model(made.pose[:, inside], made.mask[:, inside], made.age[:, inside])[0]
        filled.append(answer[:, before if answer.shape[1] > 1 else 0])
    return np.stack(filled, axis=1)


def fill_offline(model, case: Cases, poses: int) -> np.ndarray:
    """Runs a model that fills its whole window once per stretch, with the gap in the middle as far as the stretch allows."""
    made = case.window()
    start = int(np.clip(case.before + case.gap // 2 - poses // 2, 0, made.mask.shape[1] - poses))
    window = slice(start, start + poses)
    filled = model(made.pose[:, window], made.mask[:, window], made.age[:, window])[0]
    return filled[:, case.before - start : case.before - start + case.gap]


def onnx_model(path: Path):
    """(name, function of (pose, mask, age), poses before and after the filled one) of an exported model with its manifest beside it."""
    import tomllib

    import onnxruntime

    with open(path.with_suffix(".toml"), "rb") as file:
        manifest = tomllib.load(file)

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])

    def model(pose: np.ndarray, mask: np.ndarray, age: np.ndarray):
        parts = []
        for begin in range(0, len(pose), 256):
            rows = slice(begin, begin + 256)
            parts.append(session.run(None, {"pose": pose[rows], "mask": mask[rows], "age": age[rows]}))
        return [np.concatenate(column) for column in zip(*parts)]

    return path.stem, model, manifest["before"], manifest["after"]


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
