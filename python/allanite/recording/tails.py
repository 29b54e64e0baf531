"""Tail of noise: a Student t law fitted to its body, and the largest values that this law can reach.

The law is used to find outliers. A few wrong samples must not affect it, and large samples of heavy-tailed noise are not
wrong. Therefore the largest values are censored: the fit uses their number but not their size. The fit is repeated for
several shares of censored values. Values beyond the heaviest tail that a fit allows are outliers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array

#: Values of 1/ν that are tried, where ν are the degrees of freedom. The law is normal at 0 and has no variance from 0.5 on.
INVERSE_FREEDOMS = np.concatenate([[0.0, 0.005, 0.01], np.arange(0.02, 0.6, 0.015)])
#: Shares of the largest values that are censored, one fit for each. Chosen by judgment; not measured.
CENSORED_SHARES = (0.003, 0.01, 0.03, 0.1, 0.2)
#: Laws whose logL is lower than the best by more than this are excluded: three standard deviations.
MIN_DELTA_LOGL = 4.5
#: Number of scales that are tried for each law, around the scale that the median gives.
SCALE_COUNT = 13
#: Maximum distance of a tried scale from the scale of the median, in standard errors of the median.
SCALE_RANGE = 4.0
#: Minimum number of uncensored magnitudes for a fit. Chosen by judgment; not measured.
MIN_MAGNITUDES = 50
#: Power laws are fitted to the values between two ranks, counted from the largest value. First ranks that are tried.
FIRST_RANKS = (20, 100, 500, 2000)
#: Last rank of such a fit, divided by its first rank. Chosen by judgment; not measured.
RANK_RATIO = 25
#: The largest values are outliers if the fitted power law makes so many of them with a probability below this one.
MAX_PROBABILITY = 1e-5
#: Values are called rounded to a coarse step if at most this many different values occur.
MAX_COARSE_LEVELS = 50
#: Number of samples that are examined for a coarse step.
EXAMINED_SAMPLES = 20_000


@dataclass(frozen=True, slots=True)
class Tail:
    """Student t law fitted to the magnitudes |x| of a sample.

    `inverse_freedom` is 1/ν, where ν are the degrees of freedom; 0 for the normal law. `low` is the smallest tried 1/ν
    that the sample does not exclude (three standard deviations), and `high` the tried value next above the largest one.
    `scale` is that of the law with 1/ν = `high`.
    """

    inverse_freedom: float
    low: float
    high: float
    scale: float

    @property
    def heavy(self) -> bool:
        """True if the data exclude the normal law: the tail is heavier."""
        return self.low > 0.0

    def reach(self, probability: float) -> float:
        """Magnitude that one value exceeds with at most this `probability`, for the heaviest tail that the data allow."""
        return float(self.scale * _exceeded_magnitude(self.high, probability))


def _exceeded_magnitude(inverse_freedom: float, probability: float) -> float:
    """Magnitude that a value of Student's t law with scale 1 exceeds with this two-sided probability."""
    from scipy.special import ndtri, stdtrit

    p = 0.5 * probability
    return float(-(ndtri(p) if inverse_freedom == 0.0 else stdtrit(1.0 / inverse_freedom, p)))


