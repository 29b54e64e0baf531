"""Claim: rates of daily series with flicker noise have the scatter of the best estimate and valid intervals.

Each series has white and flicker noise, an annual term and 10 % missing days. It is fitted by `al.trend`, which selects and
fits the noise, and by least squares with the true noise. Prints the scatter of both errors around the true rate, their mean
standard errors, the ratios of these, the coverage of the 95 % interval, the selected noise models, and CPU time.

    python benches/claims/trends.py [--series 500] [--days 3000] [--mom FOLDER]

`--mom` also writes each series for other programs, 1 mm of white noise and 4.37 mm/yr^¼ of flicker noise.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np

import allanite as al
from allanite.effects.terms import Flicker, White
from allanite.fit.stamped.noise import sampled_noise, sum_of_noises

DAY = 86400.0
WHITE, FLICKER = 1.0, 1.0  # mm, standard deviation of a sample and of the summed deviates


def series(days, seed):
    """Return samples in mm, NaN where missing; the true rate is 0."""
    rng = np.random.default_rng([seed, 51])
    noise = al.parse_model(f"N(N={WHITE})+B(B={FLICKER})")
    x = noise.simulate(n=days, rate=1.0, seed=seed, axis=1).samples.copy()
    x += 3.0 * np.sin(2.0 * np.pi * np.arange(days) / 365.25 + 0.3)
    x[rng.random(days) < 0.1] = np.nan
    return x


def with_true_noise(found, days):
    """Return rate and standard error of least squares with the true noise and the same functions of time."""
    own = found._series
    terms = (White(WHITE**2), Flicker(FLICKER**2))
    noise = sum_of_noises([sampled_noise(term, 1.0 / DAY, days) for term in terms])
    best = own.regressed(noise)
    return best.amplitudes[1], np.sqrt(best.covariance[1, 1])


def study(count, days, folder=None, first=0):
    """Return rows (rate, error, covered, rate with the true noise, its error), noise models, and CPU seconds per series."""
    rows, names, used = [], Counter(), 0.0
    for seed in range(first, first + count):
        x = series(days, seed)
        if folder is not None:
            lines = [f"{50000 + k} {v:.6f}\n" for k, v in enumerate(x) if np.isfinite(v)]
            (folder / f"s{seed}.mom").write_text("# sampling period 1.0\n" + "".join(lines))
        began = process_time()
        found = al.trend(al.Recording(x, rate=1.0 / DAY), unit="mm")
        used += process_time() - began
        assert found.rate.interval is not None
        low, high = found.rate.interval
        names[found.noise.name] += 1
        rows.append(
            (found.rate, found.rate.std_error, low < 0.0 < high, *with_true_noise(found, days))
        )
    return np.array(rows, dtype=float), names, used / count


def main():
    """Print errors, standard errors, coverage and the noise models."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--series", type=int, default=500, help="number of series")
    parser.add_argument("--days", type=int, default=3000, help="days of a series")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--mom", type=Path, help="folder that gets each series as a .mom file")
    given = parser.parse_args()
    rows, names, seconds = study(given.series, given.days, given.mom, given.first)
    rate, error, covered, known, known_error = rows.T
    print(f"{given.series} series of {given.days} days, mm/year")
    ratio = np.sqrt((rate**2).mean() / (known**2).mean())
    print(f"error: {rate.std():.4f}; with the true noise {known.std():.4f}; ratio {ratio:.4f}")
    ratio = error.mean() / known_error.mean()
    stated = f"{error.mean():.4f}; with the true noise {known_error.mean():.4f}"
    print(f"sigma: {stated}; ratio {ratio:.4f}")
    print(
        f"covered: {100 * covered.mean():.1f} %; noise chosen: {dict(names)}; {seconds:.2f} s of CPU time a series"
    )


if __name__ == "__main__":
    main()
