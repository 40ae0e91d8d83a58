"""What the published systems' experiments share: recordings, where results go, tables, the filter."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from ..augment import Variation
from ..fitting import Schedule, fit
from ..joints import mirrored
from ..recordings import Prepared

VALIDATES_EVERY = 8
"""So many spans of the training recordings teach for one that says when to stop."""


@dataclass
class Experiment:
    """One system's run: recordings by split, and the folder of its checkpoints."""

    name: str
    work: Path
    data: Path
    train: Prepared
    held_out: Prepared
    unseen: Prepared
    minutes: float | None

    @classmethod
    def load(cls, name: str, data: Path, work: Path, minutes: float | None) -> "Experiment":
        folder = work / name
        folder.mkdir(parents=True, exist_ok=True)
        parts = [Prepared.load(data, split) for split in ("train", "held_out", "unseen")]
        return cls(name, folder, data, *parts, minutes)

    def tests(self) -> dict[str, Prepared]:
        """Recordings that test, by what the tables call them."""
        return {"held out": self.held_out, "unseen": self.unseen}

    def teaching(self) -> Prepared:
        """The recordings that teach."""
        return self._part(lambda number: number % VALIDATES_EVERY != 3)

    def validating(self) -> Prepared:
        """The recordings that say when to stop."""
        return self._part(lambda number: number % VALIDATES_EVERY == 3)

    def _part(self, chosen) -> Prepared:
        spans = [(name, poses) for number, (name, poses) in enumerate(self.train.spans()) if chosen(number)]
        return Prepared.joined(spans)

    def fit(self, what: str, model: torch.nn.Module, losses, score, schedule: Schedule) -> torch.nn.Module:
        """Trains one network of this system, or loads it where it is trained already.

        `losses()` draws a batch (by PyTorch's own generator, which a checkpoint keeps) and gives its loss; `score()` measures
        `model` on recordings that do not teach.
        """
        folder = self.work / what
        minutes = schedule.minutes if self.minutes is None else self.minutes
        # How long a finished run was allowed to take: one that was stopped goes on, and so does one that is given more.
        allowed = folder / "allowed_minutes.txt"
        if not allowed.is_file() or float(allowed.read_text()) < minutes:
            schedule = replace(schedule, minutes=minutes)
            fit(folder, model, lambda model, _: {"loss": losses(model)}, lambda model: {"score": score(model)}, schedule)
            allowed.write_text(f"{minutes}\n")
        model.load_state_dict(torch.load(folder / "best.pt", map_location="cpu", weights_only=True))
        return model.cpu().eval()

    def note(self, what: str, figures: dict) -> None:
        """Keeps figures in `figures.json`, for the manifest."""
        path = self.work / "figures.json"
        known = json.loads(path.read_text()) if path.is_file() else {}
        known[what] = figures
        path.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n")

    def noted(self, what: str) -> dict:
        """Figures that [Experiment.note] kept."""
        return json.loads((self.work / "figures.json").read_text())[what]

    def keep(self, name: str, text: str) -> None:
        (self.work / name).write_text(text + "\n")


def body_proportions(prepared: Prepared, bones) -> tuple[torch.Tensor, torch.Tensor]:
    """Of `bones` (child, parent): their usual lengths for a size of one `[B]`, and the usual size, metres.

    Each recording counts once, so that long ones do not decide what people look like.
    """
    child, parent = [c for c, _ in bones], [p for _, p in bones]
    lengths = [np.linalg.norm(poses[:, child] - poses[:, parent], axis=-1).mean(0) for _, poses in prepared.spans()]
    lengths = np.array(lengths)
    sizes = lengths.mean(1, keepdims=True)
    ratio = (lengths / sizes).mean(0)
    return torch.from_numpy(ratio.astype(np.float32)), torch.tensor(float(sizes.mean()))


def early_stopping(steps_an_epoch: int, patience: int = 20, epochs: int = 400, rate: float = 1e-3, averaging: float = 0.995) -> Schedule:
    """Adam until `patience` epochs brought nothing."""
    return Schedule(
        steps=epochs * steps_an_epoch, rate=rate, weight_decay=0.0, warm_up=steps_an_epoch, check_every=steps_an_epoch,
        patience=patience, cosine=False, adam_w=False, averaging=averaging,
    )


def in_mirror(prepared: Prepared) -> Prepared:
    """The recordings as a mirror shows them."""
    return Prepared(mirrored(prepared.poses), prepared.starts, prepared.names)


AS_RECORDED = Variation(speed=(1.0, 1.0), size=(1.0, 1.0), backwards=0.0, mixed_arms=0.0)
"""Stretches as they were recorded, but for the mirror and the heading."""


def numpy_rng() -> np.random.Generator:
    """A NumPy generator that goes on with what PyTorch's draws."""
    return np.random.default_rng(int(torch.randint(2**31, (1,))))


def windows(prepared: Prepared, frames: int, stride: int) -> torch.Tensor:
    """`[N, frames, 25, 3]`: every window of every span, one each `stride` poses."""
    cut = [
        poses[start : start + frames]
        for _, poses in prepared.spans()
        for start in range(0, len(poses) - frames + 1, stride)
    ]
    return torch.from_numpy(np.stack(cut))


def table(header: list[str], rows: list[list]) -> str:
    """A table as Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def savitzky_golay(x: np.ndarray, window: int, order: int) -> np.ndarray:
    """`x` `[T, F]` smoothed over time by polynomials of `order` over `window` poses; at the ends the last full window's
    polynomial is read where it is needed (as Savitzky and Golay's users do it)."""
    if len(x) < window:
        return x
    half = window // 2
    powers = np.vander(np.arange(-half, half + 1) / half, order + 1)
    hat = powers @ np.linalg.pinv(powers)
    middle = np.stack([np.convolve(column, hat[half][::-1], mode="valid") for column in x.T], 1)
    return np.concatenate([hat[:half] @ x[:window], middle, hat[half + 1 :] @ x[-window:]])
