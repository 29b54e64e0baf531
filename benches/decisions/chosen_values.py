"""Results with other values of constants that have no derivation.

    python benches/decisions/chosen_values.py [courses] [gates] [posterior]

courses: forms of a moving band; names of hidden bands that drift. gates: fine steps of a periodic noise level; coverage of
N. posterior: draws behind a holdover band; difference of its half-width at 3 h from that of ten times as many draws.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np

import allanite as al

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1] / "claims")]
import holdover
import records

BANDS = importlib.import_module("allanite.suggestion.screens.drifting_bands")
LEVELS = importlib.import_module("allanite.suggestion.screens.level_forms")
POSTERIOR = importlib.import_module("allanite.fit.stamped.posterior")


def courses():
    """Print how many of six drifting bands are named exactly."""
    kind = "drifting_resonance"
    start = records.HIDDEN[kind].start
    for name, value in (
        ("WIDTH_RATIOS", BANDS.WIDTH_RATIOS),
        ("WIDTH_RATIOS", (1.0,)),
        ("WIDTH_RATIOS", (1.0, 0.25)),
        ("STRAIGHT_PARTS", ()),
        ("STRAIGHT_PARTS", (1, 2)),
    ):
        kept = getattr(BANDS, name)
        setattr(BANDS, name, value)
        found = [al.improve(records.record(kind, seed), start).fit.model for seed in range(6)]
        setattr(BANDS, name, kept)
        exact = sum(sorted(m.name.split("+")) == sorted([*start.split("+"), "DRES"]) for m in found)
        print(f"{name} = {value}: {exact} of 6 exact", flush=True)


def gates():
    """Print the coverage and the bias of N where white noise is 1.5 times as loud for 37 % of a period."""
    n, rate, N = 20_000, 10.0, 0.01
    t = np.arange(n) / rate
    for steps in (1, 2, 8, 16):
        kept, LEVELS.FINE_PHASES = LEVELS.FINE_PHASES, steps
        covered, bias = 0, []
        for seed in range(12):
            white = N * np.sqrt(rate) * np.random.default_rng([seed, 3]).standard_normal(n)
            x = white * np.where((t / 37.3 + 0.21) % 1 < 0.37, 1.5, 1.0)
            own = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N").fit["N"]
            covered += own.interval[0] <= N <= own.interval[1]
            bias.append(own.value / N - 1.0)
        LEVELS.FINE_PHASES = kept
        error = np.std(bias) / np.sqrt(len(bias))
        print(
            f"FINE_PHASES = {steps}: N covered in {covered} of 12, bias {100 * np.mean(bias):.2f} ± {100 * error:.2f} %",
            flush=True,
        )


def half_widths():
    """Return the half-width of the band at the longest time for two clocks of each kind, shape (clocks,)."""
    widths = []
    for name in holdover.CLOCKS:
        for seed in range(2):
            phase, _ = holdover.simulated(name, seed, 600)
            found = al.timing(
                al.Recording(phase, rate=holdover.RATE, quantity="angle"), after=holdover.AFTER
            )
            last = found.holdover[-1]
            widths.append(0.5 * (last.high - last.low))
    return np.array(widths)


def posterior():
    """Print the rms and the largest relative difference of half-widths from those of ten times as many draws."""
    kept, POSTERIOR.POINTS = POSTERIOR.POINTS, (320, 960)
    exact = half_widths()
    POSTERIOR.POINTS = kept
    for name, value in (
        ("POINTS", kept),
        ("POINTS", (16, 48)),
        ("POINTS", (64, 192)),
        ("PROPOSAL_FREEDOM", 2.5),
        ("PROPOSAL_FREEDOM", 10.0),
        ("MAX_WIDTH_STEPS", 7),
        ("MAX_WIDTH_STEPS", 28),
    ):
        kept = getattr(POSTERIOR, name)
        setattr(POSTERIOR, name, value)
        away = np.abs(half_widths() / exact - 1.0)
        setattr(POSTERIOR, name, kept)
        rms = float(np.sqrt(np.mean(away**2)))
        print(
            f"{name} = {value}: {100 * rms:.1f} % rms, {100 * away.max():.1f} % at most", flush=True
        )


if __name__ == "__main__":
    for part in sys.argv[1:] or ("courses", "gates", "posterior"):
        {"courses": courses, "gates": gates, "posterior": posterior}[part]()
