"""The network that tells open hands from closed ones: its training, export and figures."""

import copy
import os
import time

import numpy as np
import torch

from . import hands_data
from .export import OPSET, _hash
from .hands_data import CAMERAS, augmented, known, load, numbers
from .hands_network import ExportedGrip, Grip
from .train import rate_at

GOLDEN = 8
# A probability nearer to one half than this is no vote (bodytrack/src/grip.rs).
TELLS = 0.2
# What is said to be in sight by less than this is not looked at (bodytrack/src/grip.rs).
SEEN = 0.3
FAR_M = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.5]


def train_arguments(parser):
    parser.add_argument("--data", required=True, help="folder with train-*.hands and held_out-*.hands")
    parser.add_argument("--run", required=True, help="folder for the checkpoint")
    parser.add_argument("--minutes", type=float, default=10, help="of training in all; the learning rate falls over them")
    parser.add_argument("--batch", type=int, default=128)
    parser.add_argument("--rate", type=float, default=2e-3, help="learning rate at its highest")
    parser.add_argument("--width", type=int, default=16)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)


def train(options):
    torch.set_num_threads(options.threads)
    torch.manual_seed(options.seed)
    random = np.random.default_rng(options.seed)
    crops, truth = load(options.data, "train")
    facts, closed = known(truth), truth.closed
    looked_at = np.flatnonzero(truth.said_visible > SEEN)
    test = load(options.data, "held_out")
    network = Grip(options.width)
    averaged = copy.deepcopy(network).eval()
    optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=2e-2)
    seconds, steps, told, losses = 0.0, 0, 0.0, []
    while seconds < 60 * options.minutes:
        began = time.monotonic()
        places = random.choice(looked_at, options.batch, replace=False)
        hand = augmented(numbers(crops[places]), random)
        for group in optimiser.param_groups:
            group["lr"] = rate_at(seconds / 60 / options.minutes, options.rate)
        network.train()
        logits = network(hand, torch.from_numpy(facts[places]))[:, 0]
        loss = torch.nn.functional.binary_cross_entropy_with_logits(logits, torch.from_numpy(closed[places]))
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        steps += 1
        losses.append(loss.item())
        keep = min(0.998, (1 + steps) / (20 + steps))
        with torch.no_grad():
            for slow, fast in zip(averaged.state_dict().values(), network.state_dict().values()):
                if slow.dtype.is_floating_point:
                    slow.lerp_(fast, 1 - keep)
                else:
                    slow.copy_(fast)
        seconds += time.monotonic() - began
        if seconds - told > 60 or seconds >= 60 * options.minutes:
            told = seconds
            figures = measures(run(ExportedGrip(averaged), *test), test[1])
            print(f"{seconds:.0f} s, {steps * options.batch} hands, loss {np.mean(losses):.4f}", figures, flush=True)
            losses = []
    factor, offset = correction(run(ExportedGrip(averaged), *test), test[1])
    print(f"factor {factor:.3f}, offset {offset:+.3f}")
    os.makedirs(options.run, exist_ok=True)
    state = {"config": network.config, "network": averaged.state_dict(), "factor": factor, "offset": offset}
    torch.save(state, os.path.join(options.run, "hands.pt"))


def run(network, crops, truth, batch=512):
    """The probability that each hand is closed."""
    facts, parts = known(truth), []
    network.eval()
    with torch.no_grad():
        for start in range(0, len(crops), batch):
            here = slice(start, start + batch)
            parts.append(network(torch.from_numpy(numbers(crops[here])), torch.from_numpy(facts[here])).numpy())
    return np.concatenate(parts)[:, 0]


def correction(said, truth):
    """The factor and offset that put logits right: logistic regression by Newton's method."""
    keep = truth.said_visible > SEEN
    p = np.clip(said[keep].astype(np.float64), 1e-6, 1 - 1e-6)
    x = np.stack([np.log(p / (1 - p)), np.ones_like(p)], 1)
    weights = np.array([1.0, 0.0])
    for _ in range(20):
        q = 1 / (1 + np.exp(-x @ weights))
        gradient = x.T @ (truth.closed[keep] - q)
        weights += np.linalg.solve((x * (q * (1 - q))[:, None]).T @ x + 1e-6 * np.eye(2), gradient)
    return float(weights[0]), float(weights[1])


def measures(said, truth, keep=None):
    """Of the hands that are in sight: how many are voted on, how many of the votes are right; gap of the probabilities."""
    looked = truth.said_visible > SEEN
    keep = np.ones_like(looked) if keep is None else keep
    seen = keep & (truth.visible > 0.5)
    vote = looked & (np.abs(said - 0.5) > TELLS)
    right = (said > 0.5) == (truth.closed > 0.5)
    hidden = keep & (truth.visible < 0.5)

    def share(of):
        return round(100 * float(of.mean()), 1) if len(of) else float("nan")

    curve = [line for line in reliability(said[keep & looked], truth.closed[keep & looked])]
    all_ = max(sum(count for _, _, count in curve), 1)
    return {
        "hands": int(seen.sum()),
        "right": share(right[seen]),
        "voted": share(vote[seen]),
        "votes_right": share(right[seen & vote]),
        "hidden_voted": share(vote[hidden]),
        "hidden_votes_right": share(right[hidden & vote]),
        "gap": round(100 * sum(count * abs(a - b) for a, b, count in curve) / all_, 1),
    }


