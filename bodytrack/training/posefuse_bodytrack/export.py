"""Writes a run's network as ONNX with a manifest and golden outputs, and compares it with what it came from."""

import hashlib
import os

import numpy as np
import torch

from . import joints, metrics
from .data import Files, Truth, channels
from .evaluate import onnx
from .network import Exported
from .train import load

OPSET = 17
GOLDEN = 3
OUTPUTS = {"joints": [25, 3], "sigma": [25], "visible": [25], "heading": [2], "hands": [2]}
UNITS = {"joints": "m", "sigma": "m", "visible": "1", "heading": "1", "hands": "1"}


def arguments(parser):
    parser.add_argument("--run", required=True)
    parser.add_argument("--data", required=True, help="for golden outputs and the manifest's figures")
    parser.add_argument("--out", required=True, help="folder")
    parser.add_argument("--name", default="depth-joints")
    parser.add_argument("--limit", type=int, help="figures from only so many crops")
    parser.add_argument("--mirror", action="store_true", help="the mean with what is said of the mirror image; twice the cost")


def export(options):
    network = Exported(load(options.run), options.mirror).eval()
    crops, truths = Files(options.data, "unseen").all(options.limit)
    crops, truth = channels(crops), Truth(truths)
    path = os.path.join(options.out, options.name + ".onnx")
    os.makedirs(options.out, exist_ok=True)
    torch.onnx.export(
        network,
        torch.from_numpy(crops[:2]),
        path,
        input_names=["crop"],
        output_names=list(OUTPUTS),
        dynamic_axes={name: {0: "N"} for name in ["crop", *OUTPUTS]},
        opset_version=OPSET,
        dynamo=False,
    )
    ours = metrics.run(network, crops[:64])
    theirs = onnx(path, crops[:64])
    for name, a, b in zip(OUTPUTS, ours, theirs):
        difference = np.abs(a - b).max()
        print(f"{name}: differs from PyTorch by {difference:.1e}")
        if not difference < 1e-3:
            raise SystemExit(f"the exported network says something else than the trained one ({name})")
    golden = os.path.join(options.out, options.name + ".golden.bin")
    with open(golden, "wb") as file:
        for part in [crops[:GOLDEN], *(o[:GOLDEN] for o in theirs)]:
            file.write(np.ascontiguousarray(part, "<f4").tobytes())
    figures = figures_of(onnx(path, crops), truth)
    parameters = sum(p.numel() for p in network.parameters())
    manifest = os.path.join(options.out, options.name + ".toml")
    with open(manifest, "w") as file:
        file.write(manifest_of(options.name, path, parameters, figures))
    print(f"{path}: {os.path.getsize(path) / 1e6:.2f} MB, {parameters} parameters")


def figures_of(outputs, truth):
    tables = metrics.tables(outputs, truth)
    figures = {}
    for name in ["all", "front", "side", "back"]:
        for key in ["mpjpe_visible_mm", "mpjpe_hidden_mm", "within_10cm_visible", "sides_right"]:
            if key in tables[name]:
                figures[f"unseen_{name}_{key}"] = round(float(tables[name][key]), 1)
    for key, value in metrics.others(outputs, truth).items():
        if key != "curve" and np.isfinite(value):
            figures[f"unseen_{key}"] = round(float(value), 1)
    return figures


def _hash(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def manifest_of(name, path, parameters, figures):
    crop = f'["N", {joints.CHANNELS}, {joints.SIZE}, {joints.SIZE}]'
    outputs = "\n".join(
        f'{key} = {{ shape = ["N", {", ".join(map(str, shape))}], unit = "{UNITS[key]}" }}' for key, shape in OUTPUTS.items()
    )
    lines = "\n".join(f"{key} = {value}" for key, value in figures.items())
    return f'''version = 1
name = "{name}"
opset = {OPSET}
sha256 = "{_hash(path)}"
quick_ms = 8.0

[inputs]
crop = {{ shape = {crop}, unit = "1" }}

[outputs]
{outputs}

[about]
summary = "Joints of a person in a depth crop: convolutions whose cells vote (after A2J, Xiong et al. 2019)."
source = "ours"
licence = "MIT OR Apache-2.0"
training_data = "People rendered by the simulator: CMU motion capture (models/training/split.toml) on bodies of many sizes, and the simulator's own motion"
parameters = {parameters}

[figures]
{lines}
'''
