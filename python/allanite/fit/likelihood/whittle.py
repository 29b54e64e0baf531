"""Whittle likelihood of binned ordinates: non-negative coefficients by Fisher scoring.

logL(θ) = −½ Σ_b n_b (ln S_b + I_b/S_b), S = Gθ, θ ≥ 0 the squared coefficients (Whittle 1953; Pawitan &
O'Sullivan 1994). With exact columns G it is unbiased (Sykulski et al. 2019, "debiased Whittle").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import (
    EVIDENCE,
    HALF_CHI2,
    best_scale,
    likelihood,
    linearised,
)

__all__ = [
    "Maximum",
    "climb",
    "climb_many",
    "first_guess",
    "information",
    "log_likelihood",
    "maximise",
    "normal_scores",
    "profile_interval",
]

Array = NDArray[np.float64]
#: Half the 95 % point of χ²₁. Limits beside 0 use it too: one-sided ones (1.3528), where the data themselves choose
#: between limit and interval, miss 5 % above and 2.5 % below, and K of a short N+B+K would be covered by 88 %.
LEVEL = HALF_CHI2
#: Most degrees of freedom of a bin in the fit that gives each about one vote.
VOTES = 10.0
#: Degrees of freedom below which nothing was seen.
SEEN = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Maximum:
    """The maximum of the likelihood.

    Attributes
    ----------
    theta : ndarray, shape (p,)
        Squared coefficients.
    spectrum : ndarray, shape (bins,)
        Fitted spectrum.
    log_likelihood : float
        Marginal logL, less `EVIDENCE` where there is a discrepancy.
    scale : int or None
        Index of the discrepancy's scale in `discrepancy.SCALES`; None where the model is taken for true.
    weight : ndarray, shape (bins,)
        Effective degrees of freedom.
    """

    theta: Array
    spectrum: Array
    log_likelihood: float
    scale: int | None
    weight: Array

    __repr__ = brief


def log_likelihood(power: Array, count: Array, spectrum: Array) -> float:
    """−½ Σ n_b (ln S_b + I_b/S_b)."""
    return float(-0.5 * (count @ (np.log(spectrum) + power / spectrum)))


def climb(
    power: Array,
    count: Array,
    columns: Array,
    theta: Array,
    scale: int | None,
    offset: Array | None = None,
    rounds: int = 80,
) -> Maximum:
    """The maximum of the likelihood that lies uphill of `theta`, θ ≥ 0; a scale of discrepancy is fitted on the way.

    Fisher scoring: non-negative least squares with the effective degrees of freedom, shortened until logL rises.
    """
    law = likelihood(count)
    found, spectrum, value, scale, weight = law.climb(power, columns, theta, scale, offset, rounds)
    total = value - (EVIDENCE if scale is not None else 0.0)
    return Maximum(found, spectrum, total, scale, weight)


def climb_many(
    power: Array,
    count: Array,
    columns: Array,
    thetas: Array,
    scale: int | None,
    rounds: int = 80,
    *,
    cells: bool = False,
) -> tuple[Array, Array, list[int | None]]:
    """`climb` from many starts, each with columns of its own, on all processors.

    Parameters
    ----------
    power, count : ndarray, shape (bins,)
        Mean squared ordinate of each bin and its degrees of freedom.
    columns : ndarray, shape (m, bins, p)
        Expected power of each effect at coefficient 1.
    thetas : ndarray, shape (m, p)
        Starts.
    scale : int or None
        Where the scale of discrepancy begins; None: δ = 0.
    rounds : int
        Most rounds of each.
    cells : bool
        Whether the powers are those of whole cells.

    Returns
    -------
    tuple
        Squared coefficients (m, p); logL as `Maximum` has it, shape (m,); the index of each scale.
    """
    law = likelihood(count, cells=cells)
    found, values, scales = law.climb_many(power, columns, thetas, scale, rounds)
    return found, values - (EVIDENCE if scale is not None else 0.0), scales


def maximise(
    power: Array,
    count: Array,
    columns: Array,
    start: Maximum | None = None,
    offset: Array | None = None,
) -> Maximum:
    """Maximise the likelihood over θ ≥ 0 and the scale of the discrepancy.

    Parameters
    ----------
    power, count : ndarray, shape (bins,)
        Mean squared ordinate of each bin and its degrees of freedom.
    columns : ndarray, shape (bins, p)
        Expected power of each effect at coefficient 1.
    start : Maximum, optional
        Where to look first, with `theta` of shape (p,): another maximum of nearly the same columns.
    offset : ndarray, shape (bins,), optional
        Power that is there in any case (held effects).

    Returns
    -------
    Maximum
    """

    def plainly(votes: Array) -> Maximum:
        first = first_guess(power, votes, columns, offset)
        return climb(power, votes, columns, first, None, offset)

    plain = plainly(count)
    scale, value = best_scale(power, count, plain.spectrum)
    found = [plain]
    if value > plain.log_likelihood:
        # A wrong model has several maxima: near the Whittle fit, and where every bin has one vote.
        even = plainly(np.minimum(count, VOTES))
        starts = [(plain.theta, scale), (even.theta, best_scale(power, count, even.spectrum)[0])]
        if start is not None and start.scale is not None:
            starts.append((start.theta, start.scale))
        found += [climb(power, count, columns, theta, scale, offset) for theta, scale in starts]
    return max(found, key=lambda m: m.log_likelihood)


def first_guess(power: Array, count: Array, columns: Array, offset: Array | None) -> Array:
    """Least squares in units of the measured power."""
    return likelihood(count).first(power, columns, offset)


def information(count: Array, weight: Array, slopes: Array) -> Array:
    """Fisher information of φ from the slopes ∂lnS_b/∂φ, shape (bins, p).

    ½ Σ n_b (∂lnS_b)(∂lnS_b)ᵀ where weight is count.
    """
    rows, _ = linearised(slopes, count, count, count, weight)
    return np.asarray(0.5 * rows.T @ rows)


def profile_interval(
    power: Array, count: Array, columns: Array, best: Maximum, index: int, told: float = 1.0
) -> tuple[float, float, float]:
    """Profile-likelihood interval of θ_index with the other θ free.

    `told` is what a unit of logL is worth where bins depend on each other: the variance of θ_index that the likelihood
    claims over that it has (Chandler & Bate 2007).

    Returns
    -------
    tuple of float
        (low, high, drop): 95 % limits of θ, low = 0 where 0 is inside; and how much logL falls when
        θ_index = 0.
    """
    others = np.delete(columns, index, axis=1)
    column = columns[:, index]
    rest = np.delete(best.theta, index)

    def drop(theta: float) -> float:
        found = climb(power, count, others, rest, best.scale, column * theta)
        return told * (best.log_likelihood - found.log_likelihood)

    def search(inside: float, outside: float, level: float) -> float:
        # Bisection in the square root, where the profile is nearly a parabola.
        a, b = np.sqrt(inside), np.sqrt(outside)
        for _ in range(14):
            middle = 0.5 * (a + b)
            if drop(middle**2) < level:
                a = middle
            else:
                b = middle
        return float((0.5 * (a + b)) ** 2)

    centre = float(best.theta[index])
    at_zero = drop(0.0) if others.shape[1] else np.inf
    low = search(centre, 0.0, LEVEL) if at_zero > LEVEL else 0.0
    # The scale of one coefficient alone: as if every bin were its own.
    slopes = column / best.spectrum
    known = told * float(information(count, best.weight, slopes[:, None])[0, 0])
    step = 1.0 / np.sqrt(max(known, 1e-300))
    outside = centre + 2.0 * step
    for _ in range(60):
        if drop(outside) > LEVEL:
            break
        outside = centre + 2.0 * (outside - centre)
    return low, search(centre, outside, LEVEL), float(max(at_zero, 0.0))


def normal_scores(power: Array, count: Array, spectrum: Array) -> Array:
    """Standard normal score of each bin under I/S ~ χ²_n/n.

    Signed root of the deviance with its higher-order correction (Barndorff-Nielsen's r*), accurate to 0.03 for
    one degree of freedom and without an end in the far tails.
    """
    nu = count / 2.0
    ratio = np.maximum(power / spectrum, 1e-300)
    deviance = 2.0 * nu * (ratio - 1.0 - np.log(ratio))
    w = np.sign(ratio - 1.0) * np.sqrt(np.maximum(deviance, 0.0))
    u = np.sqrt(nu) * (ratio - 1.0)
    near = np.abs(w) < 1e-3
    safe = np.where(near, 1.0, w)
    corrected = w + np.log(np.where(near, 1.0, np.abs(u)) / np.abs(safe)) / safe
    return np.where(count < SEEN, 0.0, np.where(near, w + 1.0 / (3.0 * np.sqrt(nu)), corrected))
