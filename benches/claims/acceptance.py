"""Claim: an acceptance test gives at most 5 % wrong "meets" and at most 5 % wrong "does not meet".

    python benches/claims/acceptance.py [--records 30] [--samples 6000]

Simulated records of N+B+K, made without the package, have true figures of 0.8, 1.0 and 1.25 times the limit of the data
sheet. A unit at 0.8 or 1.0 times the limit meets the sheet, one at 1.25 times does not.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE = 10.0
#: White noise, flicker noise and random walk of a MEMS gyroscope (based on deg/s).
N, B, K = 0.005, 0.002, 1e-4
RATIOS = (0.8, 1.0, 1.25)


def record(rng: np.random.Generator, n: int) -> np.ndarray:
    """Samples of N+B+K in deg/s."""
    return g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, B) + g.walk(rng, n, RATE, K)


def true_figures() -> dict[str, tuple[float, str]]:
    """True figures of the simulated sensor: value and unit by name."""
    tau = np.geomspace(0.1, 1e5, 4000)
    variance = al.parse_model(f"N(N={N})+B(B={B})+K(K={K})").allan_variance(tau, rate=RATE)
    return {
        "angle_random_walk": (60.0 * N, "deg/sqrt(h)"),
        "bias_instability": (3600.0 * B, "deg/h"),
        "rate_random_walk": (K * 3600.0 * 60.0, "deg/h/sqrt(h)"),
        "in_run_bias_stability": (3600.0 * float(np.sqrt(variance.min())), "deg/h"),
    }


def count(records: int, samples: int, seed: int = 0) -> dict[tuple[str, float], dict[str, int]]:
    """Count the verdicts by figure and by ratio of the true value to the limit."""
    truth = true_figures()
    found: dict[tuple[str, float], dict[str, int]] = {}
    for number in range(records):
        ratio = RATIOS[number % len(RATIOS)]
        rng = np.random.default_rng([seed, number])
        log = al.Recording(record(rng, samples), rate=RATE, unit="deg/s")
        figures = tuple(al.Quoted(k, value / ratio, unit) for k, (value, unit) in truth.items())
        for tested in al.accept(log, al.DataSheet("sheet", figures)).figures:
            row = found.setdefault((tested.figure.name, ratio), {})
            row[tested.verdict] = row.get(tested.verdict, 0) + 1
    return found


def wrong(found: dict[tuple[str, float], dict[str, int]]) -> dict[str, tuple[int, int]]:
    """Count the wrong verdicts of each kind, and the records in which that verdict would be wrong, over all figures."""
    meets = [row for (_, ratio), row in found.items() if ratio > 1.0]
    not_meets = [row for (_, ratio), row in found.items() if ratio <= 1.0]
    return {
        "meets": (sum(r.get("meets", 0) for r in meets), sum(sum(r.values()) for r in meets)),
        "does not meet": (
            sum(r.get("does not meet", 0) for r in not_meets),
            sum(sum(r.values()) for r in not_meets),
        ),
    }


def main() -> None:
    """Print the counts of all verdicts and the share of wrong ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=30, help="simulated records in all")
    parser.add_argument("--samples", type=int, default=6000, help="samples of a record")
    given = parser.parse_args()
    found = count(given.records, given.samples)
    for (name, ratio), row in sorted(found.items()):
        print(f"{name:24} {ratio:5.2f} {row}")
    for verdict, (bad, total) in wrong(found).items():
        print(f"wrong {verdict!r}: {bad} of {total} ({100 * bad / total:.1f} %)")


if __name__ == "__main__":
    main()
