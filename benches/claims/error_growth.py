"""Claim: ±1.96 times the predicted error growth contains the error, if the record shows all effects of the sensor.

A gyroscope of white noise and at most one slow effect is recorded for 600 s, modeled by `al.improve`, and integrated from
there on. Prints the share of errors within ±1.96 times `al.error_growth` after each time. A hidden effect is as strong as
the white noise only at the end of the record. `al.error_growth` counts the effects of the model, not those overlooked.

    python benches/claims/error_growth.py [--records 60]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import allanite as al

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))
import generators as g

#: Length of the record and times since the fix, s, at 1 Hz; white noise, rad/√s.
LENGTH, AFTER, N = 600, (60, 360, 600), 0.01
#: Name of each sensor → its slow effect.
SENSORS = {
    "white noise": lambda _, n: np.zeros(n),
    "hidden flicker": lambda rng, n: g.flicker(rng, n, 1.0, 1.07e-3),
    "hidden random walk": lambda rng, n: g.walk(rng, n, 1.0, 4e-5),
    "stronger random walk": lambda rng, n: g.walk(rng, n, 1.0, 8.7e-5),
    # 2.5 standard errors of the ramp in white noise.
    "hidden ramp": lambda _, n: g.ramp(n, 1.0, 2.5 * N * np.sqrt(12.0 / LENGTH**3)),
}


def one(name, seed):
    """Return for each time whether the error is within ±1.96 of the predicted standard deviation."""
    rng = np.random.default_rng([seed, *name.encode()])
    n = LENGTH + max(AFTER)
    samples = g.white(rng, n, 1.0, N) + SENSORS[name](rng, n)
    known, ahead = samples[:LENGTH], samples[LENGTH:]
    fit = al.improve(al.Recording(known, rate=1.0, unit="rad/s"), "N").fit
    angle = al.error_growth(fit, aided=float(LENGTH), tau=AFTER)[0]
    errors = np.cumsum(ahead - known.mean())[np.array(AFTER) - 1]
    return np.abs(errors) <= 1.96 * angle.total


def main():
    """Print the share of errors within ±1.96 standard deviations for each sensor."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=60, help="records of each sensor")
    given = parser.parse_args()
    for name in SENSORS:
        shares = np.mean([one(name, seed) for seed in range(given.records)], axis=0)
        print(f"{name}: {' '.join(f'{100 * s:.0f} %' for s in shares)} after {AFTER} s", flush=True)


if __name__ == "__main__":
    main()