def reliability(said, closed):
    """By tenths: what was said, what was true, how many."""
    tenths = np.minimum((said * 10).astype(int), 9)
    each = [tenths == tenth for tenth in range(10)]
    return [(float(said[t].mean()), float(closed[t].mean()), int(t.sum())) for t in each if t.any()]


def table(said, truth):
    """`measures` by camera, whether smeared, and distance."""
    rows = {"all": measures(said, truth)}
    for smeared in (0, 1):
        rows[["as sharp as rendered", "smeared as by a correlation window"][smeared]] = measures(
            said, truth, (truth.smeared == smeared) & (truth.camera < 2)
        )
    for number, name in enumerate(CAMERAS):
        rows[name] = measures(said, truth, truth.camera == number)
        for low, high in zip(FAR_M, FAR_M[1:]):
            keep = (truth.camera == number) & (truth.distance >= low) & (truth.distance < high)
            rows[f"{name}, {low}-{high} m"] = measures(said, truth, keep)
    return rows


def read(path):
    state = torch.load(os.path.join(path, "hands.pt"), weights_only=True)
    network = Grip(**state["config"])
    network.load_state_dict(state["network"])
    return ExportedGrip(network.eval(), state["factor"], state["offset"]).eval()


def evaluate_arguments(parser):
    parser.add_argument("--data", required=True)
    parser.add_argument("--subset", default="unseen")
    parser.add_argument("--run", required=True)


def evaluate(options):
    crops, truth = load(options.data, options.subset)
    said = run(read(options.run), crops, truth)
    rows = table(said, truth)
    names = list(rows["all"])
    print("\t".join(["", *names]))
    for name, row in rows.items():
        print("\t".join([name, *(str(row[n]) for n in names)]))
    looked = truth.said_visible > SEEN
    curve = reliability(said[looked], truth.closed[looked])
    print("closed said / true / hands: " + "  ".join(f"{a:.2f}/{b:.2f}/{n}" for a, b, n in curve))


def export_arguments(parser):
    parser.add_argument("--run", required=True)
    parser.add_argument("--data", required=True, help="for golden outputs and the manifest's figures")
    parser.add_argument("--out", required=True, help="folder")
    parser.add_argument("--name", default="depth-hands")


def export(options):
    network = read(options.run)
    crops, truth = load(options.data, "unseen")
    hand, facts = numbers(crops[:GOLDEN]), known(truth)[:GOLDEN]
    path = os.path.join(options.out, options.name + ".onnx")
    torch.onnx.export(
        network,
        (torch.from_numpy(hand), torch.from_numpy(facts)),
        path,
        input_names=["hand", "known"],
        output_names=["closed"],
        dynamic_axes={name: {0: "N"} for name in ["hand", "known", "closed"]},
        opset_version=OPSET,
        dynamo=False,
    )
    import onnxruntime

    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    (theirs,) = session.run(None, {"hand": hand, "known": facts})
    ours = network(torch.from_numpy(hand), torch.from_numpy(facts)).detach().numpy()
    if not np.abs(ours - theirs).max() < 1e-4:
        raise SystemExit("the exported network says something else than the trained one")
    with open(os.path.join(options.out, options.name + ".golden.bin"), "wb") as file:
        for part in [hand, facts, theirs]:
            file.write(np.ascontiguousarray(part, "<f4").tobytes())
    figures = {}
    rows = table(run(network, crops, truth), truth)
    for row, prefix in [("all", "all"), (CAMERAS[0], "640x480"), (CAMERAS[1], "320x240")]:
        for key in ["voted", "votes_right", "gap"]:
            figures[f"unseen_{prefix}_{key}"] = rows[row][key]
    parameters = sum(p.numel() for p in network.parameters())
    with open(os.path.join(options.out, options.name + ".toml"), "w") as file:
        file.write(manifest(options.name, path, parameters, figures))
    print(f"{path}: {os.path.getsize(path) / 1e6:.2f} MB, {parameters} parameters")


def manifest(name, path, parameters, figures):
    lines = "\n".join(f"{key} = {value}" for key, value in figures.items())
    size = hands_data.SIZE
    return f'''version = 1
name = "{name}"
opset = {OPSET}
sha256 = "{_hash(path)}"
quick_ms = 1.0

[inputs]
hand = {{ shape = ["N", {hands_data.CHANNELS}, {size}, {size}], unit = "1" }}
known = {{ shape = ["N", {hands_data.KNOWN}], unit = "1" }}

[outputs]
closed = {{ shape = ["N", 1], unit = "1" }}

[about]
summary = "Whether a hand in a depth crop is closed: a few convolutions."
source = "ours"
licence = "MIT OR Apache-2.0"
training_data = "Hands rendered by the simulator: CMU motion capture (models/training/split.toml) and the simulator's own motion, located by the body's network"
parameters = {parameters}

[figures]
{lines}
'''
