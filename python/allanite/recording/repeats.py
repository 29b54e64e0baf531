"""Repeated samples: stuck values, and sensors that are read faster than they measure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.recording.distorted import dead_band_of

#: Samples compared at a time, to limit memory.
PART_SAMPLES = 1 << 20
#: Minimum share of repeats, beyond those by chance, that is polling. A sensor of 98 Hz read at 100 Hz changes N by 1 %.
MIN_SHARE = 0.02
#: Maximum share of samples that equal an earlier one by chance, for taking all equal neighbors as repeats. Then the rate
#: and the white variance change by 0.5 % at most.
MAX_CHANCE = 0.005
#: Lags, in samples, at which samples are equal by chance alone: longer than any hold that is recognized.
CHANCE_LAGS = (53, 101, 211)
#: Windows in which repeats are counted. A sensor that is polled repeats in all of them, a lost link in few.
WINDOWS = 64
#: Maximum ratio of the count of repeats in a window to the mean of all windows, and of the mean to the minimum count. Even
#: random repeats, 50 or more in each of 64 windows, exceed it with a probability of only 1e-4.
MAX_RATIO = 2.0
#: Minimum number of repeats: 50 in each window distinguish a steady share from bursts.
MIN_COUNT = 50
#: Samples in which the rate of the sensor is searched, and samples of a block in which its phase is measured.
SEARCH_SAMPLES, PHASE_BLOCK = 1 << 18, 1 << 10
#: Minimum share of the expected repeats that equal the previous sample. Chance alone makes the share of CHANCE_LAGS,
#: which is below one half for any sensor that is not locked to one code.
MIN_MATCH = 0.95


@dataclass(frozen=True, slots=True)
class Polling:
    """How often samples repeat; `kept` is a mask, shape (n,), of the samples that are the first with their value."""

    kept: NDArray[np.bool_]

    @property
    def share(self) -> float:
        """Fraction (0 to 1) of the samples that repeat the previous sample."""
        return 1.0 - float(np.mean(self.kept))

    @property
    def ratio(self) -> float:
        """Rate of the sensor divided by the rate of the log; below 1."""
        return float(np.mean(self.kept))


def polling_of(rows: NDArray[np.floating | np.integer]) -> Polling | None:
    """`Polling` of samples, shape (n,) or (n, columns), if the sensor is slower than the log and its samples repeat.

    A row is a repeat if no column changes. Rows of a coarse sensor are equal by chance too; the repeats among them are
    found by the regular pattern that two steady rates make. None for fewer than 422 rows, fewer than 50 repeats or 2 %,
    repeats in few parts of the record, or a column with a dead band.
    """
    n = len(rows)
    if n < 2 * max(CHANCE_LAGS):
        return None
    equal = _equals_earlier(rows, 1)
    share = float(np.mean(equal))
    if share < MIN_SHARE or np.count_nonzero(equal) < MIN_COUNT:
        return None
    chance = max(float(np.mean(_equals_earlier(rows, lag))) for lag in CHANCE_LAGS)
    repeats = equal if chance < min(MAX_CHANCE, 0.25 * share) else _regular_repeats(equal, chance)
    if repeats is None:
        return None
    count = int(np.count_nonzero(repeats))
    if count < max(MIN_COUNT, MIN_SHARE * n):
        return None
    windows = min(WINDOWS, count // MIN_COUNT)
    edges = np.linspace(0, repeats.size, windows, endpoint=False).astype(np.int64)
    counts = np.add.reduceat(repeats.astype(np.int64), edges)
    mean = float(counts.mean())
    if counts.max() > MAX_RATIO * mean or MAX_RATIO * counts.min() < mean:
        return None
    # A log with a dead band writes a new value when it differs enough, not when the sensor has measured.
    if any(dead_band_of(column) is not None for column in rows.reshape(n, -1).T):
        return None
    return Polling(np.concatenate(([True], ~repeats)))


def _equals_earlier(rows: NDArray[np.floating | np.integer], lag: int) -> NDArray[np.bool_]:
    """Mask of shape (n − lag,): True if row lag + i equals row i in every column."""
    same = rows[lag:] == rows[:-lag]
    return np.asarray(same if same.ndim == 1 else same.all(axis=1))


def _regular_repeats(equal: NDArray[np.bool_], chance: float) -> NDArray[np.bool_] | None:
    """Mask of repeats in the regular pattern of a sensor slower than the log; None without a pattern.

    Entry k of `equal` is True if row k + 1 equals row k. Rows outside of the pattern are equal by chance, with the
    probability `chance`, at most 0.5. Sample k shows the sensor's value with the number floor(k r + φ), where r is the
    ratio of the rates. This makes a line at the frequency r in the spectrum of `equal`.
    """
    if chance > 0.5:
        return None
    some = equal[:SEARCH_SAMPLES].astype(np.float64)
    power = np.abs(np.fft.rfft(some - some.mean(), 4 * some.size)) ** 2
    frequency = float(np.argmax(power)) / (4 * some.size)
    best: NDArray[np.bool_] | None = None
    for ratio in {frequency, 1.0 - frequency}:
        if not 0.02 < ratio < 1.0 - MIN_SHARE:
            continue
        expected = _expected_repeats(equal, ratio)
        if not expected.any() or expected.all():
            continue
        matched, elsewhere = float(np.mean(equal[expected])), float(np.mean(equal[~expected]))
        if matched > MIN_MATCH and elsewhere < chance + 1.0 - MIN_MATCH:
            found = expected & equal
            if best is None or np.count_nonzero(found) > np.count_nonzero(best):
                best = found
    return best


def _expected_repeats(equal: NDArray[np.bool_], ratio: float) -> NDArray[np.bool_]:
    """Mask, shape of `equal`, of the repeats expected from a sensor whose rate is `ratio` times the rate of the log."""
    k = np.arange(1, equal.size + 1, dtype=np.float64)
    blocks = max(equal.size // PHASE_BLOCK, 1)
    edges = np.linspace(0, equal.size, blocks, endpoint=False).astype(np.int64)
    turned = (1.0 - equal) * np.exp(-2j * np.pi * ratio * k)
    angles = np.unwrap(np.angle(np.add.reduceat(turned, edges)))
    middles = 0.5 * (edges + np.append(edges[1:], equal.size))
    phase = (np.interp(k, middles, angles) + np.pi * ratio) / (2.0 * np.pi)
    new = (k * ratio + phase) % 1.0 < ratio
    return ~new


def longest_run(samples: NDArray[Any]) -> tuple[int, int, int]:
    """First index and length of the longest run of one value, and number of samples that equal the previous one.

    NaN equals nothing.
    """
    n, longest, start, run_start, equal = samples.size, 1, 0, 0, 0
    for at in range(0, n - 1, PART_SAMPLES):
        part = samples[at : at + PART_SAMPLES + 1]
        changes = np.flatnonzero(part[1:] != part[:-1])
        equal += part.size - 1 - changes.size
        if changes.size:
            ends = changes + at + 1
            runs = np.diff(ends, prepend=run_start)
            i = int(np.argmax(runs))
            if runs[i] > longest:
                longest, start = int(runs[i]), int(ends[i] - runs[i])
            run_start = int(ends[-1])
    if n - run_start > longest:
        longest, start = n - run_start, run_start
    return start, longest, equal


def share_of_repeats_followed(samples: Array, limit: int) -> float:
    """Fraction of the repeated samples whose next sample repeats them, too; 0 without repeats.

    Runs of `limit` or more equal samples are ignored. If each sample repeats at random, the fraction is the share of
    repeats among all samples; it is larger if values are held.
    """
    repeats = runs = 0
    for first in range(0, samples.size - 1, PART_SAMPLES):
        part = samples[first : first + PART_SAMPLES + 1]
        lengths = np.diff(np.flatnonzero(part[1:] != part[:-1]))
        short = lengths[(lengths > 1) & (lengths < limit)]
        repeats += int(short.sum()) - short.size
        runs += short.size
    return (repeats - runs) / repeats if repeats else 0.0
