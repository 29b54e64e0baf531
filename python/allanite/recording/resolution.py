"""Resolution: the step (LSB) of which samples are multiples."""

from __future__ import annotations

import numpy as np

from allanite.common.arrays import Array

#: Minimum number of visits to the rarer of two values that are noise rather than an accident. Chosen by judgment; not
#: measured.
MIN_FLIPS = 5


def step_of(values: Array, single: bool) -> float:
    """Step (LSB) of which all differences between the values are multiples; 0 without such a step.

    0 also if over half of the values, or fewer than 3 of them, are distinct. `single` means single precision.
    """
    levels = np.unique(values)
    if levels.size < 2 or levels.size > 0.5 * values.size:
        return 0.0
    noise = _storage_error(levels, single)
    levels = _distinct_levels(levels, noise) - levels[0]
    if levels.size < 3:
        return 0.0
    smallest = float(np.diff(levels).min())
    for step in (smallest, smallest / 2, smallest / 3):
        counts = np.rint(levels / step)
        step = float(levels @ counts / (counts @ counts))
        if np.all(np.abs(levels - counts * step) < 0.02 * step + 4 * noise) and step > 8 * noise:
            return step
    return 0.0


def _storage_error(levels: Array, single: bool) -> float:
    """Rounding error of the stored values, in their unit; `single` is True for single precision."""
    return (2.0**-23 if single else 2.0**-48) * float(np.abs(levels).max())


def _distinct_levels(levels: Array, noise: float) -> Array:
    """The ascending `levels` that are more than 4 `noise` above the previous level, even if that one is removed."""
    return levels[np.concatenate(([True], np.diff(levels) > 4 * noise))]


def is_fill(value: float, step: float) -> bool:
    """True if a value often marks lost samples: 0, or a whole number v with |v| ≥ 99 and |v| < 2 `step`.

    `step` is the distance of the value from the most frequent value.
    """
    size = abs(value)
    return size == 0.0 or (size >= 99.0 and size.is_integer() and step > 0.5 * size)


def two_codes(spread: Array, single: bool) -> float:
    """Distance of the two values between which samples flip; 0 for one value, or more than two.

    Also 0 if the samples visit the rarer value fewer than 5 times, or for more than 3 samples each in the median: a few
    wrong samples, or a status, are no noise. A rarer value that marks lost samples must make 5 % of the samples. `spread`
    are blocks of neighboring samples (blocks, length), and `single` means stored in single precision.
    """
    levels = np.unique(spread[np.isfinite(spread)])
    if levels.size < 2 or levels.size > 0.5 * spread.size:
        return 0.0
    levels = _distinct_levels(levels, _storage_error(levels, single))
    if levels.size != 2:
        return 0.0
    step = float(levels[1] - levels[0])
    if not np.isfinite(step):  # samples near the largest double
        return 0.0
    rare = spread > levels.mean()
    if rare.mean() > 0.5:
        rare = spread < levels.mean()
    value = float(spread[rare][0])
    # Noise flips often, for one or two samples; a status lasts.
    edges = np.diff(np.pad(rare.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    starts, ends = (np.argwhere(edges == sign)[:, 1] for sign in (1, -1))
    lengths = ends - starts
    few = lengths.size < MIN_FLIPS or (is_fill(value, step) and rare.mean() < 0.05)
    return 0.0 if few or float(np.median(lengths)) > 3 else step
