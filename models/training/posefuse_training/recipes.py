"""Which models there are to train. A recipe is a module with what the commands need; see `Recipe`."""

import importlib
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any, Protocol

RECIPES = {
    "ours-live": "ours.live",
    "ours-offline": "ours.offline",
}


class Recipe(Protocol):
    """What a module named in `RECIPES` offers."""

    KIND: str
    """`live` or `offline`."""
    BEFORE: int
    AFTER: int
    """Poses before and after the one that is filled; a model may also fill all of its window."""
    ABOUT: dict[str, Any]
    """`summary` and `source` of the manifest."""

    def arguments(self, parser: ArgumentParser) -> None:
        """What `train` takes besides `--data`, `--run`, `--seed`, `--minutes`, `--fresh`."""

    def train(self, options: Namespace) -> None:
        """Trains into the folder `options.run`; goes on where it was stopped."""

    def load(self, runs: list[Path]) -> Any:
        """The trained `torch.nn.Module` in eval mode with the common interface: (pose, mask, age) to (filled, sigma).

        Of several runs, where the model can: all of them together.
        """


def recipe(name: str) -> Recipe:
    """The recipe of that name."""
    if name not in RECIPES:
        raise SystemExit(f"there is no model `{name}`; there are: {', '.join(sorted(RECIPES))}")
    return importlib.import_module(f".{RECIPES[name]}", __package__)
