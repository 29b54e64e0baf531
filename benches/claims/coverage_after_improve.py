"""Claim: 95 % intervals of the final model of a stepwise model building from N cover the truth.

    python benches/claims/coverage_after_improve.py [--records 500] [--samples 20000] [--only N+K]

Coverage is counted over the records whose final model has exactly the true kinds of effects; for the others the final
models are printed. The samples come from tests/python/generators.py, which does not use the package.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, N = 50.0, 0.0126
B, K, Q_C, TIME, CUTOFF = 0.008, 1e-3, 0.01, 4.0, 8.0


def filtered(rng, n):
    """Return white noise after a digital Butterworth filter of order 2."""
    b, a = signal.butter(2, CUTOFF / (RATE / 2.0))
    return signal.lfilter(b, a, g.white(rng, n + 4096, RATE, N))[4096:]


#: Name of each truth → its samples and the true values by parameter key.
TRUTHS = {
    "N+GM": (
        lambda rng, n: g.white(rng, n, RATE, N) + g.gauss_markov(rng, n, RATE, Q_C, TIME),
        {"N.N": N, "GM.q_c": Q_C, "GM.correlation_time": TIME},
    ),
    "N+K": (
        lambda rng, n: g.white(rng, n, RATE, N) + g.walk(rng, n, RATE, K),
        {"N.N": N, "K.K": K},
    ),
    "N+B": (
        lambda rng, n: g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, B),
        {"N.N": N, "B.B": B},
    ),
    "N+BW+B": (
        lambda rng, n: filtered(rng, n) + g.flicker(rng, n, RATE, B),
        {"N.N": N, "BW.cutoff": CUTOFF, "B.B": B},
    ),
}


def main() -> None:
    """Print the coverage of each parameter of each truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=500, help="records of each truth")
    parser.add_argument("--samples", type=int, default=20_000, help="samples of a record")
    parser.add_argument("--only", choices=TRUTHS, help="run this truth alone")
    asked = parser.parse_args()
    for name, (samples, values) in TRUTHS.items():
        if asked.only not in {None, name}:
            continue
        inside, ends = Counter(), Counter()
        for seed in range(asked.records):
            rng = np.random.default_rng([seed, 11])
            record = al.Recording(samples(rng, asked.samples), rate=RATE, unit="rad/s")
            fit = al.improve(record, "N").fit
            end = "+".join(sorted(fit.model.name.split("+")))
            ends[end] += 1
            if end != "+".join(sorted(name.split("+"))):
                continue
            for number, value in values.items():
                interval = fit[number].interval
                assert interval is not None
                inside[number] += interval[0] <= value <= interval[1]
        right = ends["+".join(sorted(name.split("+")))]
        print(
            f"{name}: {right} of {asked.records} searches end with it; all final models {dict(ends)}"
        )
        for number in values:
            share = inside[number] / max(right, 1)
            # Binomial standard error of a coverage of 95 %.
            print(
                f"   {number}: {100 * share:.1f} % ± {100 * np.sqrt(0.05 * 0.95 / max(right, 1)):.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
