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

__all__ = ["Family", "arc_length", "interval_trials", "line_trials", "log_chance", "octave_trials"]

#: Chance of a false suggestion in a whole check.
FALSE_ALARM = 0.01


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


def arc_length(directions: NDArray[np.float64]) -> float:
    """Total angle between successive rows of unit vectors, shape (points, dimension)."""
    if directions.shape[0] < 2:
        return 0.0
    cosine = np.clip(np.sum(directions[1:] * directions[:-1], axis=1), -1.0, 1.0)
    return float(np.arccos(cosine).sum())


def line_trials(n: int) -> float:
    """W of Baluev's false-alarm formula for a search of n evenly spaced samples to the Nyquist frequency."""
    return 0.5 * n * float(np.sqrt(np.pi / 3.0))


def octave_trials(cycles: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """W of a search for a line of so many cycles, over its share of the chance.

    Baluev's W is proportional to the range of frequencies searched. Octaves from one cycle to n/2 share one half of the
    chance equally, so that a slow line does not pay for all the fast ones; all frequencies share the other half, so that
    a fast one hardly pays for that.
    """
    octaves = max(1.0, np.log2(n / 2.0))
    place = np.floor(np.log2(np.maximum(cycles, 1.0)))
    of_octave = 0.5 * n / (octaves * np.minimum(2.0**place, 0.25 * n))
    return np.asarray(line_trials(n) * 2.0 / (1.0 + of_octave))


def interval_trials(cells: int, length: int, x: float) -> float:
    """Independent intervals among all that `cells` cells of time hold, tried at steps of an eighth of their length.

    Of the lengths `length` … 2 `length` − 1, times the number of such octaves. An interval shares its evidence with its
    neighbours the more the less evidence there is: 1.65 x per length of the record, found by simulation (256 cells of
    normal noise, 160 000 records, x = 5 … 9: 7.5 to 14.9 at 16 … 128 cells; the fewer the shorter).
    """
    step = max(1, length // 8)
    lengths = len(range(length, min(2 * length, cells), step))
    return min(lengths * (cells / step), 1.65 * x * cells / length) * int(np.log2(cells))
