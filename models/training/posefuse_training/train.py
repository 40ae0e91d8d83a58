"""`train`: one model, from prepared arrays; goes on where it was stopped."""

import argparse
import sys
from pathlib import Path

from .recipes import RECIPES, recipe


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", choices=sorted(RECIPES))
    parser.add_argument("--data", type=Path, required=True, help="folder written by `prepare`")
    parser.add_argument("--run", type=Path, required=True, help="folder for checkpoints and curves")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fresh", action="store_true", help="begin anew though the run has checkpoints")
    parser.add_argument("--threads", type=int, default=0, help="threads on the processor; 0: PyTorch's choice")
    name = next((word for word in sys.argv[2:] if word in RECIPES), None)
    if name:
        recipe(name).arguments(parser)


def run(options: argparse.Namespace) -> int:
    import torch

    if options.threads:
        torch.set_num_threads(options.threads)
    torch.manual_seed(options.seed)
    recipe(options.model).train(options)
    return 0