def tail_of(magnitudes: Array, censored: float, *, ordered: bool = False) -> Tail | None:
    """Student t law fitted to magnitudes, of which the largest (a share `censored`) enter only by their number.

    `ordered` magnitudes ascend. None below 50 uncensored magnitudes, if the median is 0, or if no uncensored magnitude
    exceeds the median.
    """
    from scipy.special import ndtr, stdtr

    n = magnitudes.size
    keep = int(n * (1.0 - censored))
    if keep < MIN_MAGNITUDES:
        return None
    rising = magnitudes if ordered else _kernels.in_order(np.ascontiguousarray(magnitudes))
    median, top = rising[n // 2], rising[keep - 1]
    if not 0.0 < median < top:
        return None
    wide = min(2.0 * median, 0.999 * top)
    edges = np.unique(np.append(np.linspace(0.0, wide, 14)[:-1], np.geomspace(wide, top, 12)))
    places = np.searchsorted(rising, edges)
    places[-1] = inside = int(np.searchsorted(rising, top, side="right"))
    count, beyond = np.diff(places), n - inside
    # The median of n normal magnitudes has a relative standard error of 1.17/√n.
    spread = np.exp(np.linspace(-SCALE_RANGE, SCALE_RANGE, SCALE_COUNT) * 1.2 / np.sqrt(n))
    value = np.empty(INVERSE_FREEDOMS.size)
    scales = np.empty(INVERSE_FREEDOMS.size)
    for i, inverse in enumerate(INVERSE_FREEDOMS):
        s = median / _exceeded_magnitude(inverse, 0.5) * spread[:, None]
        lower = ndtr(-edges / s) if inverse == 0.0 else stdtr(1.0 / inverse, -edges / s)
        p = 2.0 * np.maximum(lower[:, :-1] - lower[:, 1:], 1e-300)
        total = np.log(p) @ count + beyond * np.log(np.maximum(2.0 * lower[:, -1], 1e-300))
        best = int(np.argmax(total))
        value[i], scales[i] = total[best], s[best, 0]
    best = int(np.argmax(value))
    allowed = INVERSE_FREEDOMS[value > value[best] - MIN_DELTA_LOGL]
    # The limit lies between two tried laws; take the heavier one.
    heaviest = min(
        int(np.searchsorted(INVERSE_FREEDOMS, allowed[-1])) + 1, INVERSE_FREEDOMS.size - 1
    )
    center = float(INVERSE_FREEDOMS[best])
    if 0 < best < INVERSE_FREEDOMS.size - 1:
        # Refine 1/ν by the maximum of the parabola through the best law and its two neighbors.
        three = slice(best - 1, best + 2)
        square, slope, _ = np.polyfit(INVERSE_FREEDOMS[three] - center, value[three], 2)
        center += float(-0.5 * slope / square) if square < 0.0 else 0.0
    return Tail(
        center, float(allowed[0]), float(INVERSE_FREEDOMS[heaviest]), float(scales[heaviest])
    )


def outlier_limit(magnitudes: Array, probability: float, step: float = 0.0) -> float:
    """Magnitude above which a value is an outlier: the smallest limit of several tail fits, plus half a `step`.

    One value of pure noise exceeds the limit with the given `probability`. Rounded values are first spread at random
    (seed 0) over one `step`. Infinite if no law can be fitted.
    """
    if step > 0.0:
        spread = np.random.default_rng(0).uniform(-0.5 * step, 0.5 * step, magnitudes.size)
        magnitudes = np.abs(magnitudes + spread)
    magnitudes = _kernels.in_order(np.ascontiguousarray(magnitudes))
    tails = [tail_of(magnitudes, share, ordered=True) for share in CENSORED_SHARES]
    limits = [t.reach(probability) for t in tails if t is not None]
    return min([*limits, *_power_law_limits(magnitudes, probability)], default=np.inf) + 0.5 * step


def _power_law_limits(rising: Array, probability: float) -> list[float]:
    """Outlier limits from power laws fitted to the largest of the magnitudes `rising`; empty for fewer than 2000 values.

    A limit is the magnitude that a single value exceeds with the given `probability`, by extrapolation of the power law.
    The exponent is that of Hill (1975) without the very largest values. A second limit is added if the largest values are
    far more numerous than the power law predicts; these values lie above it.
    """
    from scipy.special import pdtrc

    n = rising.size
    out: list[float] = []
    for left_out in FIRST_RANKS:
        last = RANK_RATIO * left_out
        if 4 * last > n:
            break
        top = rising[n - last :][::-1]
        edge = float(top[left_out - 1])
        if not top[-1] > 0.0:
            break
        if edge == top[-1]:
            continue  # clipped samples: many values equal the largest, and no power law fits them
        # Hill's estimate from the values between the two ranks; each omitted value counts as large as `edge`.
        used = last - left_out
        exponent = (
            float(
                np.log(top[left_out - 1 :] / top[-1]).sum()
                + (left_out - 1) * np.log(edge / top[-1])
            )
            / used
        )
        # The upper limit of the exponent, three standard errors above the estimate.
        exponent *= 1.0 + 3.0 / np.sqrt(used)
        out.append(edge * (left_out / (probability * n)) ** exponent)
        # Values are outliers if there are ten times as many as the law predicts, and this is no accident.
        number = np.arange(1, left_out)
        with np.errstate(divide="ignore"):  # many samples at the end of the range are equal
            expected = left_out * (edge / top[: left_out - 1]) ** (1.0 / exponent)
        is_excess = (expected < 0.1 * number) & (pdtrc(number - 1, expected) < MAX_PROBABILITY)
        if is_excess.any():
            out.append(float(np.nextafter(top[np.flatnonzero(is_excess)[-1]], 0.0)))
    return out


def coarse_step(values: Array) -> float:
    """Smallest distance between different values if 2 to 50 different values occur, else 0; long columns are thinned."""
    some = values[:: max(1, values.size // EXAMINED_SAMPLES)]
    levels = np.unique(some)
    if levels.size > MAX_COARSE_LEVELS or levels.size < 2:
        return 0.0
    return float(np.diff(levels).min())
