"""The p-value of a rise of logL, with the number of effects and frequencies searched counted.

A candidate with one coefficient on the edge of its range raises logL by x with probability Φ(−√2x) when it is not there
(half-χ², Self & Liang 1987). Along a grid of shapes the whitened directions turn by an angle L in all, and Davies (1977,
Biometrika 64) bounds the chance of any reaching x by Φ(−√2x) + L/2π e^{−x}. A line of any frequency reaches x with
W √x e^{−x}, W = T f_max √(4π/12)… (Baluev 2008, MNRAS 385). Intervals of time of about one length share what they are
tried for, so that long ones do not pay for how many short ones there are (`interval_trials`). Families share the 1 % of
a check equally.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    LEVEL_CELLS,
    MAX_REFIT_GAIN_RATIO,
    MIN_SEARCH_FAMILIES,
)
from allanite.suggestion.known_frequencies import known_bands

__all__ = [
    "Family",
    "arc_length",
    "best_interval",
    "interval_trials",
    "line_trials",
    "log_chance",
    "may_show",
    "refine",
    "trials_at",
    "two_levels",
]


@dataclass(frozen=True, slots=True)
class Family:
    """What was tried together.

    Attributes
    ----------
    name : str
    arcs : tuple of float
        For each kind tried, the angle its direction turns along its grid (0: a single direction).
    sides : int
        1 for coefficients that cannot be negative, 2 for amplitudes of either sign.
    width : float
        W of a search over all frequencies; 0 for the others.
    """

    name: str
    arcs: tuple[float, ...] = ()
    sides: int = 1
    width: float = 0.0


def log_chance(family: Family, x: float) -> float:
    """Ln of the chance that anything in the family reaches a rise of logL of x on a record without it."""
    from scipy.special import log_ndtr

    if x <= 0.0:
        return 0.0
    if family.width > 0.0:
        return float(min(0.0, np.log(family.width) + 0.5 * np.log(x) - x))
    single = float(log_ndtr(-np.sqrt(2.0 * x)))
    total = -np.inf
    for arc in family.arcs:
        total = np.logaddexp(total, single)
        if arc > 0.0:
            total = np.logaddexp(total, np.log(arc / (2.0 * np.pi)) - x)
    return float(min(0.0, total + np.log(family.sides)))


def may_show(family: Family, promised: float) -> bool:
    """Whether a rise of logL that a search promises could be significant once it is refitted.

    Of what has ordinates of its own: a slow function may gain more, for the noise about it was estimated with it.
    """
    return log_chance(family, MAX_REFIT_GAIN_RATIO * promised) < np.log(
        FALSE_ALARM_PROBABILITY / MIN_SEARCH_FAMILIES
    )


def arc_length(directions: NDArray[np.float64]) -> float:
    """Total angle between successive rows of unit vectors, shape (points, dimension)."""
    if directions.shape[0] < 2:
        return 0.0
    cosine = np.clip(np.einsum("ij,ij->i", directions[1:], directions[:-1]), -1.0, 1.0)
    return float(np.arccos(cosine).sum())


def line_trials(n: int) -> float:
    """W of Baluev's false-alarm formula for a search of n evenly spaced samples to the Nyquist frequency."""
    return 0.5 * n * float(np.sqrt(np.pi / 3.0))


def trials_at(cycles: NDArray[np.float64], n: int, rate: float) -> NDArray[np.float64]:
    """W of a search for a line of so many cycles in n samples at `rate` Hz, over its share of the chance.

    Baluev's W is proportional to the range of frequencies searched. Octaves from one cycle to n/2 share one part of the
    chance equally, so that a slow line does not pay for all the fast ones. All frequencies share a second part, so that a
    fast one hardly pays for that. Frequencies that are known beforehand share a third part, where the record has some.
    """
    whole = line_trials(n)
    octaves = max(1.0, np.log2(n / 2.0))
    place = np.floor(np.log2(np.maximum(cycles, 1.0)))
    of_octave = 0.5 * n / (octaves * np.minimum(2.0**place, 0.25 * n))
    bands = known_bands(n, rate)
    widths = np.maximum(whole * (bands[:, 1] - bands[:, 0]) / (0.5 * rate), 1.0)
    frequency = np.asarray(cycles)[..., None] * rate / n
    known = ((bands[:, 0] <= frequency) & (frequency <= bands[:, 1])).any(axis=-1)
    of_known = known * whole / max(float(widths.sum()), 1.0)
    shares = 3.0 if bands.size else 2.0
    return np.asarray(shares * whole / (1.0 + of_octave + of_known))


