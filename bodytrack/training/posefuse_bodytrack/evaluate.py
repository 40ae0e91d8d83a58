"""Figures of a network (a run's, or an ONNX file's) on one subset of the rendered people."""

import numpy as np

from . import metrics
from .data import Files, Truth, channels


def arguments(parser):
    parser.add_argument("--data", required=True)
    parser.add_argument("--subset", default="unseen", help="train, held_out or unseen")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--run", help="folder of a training")
    which.add_argument("--model", help="an ONNX file")
    parser.add_argument("--limit", type=int, help="only so many crops")
    parser.add_argument("--mirror", action="store_true", help="the mean with what is said of the mirror image")


def onnx(path, crops, batch=64):
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    parts = [session.run(None, {"crop": crops[i : i + batch]}) for i in range(0, len(crops), batch)]
    return [np.concatenate(column) for column in zip(*parts)]


def outputs_of(options, crops):
    if options.model:
        return onnx(options.model, crops)
    from .network import Exported
    from .train import load

    return metrics.run(Exported(load(options.run), options.mirror), crops)


def evaluate(options):
    crops, truths = Files(options.data, options.subset).all(options.limit)
    truth = Truth(truths)
    show(outputs_of(options, channels(crops)), truth)


def show(outputs, truth):
    tables = metrics.tables(outputs, truth)
    names = list(tables["all"])
    print("\t".join(["", *names]))
    for name, line in tables.items():
        print("\t".join([name, *(f"{line[n]:.1f}" if n in line else "-" for n in names)]))
    others = metrics.others(outputs, truth)
    curve = others.pop("curve")
    for name, value in others.items():
        print(f"{name}\t{value:.1f}")
    print("confidence said / true / joints: " + "  ".join(f"{a:.2f}/{b:.2f}/{n}" for a, b, n in curve))
