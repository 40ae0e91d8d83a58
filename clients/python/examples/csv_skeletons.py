#!/usr/bin/env python3
"""Any CSV with a header: pushes skeletons by saying what its columns mean.

One row a body and frame, three columns a joint:
    python csv_skeletons.py walk.csv --time t_ms --time-unit ms --id person \\
        --columns "{joint}_{axis}" --joint-set azure-kinect --unit mm --axes x,y,z
One row a joint:
    python csv_skeletons.py walk.csv --time t --joint joint --columns "{axis}" --joint-set kinect-v2 --axes=-x,-y,z

--columns   how position columns are called; {joint} is the joint's name in the joint set, {axis} is x, y or z
--confidence how confidence columns are called, e.g. "{joint}_c"; without, every joint that is there counts 1
--axes      where optical x (right), y (down) and z (forward) come from: x right, y up, z forward in the file is x,-y,z;
            Kinect's x left, y up, z forward is -x,-y,z; z towards the viewer is x,-y,-z
--rename    a joint's name in the file and in the joint set: --rename pelvis=SpineBase
--missing   a number that stands for nothing, e.g. -9999; empty cells and nan do anyway
Upper and lower case, blanks and underscores in column names do not count.
"""
import csv
import math
import re
from collections.abc import Iterable, Iterator

import common
import posefuse
from posefuse import Body, Joint

TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
LENGTH = {"m": 1.0, "cm": 0.01, "mm": 0.001}


def plain(name: str) -> str:
    """A column's name without what does not count."""
    return re.sub(r"[\s_]", "", name).lower()


def axes_of(text: str) -> list[tuple[int, float]]:
    """`-x,-y,z` as (column, sign) for optical x, y and z."""
    parts = [part.strip().lower() for part in text.split(",")]
    if sorted(part.lstrip("-+") for part in parts) != ["x", "y", "z"]:
        raise ValueError(f"--axes {text!r}: expected x, y and z in some order, each with or without -, e.g. -x,-y,z")
    return [("xyz".index(part.lstrip("-+")), -1.0 if part.startswith("-") else 1.0) for part in parts]


class Reader:
    """What the columns mean."""

    def __init__(self, args):
        self.args = args
        self.axes = axes_of(args.axes)
        self.names = posefuse.JOINT_SETS[args.joint_set]
        self.theirs = {ours: theirs for theirs, _, ours in (pair.partition("=") for pair in args.rename)}
        if unknown := [name for name in self.theirs if name not in self.names]:
            raise ValueError(f"--rename: {args.joint_set} has no joint {unknown[0]!r}; it has {', '.join(self.names)}")
        self.understood = False
        self.ours = {plain(self.theirs.get(name, name)): name for name in self.names}

    def frames(self, lines: Iterable[str]) -> Iterator[common.Frame]:
        """Frames of rows with equal times; rows must be in the order of time."""
        now, bodies = None, {}
        rows = csv.DictReader(lines, delimiter=self.args.delimiter)
        self.rows = rows
        for row in rows:
            if not self.args.joint and rows.line_num == 2:
                self.check_columns(rows.fieldnames)
            row = {plain(key): value for key, value in row.items() if key is not None and value is not None}
            at = self.number(row, self.args.time) * TIME[self.args.time_unit]
            if at != now:
                if now is not None:
                    yield now, list(bodies.values())
                now, bodies = at, {}
            person = int(self.number(row, self.args.id)) if self.args.id else 1
            self.put(row, bodies.setdefault(person, Body(person, {})))
        if now is None:
            raise ValueError("the file has no rows below its header")
        yield now, list(bodies.values())
        if not self.understood:
            raise ValueError(f"no joint was understood: no row of column {self.args.joint!r} names a joint of {self.args.joint_set}, "
                             f"e.g. {self.names[0]}, or no column is called as --columns {self.args.columns!r} says")

    def check_columns(self, header: list[str]) -> None:
        """At least one joint has to be there."""
        there = {plain(column) for column in header}
        wanted = [self.args.columns.format(joint=self.theirs.get(name, name), axis="x") for name in self.names]
        if not any(plain(column) in there for column in wanted):
            raise ValueError(f"the file has no column like {wanted[0]!r}; it has {', '.join(header[:12])}; --columns says how they are called")

    def put(self, row: dict, body: Body) -> None:
        """Puts the joints of a row into its body."""
        if self.args.joint:
            name = self.ours.get(plain(self.cell(row, self.args.joint)))
            names = [name] if name else []
        else:
            names = self.names
        for name in names:
            if (joint := self.joint(row, name)) is not None:
                body.joints[name] = joint

    def joint(self, row: dict, name: str) -> Joint | None:
        """One joint in optical axes, metres; `None` where a number is missing."""
        theirs = self.theirs.get(name, name)
        cells = [row.get(plain(self.args.columns.format(joint=theirs, axis=axis))) for axis in "xyz"]
        if any(cell is None for cell in cells):
            return None
        self.understood = True
        values = [self.value(cell, name) for cell in cells]
        if any(math.isnan(value) or value == self.args.missing for value in values):
            return None
        x, y, z = (sign * values[column] * LENGTH[self.args.unit] for column, sign in self.axes)
        if not self.args.confidence:
            return Joint(x, y, z)
        return Joint(x, y, z, min(max(self.number(row, self.args.confidence.format(joint=theirs)), 0.0), 1.0))

    def value(self, cell: str, name: str) -> float:
        try:
            return float(cell) if cell.strip() else math.nan
        except ValueError:
            raise ValueError(f"line {self.rows.line_num}, joint {name}: expected a number, found {cell!r}") from None

    def cell(self, row: dict, column: str) -> str:
        try:
            return row[plain(column)]
        except KeyError:
            raise ValueError(f"the file has no column {column!r}; it has {', '.join(self.rows.fieldnames)}") from None

    def number(self, row: dict, column: str) -> float:
        cell = self.cell(row, column)
        try:
            return float(cell)
        except ValueError:
            raise ValueError(f"line {self.rows.line_num}, column {column!r}: expected a number, found {cell!r}") from None


def main() -> None:
    parser = common.options(__doc__, "csv")
    parser.add_argument("file", help="the file; `-`: standard input, live")
    parser.add_argument("--time", required=True, metavar="COLUMN")
    parser.add_argument("--time-unit", choices=TIME, default="s")
    parser.add_argument("--id", metavar="COLUMN", help="the person; without, there is one")
    parser.add_argument("--joint", metavar="COLUMN", help="the joint's name, where each row is one joint")
    parser.add_argument("--columns", default="{joint}_{axis}", metavar="PATTERN")
    parser.add_argument("--confidence", metavar="PATTERN")
    parser.add_argument("--joint-set", choices=posefuse.JOINT_SETS, default="kinect-v2")
    parser.add_argument("--rename", action="append", default=[], metavar="THEIRS=OURS")
    parser.add_argument("--unit", choices=LENGTH, default="m")
    parser.add_argument("--axes", default="x,y,z", metavar="X,Y,Z")
    parser.add_argument("--missing", type=float, metavar="NUMBER")
    parser.add_argument("--delimiter", default=",")
    args = parser.parse_args()
    try:
        reader = Reader(args)
    except ValueError as error:
        parser.error(str(error))
    with common.lines_of(args.file) as lines:
        common.run(args, reader.frames(lines), joint_set=args.joint_set, model="CSV", live=args.file == "-")


if __name__ == "__main__":
    main()
