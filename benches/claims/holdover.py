"""Holdover bands of simulated clocks against what the clocks then did.

Each clock is fitted by `al.timing` on a record that ends before a held-out segment. Prints how often the 95 % band after
each time holds the phase, for each kind of clock and in all.

    python benches/claims/holdover.py [--clocks 300] [--samples 1200]
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np

import allanite as al

#: 10 s apart; each time after the last sample in s.
RATE, AFTER = 0.1, (600.0, 3600.0, 10800.0)
#: A counter and a rubidium clock, a cesium clock, two crystals, a maser; with a frequency offset and a drift of some.
CLOCKS = {
    "white PM + white FM": ("Q(Q=1e-9)+N(N=2e-11)", 0.0),
    "white FM": ("N(N=1e-11)", 0.0),
    "white FM + flicker FM": ("N(N=1e-11)+B(B=1e-12)", 0.0),
    "white PM + random-walk FM": ("Q(Q=1e-9)+K(K=3e-14)", 0.0),
    "flicker PM + flicker FM": ("F(F=1e-9)+B(B=3e-12)", 0.0),
    "white FM + drift": ("N(N=1e-11)", 3e-15),
}


def one(name, seed, samples):
    """True for each time at which the holdover band contains the measured phase."""
    model, drift = CLOCKS[name]
    ahead = round(max(AFTER) * RATE)
    n = samples + ahead
    clock = al.parse_model(model).simulate(n=n, rate=RATE, seed=seed, unit="1", axis=3)
    t = np.arange(n + 1) / RATE
    phase = np.concatenate([[0.0], np.cumsum(clock.samples)]) / RATE
    phase += 1e-10 * t + 0.5 * drift * t**2
    log = al.Recording(phase[:samples], rate=RATE, quantity="angle")
    found = al.timing(log, after=AFTER)
    truth = [phase[samples - 1 + round(after * RATE)] for after in AFTER]
    return [h.low <= x <= h.high for h, x in zip(found.holdover, truth, strict=True)]


def study(clocks, samples, first=0):
    """Name → shares that the bands hold, shape (times,)."""
    each = max(1, clocks // len(CLOCKS))
    return {
        name: np.mean([one(name, seed, samples) for seed in range(first, first + each)], axis=0)
        for name in CLOCKS
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clocks", type=int, default=300)
    parser.add_argument("--samples", type=int, default=1200)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    began = process_time()
    found = study(given.clocks, given.samples, given.first)
    for name, shares in found.items():
        print(f"{name}: {' '.join(f'{100 * s:.1f} %' for s in shares)}")
    mean = np.mean(list(found.values()), axis=0)
    print(f"all: {' '.join(f'{100 * s:.1f} %' for s in mean)} after {AFTER} s")
    print(f"{100 * mean.mean():.2f} % of all; {process_time() - began:.0f} s of CPU time")


if __name__ == "__main__":
    main()
