"""The training loop of the published systems: epochs, early stopping, and going on where it was stopped."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import torch
from torch import nn


@dataclass
class Schedule:
    """How long to train: at most `epochs`, or until `patience` of them brought nothing, or `minutes` are over."""

    epochs: int
    patience: int
    minutes: float
    """Of processor time."""
    rate: float = 1e-3
    halve_after: int = 6
    """The rate is halved each time so many epochs brought nothing."""


def fit(
    model: nn.Module,
    epoch_loss: Callable[[torch.Generator], object],
    validate: Callable[[], float],
    schedule: Schedule,
    checkpoint: Path,
) -> dict:
    """Trains `model` with Adam and leaves in it what validated best.

    `epoch_loss` gives the losses of one epoch's batches, one after another, each to be gone down by; `validate` measures, lower
    is better. What has been reached is in `checkpoint` after every epoch. Returns how it went.
    """
    optimiser = torch.optim.Adam(model.parameters(), lr=schedule.rate)
    generator = torch.Generator().manual_seed(1)
    state = {"epoch": 0, "best": float("inf"), "best_epoch": 0, "seconds": 0.0, "curve": []}
    kept = {name: value.clone() for name, value in model.state_dict().items()}
    if checkpoint.is_file():
        saved = torch.load(checkpoint, weights_only=False)
        model.load_state_dict(saved["model"])
        optimiser.load_state_dict(saved["optimiser"])
        generator.set_state(saved["generator"])
        state, kept = saved["state"], saved["kept"]
    while not _over(state, schedule):
        start = time.process_time()
        model.train()
        total, count = 0.0, 0
        for loss in epoch_loss(generator):
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimiser.step()
            total, count = total + loss.item(), count + 1
        model.eval()
        with torch.no_grad():
            value = validate()
        state["epoch"] += 1
        state["seconds"] += time.process_time() - start
        state["curve"].append((total / max(count, 1), value))
        if value < state["best"]:
            state["best"], state["best_epoch"] = value, state["epoch"]
            kept = {name: value.clone() for name, value in model.state_dict().items()}
        elif (state["epoch"] - state["best_epoch"]) % schedule.halve_after == 0:
            for group in optimiser.param_groups:
                group["lr"] *= 0.5
        _say(checkpoint.stem, state)
        _save(checkpoint, model, optimiser, generator, state, kept)
    model.load_state_dict(kept)
    model.eval()
    return state


def _over(state: dict, schedule: Schedule) -> bool:
    stale = state["epoch"] - state["best_epoch"] >= schedule.patience
    return state["epoch"] >= schedule.epochs or stale or state["seconds"] >= 60.0 * schedule.minutes


def _say(name: str, state: dict) -> None:
    loss, value = state["curve"][-1]
    print(
        f"{name}: epoch {state['epoch']} ({state['seconds']:.0f} s) loss {loss:.5f}, validation {value:.5f}, best {state['best']:.5f}",
        flush=True,
    )


def _save(checkpoint: Path, model, optimiser, generator, state: dict, kept: dict) -> None:
    """Whole or not at all: written beside, then moved."""
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    beside = checkpoint.with_suffix(".part")
    everything = {
        "model": model.state_dict(),
        "optimiser": optimiser.state_dict(),
        "generator": generator.get_state(),
        "state": state,
        "kept": kept,
    }
    torch.save(everything, beside)
    beside.replace(checkpoint)
