"""Intervals over all models that a record cannot tell apart: do they hold the truth where those of one model do not?

Ladders from N on records of which hardly anything but white noise is seen, so that the model is often a wrong one. Of each
coefficient that a ladder ends with: in how many the truth, 0 for what is not there, is in its own interval and in that over
the rivals. The samples come from tests/python/generators.py.

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
#: Of each truth its coefficients beside N.
TRUTHS = {
    "N+GM": {"GM.q_c": 2.5e-3},
    "N+B": {"B": 4e-3},
    "N+K": {"K": 5e-4},
    "N+B+K": {"B": 3e-3, "K": 5e-4},
}


def record(truth, seed):
    """A correlation time of the Gauss-Markov process is 8 s."""
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
    """By coefficient: ladders that end with it, and how many intervals hold the truth, alone and over the rivals."""
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
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=60)
    seeds = range(parser.parse_args().seeds)
    print(f"{'truth':8} {'found':14} {'ladders':>8} {'alone':>6} {'over rivals':>12}")
    for truth in TRUTHS:
        found, alone, over = counted(truth, seeds)
        for key, number in found.items():
            print(f"{truth:8} {key:14} {number:8} {alone[key]:6} {over[key]:12}", flush=True)


if __name__ == "__main__":
    main()
