"""The training loop all models share: checkpoints, going on after a stop, averaged weights, progress, curves.

A folder of a run holds `last.pt` (everything needed to go on), `best.pt` (the averaged weights with the best score so far),
`curves.csv` and `curves.png`.
"""

import copy
import csv
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import torch


@dataclass
class Schedule:
    """How long and how fast; a run goes on until its steps or its minutes are used up, whichever is first."""

    steps: int = 20_000
    minutes: float = math.inf
    rate: float = 1e-3
    weight_decay: float = 1e-2
    warm_up: int = 200
    averaging: float = 0.999
    """Of the averaged weights, how much each step keeps."""
    clip: float = 1.0
    check_every: int = 500
    patience: int | None = None
    """Checks without a better score after which it stops."""
    cosine: bool = True
    adam_w: bool = True
    choose: str = "best"
    """Which averaged weights are kept: the "best" by score, or the "last" (no recording then chooses)."""


def device() -> torch.device:
    """A GPU where there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def fit(
    folder: Path,
    model: torch.nn.Module,
    loss: Callable[[torch.nn.Module, int], dict[str, torch.Tensor]],
    check: Callable[[torch.nn.Module], dict[str, float]],
    schedule: Schedule,
    fresh: bool = False,
) -> torch.nn.Module:
    """Trains `model` and returns the averaged weights with the best score.

    `loss(model, step)` gives named parts; "loss" is what is made smaller. `check(model)` measures without gradient; "score" is
    what the best is chosen by, less is better.
    """
    folder.mkdir(parents=True, exist_ok=True)
    model.to(device())
    parameters = [p for p in model.parameters() if p.requires_grad]
    kind = torch.optim.AdamW if schedule.adam_w else torch.optim.Adam
    optimiser = kind(parameters, lr=schedule.rate, weight_decay=schedule.weight_decay)
    averaged = copy.deepcopy(model)
    state = {"step": 0, "seconds": 0.0, "best": math.inf, "stale": 0, "curves": []}
    if (folder / "last.pt").is_file() and not fresh:
        state = _resume(folder / "last.pt", model, averaged, optimiser)
        print(f"goes on after step {state['step']}, best score {state['best']:.4g}", flush=True)
    begun, before = time.monotonic(), state["seconds"]
    sums: dict[str, float] = {}
    while (share := _share(state, schedule)) < 1:
        for group in optimiser.param_groups:
            group["lr"] = schedule.rate * _pace(state["step"], share, schedule)
        model.train()
        parts = loss(model, state["step"])
        optimiser.zero_grad(set_to_none=True)
        parts["loss"].backward()
        torch.nn.utils.clip_grad_norm_(parameters, schedule.clip)
        optimiser.step()
        state["step"] += 1
        _average(averaged, model, min(schedule.averaging, (1 + state["step"]) / (10 + state["step"])))
        for name, value in parts.items():
            sums[name] = sums.get(name, 0.0) + value.item()
        state["seconds"] = before + time.monotonic() - begun
        if state["step"] % schedule.check_every == 0 or _share(state, schedule) >= 1:
            count = state["step"] % schedule.check_every or schedule.check_every
            _checked(folder, averaged, check, state, {name: value / count for name, value in sums.items()}, schedule.choose)
            sums = {}
            _save(folder / "last.pt", model, averaged, optimiser, state, schedule)
            if schedule.patience is not None and state["stale"] >= schedule.patience:
                print(f"no better score in {state['stale']} checks: stops", flush=True)
                break
    model.load_state_dict(torch.load(folder / "best.pt", map_location=device(), weights_only=True))
    return model.eval()


def _share(state: dict, schedule: Schedule) -> float:
    """How much of the run is done, 0..1."""
    return max(state["step"] / schedule.steps, state["seconds"] / 60 / schedule.minutes)


def _pace(step: int, share: float, schedule: Schedule) -> float:
    warm = min(1.0, (step + 1) / max(schedule.warm_up, 1))
    return warm * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * min(share, 1))) if schedule.cosine else 1.0)


@torch.no_grad()
def _average(averaged: torch.nn.Module, model: torch.nn.Module, keep: float) -> None:
    for old, new in zip(averaged.parameters(), model.parameters()):
        old.lerp_(new, 1 - keep)
    for old, new in zip(averaged.buffers(), model.buffers()):
        old.copy_(new)


def _checked(folder: Path, averaged: torch.nn.Module, check, state: dict, trained: dict[str, float], choose: str) -> None:
    averaged.eval()
    with torch.no_grad():
        measured = check(averaged)
    better = measured["score"] < state["best"] or choose == "last"
    state["stale"] = 0 if better else state["stale"] + 1
    if better:
        state["best"] = measured["score"]
        torch.save(averaged.state_dict(), folder / "best.pt")
    row = {"step": state["step"], "minutes": state["seconds"] / 60, **trained, **measured}
    state["curves"].append(row)
    print("  ".join(f"{name} {value:.4g}" for name, value in row.items()), "*" if better else "", flush=True)
    with open(folder / "curves.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(row))
        writer.writeheader()
        writer.writerows(state["curves"])
    draw(folder / "curves.png", state["curves"])


def draw(path: Path, curves: list[dict[str, float]]) -> None:
    """Every number of the curves against the step, one small picture each."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    names = [name for name in curves[-1] if name not in ("step", "minutes")]
    columns = min(4, len(names))
    rows = -(-len(names) // columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(3.4 * columns, 2.4 * rows), squeeze=False)
    for axis in axes.flat[len(names) :]:
        axis.set_visible(False)
    for axis, name in zip(axes.flat, names):
        axis.plot([row["step"] for row in curves], [row[name] for row in curves])
        axis.set_title(name, fontsize=9)
        axis.set_xlabel("step", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def _save(path: Path, model, averaged, optimiser, state: dict, schedule: Schedule) -> None:
    # Written aside and renamed, so that a stop in between leaves the older one whole.
    aside = path.with_suffix(".new")
    torch.save(
        {
            "model": model.state_dict(),
            "averaged": averaged.state_dict(),
            "optimiser": optimiser.state_dict(),
            "state": state,
            "schedule": asdict(schedule),
            "torch": torch.get_rng_state(),
        },
        aside,
    )
    aside.replace(path)


def _resume(path: Path, model, averaged, optimiser) -> dict:
    saved = torch.load(path, map_location=device(), weights_only=True)
    model.load_state_dict(saved["model"])
    averaged.load_state_dict(saved["averaged"])
    optimiser.load_state_dict(saved["optimiser"])
    torch.set_rng_state(saved["torch"].cpu())
    return saved["state"]
