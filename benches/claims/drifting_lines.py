"""Claim: a line whose frequency drifts, hidden in N+B+K, is the only effect that is added.

The frequency drifts from 12.3 Hz to another one within 900 s at 100 Hz; the phase is summed sample by sample.

    python benches/claims/drifting_lines.py [--seeds 2]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, LENGTH = 100.0, 90_000
FIRST, LAST = 12.3, (11.8, 12.25, 12.35, 12.5)
AMPLITUDES = (0.006, 0.01, 0.014, 0.02)


def record(last, amplitude, seed):
    """Return a record of N+B+K and the drifting line."""
    rng = np.random.default_rng([seed, round(1e3 * last), round(1e4 * amplitude)])
    x = g.white(rng, LENGTH, RATE, 0.0126)
    x += g.flicker(rng, LENGTH, RATE, 0.002) + g.walk(rng, LENGTH, RATE, 9.07e-5)
    frequency = np.linspace(FIRST, last, LENGTH, endpoint=False)
    angle = 2.0 * np.pi * (np.cumsum(frequency) - frequency) / RATE
    x += amplitude * np.sin(angle + rng.uniform(0.0, 2.0 * np.pi))
    return al.Recording(x, rate=RATE, unit="rad/s")


def main() -> None:
    """Print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--seeds", type=int, default=2, help="records of each amplitude and final frequency"
    )
    asked = parser.parse_args()
    for amplitude in AMPLITUDES:
        only = nothing = 0
        for last in LAST:
            for seed in range(asked.seeds):
                study = al.improve(record(last, amplitude, seed), "N+B+K")
                added = [step.added.kind for step in study.ladder[1:]]
                only += added == ["drifting_line"]
                nothing += not added
                if added not in (["drifting_line"], []):
                    print(f"   {amplitude} rad/s to {last} Hz, seed {seed}: {study!r}", flush=True)
        count = len(LAST) * asked.seeds
        print(
            f"{1e3 * amplitude:g} mrad/s: the only step in {only} of {count}, nothing added in {nothing}",
            flush=True,
        )


if __name__ == "__main__":
    main()
