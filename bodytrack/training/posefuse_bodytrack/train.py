"""The training loop: checkpoints that a run goes on from, averaged weights, curves."""

import copy
import csv
import math
import os
import time

import numpy as np
import torch

from . import joints, metrics
from .data import Files, Stream, Truth, channels
from .network import Exported, Network

FIELDS = ["seconds", "samples", "loss", "rate"]


def arguments(parser):
    parser.add_argument("--data", required=True, help="folder with train-*.crops and unseen-*.crops")
    parser.add_argument("--run", required=True, help="folder for checkpoints and curves; a run goes on where it ended")
    parser.add_argument("--start", help="another run, whose weights a new run begins with")
    parser.add_argument("--minutes", type=float, default=240, help="of training in all; the learning rate falls over them")
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--rate", type=float, default=2e-3, help="learning rate at its highest")
    parser.add_argument("--width", type=int, default=24)
    parser.add_argument("--blocks", type=int, nargs=3, default=[0, 1, 2], help="residual blocks at 32, 16 and 8 cells")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--every", type=float, default=4, help="minutes between measurements")
    parser.add_argument("--seed", type=int, default=1)


def loss_of(outputs, truth):
    """Likelihood of the places under Laplace's law in space, with the distance itself; likelihoods of the rest.

    Laplace's scale is half the standard deviation along an axis, which is what `sigma` means.
    """
    found, sigma, visible, heading, hands = outputs
    distance = ((found - truth.joints).square().sum(-1) + 1e-6).sqrt()
    scale = 0.5 * sigma
    places = (distance / scale + 3 * scale.log()).mean() + 5 * distance.mean()
    bce = torch.nn.functional.binary_cross_entropy_with_logits
    seen = bce(visible, truth.visible)
    # Of somebody who lies no heading can be told.
    level = truth.upright.abs().clamp(0.1, 1)[:, None]
    turned = ((heading - truth.heading).square() * level).mean()
    palms = truth.visible[:, [joints.INDEX["HandLeft"], joints.INDEX["HandRight"]]]
    closed = (bce(hands, truth.hands, reduction="none") * palms).sum() / palms.sum().clamp(min=1)
    return places + 0.5 * seen + 2 * turned + 0.4 * closed


def rate_at(share, highest):
    """Up over the first fiftieth, then down along a cosine to a hundredth."""
    if share < 0.02:
        return highest * max(share / 0.02, 0.02)
    return highest * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * (share - 0.02) / 0.98)))


class Run:
    """A network in training with all that a checkpoint holds."""

    def __init__(self, options):
        self.options = options
        self.network = Network(options.width, options.blocks).to(memory_format=torch.channels_last)
        self.averaged = copy.deepcopy(self.network).eval()
        self.optimiser = torch.optim.AdamW(self.network.parameters(), lr=options.rate, weight_decay=1e-2)
        self.seconds, self.steps, self.samples = 0.0, 0, 0
        self.path = os.path.join(options.run, "checkpoint.pt")
        os.makedirs(options.run, exist_ok=True)
        if os.path.exists(self.path):
            self.restore()
        elif options.start:
            for network in (self.network, self.averaged):
                network.load_state_dict(load(options.start).state_dict())

    def restore(self):
        state = torch.load(self.path, weights_only=True)
        if state["config"] != self.network.config:
            raise SystemExit(f"{self.path} is of a network {state['config']}; asked for {self.network.config}")
        self.network.load_state_dict(state["network"])
        self.averaged.load_state_dict(state["averaged"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.seconds, self.steps, self.samples = state["seconds"], state["steps"], state["samples"]

    def save(self):
        state = {
            "config": self.network.config,
            "network": self.network.state_dict(),
            "averaged": self.averaged.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "seconds": self.seconds,
            "steps": self.steps,
            "samples": self.samples,
        }
        torch.save(state, self.path + ".new")
        os.replace(self.path + ".new", self.path)

    def step(self, crops, truth):
        share = self.seconds / 60 / self.options.minutes
        for group in self.optimiser.param_groups:
            group["lr"] = rate_at(min(share, 1), self.options.rate)
        self.network.train()
        loss = loss_of(self.network(crops.contiguous(memory_format=torch.channels_last)), truth)
        self.optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 20.0)
        self.optimiser.step()
        self.steps += 1
        self.samples += len(crops)
        keep = min(0.998, (1 + self.steps) / (20 + self.steps))
        with torch.no_grad():
            for slow, fast in zip(self.averaged.state_dict().values(), self.network.state_dict().values()):
                if slow.dtype.is_floating_point:
                    slow.lerp_(fast, 1 - keep)
                else:
                    slow.copy_(fast)
        return loss.item()


def load(run):
    """The averaged network of a run's folder, ready to be used."""
    state = torch.load(os.path.join(run, "checkpoint.pt"), weights_only=True)
    network = Network(**state["config"])
    network.load_state_dict(state["averaged"])
    return network.eval()


def train(options):
    torch.set_num_threads(options.threads)
    torch.manual_seed(options.seed)
    run = Run(options)
    stream = Stream(Files(options.data, "train"), options.batch, options.seed + run.steps)
    crops, truths = Files(options.data, "unseen").all(3000)
    test, truth = channels(crops), Truth(truths)
    losses, measured = [], run.seconds
    while run.seconds < 60 * options.minutes:
        began = time.monotonic()
        losses.append(run.step(*stream.next()))
        run.seconds += time.monotonic() - began
        if not np.isfinite(losses[-1]):
            raise SystemExit(f"the loss is {losses[-1]} after {run.steps} steps: try a lower --rate")
        if run.seconds - measured >= 60 * options.every or run.seconds >= 60 * options.minutes:
            measured = run.seconds
            run.save()
            report(run, losses, test, truth)
            losses = []


def report(run, losses, test, truth):
    tables = metrics.tables(metrics.run(Exported(run.averaged), test), truth)
    whole, front = tables["all"], tables["front"]
    row = {
        "seconds": round(run.seconds),
        "samples": run.samples,
        "loss": round(float(np.mean(losses)), 4),
        "rate": run.optimiser.param_groups[0]["lr"],
        **{name: round(float(value), 2) for name, value in whole.items()},
        "front_within_10cm_visible": round(front["within_10cm_visible"], 2),
    }
    print(" ".join(f"{name} {value}" for name, value in row.items()), flush=True)
    path = os.path.join(run.options.run, "curves.csv")
    known = os.path.exists(path)
    with open(path, "a", newline="") as file:
        writer = csv.DictWriter(file, row.keys())
        if not known:
            writer.writeheader()
        writer.writerow(row)
    draw(path, os.path.join(run.options.run, "curves.png"))


def draw(table, picture):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plot

    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    samples = [float(row["samples"]) / 1000 for row in rows]
    figure, axes = plot.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    for axis, names in zip(
        axes,
        [["loss"], ["mpjpe_visible_mm", "mpjpe_hidden_mm"], ["within_10cm_visible", "within_10cm", "sides_right"]],
    ):
        for name in names:
            axis.plot(samples, [float(row[name]) for row in rows], label=name)
        axis.set_xlabel("thousand crops")
        axis.legend()
    figure.savefig(picture, dpi=90)
    plot.close(figure)
