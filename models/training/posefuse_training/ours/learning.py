"""How both of our models learn: what they are shown, their loss, and how they are measured meanwhile."""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ..augment import Source, Variation
from ..cases import GAPS_S, cases
from ..corrupt import Room, Window, gaps, measured, newcomers, window
from ..evaluate import conditional_of, simple_methods, table
from ..fitting import Schedule, device, fit
from ..joints import BONES, PARENTS, PARTS
from ..pairs import Pairs
from ..recordings import Prepared, kind_of
from .prior import own_spans
from .weighing import TRUSTED, Told, Weighing

LONGEST = 90
"""Poses before the window in which a gap may have begun."""


class Shape(NamedTuple):
    """Poses of a model's window before and after the one it fills."""

    before: int
    after: int

    @property
    def poses(self) -> int:
        return self.before + 1 + self.after


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--width", type=int, default=256)
    parser.add_argument("--blocks", type=int, default=2)
    parser.add_argument("--dropout", type=float, default=0.4)
    parser.add_argument("--dropped-features", type=float, default=0.3)
    parser.add_argument("--steps", type=int, default=30_000)
    parser.add_argument("--batch", type=int, default=256)
    parser.add_argument("--ends", type=int, default=4, help="windows cut from each drawn stretch")
    parser.add_argument("--pool", type=int, default=300, help="batches kept to draw from")
    parser.add_argument("--reuse", type=int, default=6, help="steps for each newly drawn batch")
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--weight-decay", type=float, default=0.1)
    parser.add_argument("--evenness", type=float, default=0.8, help="1: kinds of motion are drawn as often as there is of them; 0: all alike")
    parser.add_argument("--made", type=float, default=0.1, help="share of the simulator's own motion")
    parser.add_argument("--mixed-arms", type=float, default=0.1)
    parser.add_argument("--pairs", type=Path, help="folder written by the example `pairs`: windows of simulated rooms")
    parser.add_argument("--paired", type=float, default=0.3, help="share of such windows")
    parser.add_argument("--check-every", type=int, default=500)
    parser.add_argument("--begin-with", type=Path, help="a run of the same shape whose weights to go on from")
    parser.add_argument("--leave-out", nargs="*", default=[], help="kinds of motion that validate instead of training")


def recipe(kind: type[Weighing]):
    """(arguments, train, load) of a recipe for such models."""

    def train_one(options: argparse.Namespace) -> None:
        model = kind(options.width, options.blocks, options.dropout, options.dropped_features)
        train(options, model, Shape(kind.BEFORE, kind.AFTER))

    return arguments, train_one, lambda runs: load(runs, kind)


def train(options: argparse.Namespace, model: Weighing, shape: Shape) -> None:
    """Trains `model`; with --leave-out the score is measured on those kinds, else on the held-out recordings."""
    prepared, validation = divided(Prepared.load(options.data, "train"), options.leave_out)
    source = Source([(prepared, 1 - options.made), (Prepared.load(options.data, "made"), options.made)], options.evenness)
    variation = Variation(mixed_arms=options.mixed_arms)
    model.prior.fit(own_spans(prepared))
    rng = np.random.default_rng(options.seed)
    model.to(device())

    def draw() -> Lesson:
        return lesson(model, windows(rng, source, options.batch, options.ends, Room(), variation, shape))

    tests = {"left out": validation} if options.leave_out else {"held out": Prepared.load(options.data, "held_out")}
    methods = simple_methods(conditional_of(prepared), offline=shape.after > 0)
    splits = {name: Checks(model, shape, prepared, methods) for name, prepared in tests.items()}
    pool = Pool(draw, options.pool, options.reuse, rng)
    paired, tested = None, None
    if options.pairs:
        taught, test = Pairs.load(options.pairs, shape.before).divided()
        paired, tested = Fixed(model, taught, rng), Fixed(model, test, rng)
    if options.begin_with:
        model.load_state_dict(torch.load(options.begin_with / "best.pt", map_location=device(), weights_only=True))
    else:
        model.begin(pool.features())

    def loss(model: Weighing, _step: int) -> dict[str, Tensor]:
        given = pool.next()
        if paired is None:
            return losses(model, given)
        count = round(options.paired * options.batch)
        return losses(model, together(cut(given, options.batch - count), paired.some(count)))

    def check(model: Weighing) -> dict[str, float]:
        result = checked(model, splits)
        if tested is not None:
            result["rooms"] = tested.error_mm(model) / tested.plain_mm
            result["score"] += result["rooms"]
        return result

    schedule = Schedule(
        steps=options.steps, minutes=options.minutes, rate=options.rate, weight_decay=options.weight_decay,
        check_every=options.check_every, choose="last",
    )
    fit(options.run, model, loss, check, schedule, options.fresh)


