"""Claim: 95 % holdover bands of simulated clocks contain the phase that followed.

Each clock is fitted by `al.timing` on a record that ends before a held-out segment. Prints the share of bands that
contain the phase after each time, and the mean ratio of their widths to those under the true noise, for each kind of clock
and for all. A hidden noise or drift is as strong as the others only at the end of the record. The share of bands of the
same records under the true noise shows how far the shares of so few records scatter.

    python benches/claims/holdover.py [--clocks 300] [--samples 1200] [--results FILE]

The file of results gets one JSON line per clock; a repeated run continues it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from time import process_time

import numpy as np
from results_file import Results

import allanite as al
from allanite.clocks.noise import thinned_indices
from allanite.fit.stamped.likelihood import StampedSeries
from allanite.fit.stamped.noise import integrated_noise, sum_of_noises

#: Rate in Hz; times after the last sample in s.
RATE, AFTER = 0.1, (600.0, 3600.0, 10800.0)
#: Name of each clock → model of its frequency noise and its drift.
CLOCKS = {
    "white PM + white FM": ("Q(Q=1e-9)+N(N=2e-11)", 0.0),
    "white FM": ("N(N=1e-11)", 0.0),
    "white FM + flicker FM": ("N(N=1e-11)+B(B=1e-12)", 0.0),
    "white PM + random-walk FM": ("Q(Q=1e-9)+K(K=3e-14)", 0.0),
    "flicker PM + flicker FM": ("F(F=1e-9)+B(B=3e-12)", 0.0),
    "white FM + drift": ("N(N=1e-11)", 3e-15),
    "white PM, hidden white FM": ("Q(Q=1e-9)+N(N=1.5e-11)", 0.0),
    "white FM, hidden flicker FM": ("N(N=1e-11)+B(B=3e-13)", 0.0),
    "white FM, hidden random-walk FM": ("N(N=1e-11)+K(K=1e-14)", 0.0),
    "white FM, hidden drift": ("N(N=1e-11)", 7e-17),
    "white FM + flicker FM, hidden drift": ("N(N=1e-11)+B(B=1e-12)", 1e-16),
    "white FM + drift, hidden random-walk FM": ("N(N=1e-11)+K(K=1e-14)", 3e-15),
}


def simulated(name, seed, samples):
    """Return the phase of a clock, shape (samples,), and the phase after each time."""
    model, drift = CLOCKS[name]
    n = samples + round(max(AFTER) * RATE)
    # One axis for each kind: records of one seed and one axis share their random numbers.
    axis = list(CLOCKS).index(name)
    clock = al.parse_model(model).simulate(n=n, rate=RATE, seed=seed, unit="1", axis=axis)
    t = np.arange(n + 1) / RATE
    phase = np.concatenate([[0.0], np.cumsum(clock.samples)]) / RATE
    phase += 1e-10 * t + 0.5 * drift * t**2
    return phase[:samples], phase[[samples - 1 + round(after * RATE) for after in AFTER]]


def one(name, seed, samples):
    """Return for each time whether the holdover band contains the phase, and the width of the band."""
    phase, truth = simulated(name, seed, samples)
    found = al.timing(al.Recording(phase, rate=RATE, quantity="angle"), after=AFTER)
    bands = zip(found.holdover, truth, strict=True)
    return [(float(h.low <= x <= h.high), h.high - h.low) for h, x in bands]


def with_true_noise(name, seed, samples):
    """Return for each time whether the 95 % band under the true noise contains the phase, and the width of the band."""
    model, drift = CLOCKS[name]
    phase, truth = simulated(name, seed, samples)
    noise = sum_of_noises(
        [
            integrated_noise(term, RATE, samples).scaled(getattr(effect, effect.coefficient) ** 2)
            for effect in al.parse_model(model).stochastic
            for term in effect.unit_terms(RATE)
        ]
    )
    rows = thinned_indices(samples)
    powers = (0, 1, 2) if drift else (0, 1)
    at, ahead = (rows - (samples - 1)) / RATE, np.array(AFTER)
    series = StampedSeries(at, phase[rows], np.array([at**p for p in powers]))
    _, mean, variance = series.predicted(noise, ahead, np.array([ahead**p for p in powers]))
    half = 1.959964 * np.sqrt(variance)
    return np.transpose([np.abs(truth - mean) <= half, 2.0 * half]).tolist()


def study(clocks, samples, first=0, results=None, kinds=tuple(CLOCKS)):
    """Return name → 1 for bands that contain the phase and 0 for others, and widths, shape (clocks, times, 2)."""
    each = max(1, clocks // len(kinds))
    results = results or Results()
    # All kinds of clocks by turns: an interrupted study has the same number of each.
    held = {
        (name, seed): results.of(f"{name} {seed}", lambda n=name, s=seed: one(n, s, samples))
        for seed in range(first, first + each)
        for name in kinds
    }
    return {
        name: np.array([row for (own, _), row in held.items() if own == name]) for name in kinds
    }


def main():
    """Print coverage and widths of the bands of each clock and of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clocks", type=int, default=300, help="clocks in all")
    parser.add_argument("--samples", type=int, default=1200, help="samples of the fitted record")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--results", type=Path, help="file with one JSON line per clock")
    given = parser.parse_args()
    began = process_time()
    results = Results(given.results, f"{given.samples} samples")
    found = study(given.clocks, given.samples, given.first, results)
    shares, known_shares, ratios = [], [], []
    for name, rows in found.items():
        seeds = range(given.first, given.first + len(rows))
        known = np.array([with_true_noise(name, seed, given.samples) for seed in seeds])
        shares.append(rows[..., 0].mean(axis=0))
        known_shares.append(known[..., 0].mean(axis=0))
        ratios.append(np.exp(np.log(rows[..., 1] / known[..., 1]).mean(axis=0)))
        print(f"{name}: {_line(shares[-1], ratios[-1], known_shares[-1])}")
    mean = np.mean(shares, axis=0)
    print(
        f"all: {_line(mean, np.mean(ratios, axis=0), np.mean(known_shares, axis=0))}, after {AFTER} s"
    )
    print(f"{100 * mean.mean():.2f} % of all; {process_time() - began:.0f} s of CPU time")


def _line(shares, ratios, known):
    """Return a line of text: shares of the bands, ratio of their widths, and shares under the true noise."""
    percent, true = (" ".join(f"{100 * s:.1f} %" for s in some) for some in (shares, known))
    return f"{percent}; widths × {' '.join(f'{r:.2f}' for r in ratios)}; true noise {true}"


if __name__ == "__main__":
    main()
