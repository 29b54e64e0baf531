"""Marginal likelihood of bin power with a fitted model discrepancy δ.

In each bin b the ratio of measured to expected power is e^{ε_b} χ²_n/n with an unknown error ε_b ~ δ t₂. Most bins are
right, a few may be far off. t₂ is a normal distribution of variance δ²w with w inverse-gamma (1, 1). For a given w the
bin's power is close to a gamma variable of the same mean and log-variance 2/n + δ²w. The marginal likelihood is therefore
a short sum over w.
δ = 0 is the Whittle likelihood. A bin that disagrees with the model keeps only a few effective degrees of freedom.

The sum is computed by the core (`_kernels.Likelihood`), with 14 nodes in w.

(Scale mixtures of normals: Andrews & Mallows 1974; robust likelihood with fitted scale: Lange, Little & Taylor 1989.)
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.parameters import NORMAL
from allanite.common.threads import stop_if_unwanted
from allanite.spectrum.spectrum import cells_of

#: Minimum ΔlogL of a discrepancy δ > 0 over δ = 0. Half of χ²₁ exceeds it for 0.7 % of true models; otherwise δ is 0 and
#: the fit is the Whittle fit.
MIN_DISCREPANCY_DELTA_LOGL = 3.0
#: Grid of discrepancies δ, 16 per decade: between neighbors the likelihood falls by less than 0.05.
SCALES = np.geomspace(1e-3, 3.0, 57)
#: Half of the 95 % point of χ²₁, ½·1.96²: fall of the profile logL at the ends of a 95 % interval. Upper limits of
#: coefficients near 0 use it too: a one-sided limit (1.3528), chosen by the data instead of an interval, would miss 5 %
#: above and 2.5 % below. K of a short N+B+K would be covered by 88 %.
HALF_CHI2_95 = 0.5 * NORMAL**2


@lru_cache(maxsize=64)
def _likelihood_of_bytes(count: bytes, cells: bool) -> _kernels.Likelihood:
    """`_kernels.Likelihood` of bins whose degrees of freedom are given as bytes (a key of the cache); see `likelihood`."""
    counts = np.frombuffer(count)
    return _kernels.Likelihood(
        counts, SCALES, [*range(counts.size)] if cells else cells_of(counts.size)
    )


def likelihood(count: Array, *, cells: bool = False) -> _kernels.Likelihood:
    """`_kernels.Likelihood`: marginal likelihood of bins with the degrees of freedom `count`; its tables are cached.

    By default the bins of a cell (a group of neighboring bins) share one error ε of the model. With `cells`, each value of
    `count` is that of a whole cell, and has its own ε.
    """
    stop_if_unwanted()  # every fit passes here often enough to react to an interrupt
    return _likelihood_of_bytes(count.tobytes(), cells)


def marginal_likelihood(
    power: Array, count: Array, spectrum: Array, scale: int | None
) -> tuple[float, Array]:
    """Pair (logL, weight) of a spectrum at the discrepancy δ = SCALES[scale], or at δ = 0 if `scale` is None.

    logL is in units of the Whittle likelihood −½ Σ n (ln S + I/S). The weight, shape (bins,), are the effective degrees of
    freedom of each bin, at most its count.
    """
    return likelihood(count).judge(power, spectrum, scale)


def profile_likelihood(power: Array, count: Array, spectrum: Array) -> Array:
    """Array of the marginal logL of a spectrum at each discrepancy δ of `SCALES`, shape (scales,)."""
    return likelihood(count).profile(power, spectrum[None], range(SCALES.size))[:, 0]


def best_scale(power: Array, count: Array, spectrum: Array) -> tuple[int, float]:
    """Pair: index into `SCALES` (the tried values of the discrepancy δ) with the largest marginal logL, and this logL.

    An index is returned even if δ = 0 is more likely.
    """
    return likelihood(count).best_scale(power, spectrum)[:2]


def bin_levels(power: Array, count: Array, spectrum: Array, scale: int | None) -> Array:
    """Estimated ratio e^ε of true to modeled power in each bin, shape (bins,).

    `scale` is the index of the discrepancy δ in `SCALES`; None means δ = 0, and all ratios are 1. Groups of neighboring
    bins share one ratio. The ratio is also 1 in a group with less than half a degree of freedom: a regression fits such
    bins exactly, so that their power is rounding error.
    """
    if scale is None:
        return np.ones_like(power)
    # Fraction of a cell's deviation in ln power that is attributed to the discrepancy.
    first = cells_of(count.size)
    total = np.add.reduceat(count, first)
    taken = (
        1.0 - np.add.reduceat(marginal_likelihood(power, count, spectrum, scale)[1], first) / total
    )
    mean = np.add.reduceat(count * power / spectrum, first) / total
    mean[total < 0.5] = 1.0
    return np.repeat(mean**taken, np.diff([*first, count.size]))


def linearized(
    slopes: Array, power: Array, count: Array, spectrum: Array, weight: Array
) -> tuple[Array, Array]:
    """Pair (rows, residual) of the least-squares problem rows · x ≈ residual, whose solution x is a Fisher-scoring step.

    `slopes`, shape (bins, p), are ∂ln S/∂x; `weight` is that of `marginal_likelihood`. rows has shape (bins + groups, p); a
    group are neighboring bins that share one error of the model. First come the bins, as deviation from the mean of their
    group, with all degrees of freedom. The mean of each group follows, with the effective ones. ½ rowsᵀ·rows is the Fisher
    information, and ½ rowsᵀ·residual the gradient of logL.
    """
    first = cells_of(count.size)
    sizes = np.diff([*first, count.size])
    total, left = np.add.reduceat(count, first), np.add.reduceat(weight, first)
    ratio = power / spectrum
    mean = np.add.reduceat(count * ratio, first) / total
    middle = np.add.reduceat(count[:, None] * slopes, first, axis=0) / total[:, None]
    steep = 1.0 + left / total * (mean - 1.0)
    root = np.sqrt(count)
    inside = (slopes - np.repeat(middle, sizes, axis=0)) * root[:, None]
    residual = np.repeat(steep, sizes) * (ratio / np.repeat(mean, sizes) - 1.0) * root
    rows = np.vstack([inside, middle * np.sqrt(left)[:, None]])
    return rows, np.concatenate([residual, (mean - 1.0) * np.sqrt(left)])


def scale_interval(
    power: Array, count: Array, spectrum: Array, scale: int | None
) -> tuple[float, float]:
    """95 % interval of the discrepancy δ of ln power at a fixed spectrum, from its profile likelihood.

    `scale` is the index of the fitted δ in `SCALES`, or None for δ = 0. (0, 0.001) if no δ of `SCALES` is inside.
    """
    values = profile_likelihood(power, count, spectrum)
    plain, _ = marginal_likelihood(power, count, spectrum, None)
    inside = values > max(float(values.max()), plain) - HALF_CHI2_95
    if not inside.any():
        return 0.0, float(SCALES[0])
    at = SCALES[inside]
    low = 0.0 if scale is None or plain > float(values.max()) - HALF_CHI2_95 else float(at[0])
    return low, float(at[-1])


def expected_saturated_gain(count: Array) -> float:
    """Expected logL of the saturated model minus that of the true model: Σ ½n E[x − 1 − ln x], x ~ χ²_n/n."""
    from scipy.special import digamma

    half = count / 2.0
    return float(half @ (np.log(half) - digamma(half)))
