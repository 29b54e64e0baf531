"""Claim: intervals of the three-cornered hat contain the true deviation of each of three or more clocks.

Clocks of different quality, with white FM, flicker FM and random-walk FM. An interval of a clock that is not detected is
its 95 % limit.

    python benches/claims/hats.py [--records 300] [--samples 512]
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np

import allanite as al

#: Name of each case → models of its clocks.
CASES = {
    "three alike, white FM": ["N(N=1)", "N(N=1)", "N(N=1)"],
    "1 : 2 : 4, white FM": ["N(N=1)", "N(N=2)", "N(N=4)"],
    "1 : 1 : 10, flicker FM": ["B(B=1)", "B(B=1)", "B(B=10)"],
    "white, flicker, random walk": ["N(N=1)", "B(B=0.3)", "K(K=0.05)"],
    "four alike, white FM": ["N(N=1)"] * 4,
}


def one(name, seed, samples):
    """Return rows (τ, clock, true deviation inside the interval, detected) of one record."""
    models = [al.parse_model(text) for text in CASES[name]]
    # One replicate for each case: records of one seed, axis and replicate share their random numbers.
    case = list(CASES).index(name)
    x = np.column_stack(
        [
            np.cumsum(
                model.simulate(n=samples, rate=1.0, seed=seed, axis=k, replicate=case).samples
            )
            for k, model in enumerate(models)
        ]
    )
    found = al.three_cornered_hat(al.Recording(x, rate=1.0, quantity="angle"), seed=seed)
    rows = []
    for k, (model, clock) in enumerate(zip(models, found.values(), strict=True)):
        truth = np.sqrt(model.allan_variance(clock.tau, rate=1.0))
        held = (clock.low <= truth) & (truth <= clock.high)
        rows += [(m, k, h, d) for m, h, d in zip(clock.tau, held, clock.detected, strict=True)]
    return rows


def study(records, samples, first=0):
    """Return case → rows of all records."""
    each = max(1, records // len(CASES))
    return {
        name: np.array(
            [row for seed in range(first, first + each) for row in one(name, seed, samples)],
            dtype=float,
        )
        for name in CASES
    }


def main():
    """Print the coverage of each case, and of each τ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=300, help="records in all")
    parser.add_argument("--samples", type=int, default=512, help="samples of a record")
    given = parser.parse_args()
    began = process_time()
    found = study(given.records, given.samples)
    for name, rows in found.items():
        tau, _, held, seen = rows.T
        parts = [f"{m:g} s {100 * held[tau == m].mean():.0f} %" for m in np.unique(tau)]
        shares = f"{100 * held.mean():.1f} % ({100 * seen.mean():.0f} % detected)"
        print(f"{name}: {shares}; {', '.join(parts)}")
    held = np.concatenate([rows[:, 2] for rows in found.values()])
    print(
        f"all: {100 * held.mean():.2f} % of {held.size}; {process_time() - began:.0f} s of CPU time"
    )


if __name__ == "__main__":
    main()
