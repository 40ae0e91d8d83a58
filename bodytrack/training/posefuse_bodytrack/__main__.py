"""Commands: train, export, evaluate; the same for hands: hands-train, hands-export, hands-evaluate."""

import argparse

from . import evaluate, export, hands, train


def main():
    parser = argparse.ArgumentParser(prog="posefuse_bodytrack", description=__doc__)
    commands = parser.add_subparsers(required=True)
    for name, about, arguments, action in [
        ("train", train.__doc__, train.arguments, train.train),
        ("export", export.__doc__, export.arguments, export.export),
        ("evaluate", evaluate.__doc__, evaluate.arguments, evaluate.evaluate),
        ("hands-train", hands.__doc__, hands.train_arguments, hands.train),
        ("hands-export", hands.__doc__, hands.export_arguments, hands.export),
        ("hands-evaluate", hands.__doc__, hands.evaluate_arguments, hands.evaluate),
    ]:
        command = commands.add_parser(name, help=about, description=about)
        arguments(command)
        command.set_defaults(action=action)
    options = parser.parse_args()
    options.action(options)


if __name__ == "__main__":
    main()
