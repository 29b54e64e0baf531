"""Claim: a vibration whose level changes is found as resonance and level change, and a constant one never is.

Hidden: N+B+K of half an hour at 50 Hz and a resonance at 12 Hz, which is present for a third of the record or doubles for
a sixth. Nulls: checks of nine true models without a level that changes. The samples come from tests/python/generators.py.

    python benches/claims/band_levels.py [--seeds 8] [--null 60] [--samples 20000]
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

RATE, LENGTH = 50.0, 90_000
HIDDEN = {
    "on for a third": lambda t: (t > 600.0) & (t < 1200.0),
    "doubles for a sixth": lambda t: np.where((t > 600.0) & (t < 900.0), 2.0, 1.0),
}
NULLS = {
    "N": ("N", lambda r, n: r.standard_normal(n)),
    "N+B+K": ("N+B+K", lambda r, n: sensor(r, n)),
    "t(5)": ("N", lambda r, n: r.standard_t(5, n)),
    "t(3)": ("N", lambda r, n: r.standard_t(3, n)),
    "rounded to 3": ("N", lambda r, n: np.round(r.standard_normal(n) / 3.0) * 3.0),
    "rounded to 1.4": ("N", lambda r, n: np.round(g.white(r, n, RATE, 0.01) / 0.1) * 0.1),
    "N+RES, 1 Hz": (
        "N+RES",
        lambda r, n: g.white(r, n, RATE, 0.01) + g.resonance(r, n, RATE, 12.0, 0.02, 0.03),
    ),
    "N+RES, 8 mHz": (
        "N+RES",
        lambda r, n: g.white(r, n, RATE, 0.01) + g.resonance(r, n, RATE, 2.0, 0.002, 0.03),
    ),
    "N+GM": (
        "N+GM",
        lambda r, n: g.white(r, n, RATE, 0.01) + g.gauss_markov(r, n, RATE, 0.02, 2.0),
    ),
}


def sensor(rng, n):
    """Return n samples of N+B+K in deg/s."""
    return g.white(rng, n, RATE, 0.01) + g.flicker(rng, n, RATE, 0.003) + g.walk(rng, n, RATE, 2e-4)


def hidden(name, seed):
    """Build a model step by step for a record with a vibration whose level changes."""
    rng = np.random.default_rng(seed)
    x = sensor(rng, LENGTH)
    x += HIDDEN[name](np.arange(LENGTH) / RATE) * g.resonance(
        rng, LENGTH, RATE, 12.0, 1.0 / 12.0, 0.05
    )
    return al.improve(al.Recording(x, rate=RATE, unit="deg/s"), "N+B+K")


def main() -> None:
    """Print the counts of correct results and of false alarms."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8, help="records of each hidden change")
    parser.add_argument("--null", type=int, default=60, help="records of each true model")
    parser.add_argument(
        "--samples", type=int, default=20_000, help="samples of a record of a true model"
    )
    asked = parser.parse_args()
    for name in HIDDEN:
        right = 0
        for seed in range(asked.seeds):
            study = hidden(name, seed)
            added = [step.added.kind for step in study.ladder[1:]]
            right += study.adequate and added == ["resonance", "band_level_change"]
            effects = [str(effect) for effect in study.fit.model][3:]
            print(f"{name}, {seed}: {study.stopped_because}, {effects}", flush=True)
        print(f"{name}: {right} of {asked.seeds} the resonance and its level alone", flush=True)
    for name, (start, samples) in NULLS.items():
        kinds: Counter[str] = Counter()
        raised = 0
        for seed in range(asked.null):
            x = samples(np.random.default_rng([seed, 77]), asked.samples)
            check = al.parse_model(start).fit(al.Recording(x, rate=RATE)).check()
            raised += not check.adequate
            kinds.update(s.kind for s in check.significant)
        print(f"{name}: {raised} of {asked.null} not adequate, {dict(kinds)}", flush=True)


if __name__ == "__main__":
    main()
