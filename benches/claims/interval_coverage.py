"""Claim: 95 % intervals of coefficients cover the truth. Prints the table of docs/validation.md.

python benches/claims/interval_coverage.py [RECORDS]
"""

import sys
from pathlib import Path

import numpy as np

import allanite as al

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import generators as g

SAMPLES, RATE = 4096, 1.0
#: Model → true values by key and a source of its samples; K of the first is near its detection limit.
CASES = {
    "N+B+K": (
        {"N": 1.0, "B": 0.15, "K": 0.01},
        lambda rng: (
            g.white(rng, SAMPLES, RATE, 1.0)
            + g.flicker(rng, SAMPLES, RATE, 0.15)
            + g.walk(rng, SAMPLES, RATE, 0.01)
        ),
    ),
    "N+K": (
        {"N": 1.0, "K": 0.03},
        lambda rng: g.white(rng, SAMPLES, RATE, 1.0) + g.walk(rng, SAMPLES, RATE, 0.03),
    ),
    "N+GM": (
        {"N": 1.0, "GM.q_c": 0.09, "GM.correlation_time": 50.0},
        lambda rng: (
            g.white(rng, SAMPLES, RATE, 1.0) + g.gauss_markov(rng, SAMPLES, RATE, 0.09, 50.0)
        ),
    ),
}


def main(records: int) -> None:
    """Print the coverage of each coefficient and method over so many records."""
    print(
        "| model | number | method | covered | missed above | missed below | limits only |\n|---|---|---|---|---|---|---|"
    )
    for name, (truth, make) in CASES.items():
        rng = np.random.default_rng(1)
        tally = {(key, m): np.zeros(4) for key in truth for m in ("whittle", "gls")}
        for _ in range(records):
            recording = al.Recording(make(rng), rate=RATE, unit="1")
            for method in ("whittle", "gls"):
                fit = al.fit_model(recording, name, method=method)
                for key, value in truth.items():
                    interval = fit[key].interval
                    assert interval is not None
                    low, high = interval
                    tally[key, method] += [
                        low <= value <= high,
                        value < low,
                        value > high,
                        not fit[key].detected,
                    ]
        for (key, method), counts in tally.items():
            cells = " | ".join(f"{100 * c / records:.1f} %" for c in counts)
            print(f"| {name} | {key} | {method} | {cells} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
