"""`published`: systems from papers, each built as described and measured by its own paper's measures.

`python -m posefuse_training published NAME --data PREPARED --work FOLDER` trains one (or goes on where it was stopped), prints our
figures beside the published ones, and with `--export models/data` writes the model that the program ships.
"""

import argparse
import importlib
from pathlib import Path

SYSTEMS = {
    "pose-resnet": "pose_resnet",
    "clip-autoencoder": "clip_autoencoder",
    "dual-autoencoder": "dual_autoencoder",
    "sparse-dictionary": "sparse_dictionary",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("system", choices=sorted(SYSTEMS))
    parser.add_argument("--data", type=Path, required=True, help="folder of prepared splits")
    parser.add_argument("--work", type=Path, required=True, help="folder for checkpoints and tables")
    parser.add_argument("--export", type=Path, help="folder for the ONNX model, its manifest and its golden output")
    parser.add_argument("--minutes", type=float, help="at most so many minutes for each network")
    parser.add_argument("--threads", type=int, default=1)


def run(options: argparse.Namespace) -> int:
    import torch

    from .experiment import Experiment

    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    system = importlib.import_module(f".{SYSTEMS[options.system]}", __package__)
    experiment = Experiment.load(options.system, options.data, options.work, options.minutes)
    report = system.experiment(experiment)
    print(report)
    experiment.keep("table.md", report)
    if options.export:
        system.ship(experiment, options.export)
    return 0
