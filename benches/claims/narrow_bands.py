"""Claim: a resonance narrower than a bin is found as one, and its intervals contain the truth.

Records of an hour at 50 Hz of N+B+K and a resonance at 2 to 20 Hz with 3 to 100 ordinates between its half-power points
and 30 times the power of the white noise there, complete or with missing samples. The samples come from
tests/python/generators.py.

    python benches/claims/narrow_bands.py [--seeds 40] [--missing random]
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

RATE, LENGTH = 50.0, 180_000
N, B, K = 0.0126, 0.002, 9.07e-5
START = {"angle_random_walk", "bias_instability", "rate_random_walk"}
#: Ratio of the power of the resonance to that of the noise in its band.
ABOVE = 30.0


#: Missing samples: none, one, 5 % at random, 5 % in blocks of 3 s (150 samples), a tenth in one gap.
MISSING = ("nothing", "one", "random", "blocks", "tenth")


def lost(missing, rng):
    """Return the mask of missing samples, shape (LENGTH,)."""
    k, block = np.arange(LENGTH), 150
    if missing == "random":
        return rng.random(LENGTH) < 0.05
    if missing == "blocks":
        blocks = LENGTH // block
        return np.isin(k // block, rng.choice(blocks, blocks // 20, replace=False))
    length = {"nothing": 0, "one": 1, "tenth": LENGTH // 10}[missing]
    return (k >= LENGTH // 3) & (k < LENGTH // 3 + length)


def one(seed, missing):
    """Return the width in ordinates, the study, and the true values by key."""
    rng = np.random.default_rng(seed)
    wide = float(np.exp(rng.uniform(np.log(3.0), np.log(100.0))))
    frequency = float(rng.uniform(2.0, 20.0))
    half = 0.5 * wide * RATE / (2.0 * LENGTH)
    rms = N * float(np.sqrt(wide * RATE * ABOVE / LENGTH))
    x = g.white(rng, LENGTH, RATE, N)
    x += g.flicker(rng, LENGTH, RATE, B) + g.walk(rng, LENGTH, RATE, K)
    x += g.resonance(rng, LENGTH, RATE, frequency, half / frequency, rms)
    x[lost(missing, rng)] = np.nan
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N+B+K")
    truth = {"RES.frequency": frequency, "RES.damping": half / frequency, "RES.rms": rms, "N.N": N}
    return wide, study, truth


def main():
    """Print how often the resonance alone is added, and how often each interval contains the truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=40, help="number of records")
    parser.add_argument("--missing", choices=MISSING, default="nothing", help="missing samples")
    asked = parser.parse_args()
    found, inside = Counter(), Counter()
    for seed in range(asked.seeds):
        wide, study, truth = one(seed, asked.missing)
        added = [e.kind for e in study.fit.model if e.kind not in START]
        right = added == ["resonance"] and study.adequate
        found["right" if right else "other"] += 1
        if not right:
            what = f"{study.fit.model}, {study.stopped_because}"
            print(f"   seed {seed}, {wide:.0f} ordinates: {what}", flush=True)
            continue
        for name, value in truth.items():
            low, high = study.fit[name].interval
            inside[name] += low <= value <= high
    held = ", ".join(f"{name} {count}" for name, count in inside.items())
    print(
        f"{found['right']} of {asked.seeds} end adequate with one resonance; of these inside their intervals: {held}"
    )


if __name__ == "__main__":
    main()
