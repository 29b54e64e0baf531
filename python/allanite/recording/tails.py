"""Tail of noise: a Student t law fitted to its body, and the largest values that this law can reach.

A few wrong samples must not affect the law that judges them, and large samples of heavy-tailed noise are not wrong. So the
law is fitted to the body: of the largest few percent only the number counts (a censored sample). This is repeated for
several such shares. Values beyond the heaviest tail that the best fit allows are outliers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CENSORED_SHARES", "Tail", "coarse_step", "outlier_limit", "tail_of"]

#: 1/ν of the laws that are tried, from the normal one to one without a variance.
INVERSE_FREEDOMS = np.concatenate([[0.0, 0.005, 0.01], np.arange(0.02, 0.6, 0.015)])
#: Shares of the largest values of which only the number counts.
CENSORED_SHARES = (0.003, 0.01, 0.03, 0.1, 0.2)
#: ΔlogL by which two laws are distinguished: three standard deviations.
MIN_DELTA_LOGL = 4.5
#: Number of scales tried around the one given by the median, and their range in its standard errors.
SCALES, SCALE_RANGE = 13, 4.0
#: Ratio of the largest to the smallest rank through which a power law is fitted.
RANK_RATIO = 25
#: Probability of that many large values below which they are outliers.
MAX_PROBABILITY = 1e-5


@dataclass(frozen=True, slots=True)
class Tail:
    """Student t law of the magnitudes of a sample.

    Attributes
    ----------
    inverse_freedom : float
        1/ν; 0 is the normal law.
    low, high : float
        Values of 1/ν three standard deviations to each side.
    scale : float
        Scale of the law, in the unit of the sample.
    """

    inverse_freedom: float
    low: float
    high: float
    scale: float

    @property
    def heavy(self) -> bool:
        """True if the normal law is excluded."""
        return self.low > 0.0

    def reach(self, chance: float) -> float:
        """Magnitude that one value exceeds with at most this probability, under the heaviest allowed tail."""
        return float(self.scale * _quantile(self.high, chance))


def _quantile(inverse: float, chance: float) -> float:
    """Magnitude that a value of a law exceeds with this probability."""
    from scipy.special import ndtri, stdtrit

    p = 0.5 * chance
    return float(-(ndtri(p) if inverse == 0.0 else stdtrit(1.0 / inverse, p)))


def _ascending(magnitudes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Magnitudes in ascending order."""
    return _kernels.in_order(np.ascontiguousarray(magnitudes))


