"""A band narrower than a bin: is it named as one, and do its intervals hold the truth?

Records of an hour at 50 Hz of N+B+K and a resonance of 3 to 100 ordinates between its half-power points, at 2 to 20 Hz,
with 30 times the power of the white noise there, whole or with samples missing. The samples come from
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
#: Power of the band over that of the noise in it.
ABOVE = 30.0


#: What is missing: nothing, one sample, 5 % of them, 5 % in blocks of 3 s (150 samples), a tenth in one piece.
MISSING = ("nothing", "one", "random", "blocks", "tenth")


def lost(missing, rng):
    """Which samples are missing, shape (LENGTH,)."""
    k, block = np.arange(LENGTH), 150
    if missing == "random":
        return rng.random(LENGTH) < 0.05
    if missing == "blocks":
        blocks = LENGTH // block
        return np.isin(k // block, rng.choice(blocks, blocks // 20, replace=False))
    length = {"nothing": 0, "one": 1, "tenth": LENGTH // 10}[missing]
    return (k >= LENGTH // 3) & (k < LENGTH // 3 + length)


def one(seed, missing):
    """The study, and the truth by name."""
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
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--missing", choices=MISSING, default="nothing")
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
        f"{found['right']} of {asked.seeds} end adequate as one band; of these inside their intervals: {held}"
    )


if __name__ == "__main__":
    main()
