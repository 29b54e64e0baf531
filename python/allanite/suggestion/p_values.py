"""P-values of a rise of logL, corrected for the number of effects, frequencies and times searched.

If an effect with one coefficient at the edge of its range is absent, it raises logL by x with probability Φ(−√2x)
(half-χ², Self & Liang 1987). Along a grid of shapes the whitened directions turn by a total angle L. Davies (1977,
Biometrika 64) bounds the probability that any of them reaches x by Φ(−√2x) + L/2π e^{−x}. A line at any frequency reaches
x with probability W √x e^{−x}, W = T f_max √(4π/12)… (Baluev 2008, MNRAS 385). Intervals of one octave of length share
their trials, so that long intervals do not pay for the number of short ones (`interval_trials`). All families share the
1 % false alarms of a check equally.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY


@dataclass(frozen=True, slots=True)
class Family:
    """Candidates that were searched together and share one false-alarm probability.

    `arcs` are, for each kind tried, the angle its direction turns along its grid (0: a single direction). `sides` is 1 for
    coefficients that cannot be negative, 2 for amplitudes of either sign. `width` is W of a search over all frequencies.

    An unmodeled change of the noise level raises ΔlogL by chance. With the `scatter` ``"spectrum"``, ΔlogL is divided by
    the overdispersion of the spectrum, with ``"time"`` by the largest relative noise power at any time. With ``"none"`` it
    is not divided, because the screen has considered the level.
    """

    name: str
    arcs: tuple[float, ...] = ()
    sides: int = 1
    width: float = 0.0
    scatter: Literal["spectrum", "time", "none"] = "spectrum"


def log_p_value(family: Family, x: float) -> float:
    """Natural logarithm of the p-value: the probability that the largest ΔlogL in a family is at least x by chance.

    At most 0; 0 for x ≤ 0. With `family.width` it is Baluev's formula for lines, otherwise Davies' formula. An arc is the
    angle, rad, by which a whitened shape turns along the grid of its shape values.
    """
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


def log_chi2_tail(gain: float, count: int) -> float:
    """Ln of the probability that `count` amplitudes fitted to noise raise logL by `gain` or more; at most 0.

    This is Γ(a, x) ≈ xᵃ⁻¹e⁻ˣ/(1 − (a − 1)/x) for x > a − 1, with a = count/2; the error of ln is of the order of (a/x)².
    """
    from scipy.special import gammaln

    a = 0.5 * count
    if gain <= max(a - 1.0, 0.0):
        return 0.0
    beyond = float(np.log1p((1.0 - a) / gain)) if gain > 0.0 else 0.0
    return min(0.0, (a - 1.0) * float(np.log(gain)) - gain - float(gammaln(a)) - beyond)


def may_become_significant(family: Family, max_gain: float) -> bool:
    """True if a candidate of `family` with a ΔlogL of `max_gain` would have a p-value below 1 %.

    `max_gain` is the ΔlogL of the search, or an estimate of the largest ΔlogL of a refit. Neither is a strict limit.
    """
    return log_p_value(family, max_gain) < np.log(FALSE_ALARM_PROBABILITY)


def min_significant_score(count: float) -> float:
    """Standard normal score that the largest of `count` independent scores exceeds with a probability of 1 %."""
    from scipy.special import ndtri

    return -float(ndtri(FALSE_ALARM_PROBABILITY / count))


def arc_length(directions: NDArray[np.float64]) -> float:
    """Sum of the angles between successive rows of unit vectors, rad; 0 for fewer than two rows."""
    if directions.shape[0] < 2:
        return 0.0
    cosine = np.clip(np.einsum("ij,ij->i", directions[1:], directions[:-1]), -1.0, 1.0)
    return float(np.arccos(cosine).sum())


def interval_trials(cells: int, length: int, x: float) -> float:
    """Number of independent trials of a search for an interval of `length` … 2·`length` − 1 cells; its best ΔlogL is `x`.

    The record has `cells` cells (time intervals of equal length). The number is that of tried intervals, but at most 1.65 x
    `cells`/`length`, because near intervals are not independent. It is multiplied by log₂(`cells`), rounded down: the
    number of octaves of lengths in the whole search.
    """
    # By simulation of 256 cells of normal noise, 160 000 records, x = 5 … 9, lengths 16 … 128 cells: 7.5 to 14.9 instead of
    # 1.65 x = 8.3 to 14.9; fewer for shorter ones.
    step = max(1, length // 8)
    lengths = len(range(length, min(2 * length, cells), step))
    return min(lengths * (cells / step), 1.65 * x * cells / length) * int(np.log2(cells))


def best_interval(
    power: NDArray[np.float64], freedom: float, cells: int
) -> tuple[int, int, float, float]:
    """Tuple (first value, end, ΔlogL, ln p) of the interval whose separate level of power has the lowest p-value.

    The end is exclusive. `power` is a series over time, `freedom` the degrees of freedom of each value. Boundaries lie
    between `cells` equal cells. ln p is 0 if no interval raises logL. (0, 0, 0, inf) for fewer than two cells.
    """
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
        gain = delta_logl_of_two_levels(
            total[last] - total[first], inside, total[-1], size, freedom
        )
        top = int(np.argmax(gain))
        x = float(gain[top])
        log_p = 0.0
        if x > 0.0:
            tail = float(log_ndtr(-np.sqrt(2.0 * x)) + np.log(2.0))
            log_p = np.log(interval_trials(cells, octave, x)) + tail
        if log_p < best[3]:
            best = (int(edges[first[top]]), int(edges[last[top]]), x, float(log_p))
    return best


def delta_logl_of_two_levels(
    inside: NDArray[np.float64], count: NDArray[np.float64], total: float, n: float, freedom: float
) -> NDArray[np.float64]:
    """ΔlogL, nats, of a separate mean power inside each of many intervals of a series of `n` values with the sum `total`.

    `inside` is the sum of the `count` values inside an interval, `freedom` the degrees of freedom d of each value. ΔlogL is
    −½ Σ d ln ρ, with the mean power ρ inside or outside over the common mean.
    """
    a = np.maximum(inside / count, 1e-12)
    b = np.maximum((total - inside) / (n - count), 1e-12)
    mean = total / n
    return np.asarray(-0.5 * freedom * (count * np.log(a / mean) + (n - count) * np.log(b / mean)))
