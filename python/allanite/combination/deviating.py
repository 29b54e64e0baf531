"""Units whose noise differs from that of the others, by comparison of their powers in octaves of frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import fields_dict
from allanite.fit.likelihood.expected import column

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.common.arrays import Array
    from allanite.fit import Fit

#: Probability of reporting a healthy unit, as a fraction of units; half of the promised 1 %.
FALSE_ALARM = 0.005
#: Fewest units for the comparison. If two units differ, either of them may be the unusual one.
MIN_UNITS = 3
#: Fewest Fourier ordinates in an octave. Chosen by judgment; not measured.
MIN_ORDINATES = 8.0
#: Relative spread of the noise of healthy units of one type, and its degrees of freedom. The axes of three ADIS16405 differ
#: by 1 to 5 % at 0.2 to 2 s and by 1 to 8 % at 20 s.
TYPE_SPREAD, TYPE_FREEDOM = 0.05, 12.0


@dataclass(frozen=True, slots=True)
class DeviatingUnit:
    """A unit whose noise differs from that of the others.

    Attributes
    ----------
    unit : str
        Name of the unit.
    low_hz, high_hz : float
        Range of frequencies in which it differs most.
    factor : float
        Its noise in this range, as a standard deviation, divided by the geometric mean of the others.
    p_value : float
        Probability that a healthy unit differs as much by chance.
    """

    unit: str
    low_hz: float
    high_hz: float
    factor: float
    p_value: float

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: unit (name), low_hz, high_hz, factor and p_value."""
        return fields_dict(self)


def deviating_units(fits: Sequence[Fit], labels: Sequence[str]) -> tuple[DeviatingUnit, ...]:
    """Units whose power differs significantly from the others', in the order in which they were found.

    Empty for fewer than three units. The logarithm of the power of each unit is compared with the mean over the others,
    in every octave and in every range from the lowest octave up, because slow noise has few ordinates in one octave. A
    found unit is removed before the others are compared again.

    The variance of a difference is the sum of the statistical error of the records and of the spread between units.
    This spread is the one observed among the others, moderated by the known spread of units of one type (Smyth 2004,
    Stat. Appl. Genet. Mol. Biol. 3, 3), so that three units are enough.
    """
    edges, levels, variance = _octave_levels(fits)
    ranges = [(k, k + 1) for k in range(levels.shape[1])]
    ranges += [(0, k) for k in range(2, levels.shape[1] + 1)]
    left = list(range(len(fits)))
    found: list[DeviatingUnit] = []
    while len(left) >= MIN_UNITS:
        p, difference, place, a, b = min(
            (*_test_of_unit(levels[:, a:b], variance[:, a:b], place, left), place, a, b)
            for place in left
            for a, b in ranges
        )
        p = min(1.0, p * len(ranges))
        if p * len(left) >= FALSE_ALARM * len(fits):
            break
        low, high = float(edges[a]), float(edges[b])
        found.append(DeviatingUnit(labels[place], low, high, float(np.exp(0.5 * difference)), p))
        left.remove(place)
    return tuple(found)


def _test_of_unit(
    levels: Array, variances: Array, place: int, compared: list[int]
) -> tuple[float, float]:
    """(two-sided p-value, difference of ln power) of the unit `place` against the mean of the units `compared`.

    `levels` and `variances`, shape (units, octaves), are ln power and its variance; octaves are averaged with weights
    1/variance. The ratio of powers is tested by an F distribution whose degrees of freedom match the variances. These
    include the spread between units, estimated from the others and from a typical spread. The resulting normal score is
    judged by Student's t, with degrees of freedom by Satterthwaite (1946).
    """
    from scipy.special import digamma, fdtr, fdtrc, ndtri, stdtr

    others = [k for k in compared if k != place]
    n = len(others)
    weight = 1.0 / variances.mean(axis=0)
    weight /= weight.sum()
    level = levels @ weight
    variance = variances @ weight**2
    within = float(variance[others].mean())
    own = max(float(level[others].var(ddof=1)) - within, 0.0)
    # Variance of ln power: power is the square of a deviation, hence the factor 2.
    known = (2.0 * TYPE_SPREAD) ** 2
    freedom = TYPE_FREEDOM + n - 1
    spread = (TYPE_FREEDOM * known + (n - 1) * own) / freedom
    apart = float(level[place] - level[others].mean())
    own_variance, others_variance = float(variance[place]) + spread, (within + spread) / n
    # ψ'(d/2) = v for d = (1 + √(1 + 2v))/v, to 1 % for d ≥ 8. The mean of ln χ²/d is ψ(d/2) − ln(d/2).
    d1, d2 = ((1.0 + np.sqrt(1.0 + 2.0 * v)) / v for v in (own_variance, others_variance))
    means = digamma(0.5 * d1) - np.log(0.5 * d1) - digamma(0.5 * d2) + np.log(0.5 * d2)
    ratio = np.exp(apart + means)
    tail = min(fdtr(d1, d2, ratio), fdtrc(d1, d2, ratio))
    freedom *= ((own_variance + others_variance) / (spread * (1.0 + 1.0 / n))) ** 2
    return 2.0 * float(stdtr(freedom, ndtri(tail))), apart


def _octave_levels(fits: Sequence[Fit]) -> tuple[Array, Array, Array]:
    """(edges, levels, variances): how loud each unit is in each octave of frequency that all units have in common.

    A level is ln(measured power of the unit / power that the model of the first unit expects). Levels and their
    variances have the shape (units, octaves). The edges are in Hz, ascending, shape (octaves + 1,). The octaves begin
    with the lowest in which every unit has 8 ordinates, or with the lowest of all if there is none.
    """
    from scipy.special import digamma, polygamma

    low = max(0.5 * fit.data.rate / fit.data.n for fit in fits)
    high = min(0.5 * fit.data.rate for fit in fits)
    edges = high * 0.5 ** np.arange(int(np.log2(high / low)), -1.0, -1.0)
    total, count = np.zeros((len(fits), edges.size - 1)), np.zeros((len(fits), edges.size - 1))
    for row, fit in enumerate(fits):
        data, solution = fit.data, fit.solution
        expected = column(data.terms(fits[0].solution.model), data)
        f = data.bins.frequency(data.rate)
        place = np.searchsorted(edges, f, side="right") - 1
        good = (place >= 0) & (place < edges.size - 1)
        total[row] = np.bincount(
            place[good],
            (solution.count * solution.power / expected)[good],
            minlength=edges.size - 1,
        )
        count[row] = np.bincount(place[good], solution.count[good], minlength=edges.size - 1)
    enough = (count >= MIN_ORDINATES).all(axis=0)
    first = int(np.argmax(enough)) if enough.any() else 0
    total, count = total[:, first:], np.maximum(count[:, first:], 1.0)
    # ln of χ²/d: its mean is ψ(d/2) − ln(d/2), its variance ψ'(d/2).
    levels = np.log(np.maximum(total, 1e-300) / count) - digamma(0.5 * count) + np.log(0.5 * count)
    return edges[first:], levels, polygamma(1, 0.5 * count)
