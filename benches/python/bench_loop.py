"""Time of a fit, a check and a stepwise model building, relative to a Fourier transform of the same record.

    python benches/python/bench_loop.py [--samples 1000000 …]

Processor seconds of the whole process (all threads), also in multiples of a `numpy.fft.rfft` of the record.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE = 100.0
N, B, K = 0.0126, 0.002, 9.07e-5


def noise(n, rng):
    """Return samples of N+B+K."""
    return g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, B) + g.walk(rng, n, RATE, K)


def many(n, rng):
    """Return samples of N+B+K and seven more effects."""
    x = noise(n, rng)
    x += g.gauss_markov(rng, n, RATE, 5e-3, 20.0)
    x += g.resonance(rng, n, RATE, 31.0, 0.02, 0.03)
    x += g.resonance(rng, n, RATE, 7.0, 0.05, 0.03)
    x += g.sinusoid(n, RATE, 3.1, 0.004) + g.sinusoid(n, RATE, 12.7, 0.004)
    x += g.step(n, RATE, 0.4 * n / RATE, 0.08)
    return g.louder(x, RATE, 0.6 * n / RATE, 0.7 * n / RATE, 1.1)


def comb(n, rng):
    """Return samples of N+B+K and twelve lines that are no harmonics of each other."""
    x = noise(n, rng)
    for k in range(12):
        x += g.sinusoid(n, RATE, 1.37 + 3.79 * k, 0.003, 0.7 * k)
    return x


def spent(work):
    """Return the processor seconds of a call, and its result."""
    began = time.process_time()
    found = work()
    return time.process_time() - began, found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--samples", type=int, nargs="+", default=[1_000_000], help="lengths of the records"
    )
    asked = parser.parse_args()
    warm = al.Recording(noise(20_000, np.random.default_rng(0)), rate=RATE, unit="rad/s")
    al.improve(warm)
    print(f"{'samples':>10} {'work':34} {'CPU s':>8} {'in rfft':>8}")
    for n in asked.samples:
        rng = np.random.default_rng(1)
        record = al.Recording(many(n, rng), rate=RATE, unit="rad/s")
        lines = al.Recording(comb(n, rng), rate=RATE, unit="rad/s")
        transform, _ = spent(lambda record=record: np.fft.rfft(record.samples))
        fit_time, fit = spent(lambda record=record: al.fit_model(record, "N+B+K"))
        jobs = {
            "check": fit.check,
            "improve": lambda record=record: al.improve(record),
            "improve, 12 lines": lambda lines=lines: al.improve(lines, limit=12),
        }
        row(n, "fit N+B+K", fit_time, transform)
        for name, job in jobs.items():
            seconds, found = spent(job)
            steps = f", {len(found.ladder) - 1} steps" if hasattr(found, "ladder") else ""
            row(n, name + steps, seconds, transform)


def row(n: int, name: str, seconds: float, transform: float) -> None:
    """Print one line of the table."""
    print(f"{n:10d} {name:34} {seconds:8.2f} {seconds / transform:8.1f}", flush=True)


if __name__ == "__main__":
    main()
