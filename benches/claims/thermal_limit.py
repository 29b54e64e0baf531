"""Claim: how much of the slow Allan deviation of a real sensor any thermal law can remove.

For each axis, prints the Allan deviation after correction over that before: with the law of `al.thermal`, and with the
functions of temperature that make the deviations smallest. These are fitted to the deviations themselves, so no law of
these functions leaves less. The functions are the powers 1 to 3 of the temperature, alone, with its rate of change, and of
the temperature behind six lags (0 to 10 000 s). The last column of a law is the ratio of the root mean squares over all
averaging times above 1000 s.

    python benches/claims/thermal_limit.py FOLDER

FOLDER holds cats_thermal_a.npz and cats_thermal_b.npz (see examples/thermal_calibration.py).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

import allanite as al

AXES = ("gyro_x", "gyro_y", "acc_y", "acc_z")
#: Averaging times in samples of 1 s; differences are taken at every eighth of them.
FACTORS = (1024, 2048, 4096, 8192)
LAGS = (0, 60, 300, 1000, 3000, 10000)


def lagged(temperature, lag):
    """Return the temperature behind a first-order lag in samples."""
    if lag == 0:
        return temperature
    a = np.exp(-1.0 / lag)
    return lfilter([1.0 - a], [1.0, -a], temperature, zi=[a * temperature[0]])[0]


def functions(temperature, kind):
    """Return functions of the temperature, shape (k, n)."""
    lags = LAGS if kind == "six lags" else (0,)
    found = [((lagged(temperature, lag) - 11.0) / 6.0) ** p for lag in lags for p in (1, 2, 3)]
    if kind == "rate":
        found.append(np.gradient(lagged(temperature, 60)))
    return np.array(found)


def differences(x, m):
    """Return differences of adjacent averages over m samples, shape (…, k)."""
    total = np.cumsum(np.insert(x, 0, 0.0, axis=-1), axis=-1)
    means = (total[..., m:] - total[..., :-m]) / m
    return (means[..., m:] - means[..., :-m])[..., :: m // 8]


def lowest(samples, temperatures, kind):
    """Return the smallest possible ratio at each averaging time for several logs with one law, shape (len(FACTORS),)."""
    out = []
    for m in FACTORS:
        pairs = [
            (differences(x, m), differences(functions(t, kind), m))
            for x, t in zip(samples, temperatures, strict=True)
        ]
        y = np.concatenate([a for a, _ in pairs])
        design = np.hstack([b for _, b in pairs]).T
        left = y - design @ np.linalg.lstsq(design, y, rcond=1e-10)[0]
        out.append(np.sqrt(np.sum(left**2) / np.sum(y**2)))
    return np.array(out)


def main():
    """Print the ratios of both logs together and of each."""
    folder = Path(sys.argv[1])
    logs = {name: al.read(folder / f"cats_thermal_{name}.npz")[list(AXES)] for name in "ab"}
    for names in ("ab", "a", "b"):
        some = [logs[name] for name in names]
        found = al.thermal(some)
        for axis in AXES:
            remainder = found[axis].remainder
            places = [int(np.argmin(np.abs(remainder.tau - m))) for m in FACTORS]
            slow = remainder.tau > 1000.0
            after, before = remainder.after[slow], remainder.before[slow]
            total = np.linalg.norm(after) / np.linalg.norm(before)
            rows = {found[axis].form.name: [*(remainder.after / remainder.before)[places], total]}
            samples = [np.asarray(log.column(axis).samples, float) for log in some]
            heat = [np.asarray(log.covariates["temperature"], float) for log in some]
            for kind in ("powers", "rate", "six lags"):
                rows[f"lowest, {kind}"] = lowest(samples, heat, kind)
            for name, values in rows.items():
                print(
                    f"{names:3}{axis:8}{name:30}" + " ".join(f"{v:.2f}" for v in values), flush=True
                )
    print(f"at tau = {', '.join(f'{m} s' for m in FACTORS)}")


if __name__ == "__main__":
    main()
