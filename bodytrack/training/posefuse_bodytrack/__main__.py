"""Commands: train, export, evaluate."""

import argparse

from . import evaluate, export, train


def main():
    parser = argparse.ArgumentParser(prog="posefuse_bodytrack", description=__doc__)
    commands = parser.add_subparsers(required=True)
    for name, module, action in [
        ("train", train, train.train),
        ("export", export, export.export),
        ("evaluate", evaluate, evaluate.evaluate),
    ]:
        command = commands.add_parser(name, help=module.__doc__, description=module.__doc__)
        module.arguments(command)
        command.set_defaults(action=action)
    options = parser.parse_args()
    options.action(options)


if __name__ == "__main__":
    main()
