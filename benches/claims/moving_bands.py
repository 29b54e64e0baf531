"""Claim: a vibration whose frequency drifts is the only effect added, and a constant one is never named drifting.

Narrow-band noise around a frequency that changes, made by modulating its phase; half an hour at 100 Hz.

    python benches/claims/moving_bands.py [--seeds 10] [--start N+B+K]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, LENGTH = 100.0, 180_000
TIME = np.arange(LENGTH) / RATE
PART = TIME / TIME[-1]
COURSES = {
    "warms up": lambda _: 20.0 + 2.5 * np.exp(-TIME / 400.0),
    "slowly up": lambda rng: 18.0 + rng.uniform(1.0, 3.0) * PART,
    "swings": lambda rng: 12.0 + np.sin(2.0 * np.pi * (1.5 * PART + rng.uniform())),
    "at a loss": lambda rng: (
        20.0 + np.interp(PART, np.linspace(0, 1, 30), np.cumsum(0.25 * rng.standard_normal(30)))
    ),
}
STAYS = ("alone", "beside another", "at times", "beside a louder hour")


def noise(rng, start):
    """Return the noise of the start model."""
    x = g.white(rng, LENGTH, RATE, 0.0126)
    if "B" in start:
        x += g.flicker(rng, LENGTH, RATE, 0.002)
    if "K" in start:
        x += g.walk(rng, LENGTH, RATE, 9.07e-5)
    return x


def moves(kind, seed, start):
    """Return samples with a vibration whose frequency drifts."""
    rng = np.random.default_rng([seed, list(COURSES).index(kind)])
    course = COURSES[kind](rng)
    half, rms = rng.uniform(0.1, 0.3), rng.uniform(0.03, 0.08)
    return noise(rng, start) + g.moving_band(rng, LENGTH, RATE, course, half, rms)


def stays(kind, seed, start):
    """Return samples with a vibration of constant frequency."""
    rng = np.random.default_rng([seed, 10 + STAYS.index(kind)])
    damping, rms = 10.0 ** rng.uniform(-2.5, -1.2), rng.uniform(0.03, 0.08)
    band = g.resonance(rng, LENGTH, RATE, 20.0, damping, rms)
    if kind == "at times":
        band *= (rng.uniform(300.0, 600.0) < TIME) & (rng.uniform(900.0, 1500.0) > TIME)
    x = noise(rng, start) + band
    if kind == "beside another":
        x += g.resonance(rng, LENGTH, RATE, 20.0 * rng.uniform(1.05, 1.3), damping, 0.5 * rms)
    if kind == "beside a louder hour":
        x = g.louder(x, RATE, 500.0, 900.0, 1.3)
    return x


def main() -> None:
    """Print how often a drifting vibration is added, for both kinds of records."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10, help="records of each kind")
    parser.add_argument("--start", default="N", help="model to start from")
    asked = parser.parse_args()
    begin = al.parse_model(asked.start)
    start = [e.kind for e in begin]
    for make, kinds in ((moves, COURSES), (stays, STAYS)):
        for kind in kinds:
            alone = named = adequate = 0
            for seed in range(asked.seeds):
                x = make(kind, seed, asked.start)
                study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), asked.start)
                kinds_now = [e.kind for e in study.fit.model]
                named += "drifting_resonance" in kinds_now
                added = [k for k in kinds_now if k not in start]
                alone += added == ["drifting_resonance"]
                adequate += study.adequate
                if make is moves and added != ["drifting_resonance"]:
                    print(f"   {kind}, seed {seed}: {study!r}", flush=True)
                if make is stays and "drifting_resonance" in added:
                    print(f"   {kind}, seed {seed}: {study!r}", flush=True)
            counts = f"alone {alone}, named {named}, adequate {adequate} of {asked.seeds}"
            print(f"{make.__name__}, {kind}: {counts}", flush=True)


if __name__ == "__main__":
    main()
