"""How the published systems come to ship: behind the common interface, with deviations measured, small, checked."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import helper, numpy_helper
from torch import nn

from .. import export
from ..cases import GAPS_S, cases, error_mm
from ..evaluate import fill, fill_offline, torch_model
from ..joints import COUNT, PARTS
from .experiment import Experiment

TRUSTED_M = 0.01
"""Deviation of what was measured."""
LARGE = 4096
"""Weights with more numbers are stored in half precision."""
EVERY_CASE = 3
"""The manifest's figures come from every third gap of the table; the left and the right side still alternate."""
TRAINED_ON = "CMU motion capture, 20 minutes of 14 kinds of motion (models/training/split.toml)"


class Shipped(nn.Module):
    """The common interface: (pose, mask, age) to (filled, sigma).

    `fills` makes up all joints of the last K poses, `[N, K, 25, 3]`; measured ones stay, weakly measured ones in part. The
    published systems say nothing about how sure they are: `spread` `[25]` is how far off they were, along each axis, on recordings
    that did not teach them.
    """

    def __init__(self, fills: nn.Module):
        super().__init__()
        self.fills = fills
        self.register_buffer("spread", torch.full((COUNT,), 0.1))

    def forward(self, pose, mask, age):
        made = self.fills(pose, mask, age)
        poses = made.shape[1]
        say = mask[:, -poses:]
        filled = say.unsqueeze(-1) * pose[:, -poses:] + (1.0 - say).unsqueeze(-1) * made
        # None of them asks for the age, but the interface has it, and an exporter drops inputs that nobody uses.
        return filled, say * TRUSTED_M + (1.0 - say) * self.spread + 0.0 * age[:, -poses:]


def gap_cases(prepared, part: str, gap_s: float, system, model):
    """Cases with a gap, and what the model says of it: a live one pose by pose, one that fills its window with the gap inside."""
    poses, live = system.BEFORE + 1 + system.AFTER, system.KIND == "live"
    whole = cases(prepared, part, gap_s, poses, 15 if live else poses)
    some = slice(None, None, EVERY_CASE)
    case = replace(whole, truth=whole.truth[some], mask=whole.mask[some], there=whole.there[some], hidden=whole.hidden[some])
    return case, fill(model, case, system.BEFORE, 0) if live else fill_offline(model, case, poses)


def measure_spread(module: Shipped, system, run: Experiment) -> None:
    """Sets the deviations by gaps of a second in the recordings that said when to stop. Joints of which no gap tells get the mean."""
    square, count = np.zeros(COUNT), np.zeros(COUNT)
    for part in PARTS:
        case, filled = gap_cases(run.validating(), part, 1.0, system, torch_model(module))
        inside = slice(case.before, case.before + case.gap)
        gone = case.mask[:, inside] == 0
        off = ((filled - case.truth[:, inside]) ** 2).mean(-1) * gone
        square += off.sum((0, 1))
        count += gone.sum((0, 1))
    known = count > 0
    spread = np.full(COUNT, np.sqrt(square[known].sum() / count[known].sum()))
    spread[known] = np.sqrt(square[known] / count[known])
    module.spread.copy_(torch.from_numpy(spread.astype(np.float32)))


def gap_figures(module: Shipped, system, run: Experiment) -> dict[str, float]:
    """Mean millimetres off in gaps, as the table of `evaluate` has it: split_part_gap_mm."""
    figures = {}
    for split, prepared in run.tests().items():
        for part in PARTS:
            for gap_s in GAPS_S:
                case, filled = gap_cases(prepared, part, gap_s, system, torch_model(module))
                key = f"{split} {part} {str(gap_s).replace('.', '_')}s mm".replace(" ", "_")
                figures[key] = round(error_mm(filled, case), 1)
    return figures


def halve(path: Path) -> None:
    """Stores the file's large weights in half precision, each with a Cast back to f32, which runtimes do once as they load."""
    model = onnx.load(path)
    small, casts = [], []
    for weight in model.graph.initializer:
        array = numpy_helper.to_array(weight)
        if array.dtype != np.float32 or array.size < LARGE:
            small.append(weight)
            continue
        half = weight.name + ".half"
        small.append(numpy_helper.from_array(array.astype(np.float16), half))
        casts.append(helper.make_node("Cast", [half], [weight.name], to=onnx.TensorProto.FLOAT, name=half + ".cast"))
    nodes = [*casts, *model.graph.node]
    shorten(nodes, small, {value.name for value in (*model.graph.input, *model.graph.output)})
    del model.graph.initializer[:], model.graph.node[:], model.graph.value_info[:]
    model.graph.initializer.extend(small)
    model.graph.node.extend(nodes)
    onnx.checker.check_model(model)
    onnx.save(model, path)


def shorten(nodes, weights, kept: set[str]) -> None:
    """Gives everything but the names that are `kept` a short one: in unrolled graphs names take more room than numbers."""
    short: dict[str, str] = {"": ""}

    def of(name: str) -> str:
        return name if name in kept else short.setdefault(name, f"v{len(short):x}")

    for weight in weights:
        weight.name = of(weight.name)
    for node in nodes:
        node.name, node.doc_string = "", ""
        node.input[:] = [of(name) for name in node.input]
        node.output[:] = [of(name) for name in node.output]


@torch.no_grad()
def rounded(module: nn.Module) -> None:
    """Rounds large weights as [halve] will, so that PyTorch and the file say the same."""
    for tensor in (*module.parameters(), *module.buffers()):
        if tensor.numel() >= LARGE:
            tensor.copy_(tensor.half().float())


def ship(fills: nn.Module, system, run: Experiment, out: Path, figures: dict) -> Path:
    """Writes the model, its manifest and its golden output into `out`; `figures` are those of its own paper's measures."""
    module = Shipped(fills).eval()
    rounded(module)
    measure_spread(module, system, run)
    figures = {**figures, **gap_figures(module, system, run)}
    export.write(module, system, system.NAME, out, TRAINED_ON, figures, shrink=halve)
    path = out / f"{system.NAME}.onnx"
    print(f"{path}: {path.stat().st_size} bytes")
    return path