def divided(prepared: Prepared, kinds: list[str]) -> tuple[Prepared, Prepared]:
    """(recordings of other kinds, recordings of these kinds)."""
    parts = [[], []]
    for name, span in prepared.spans():
        parts[kind_of(name) in kinds].append((name, span))
    return Prepared.joined(parts[0]), Prepared.joined(parts[1])


def windows(rng: np.random.Generator, source: Source, batch: int, ends: int, room: Room, variation: Variation, shape: Shape) -> Window:
    """`batch` windows with the truth of the pose that is filled; `ends` of them are cut from each stretch, where something is hidden."""
    stretches, frames = batch // ends, shape.poses + LONGEST
    truth = source.draw(rng, stretches, frames, variation)
    middle = frames - shape.after - rng.integers(1, 30)
    mask = gaps(rng, stretches, frames, room, ends=middle)
    seen, mask = measured(rng, truth, mask, room)
    whole = window(seen, mask, truth)
    # What is measured below trust, or not at all, is where something can be learned.
    open_end = (mask < 1).any(axis=2)
    open_end[:, : shape.before] = False
    open_end[:, frames - shape.after :] = False
    open_end[:, middle] = True
    scores = rng.random((ends, stretches, frames)) * open_end[None]
    filled = scores.argmax(axis=2).T.reshape(-1)
    rows = np.repeat(np.arange(stretches), ends)
    index = filled[:, None] + np.arange(-shape.before, shape.after + 1)
    parts = (whole.pose[rows[:, None], index], whole.mask[rows[:, None], index], whole.age[rows[:, None], index], whole.truth[rows, filled][:, None])
    cut = Window(*parts)
    newcomers(rng, cut, room, shape.before)
    return cut


class Lesson(NamedTuple):
    """What the network is given of some windows, and the truth of their newest poses."""

    told: Told
    truth: Tensor
    """(n, 25, 3) own coordinates."""
    size: Tensor
    """(n, 1) of the person."""


@torch.no_grad()
def lesson(model: Weighing, made: Window) -> Lesson:
    """Of windows whose `truth` is that of the filled pose."""
    arrays = (made.pose, made.mask, made.age, made.truth)
    pose, mask, age, truth = (torch.from_numpy(np.ascontiguousarray(array)).to(device()) for array in arrays)
    told, frame = model.told(pose, mask, age)
    return Lesson(told, frame.own(truth)[:, 0], frame.size[:, 0, 0])


def together(one: Lesson, other: Lesson) -> Lesson:
    return _lesson([torch.cat(parts) for parts in zip(_parts(one), _parts(other))])


def cut(given: Lesson, count: int) -> Lesson:
    """The first `count` of them."""
    return _lesson([part[:count] for part in _parts(given)])


