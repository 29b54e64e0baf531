"""Claim: two Gauss–Markov processes in white noise, one ten times as slow as the other, are both found.

An hour at 50 Hz; the correlation time of the faster one is 0.1 to 5 s. Both have the same standard deviation: the one at
which `power` predicts a ΔlogL of `--worth` for either besides the other. The samples come from tests/python/generators.py,
which does not use the package.

    python benches/claims/two_lags.py [--seeds 50] [--worth 30]
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
from allanite.fit.rivals.evidence import evidence

RATE, LENGTH, N = 50.0, 180_000, 0.0126
APART = 10.0
#: A correlation time is right if it is within this factor of the true one.
RIGHT = 3.0


def lag(q_c, time):
    """Return a Gauss–Markov process as a model string."""
    return f"GM(q_c={q_c},correlation_time={time})"


def lags(sigma, time):
    """Return q_c of both processes."""
    return [sigma * float(np.sqrt(2.0 / t)) for t in (time, APART * time)]


def strength(time, worth):
    """Return the standard deviation at which either process has a ΔlogL of `worth` besides the other."""
    low, high = 1e-6, 10.0
    while high > 1.02 * low:
        middle = float(np.sqrt(low * high))
        both = [
            lag(q_c, t) for q_c, t in zip(lags(middle, time), (time, APART * time), strict=True)
        ]
        found = min(
            al.detection_power(
                f"N(N={N})+{one}", other, duration=LENGTH / RATE, rate=RATE
            ).delta_log_likelihood
            or 0.0
            for one, other in (both, both[::-1])
        )
        low, high = (middle, high) if found < worth else (low, middle)
    return high


def one(seed, worth):
    """Return the study of a record, the true model and the true correlation times."""
    rng = np.random.default_rng([seed, 3])
    fast = float(np.exp(rng.uniform(np.log(0.1), np.log(5.0))))
    times, sizes = (fast, APART * fast), lags(strength(fast, worth), fast)
    x = g.white(rng, LENGTH, RATE, N)
    for size, time in zip(sizes, times, strict=True):
        x += g.gauss_markov(rng, LENGTH, RATE, size, time)
    truth = "+".join([f"N(N={N})", *map(lag, sizes, times)])
    return al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N"), truth, times


def main() -> None:
    """Print how many records are separated, and the final models."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=50, help="number of records")
    parser.add_argument("--worth", type=float, default=30.0, help="ΔlogL of either process")
    asked = parser.parse_args()
    ends: Counter[str] = Counter()
    separated = untold = 0
    for seed in range(asked.seeds):
        study, truth, times = one(seed, asked.worth)
        lags = [e for e in study.fit.model if e.kind == "gauss_markov"]
        found = sorted(e.values["correlation_time"] for e in lags)
        right = len(found) == 2 and all(
            1 / RIGHT < a / b < RIGHT for a, b in zip(found, times, strict=True)
        )
        separated += right
        ends[study.fit.model.name] += 1
        if not right:
            ahead = evidence(al.fit_model(study.recording, truth).solution)
            ahead -= evidence(study.fit.solution)
            untold += ahead < 0.0
            print(f"   seed {seed}: {truth} → {study.fit.model}, evidence {ahead:+.1f}", flush=True)
    print(
        f"{separated} of {asked.seeds} separated; of the others {untold} where the record has more evidence for what was"
        f" found; {dict(ends)}"
    )


if __name__ == "__main__":
    main()
