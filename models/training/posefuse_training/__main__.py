"""`python -m posefuse_training prepare|train|export|evaluate`; each says with --help what it takes."""

import argparse
import importlib
import sys

COMMANDS = {
    "prepare": "motion files to clean, split arrays",
    "train": "a model, from prepared arrays; goes on where it was stopped",
    "export": "a trained model as ONNX with its manifest, checked against PyTorch",
    "published": "systems from papers: trained, measured by their own papers' measures, exported",
    "evaluate": "the table of gaps, parts and splits: trained models beside the simple methods",
}


def main() -> int:
    parser = argparse.ArgumentParser(prog="posefuse_training", description="Trains Posefuse's occlusion models.")
    commands = parser.add_subparsers(dest="command", required=True)
    chosen = sys.argv[1] if len(sys.argv) > 1 else None
    for name, text in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        if name == chosen:
            importlib.import_module(f".{name}", __package__).arguments(command)
    options = parser.parse_args()
    return importlib.import_module(f".{options.command}", __package__).run(options)


if __name__ == "__main__":
    sys.exit(main())
