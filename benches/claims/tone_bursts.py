"""Claim: a line that is present in a part of a record is found as a tone burst, and no other effect is named one.

Records of 20 minutes at 50 Hz of N+B+K and one more effect: a burst of 20 to 630 s with ΔlogL = 40, a resonance, a constant
line, a line with a random walk of its phase, or a line that decays. The samples come from tests/python/generators.py.

    python benches/claims/tone_bursts.py [--seeds 16]
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

RATE, LENGTH = 50.0, 60_000
DURATION = LENGTH / RATE
N, B, K = 0.0126, 0.002, 9e-5
WORTH = 40.0


def burst(rng, t):
    """Return a line within a random segment, with ΔlogL = A²·length/(4N²) = 40."""
    length = 10 ** rng.uniform(1.3, 2.8)
    start = rng.uniform(0.0, DURATION - length)
    size = np.sqrt(WORTH * 4.0 * N**2 / length)
    wave = size * np.sin(2.0 * np.pi * 10 ** rng.uniform(-0.5, 1.3) * t + rng.uniform(0.0, 6.0))
    return np.where((t >= start) & (t < start + length), wave, 0.0)


def resonance(rng, t):
    """Return a resonance with a damping of 0.003 to 0.1."""
    f, rms = 10 ** rng.uniform(-0.5, 1.3), 10 ** rng.uniform(-3.0, -1.7)
    return g.resonance(rng, t.size, RATE, f, 10 ** rng.uniform(-2.5, -1.0), rms)


def line(rng, t):
    """Return a line of constant amplitude."""
    f = 10 ** rng.uniform(-0.5, 1.3)
    return g.sinusoid(t.size, RATE, f, 0.004 * rng.uniform(1.0, 5.0))


def wander(rng, t):
    """Return a line whose phase is a random walk: a band of 1 to 100 mHz."""
    wide = np.sqrt(4.0 * np.pi * 10 ** rng.uniform(-3.0, -1.0) / RATE)
    phase = np.cumsum(rng.standard_normal(t.size)) * wide
    return 0.008 * np.sin(2.0 * np.pi * 10 ** rng.uniform(0.0, 1.3) * t + phase)


def decay(rng, t):
    """Return a line that decays by a factor e within a third to all of the record."""
    fade = np.exp(-t / (DURATION * rng.uniform(0.33, 1.0)))
    return 0.05 * fade * np.sin(2.0 * np.pi * 10 ** rng.uniform(0.0, 1.3) * t)


def main() -> None:
    """Print the effects of the final models for each kind of record."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=16, help="records of each kind")
    asked = parser.parse_args()
    t = np.arange(LENGTH) / RATE
    for made in (burst, resonance, line, wander, decay):
        ends: Counter[str] = Counter()
        adequate = 0
        for seed in range(asked.seeds):
            rng = np.random.default_rng([seed, 3])
            noise = g.white(rng, LENGTH, RATE, N) + g.flicker(rng, LENGTH, RATE, B)
            samples = noise + g.walk(rng, LENGTH, RATE, K) + made(rng, t)
            study = al.improve(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K")
            ends["+".join(e.short for e in study.fit.model if e.short not in "NBKR") or "-"] += 1
            adequate += study.adequate
        print(f"{made.__name__}: {adequate} of {asked.seeds} adequate; {dict(ends)}", flush=True)


if __name__ == "__main__":
    main()
