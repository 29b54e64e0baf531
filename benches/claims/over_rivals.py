"""Claim: intervals over all indistinguishable models contain the truth more often than those of one model.

Stepwise model building from N on records in which the other effects are hardly detectable, so that the final model is
often wrong. Counted for each coefficient of a final model: whether the truth (0 for an effect that is not in the record) is
inside its own interval, and inside the interval over the alternative models. The samples come from
tests/python/generators.py.

    python benches/claims/over_rivals.py [--seeds 60]
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, LENGTH = 50.0, 20_000
N = 0.0126
#: Truth → its coefficients besides N.
TRUTHS = {
    "N+GM": {"GM.q_c": 2.5e-3},
    "N+B": {"B": 4e-3},
    "N+K": {"K": 5e-4},
    "N+B+K": {"B": 3e-3, "K": 5e-4},
}


def record(truth, seed):
    """Return a record of one truth; the correlation time of a Gauss–Markov process is 8 s."""
    rng = np.random.default_rng([seed, 5])
    x = g.white(rng, LENGTH, RATE, N)
    values = TRUTHS[truth]
    if "GM.q_c" in values:
        x += g.gauss_markov(rng, LENGTH, RATE, values["GM.q_c"], 8.0)
    if "K" in values:
        x += g.walk(rng, LENGTH, RATE, values["K"])
    if "B" in values:
        x += g.flicker(rng, LENGTH, RATE, values["B"])
    return al.Recording(x, rate=RATE, unit="rad/s")


def counted(truth, seeds):
    """Count by coefficient the final models with it, and its intervals with the truth: own ones and over alternatives."""
    found, alone, over = Counter(), Counter(), Counter()
    for seed in seeds:
        study = al.improve(record(truth, seed), "N")
        wide = None if study.undecided is None else study.undecided.intervals
        for place, (effect, values) in enumerate(
            zip(study.fit.model, study.fit.estimates, strict=True)
        ):
            for p in effect.parameters:
                if p.role != "coefficient" or effect.short == "N" or values[p.name] is None:
                    continue
                key = p.name if p.name == effect.short else f"{effect.short}.{p.name}"
                true = TRUTHS[truth].get(key, 0.0)
                own = values[p.name].interval
                ends = own if wide is None else wide[place][p.name]
                found[key] += 1
                alone[key] += own[0] <= true <= own[1]
                over[key] += ends[0] <= true <= ends[1]
    return found, alone, over


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=60, help="records of each truth")
    seeds = range(parser.parse_args().seeds)
    print(f"{'truth':8} {'found':14} {'records':>8} {'own':>6} {'over alternatives':>18}")
    for truth in TRUTHS:
        found, alone, over = counted(truth, seeds)
        for key, number in found.items():
            print(f"{truth:8} {key:14} {number:8} {alone[key]:6} {over[key]:18}", flush=True)


if __name__ == "__main__":
    main()