def interval_trials(cells: int, length: int, x: float) -> float:
    """Independent intervals among all that `cells` cells of time hold, tried at steps of an eighth of their length.

    Of the lengths `length` … 2 `length` − 1, times the number of such octaves. An interval shares its evidence with its
    neighbours the more the less evidence there is: 1.65 x per length of the record, found by simulation (256 cells of
    normal noise, 160 000 records, x = 5 … 9: 7.5 to 14.9 at 16 … 128 cells; the fewer the shorter).
    """
    step = max(1, length // 8)
    lengths = len(range(length, min(2 * length, cells), step))
    return min(lengths * (cells / step), 1.65 * x * cells / length) * int(np.log2(cells))


def best_interval(
    power: NDArray[np.float64], freedom: float, cells: int
) -> tuple[int, int, float, float]:
    """The interval of cells least likely by chance, its rise of logL and the log of that chance."""
    from scipy.special import log_ndtr

    edges = (np.arange(cells + 1) * power.size // cells).astype(np.int64)
    total = np.concatenate([[0.0], np.cumsum(power)])[edges]
    size = float(power.size)
    best = (0, 0, 0.0, np.inf)
    for octave in (1 << k for k in range(int(np.log2(cells)))):
        step = max(1, octave // 8)
        lengths = np.arange(octave, min(2 * octave, cells), step)
        first = np.arange(0, cells, step)
        first, last = (
            a.ravel() for a in np.broadcast_arrays(first[:, None], first[:, None] + lengths)
        )
        first, last = first[last <= cells], last[last <= cells]
        inside = (edges[last] - edges[first]).astype(float)
        gain = two_levels(total[last] - total[first], inside, total[-1], size, freedom)
        top = int(np.argmax(gain))
        x = float(gain[top])
        chance = 0.0
        if x > 0.0:
            tail = float(log_ndtr(-np.sqrt(2.0 * x)) + np.log(2.0))
            chance = np.log(interval_trials(cells, octave, x)) + tail
        if chance < best[3]:
            best = (int(edges[first[top]]), int(edges[last[top]]), x, float(chance))
    return best


def two_levels(
    inside: NDArray[np.float64], count: NDArray[np.float64], total: float, n: float, freedom: float
) -> NDArray[np.float64]:
    """−½ Σ d ln ρ, d = `freedom` for each value."""
    a = np.maximum(inside / count, 1e-12)
    b = np.maximum((total - inside) / (n - count), 1e-12)
    mean = total / n
    return np.asarray(-0.5 * freedom * (count * np.log(a / mean) + (n - count) * np.log(b / mean)))


def refine(
    power: NDArray[np.float64], freedom: float, start: int, end: int, least: int
) -> tuple[int, int, float]:
    """Move each boundary, one after the other, over the finest axis within two coarse cells.

    Or an eighth of a longer interval, in whose steps it was looked for. The interval keeps at least `least` values:
    anything shorter is an outlier, not a level.
    """
    reach = max(2 * power.size // LEVEL_CELLS, (end - start) // 8)
    total = np.concatenate([[0.0], np.cumsum(power)])
    n, gain = float(power.size), -np.inf
    for _ in range(3):
        for side in (0, 1):
            centre = end if side else start
            tried = np.arange(max(0, centre - reach), min(power.size, centre + reach) + 1)
            tried = tried[tried > start] if side else tried[tried < end]
            low, high = (
                (np.full(tried.size, start), tried) if side else (tried, np.full(tried.size, end))
            )
            usable = (high - low >= least) & (high - low < power.size)
            value = np.full(tried.size, -np.inf)
            value[usable] = two_levels(
                total[high[usable]] - total[low[usable]],
                (high - low)[usable].astype(float),
                float(total[-1]),
                n,
                freedom,
            )
            top = int(np.argmax(value))
            gain = float(value[top])
            start, end = (start, int(tried[top])) if side else (int(tried[top]), end)
    return start, end, gain
