"""Variance of the estimates of each method relative to the Cramér–Rao bound.

Prints the table of docs/validation.md. A ratio of 1.5 means that the method needs a record 1.5 times as long for the same
variance.

    python benches/claims/efficiency.py [RECORDS]
"""

import sys
from pathlib import Path

import numpy as np

import allanite as al
from allanite.fit.classical.lines import read_lines

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import generators as g
from information import bound

SAMPLES, RATE = 2048, 1.0
CASES = {
    "N+K": ((1.0, 0.1), ("N", "K")),
    "N+GM": ((1.0, 0.5, 20.0), ("N", "GM.q_c", "GM.correlation_time")),
}


def record(name, rng):
    """Return the samples of a record of one case."""
    values = CASES[name][0]
    white = g.white(rng, SAMPLES, RATE, values[0])
    if name == "N+K":
        return white + g.walk(rng, SAMPLES, RATE, values[1])
    return white + g.gauss_markov(rng, SAMPLES, RATE, *values[1:])


def main(records: int) -> None:
    """Print the ratio of each parameter and method over so many records."""
    print(
        "| model | number | Whittle | GLS | lines (share of records in which there is one) |\n|---|---|---|---|---|"
    )
    for name, (values, keys) in CASES.items():
        rng = np.random.default_rng(1)
        found = {m: {k: [] for k in keys} for m in ("whittle", "gls", "lines")}
        for _ in range(records):
            recording = al.Recording(record(name, rng), rate=RATE, unit="1")
            for method in ("whittle", "gls"):
                fit = al.fit_model(recording, name, method=method)
                for key in keys:
                    found[method][key].append(float(fit[key]))
            readings = read_lines(recording.oadev(taus=8))
            for key in keys:
                line = readings[key] if key in ("N", "K") else None
                if line is not None and line.value is not None:
                    found["lines"][key].append(line.value)
        best = np.diag(bound(name, values, SAMPLES, RATE))
        for key, value, variance in zip(keys, values, best, strict=True):
            cells = []
            for method in ("whittle", "gls"):
                error = np.log(np.maximum(found[method][key], 1e-3 * value)) - np.log(value)
                cells.append(f"{np.mean(error**2) / variance:.2f}")
            lines = np.log(found["lines"][key]) - np.log(value) if found["lines"][key] else None
            share = len(found["lines"][key]) / records
            cells.append(
                "–"
                if lines is None
                else f"{np.mean(lines**2) / variance:.1f} ({100 * share:.0f} %)"
            )
            print(f"| {name} | {key} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
