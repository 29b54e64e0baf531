"""Claim: a watch finds changes of normal samples at most 10 % later than one whose bets hold for normal samples only.

The bets of `al.Watch` hold for any distribution of the samples. For normal samples, the best bet on a change is the
likelihood ratio of the squared cosine ordinates, which are independent χ²₁. Both watches have the same alternatives and
shares of the capital, and take the same samples. A line gives the number of segments from the change to the alarm, and the
ratio of both means with its standard error, by resampling the pairs.

    python benches/claims/watch_normal.py [--runs 100] [--after 100] [--first 0]
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.fft import dct
from watch import CHANGES, MODEL, MOST, RATE

import allanite as al
from allanite.fit.likelihood.expected import density
from allanite.scale import bets as any_bets
from allanite.scale.watch import SEGMENT, SEGMENTS_IN_LONG, Watch

TOLERANCE = 0.01
#: Resamplings of the pairs for the standard error of a ratio.
RESAMPLINGS = 1000


class NormalBets(any_bets.Bets):
    """Bets that hold for normal samples only: likelihood ratios of the squared ordinates."""

    def __init__(self, model, rate, segment, tolerance, *, lines):
        super().__init__(model, rate, segment, tolerance, lines=lines)
        self._expected = density(
            model.terms(rate, (0.0, segment / rate)), np.arange(1, segment), segment
        )
        count = np.arange(segment, dtype=float)
        wide = any_bets._NOTHING[0] if lines else any_bets._broad_alternatives(self._edges)[0]

        def against(ratios):
            null = np.clip(ratios, (1.0 - tolerance) ** 2, (1.0 + tolerance) ** 2)
            return 0.5 * np.log(null / ratios), 0.5 * (1.0 / null - 1.0 / ratios)

        fixed, slope = against(wide.reshape(-1, self._edges.size - 1))
        self._wide_fixed, self._wide_slope = fixed @ np.diff(count[self._edges - 1]), slope.T
        fixed, self._narrow_slope = against(np.array(any_bets.LINE_RATIOS)[:, None])
        self._narrow_fixed = fixed * any_bets._line_sums(count)
        self._largest = np.full(self.weights.size, -np.inf)

    def take(self, samples):
        """Bet on the next segment."""
        self.segments += 1
        z = dct(samples, norm="ortho")[1:] ** 2 / self._expected
        total = np.cumulative_sum(z, include_initial=True)
        power = any_bets._line_sums(total)
        wide = np.diff(total[self._edges - 1]) @ self._wide_slope + self._wide_fixed
        gain = np.concatenate([wide, (power * self._narrow_slope + self._narrow_fixed).reshape(-1)])
        part = any_bets.capital_share(self.segments)
        self.kept -= part
        growth = np.exp(np.minimum(gain, any_bets.MAX_LOG_GAIN))
        self.stake = np.minimum(
            (self.stake + part * np.exp(self.weights)) * growth, any_bets.MAX_VALUE
        )
        self.capital = float(self.kept + self.stake.sum())


class NormalWatch(Watch):
    """A watch with bets for normal samples."""

    def __init__(self, model, rate):
        super().__init__(model, rate)
        self._bets = tuple(
            NormalBets(self.model, rate, SEGMENT * many, TOLERANCE, lines=many > 1)
            for many in (1, SEGMENTS_IN_LONG)
        )


def delay(watch, quiet, changed):
    """Return the number of segments from the change to the alarm; 0 if the alarm comes before the change."""
    if watch.update(quiet) is not None:
        return 0
    for place, segment in enumerate(changed, start=1):
        if watch.update(segment) is not None:
            return place
    return MOST


def delays(text, runs, after, first):
    """Return delays of the watch and of that for normal samples, shape (2, runs)."""
    usual, changed = al.parse_model(MODEL), al.parse_model(text)
    found = np.zeros((2, runs))
    for run in range(runs):
        quiet = usual.simulate(n=after * SEGMENT, rate=RATE, seed=451, axis=first + run).samples
        x = changed.simulate(n=MOST * SEGMENT, rate=RATE, seed=452, axis=first + run).samples
        parts = x.reshape(MOST, SEGMENT)
        watches = Watch(usual, RATE), NormalWatch(usual, RATE)
        found[:, run] = [delay(watch, quiet, parts) for watch in watches]
    return found[:, (found > 0).all(axis=0)]


def main():
    """Print the ratio of the delays for each change, and their geometric mean."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100, help="runs of each change")
    parser.add_argument("--after", type=int, default=100, help="segments before the change")
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first run, which is its seed"
    )
    asked = parser.parse_args()
    rng = np.random.default_rng(1)
    ratios, errors = [], []
    for name, text in CHANGES.items():
        found = delays(text, asked.runs, asked.after, asked.first)
        pairs = found[:, rng.integers(found.shape[1], size=(RESAMPLINGS, found.shape[1]))]
        resampled = pairs[0].mean(axis=1) / pairs[1].mean(axis=1)
        ours, normal = found.mean(axis=1)
        ratios.append(ours / normal)
        errors.append(resampled.std() / ratios[-1])
        print(
            f"{name}: {ours:.2f} and {normal:.2f} segments: × {ratios[-1]:.3f} ± {resampled.std():.3f};"
            f" {found.shape[1]} pairs, {int((found == MOST).sum())} not in {MOST}",
            flush=True,
        )
    mean = np.exp(np.mean(np.log(ratios)))
    error = mean * np.sqrt(np.square(errors).sum()) / len(errors)
    print(f"geometric mean: × {mean:.3f} ± {error:.3f}")


if __name__ == "__main__":
    main()