class Fixed:
    """Lessons from simulated rooms, which are always the same."""

    def __init__(self, model: Weighing, pairs: Pairs, rng: np.random.Generator, at_once: int = 256):
        batches = [lesson(model, pairs.window(slice(begin, begin + at_once))) for begin in range(0, len(pairs), at_once)]
        self.parts = [torch.cat(parts) for parts in zip(*(_parts(batch) for batch in batches))]
        self.rng = rng
        self.asked = torch.from_numpy(pairs.asked()).to(device())
        self.plain_mm = pairs.plain_mm()

    def some(self, count: int) -> Lesson:
        rows = torch.from_numpy(self.rng.integers(0, len(self.parts[0]), count)).to(self.parts[0].device)
        return _lesson([part[rows] for part in self.parts])

    def error_mm(self, model: Weighing) -> float:
        """Of the joints that the engine asks for and has."""
        given = _lesson(self.parts)
        distance = torch.sqrt(((model.answer(given.told)[0] - given.truth) ** 2).sum(-1)) * given.size
        return 1000 * float(distance[self.asked].mean())


class Pool:
    """Lessons that are each used a few times: making one costs more than learning from it."""

    def __init__(self, draw, batches: int, reuse: int, rng: np.random.Generator, first: int = 24):
        """Begins with `first` batches and grows to `batches`; then the oldest go."""
        self.draw, self.reuse, self.rng, self.used = draw, reuse, rng, 0
        drawn = draw()
        self.batch, self.batches, self.drawn = len(drawn.truth), batches, 0
        self.parts = [torch.empty(batches * self.batch, *part.shape[1:], device=part.device) for part in _parts(drawn)]
        self._keep(drawn)
        for _ in range(min(first, batches) - 1):
            self._keep(draw())

    def _keep(self, drawn: Lesson) -> None:
        begin = self.drawn % self.batches * self.batch
        for old, new in zip(self.parts, _parts(drawn)):
            old[begin : begin + self.batch] = new
        self.drawn += 1

    def features(self) -> Tensor:
        return self.parts[0][: min(self.drawn, self.batches) * self.batch]

    def next(self) -> Lesson:
        """A batch drawn at random; every `reuse` of them a batch is added."""
        self.used += 1
        if self.used % self.reuse == 0:
            self._keep(self.draw())
        count = min(self.drawn, self.batches) * self.batch
        rows = torch.from_numpy(self.rng.integers(0, count, self.batch)).to(self.parts[0].device)
        parts = [part[rows] for part in self.parts]
        return _lesson(parts)


def _parts(one: Lesson) -> list[Tensor]:
    return [*one.told, *one[1:]]


def _lesson(parts: list[Tensor]) -> Lesson:
    return Lesson(Told(*parts[:-2]), *parts[-2:])


def losses(model: Weighing, given: Lesson) -> dict[str, Tensor]:
    """Distance relative to what is usual after that time, bone lengths, and the likelihood under the stated deviation."""
    newest, sigma = model.answer(given.told)
    seconds, sure = given.told.seconds, given.told.sure
    gone, weak = (sure == 0).float(), ((sure > 0) & (sure < TRUSTED)).float()
    error = newest - given.truth
    distance = torch.sqrt((error * error).sum(-1) + 1e-6)
    weight = (gone + weak) / (0.03 + 0.12 * (1 - torch.exp(-seconds / 0.5)))
    place = 0.1 * (distance * weight).sum() / weight.gt(0).sum()
    bones = bone_lengths(newest) - bone_lengths(given.truth)
    open_ = gone + weak
    touched = torch.maximum(open_[:, BONES], open_[:, PARENTS[BONES]])
    bone = (bones.abs() * touched).sum() / touched.sum().clamp(min=1)
    spread = (error.detach() ** 2).sum(-1) / (2 * sigma**2) + 3 * torch.log(sigma)
    certain = (spread * (gone + weak)).sum() / (gone + weak).sum().clamp(min=1)
    with torch.no_grad():
        shown = 1000 * (distance * given.size * gone).sum() / gone.sum()
    return {"loss": place + 0.5 * bone + 0.003 * certain, "trained mm": shown, "bones mm": 1000 * bone.detach(), "likelihood": certain.detach()}


