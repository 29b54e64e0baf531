"""The tail of a sample of noise: a Student t law fitted to what is surely noise, and what that can reach.

A few wrong samples must not make the law that judges them, and the samples of heavy-tailed noise are no wrong ones. So the
law is fitted to the body, the largest so many per cent counting only by their number (a censored sample), for several such
shares; what lies beyond the heaviest tail that the best of these bodies allows is an outlier.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CENSORED", "Tail", "coarse_step", "outlier_limit", "tail_of"]

#: 1/ν of the laws that are tried: from the normal one to one without a variance.
INVERSE = np.concatenate([[0.0, 0.005, 0.01], np.arange(0.02, 0.6, 0.015)])
#: Shares of the largest values that count by their number alone.
CENSORED = (0.003, 0.01, 0.03, 0.1, 0.2)
#: Rise of logL by which a law is told from another, three standard deviations.
SURE = 4.5
#: Scales tried to each side of the one that the median asks for, in standard errors of it.
SCALES, REACH = 13, 4.0
#: Ranks through which a power law goes: from those left out to so many times as many.
SPAN = 25
#: Chance by which a law does not make so many large values.
UNLIKELY = 1e-5


@dataclass(frozen=True, slots=True)
class Tail:
    """A Student t law of the magnitudes of a sample.

    Attributes
    ----------
    inverse_freedom : float
        1/ν; 0 is the normal law.
    low, high : float
        The same, three standard deviations to each side.
    scale : float
        Of the law, in the unit of the sample.
    """

    inverse_freedom: float
    low: float
    high: float
    scale: float

    @property
    def heavy(self) -> bool:
        """Whether the normal law is out of the question."""
        return self.low > 0.0

    def reach(self, chance: float) -> float:
        """Magnitude that one value exceeds with this chance at most, under the heaviest tail allowed."""
        return float(self.scale * _quantile(self.high, chance))


def _quantile(inverse: float, chance: float) -> float:
    from scipy.special import ndtri, stdtrit

    p = 0.5 * chance
    return float(-(ndtri(p) if inverse == 0.0 else stdtrit(1.0 / inverse, p)))


def _rising(magnitudes: NDArray[np.float64]) -> NDArray[np.float64]:
    return _kernels.in_order(np.ascontiguousarray(magnitudes))


def tail_of(
    magnitudes: NDArray[np.float64], censored: float, *, ordered: bool = False
) -> Tail | None:
    """The law of magnitudes of which the largest share `censored` counts by its number; None of hardly any.

    They may be given in order, the lowest first.
    """
    from scipy.special import ndtr, stdtr

    n = magnitudes.size
    keep = int(n * (1.0 - censored))
    if keep < 50:
        return None
    rising = magnitudes if ordered else _rising(magnitudes)
    median, top = rising[n // 2], rising[keep - 1]
    if not 0.0 < median < top:
        return None
    wide = min(2.0 * median, 0.999 * top)
    edges = np.unique(np.append(np.linspace(0.0, wide, 14)[:-1], np.geomspace(wide, top, 12)))
    places = np.searchsorted(rising, edges)
    places[-1] = inside = int(np.searchsorted(rising, top, side="right"))
    count, beyond = np.diff(places), n - inside
    # The median of magnitudes is known to 0.79/√n of itself.
    spread = np.exp(np.linspace(-REACH, REACH, SCALES) * 1.2 / np.sqrt(n))
    value = np.empty(INVERSE.size)
    scales = np.empty(INVERSE.size)
    for i, inverse in enumerate(INVERSE):
        s = median / _quantile(inverse, 0.5) * spread[:, None]
        lower = ndtr(-edges / s) if inverse == 0.0 else stdtr(1.0 / inverse, -edges / s)
        p = 2.0 * np.maximum(lower[:, :-1] - lower[:, 1:], 1e-300)
        total = np.log(p) @ count + beyond * np.log(np.maximum(2.0 * lower[:, -1], 1e-300))
        best = int(np.argmax(total))
        value[i], scales[i] = total[best], s[best, 0]
    best = int(np.argmax(value))
    allowed = INVERSE[value > value[best] - SURE]
    # Between two laws that were tried.
    heaviest = min(int(np.searchsorted(INVERSE, allowed[-1])) + 1, INVERSE.size - 1)
    centre = float(INVERSE[best])
    if 0 < best < INVERSE.size - 1:
        # The top of the parabola through three laws.
        near = slice(best - 1, best + 2)
        square, slope, _ = np.polyfit(INVERSE[near] - centre, value[near], 2)
        centre += float(-0.5 * slope / square) if square < 0.0 else 0.0
    return Tail(centre, float(allowed[0]), float(INVERSE[heaviest]), float(scales[heaviest]))


def outlier_limit(magnitudes: NDArray[np.float64], chance: float, step: float = 0.0) -> float:
    """Magnitude beyond which a value is none of the noise's.

    Parameters
    ----------
    magnitudes : ndarray, shape (n,)
    chance : float
        That one value of pure noise is beyond.
    step : float
        To which the values are rounded: they are spread over it, and half of it is no size.
    """
    if step > 0.0:
        spread = np.random.default_rng(0).uniform(-0.5 * step, 0.5 * step, magnitudes.size)
        magnitudes = np.abs(magnitudes + spread)
    magnitudes = _rising(magnitudes)
    tails = [tail_of(magnitudes, share, ordered=True) for share in CENSORED]
    limits = [t.reach(chance) for t in tails if t is not None]
    return min([*limits, *_powers(magnitudes, chance)], default=np.inf) + 0.5 * step


def _powers(rising: NDArray[np.float64], chance: float) -> list[float]:
    """The same from the largest of values in order alone: a power law through some ranks, carried on to where none is left.

    Its exponent is Hill's (1975) with the very largest left out. Tails become no heavier outwards than a power law.
    """
    from scipy.special import pdtrc

    n = rising.size
    out: list[float] = []
    for left_out in (20, 100, 500, 2000):
        last = SPAN * left_out
        if 4 * last > n:
            break
        top = rising[n - last :][::-1]
        edge = float(top[left_out - 1])
        if not top[-1] > 0.0:
            break
        if edge == top[-1]:
            continue  # the range ended: many values are the largest, and no law goes through them
        # Of the values between the two ranks, those left out counting as the lowest of them.
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
        # Several values where the law makes hardly one, of which nine in ten are wrong.
        number = np.arange(1, left_out)
        with np.errstate(divide="ignore"):  # of samples at the end of the range all are alike
            expected = left_out * (edge / top[: left_out - 1]) ** (1.0 / exponent)
        wrong = (expected < 0.1 * number) & (pdtrc(number - 1, expected) < UNLIKELY)
        if wrong.any():
            out.append(float(np.nextafter(top[np.flatnonzero(wrong)[-1]], 0.0)))
    return out


def coarse_step(values: NDArray[np.float64]) -> float:
    """Distance of neighbouring values of which there are few different ones, 0 where there are many."""
    some = values[:: max(1, values.size // 20_000)]
    levels = np.unique(some)
    if levels.size > 50 or levels.size < 2:
        return 0.0
    return float(np.diff(levels).min())
