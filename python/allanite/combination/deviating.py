"""Which unit is not like the others: power in octaves, each unit beside all others."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.fit.likelihood.expected import column

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.fit import Fit

__all__ = ["DeviatingUnit", "deviating_units"]

#: Chance of naming a healthy unit, in percent of units: half of what is promised.
FALSE = 0.005
#: Fewest units of which one can be told from the others: of two, either may be it.
FEWEST = 3
#: Fewest ordinates of an octave.
ORDINATES = 8.0
#: Spread of the deviations of healthy units of one type, and its degrees of freedom: three ADIS16405 with six axes each
#: differ by 1 to 5 % at 0.2 to 2 s and by 1 to 8 % at 20 s.
SPREAD, FREEDOM = 0.05, 12.0


@dataclass(frozen=True, slots=True)
class DeviatingUnit:
    """A unit whose noise is not that of the others.

    Attributes
    ----------
    unit : str
    low_hz, high_hz : float
        The octave in which it deviates most.
    factor : float
        Its deviation there over the geometric mean of the others'.
    p_value : float
        Of any unit so far from the others by chance.
    """

    unit: str
    low_hz: float
    high_hz: float
    factor: float
    p_value: float

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return asdict(self)


def deviating_units(fits: Sequence[Fit], labels: Sequence[str]) -> tuple[DeviatingUnit, ...]:
    """Units whose power differs from the others' in some octave, or in all from the lowest to one, most certain first.

    The logarithm of a unit's power is compared with the mean of the other units'. Its variance is chance of the records and
    the spread of the units: that of the others, moderated by the spread that units of one type are known to have (Smyth
    2004, Stat. Appl. Genet. Mol. Biol. 3, 3), so that three units are enough. The ratio follows Student's law. A slow noise
    has few ordinates, which are joined from the lowest octave on. A named unit leaves, and the rest is looked at again.
    """
    edges, levels, chance = _levels(fits)
    ranges = [(k, k + 1) for k in range(levels.shape[1])]
    ranges += [(0, k) for k in range(2, levels.shape[1] + 1)]
    left = list(range(len(fits)))
    found: list[DeviatingUnit] = []
    while len(left) >= FEWEST:
        all_of = [
            (
                *_apart(levels[:, a:b], chance[:, a:b], place, [k for k in left if k != place]),
                place,
                a,
                b,
            )
            for place in left
            for a, b in ranges
        ]
        p, apart, place, a, b = min(all_of)
        p = min(1.0, p * len(ranges))
        if p * len(left) >= FALSE * len(fits):
            break
        low, high = float(edges[a]), float(edges[b])
        found.append(DeviatingUnit(labels[place], low, high, float(np.exp(0.5 * apart)), p))
        left.remove(place)
    return tuple(found)


def _apart(
    levels: NDArray[np.float64], chance: NDArray[np.float64], place: int, others: list[int]
) -> tuple[float, float]:
    """Chance of a unit so far from the others over some octaves, and the distance in ln power."""
    from scipy.special import stdtr

    n = len(others)
    weight = 1.0 / chance.mean(axis=0)
    weight /= weight.sum()
    level = levels @ weight
    variance = chance @ weight**2
    within = float(variance[others].mean())
    own = max(float(level[others].var(ddof=1)) - within, 0.0)
    # Of the logarithm of power.
    known = (2.0 * SPREAD) ** 2
    spread = (FREEDOM * known + (n - 1) * own) / (FREEDOM + n - 1)
    apart = float(level[place] - level[others].mean())
    width = np.sqrt(spread * (1.0 + 1.0 / n) + variance[place] + within / n)
    return 2.0 * float(stdtr(FREEDOM + n - 1, -abs(apart) / width)), apart


def _levels(
    fits: Sequence[Fit],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Edges of octaves, Hz; ln of the power over the first unit's model, and its variance, shape (units, octaves)."""
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
    enough = (count >= ORDINATES).all(axis=0)
    first = int(np.argmax(enough)) if enough.any() else 0
    total, count = total[:, first:], np.maximum(count[:, first:], 1.0)
    # ln of χ²/d: its mean is ψ(d/2) − ln(d/2), its variance ψ'(d/2).
    levels = np.log(np.maximum(total, 1e-300) / count) - digamma(0.5 * count) + np.log(0.5 * count)
    return edges[first:], levels, polygamma(1, 0.5 * count)
