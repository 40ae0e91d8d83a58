"""Writes golden.txt: what SciPy and exact rational arithmetic give, for tests/golden.rs.

    pip install scipy && python make_golden.py > golden.txt

One case per line: kind, parameters, "|", input numbers, "|", expected numbers (all as shortest round-trip decimals).
  coefficients window order derivative position delta | | weights, oldest sample first   (scipy.signal.savgol_coeffs)
  exact        window order derivative position delta | | the same from rational arithmetic, also for orders at which
                                                          SciPy's Vandermonde solve has lost its accuracy
  smooth       window order derivative delta | signal | filtered    (scipy.signal.savgol_filter, mode="interp")
  fit          order derivative index | places | weights at places[index]   (rational arithmetic, irregular places)
"""

import random
import sys
from fractions import Fraction
from math import factorial

import scipy
from scipy.signal import savgol_coeffs, savgol_filter


def exact_weights(places, place, order, derivative):
    """Weights of the least-squares polynomial through `places`, by Gaussian elimination on exact normal equations."""
    offsets = [p - place for p in places]
    size = order + 1
    moments = [sum((x**k for x in offsets), Fraction(0)) for k in range(2 * order + 1)]
    rows = [
        [moments[i + j] for j in range(size)] + [Fraction(int(i == derivative))]
        for i in range(size)
    ]
    for column in range(size):
        pivot = next(r for r in range(column, size) if rows[r][column] != 0)
        rows[column], rows[pivot] = rows[pivot], rows[column]
        rows[column] = [v / rows[column][column] for v in rows[column]]
        for r in range(size):
            if r != column and rows[r][column] != 0:
                factor = rows[r][column]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[column])]
    solution = [row[-1] for row in rows]
    scale = factorial(derivative)
    return [float(scale * sum(c * x**k for k, c in enumerate(solution))) for x in offsets]


def line(kind, parameters, inputs, expected):
    words = lambda numbers: " ".join(repr(float(n)) if not isinstance(n, int) else str(n) for n in numbers)
    print(kind, words(parameters), "|", words(inputs), "|", words(expected))


def main():
    print(f"# made by make_golden.py with SciPy {scipy.__version__}, Python {sys.version.split()[0]}")
    for window, order, derivative, position, delta in [
        (2, 0, 0, 1.0, 1.0),
        (2, 1, 1, 0.0, 0.5),
        (5, 2, 0, 2.0, 1.0),
        (5, 2, 1, 2.0, 1.0),
        (7, 2, 0, 6.0, 1.0),
        (7, 2, 0, 5.0, 1.0),
        (7, 2, 0, 3.0, 1.0),
        (7, 2, 1, 6.0, 1 / 30),
        (7, 2, 2, 5.0, 1 / 30),
        (8, 3, 1, 4.0, 0.01),
        (8, 3, 0, 3.5, 1.0),
        (9, 4, 3, 0.0, 2.0),
        (11, 0, 0, 5.0, 1.0),
        (11, 5, 2, 7.25, 0.1),
        (29, 4, 0, 14.0, 1.0),
        (29, 4, 1, 28.0, 0.02),
        (64, 6, 2, 40.0, 1.0),
        (255, 3, 1, 254.0, 1.0),
    ]:
        weights = savgol_coeffs(window, order, derivative, delta, pos=position, use="dot")
        line("coefficients", (window, order, derivative, position, delta), (), weights)
        places = [Fraction(i) for i in range(window)]
        exact = exact_weights(places, Fraction(position), order, derivative)
        exact = [w / delta**derivative for w in exact]
        line("exact", (window, order, derivative, position, delta), (), exact)
        off = max(abs(a - b) for a, b in zip(weights, exact)) / max(map(abs, exact))
        print(f"SciPy is off by {off:.1e} for {window}/{order}/{derivative} at {position}", file=sys.stderr)
    for window, order, derivative, position in [
        (12, 11, 0, 4),
        (21, 20, 1, 10),
        (31, 12, 3, 30),
        (51, 15, 0, 50),
        (101, 20, 2, 50),
        (255, 30, 0, 127),
    ]:
        places = [Fraction(i) for i in range(window)]
        weights = exact_weights(places, Fraction(position), order, derivative)
        line("exact", (window, order, derivative, float(position), 1.0), (), weights)
    rng = random.Random(1)
    for window, order, derivative, delta, samples in [
        (5, 2, 0, 1.0, 5),
        (7, 2, 0, 1.0, 20),
        (7, 3, 1, 0.05, 20),
        (11, 4, 2, 0.1, 30),
        (29, 4, 0, 1.0, 40),
    ]:
        signal = [round(rng.uniform(-2.0, 2.0), 6) for _ in range(samples)]
        filtered = savgol_filter(signal, window, order, derivative, delta, mode="interp")
        line("smooth", (window, order, derivative, delta), signal, filtered)
    for window, order, derivative, index in [(7, 2, 0, 5), (7, 2, 1, 6), (9, 3, 2, 4), (15, 6, 0, 14), (4, 3, 3, 0)]:
        # Milliseconds with several lost samples: places 1 to 130 apart.
        places, at = [], 0
        for _ in range(window):
            places.append(at)
            at += rng.choice([1, 20, 33, 34, 67, 130])
        weights = exact_weights([Fraction(p) for p in places], Fraction(places[index]), order, derivative)
        line("fit", (order, derivative, index), places, weights)


main()