def tail_of(
    magnitudes: NDArray[np.float64], censored: float, *, ordered: bool = False
) -> Tail | None:
    """Law of magnitudes of which the share `censored` of the largest counts only by its number; None if there are too few.

    With `ordered`, the magnitudes are in ascending order.
    """
    from scipy.special import ndtr, stdtr

    n = magnitudes.size
    keep = int(n * (1.0 - censored))
    if keep < 50:
        return None
    rising = magnitudes if ordered else _ascending(magnitudes)
    median, top = rising[n // 2], rising[keep - 1]
    if not 0.0 < median < top:
        return None
    wide = min(2.0 * median, 0.999 * top)
    edges = np.unique(np.append(np.linspace(0.0, wide, 14)[:-1], np.geomspace(wide, top, 12)))
    places = np.searchsorted(rising, edges)
    places[-1] = inside = int(np.searchsorted(rising, top, side="right"))
    count, beyond = np.diff(places), n - inside
    # The median of magnitudes is known to 0.79/√n of itself.
    spread = np.exp(np.linspace(-SCALE_RANGE, SCALE_RANGE, SCALES) * 1.2 / np.sqrt(n))
    value = np.empty(INVERSE_FREEDOMS.size)
    scales = np.empty(INVERSE_FREEDOMS.size)
    for i, inverse in enumerate(INVERSE_FREEDOMS):
        s = median / _quantile(inverse, 0.5) * spread[:, None]
        lower = ndtr(-edges / s) if inverse == 0.0 else stdtr(1.0 / inverse, -edges / s)
        p = 2.0 * np.maximum(lower[:, :-1] - lower[:, 1:], 1e-300)
        total = np.log(p) @ count + beyond * np.log(np.maximum(2.0 * lower[:, -1], 1e-300))
        best = int(np.argmax(total))
        value[i], scales[i] = total[best], s[best, 0]
    best = int(np.argmax(value))
    allowed = INVERSE_FREEDOMS[value > value[best] - MIN_DELTA_LOGL]
    # Between two laws that were tried.
    heaviest = min(
        int(np.searchsorted(INVERSE_FREEDOMS, allowed[-1])) + 1, INVERSE_FREEDOMS.size - 1
    )
    centre = float(INVERSE_FREEDOMS[best])
    if 0 < best < INVERSE_FREEDOMS.size - 1:
        # The top of the parabola through three laws.
        near = slice(best - 1, best + 2)
        square, slope, _ = np.polyfit(INVERSE_FREEDOMS[near] - centre, value[near], 2)
        centre += float(-0.5 * slope / square) if square < 0.0 else 0.0
    return Tail(
        centre, float(allowed[0]), float(INVERSE_FREEDOMS[heaviest]), float(scales[heaviest])
    )


def outlier_limit(magnitudes: NDArray[np.float64], chance: float, step: float = 0.0) -> float:
    """Magnitude beyond which a value does not belong to the noise.

    Parameters
    ----------
    magnitudes : ndarray, shape (n,)
    chance : float
        Probability that one value of pure noise is beyond.
    step : float
        Step of rounded values, which are spread over it.
    """
    if step > 0.0:
        spread = np.random.default_rng(0).uniform(-0.5 * step, 0.5 * step, magnitudes.size)
        magnitudes = np.abs(magnitudes + spread)
    magnitudes = _ascending(magnitudes)
    tails = [tail_of(magnitudes, share, ordered=True) for share in CENSORED_SHARES]
    limits = [t.reach(chance) for t in tails if t is not None]
    return min([*limits, *_power_law_limits(magnitudes, chance)], default=np.inf) + 0.5 * step


def _power_law_limits(rising: NDArray[np.float64], chance: float) -> list[float]:
    """Limits from the largest ordered values: power laws through some ranks, extrapolated to the last expected value.

    The exponent is Hill's (1975) without the very largest values. Tails do not become heavier outwards than a power law.
    """
    from scipy.special import pdtrc

    n = rising.size
    out: list[float] = []
    for left_out in (20, 100, 500, 2000):
        last = RANK_RATIO * left_out
        if 4 * last > n:
            break
        top = rising[n - last :][::-1]
        edge = float(top[left_out - 1])
        if not top[-1] > 0.0:
            break
        if edge == top[-1]:
            continue  # clipped: many values are the largest, and no law fits them
        # Hill's exponent of the values between the two ranks; omitted values count as the lowest of them.
        used = last - left_out
        exponent = (
            float(
                np.log(top[left_out - 1 :] / top[-1]).sum()
                + (left_out - 1) * np.log(edge / top[-1])
            )
            / used
        )
        exponent *= 1.0 + 3.0 / np.sqrt(used)
        out.append(edge * (left_out / (chance * n)) ** exponent)
        # More values than the law makes, so that nine in ten of them are wrong.
        number = np.arange(1, left_out)
        with np.errstate(divide="ignore"):  # of samples at the end of the range all are alike
            expected = left_out * (edge / top[: left_out - 1]) ** (1.0 / exponent)
        wrong = (expected < 0.1 * number) & (pdtrc(number - 1, expected) < MAX_PROBABILITY)
        if wrong.any():
            out.append(float(np.nextafter(top[np.flatnonzero(wrong)[-1]], 0.0)))
    return out


def coarse_step(values: NDArray[np.float64]) -> float:
    """Distance of neighboring values if there are only few different ones, else 0."""
    some = values[:: max(1, values.size // 20_000)]
    levels = np.unique(some)
    if levels.size > 50 or levels.size < 2:
        return 0.0
    return float(np.diff(levels).min())
