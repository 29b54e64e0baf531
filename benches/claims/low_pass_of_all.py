"""Claim: for N+B+K after a low-pass of the whole signal only the filter is added, and B is that before the filter.

Records of 1800 s at 100 Hz from tests/python/generators.py and Butterworth filters of SciPy, with B at three corner
frequencies of flicker and white noise. For comparison, B of a fit whose low-pass acts on the white noise alone.

    python benches/claims/low_pass_of_all.py [--seeds 3]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, LENGTH, SETTLED = 100.0, 180_000, 4000
N, K = 0.0126, 9.07e-5
#: Frequencies at which flicker and white noise have the same density, Hz.
CORNERS = (0.02, 0.1, 0.5)
#: Order and cutoff, Hz.
FILTERS = ((1, 20.0), (2, 20.0), (4, 30.0))


def record(seed: int, corner: float, order: int, cutoff: float) -> tuple[al.Recording, float]:
    """Return the filtered record in rad/s and its B."""
    rng, n, flicker = (
        np.random.default_rng(seed),
        LENGTH + SETTLED,
        N * np.sqrt(2.0 * np.pi * corner),
    )
    x = g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, flicker) + g.walk(rng, n, RATE, K)
    y = signal.lfilter(*signal.butter(order, cutoff, fs=RATE), x)[SETTLED:]
    return al.Recording(y, rate=RATE, unit="rad/s"), flicker


def holds(fit: al.Fit, truth: float) -> bool:
    """Return whether the interval of B contains the truth; False for a model without B."""
    found = [e for e in fit.model if e.kind == "bias_instability"]
    if not found:
        return False
    interval = fit["B"].interval
    assert interval is not None
    return interval[0] <= truth <= interval[1]


def main() -> None:
    """Print how often the filter alone is added and how often B is covered."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3, help="records of each corner and filter")
    seeds = range(parser.parse_args().seeds)
    for corner in CORNERS:
        alone = covered = white = 0
        for order, cutoff in FILTERS:
            for seed in seeds:
                recording, truth = record(seed, corner, order, cutoff)
                study = al.improve(recording, "N+B+K")
                exact = [e.short for e in study.fit.model] == [
                    "N",
                    "B",
                    "K",
                    "BW",
                ] and study.adequate
                alone += exact
                covered += holds(study.fit, truth)
                white += holds(al.fit_model(recording, "N+B+K+BW(acts_on=white)"), truth)
                if not exact:
                    print(f"   order {order}, {cutoff:g} Hz, seed {seed}: {study!r}", flush=True)
        total = len(FILTERS) * len(seeds)
        print(
            f"corner {corner:g} Hz: the filter alone, adequate, in {alone} of {total}; B covered in {covered}, "
            f"with a low-pass of the white part alone in {white}",
            flush=True,
        )


if __name__ == "__main__":
    main()