def bone_lengths(poses: Tensor) -> Tensor:
    span = poses[:, BONES] - poses[:, PARENTS[BONES]]
    return torch.sqrt((span * span).sum(-1) + 1e-8)


class Checks:
    """The table's cases, prepared once: a trained model is measured in a second."""

    def __init__(self, model: Weighing, shape: Shape, prepared: Prepared, methods: dict, poses_per_gap: int = 5):
        self.simple, self.lessons = {}, {}
        simple_table = table(prepared, methods, shape.before + 1, max(shape.after, 15))
        for part in PARTS:
            rows = [simple_table[part, method] for method in methods]
            self.simple[part] = np.min(rows, axis=0)
            for gap_s in GAPS_S:
                case = cases(prepared, part, gap_s, shape.before + 1, max(shape.after, 15))
                made = case.window()
                lessons = []
                for step in np.unique(np.linspace(0, case.gap - 1, poses_per_gap).round().astype(int)):
                    filled = case.before + step
                    inside = slice(filled - shape.before, filled + shape.after + 1)
                    given = Window(made.pose[:, inside], made.mask[:, inside], made.age[:, inside], made.truth[:, filled : filled + 1])
                    lessons.append(lesson(model, given))
                self.lessons[part, gap_s] = lessons
            # The Gaussian over time, which is one of the continuations, is a simple method as well.
            own = [_mean_error(lambda told: told.ways[:, :, model.LEANS_ON], self.lessons[part, gap_s]) for gap_s in GAPS_S]
            self.simple[part] = np.minimum(self.simple[part], own)

    def errors_mm(self, model: Weighing) -> dict[str, np.ndarray]:
        """For each part one number for each gap, by the trapezium over the poses looked at."""
        return {part: np.array([_mean_error(lambda told: model.answer(told)[0], self.lessons[part, gap_s]) for gap_s in GAPS_S]) for part in PARTS}

    def ratios(self, model: Weighing) -> np.ndarray:
        """(parts, gaps): the model's error over the best simple method's."""
        errors = self.errors_mm(model)
        return np.array([errors[part] / self.simple[part] for part in PARTS])


def _mean_error(answer, lessons: list[Lesson]) -> float:
    means = []
    for one in lessons:
        newest = answer(one.told)
        gone = (one.told.sure == 0).float()
        distance = torch.sqrt(((newest - one.truth) ** 2).sum(-1)) * one.size
        means.append(1000 * float((distance * gone).sum() / gone.sum()))
    weights = np.ones(len(means))
    weights[[0, -1]] = 0.5
    return float(np.average(means, weights=weights))


def checked(model: Weighing, splits: dict[str, Checks]) -> dict[str, float]:
    """For each split the mean ratio to the best simple method, gaps of half a second and longer apart from the shortest."""
    result = {}
    for split, checks in splits.items():
        ratio = checks.ratios(model)
        result |= {f"{split} .2 s": float(ratio[:, 0].mean()), f"{split} long": float(ratio[:, 1:].mean())}
    result["score"] = float(np.mean(list(result.values())))
    return result


def load(runs: list[Path], kind: type[Weighing]) -> Weighing:
    """The trained models of these runs as one: their networks answer together, with the first one's Gaussians."""
    models = [_one(run, kind) for run in runs]
    whole = models[0]
    whole.seat([model.network for model in models])
    return whole.eval()


def _one(run: Path, kind: type[Weighing]) -> Weighing:
    weights = torch.load(run / "best.pt", map_location="cpu", weights_only=True)
    width = weights["network.first.weight"].shape[0]
    blocks = len({key.split(".")[2] for key in weights if key.startswith("network.blocks.")})
    model = kind(width, blocks, latents=weights["prior.basis"].shape[1])
    model.load_state_dict(weights)
    return model.eval()
