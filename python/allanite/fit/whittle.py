"""Whittle likelihood of binned ordinates: non-negative coefficients by Fisher scoring.

logL(θ) = −½ Σ_b n_b (ln S_b + I_b/S_b), S = Gθ, θ ≥ 0 the squared coefficients (Whittle 1953; Pawitan &
O'Sullivan 1994). With exact columns G it is unbiased (Sykulski et al. 2019, "debiased Whittle").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief

__all__ = [
    "Maximum",
    "information",
    "log_likelihood",
    "maximise",
    "normal_scores",
    "profile_interval",
]

Array = NDArray[np.float64]
#: Half the 95 % point of χ²₁. Limits beside 0 use it too: one-sided ones (1.3528), where the data themselves choose
#: between limit and interval, miss 5 % above and 2.5 % below, and K of a short N+B+K would be covered by 88 %.
LEVEL = 1.9207


@dataclass(frozen=True, slots=True, eq=False)
class Maximum:
    """The maximum of the likelihood: squared coefficients (p,), fitted spectrum (bins,), logL."""

    theta: Array
    spectrum: Array
    log_likelihood: float

    __repr__ = brief


def log_likelihood(power: Array, count: Array, spectrum: Array) -> float:
    """−½ Σ n_b (ln S_b + I_b/S_b)."""
    return float(-0.5 * (count @ (np.log(spectrum) + power / spectrum)))


def maximise(
    power: Array,
    count: Array,
    columns: Array,
    start: Array | None = None,
    offset: Array | None = None,
) -> Maximum:
    """Maximise the likelihood over θ ≥ 0.

    Parameters
    ----------
    power, count : ndarray, shape (bins,)
        Mean squared ordinate of each bin and its degrees of freedom.
    columns : ndarray, shape (bins, p)
        Expected power of each effect at coefficient 1.
    start : ndarray, shape (p,), optional
        Where to begin.
    offset : ndarray, shape (bins,), optional
        Power that is there in any case (held effects).

    Returns
    -------
    Maximum
    """
    from scipy.optimize import nnls

    base = np.zeros_like(power) if offset is None else offset
    floor = 1e-12 * float(np.max(power)) * 1e-12 + 1e-300
    root = np.sqrt(count)
    scale = 1.0 / np.maximum((columns / np.maximum(power, floor)[:, None]).max(axis=0), 1e-300)
    unit = columns * scale

    def evaluate(theta: Array) -> tuple[Array, float]:
        spectrum = np.maximum(unit @ theta + base, floor)
        return spectrum, log_likelihood(power, count, spectrum)

    if start is None:
        weight = root / np.maximum(power, floor)
        theta, _ = nnls(unit * weight[:, None], weight * np.maximum(power - base, 0.0))
        if not theta.any() and not base.any():
            theta = np.full(unit.shape[1], float(np.mean(power)) / unit.shape[1])
    else:
        theta = np.asarray(start) / scale
    spectrum, best = evaluate(theta)
    for _ in range(80):
        weight = root / spectrum
        goal, _ = nnls(unit * weight[:, None], weight * (power - base))
        step = 1.0
        moved, value = evaluate(goal)
        while not value > best - 1e-12 and step > 1e-3:
            step /= 2.0
            moved, value = evaluate(theta + step * (goal - theta))
        if not value > best:
            break
        gain = value - best
        theta, spectrum, best = theta + step * (goal - theta), moved, value
        if gain < 1e-7:
            break
    return Maximum(theta * scale, spectrum, best)


def information(count: Array, slopes: Array) -> Array:
    """Fisher information ½ Σ n_b (∂lnS_b)(∂lnS_b)ᵀ from the slopes ∂lnS_b/∂φ, shape (bins, p)."""
    return np.asarray(0.5 * slopes.T @ (slopes * count[:, None]))


def profile_interval(
    power: Array, count: Array, columns: Array, best: Maximum, index: int
) -> tuple[float, float, float]:
    """Profile-likelihood interval of θ_index with the other θ free.

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
        if others.shape[1] == 0:
            spectrum = np.maximum(column * theta, 1e-300)
            return best.log_likelihood - log_likelihood(power, count, spectrum)
        found = maximise(power, count, others, rest, column * theta)
        return best.log_likelihood - found.log_likelihood

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
    step = 1.0 / np.sqrt(max(float(0.5 * (slopes**2) @ count), 1e-300))
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
    return np.where(near, w + 1.0 / (3.0 * np.sqrt(nu)), corrected)
