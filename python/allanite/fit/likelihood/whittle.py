"""Maximum Whittle likelihood of binned ordinates over non-negative coefficients, by Fisher scoring.

logL(θ) = −½ Σ_b n_b (ln S_b + I_b/S_b), S = Gθ, θ ≥ 0 the squared coefficients (Whittle 1953; Pawitan &
O'Sullivan 1994). With exact columns G it is unbiased (Sykulski et al. 2019, "debiased Whittle").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.fit.likelihood.discrepancy import (
    HALF_CHI2_95,
    MIN_DISCREPANCY_DELTA_LOGL,
    best_scale,
    likelihood,
    linearized,
)

if TYPE_CHECKING:
    from collections.abc import Callable

#: Minimum degrees of freedom of a bin whose normal score is computed; below, the bin is empty and its score is 0.
#: Chosen by judgment; not measured.
MIN_SCORED_FREEDOM = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Maximum:
    """A maximum of the marginal likelihood over coefficients and discrepancy.

    `theta`, shape (p,), are squared coefficients; `spectrum` and `weight`, shape (bins,), the fitted power and the
    effective degrees of freedom. `scale` is the index of the discrepancy δ in `discrepancy.SCALES`; None for δ = 0. With a
    discrepancy, `log_likelihood` is reduced by `MIN_DISCREPANCY_DELTA_LOGL`.
    """

    theta: Array
    spectrum: Array
    log_likelihood: float
    scale: int | None
    weight: Array

    __repr__ = brief


def log_likelihood(power: Array, count: Array, spectrum: Array) -> float:
    """Whittle log-likelihood −½ Σ n_b (ln S_b + I_b/S_b) of a spectrum S (a float)."""
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
    """Local `Maximum` of the likelihood over θ ≥ 0, by at most `rounds` Fisher-scoring steps from `theta`.

    With a `scale`, the discrepancy δ is fitted too, from SCALES[scale]. With None, δ is 0. Each step is a non-negative
    least-squares problem with the effective degrees of freedom, shortened until logL rises. `offset` is the power of held
    effects, shape (bins,).
    """
    law = likelihood(count)
    found, spectrum, value, scale, weight = law.climb(power, columns, theta, scale, offset, rounds)
    total = value - (MIN_DISCREPANCY_DELTA_LOGL if scale is not None else 0.0)
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
    """Tuple (coefficients, logL, discrepancies) of the local maxima that `climb` reaches from m starts, in parallel.

    `columns`, shape (m, bins, p), and `thetas`, shape (m, p), are those of each start. `scale` is the index in `SCALES` at
    which the fit of the discrepancy δ starts, and logL is then lowered by 3 nats; None means δ = 0. With `cells`, each bin
    has its own error of the model; otherwise groups of neighboring bins share one. The discrepancies are indices, too, or
    None.
    """
    law = likelihood(count, cells=cells)
    found, values, scales = law.climb_many(power, columns, thetas, scale, rounds)
    return found, values - (MIN_DISCREPANCY_DELTA_LOGL if scale is not None else 0.0), scales


def maximize(
    power: Array,
    count: Array,
    columns: Array,
    start: Maximum | None = None,
    offset: Array | None = None,
) -> Maximum:
    """`Maximum` of the likelihood over θ ≥ 0 and the discrepancy δ: the best of up to three local maxima.

    The first has δ = 0 and starts from least squares, or from `start` if this has δ = 0. The others have δ > 0. They are
    tried only if some δ > 0 raises the logL at the first maximum. `start` is a maximum of nearly the same columns.
    `offset`, shape (bins,), is the power of held effects.
    """
    known = None if start is None or start.scale is not None else start.theta
    # Without a start: θ ≥ 0 that minimizes the squared relative errors of the bin power, weighted by `count`.
    theta = likelihood(count).first(power, columns, offset) if known is None else known
    plain = climb(power, count, columns, theta, None, offset)
    found = [plain]
    scale, value = best_scale(power, count, plain.spectrum)
    if value > plain.log_likelihood:
        starts = [(plain.theta, scale)]
        if start is not None and start.scale is not None:
            starts.append((start.theta, start.scale))
        found += [climb(power, count, columns, theta, scale, offset) for theta, scale in starts]
    return max(found, key=lambda m: m.log_likelihood)


def information(count: Array, weight: Array, slopes: Array) -> Array:
    """Fisher information matrix of parameters φ, shape (p, p), from the slopes ∂lnS_b/∂φ, shape (bins, p).

    `count` are the degrees of freedom n_b, and `weight` the lower effective ones under a discrepancy (`Maximum.weight`).
    Without discrepancy both are equal, and the matrix is ½ Σ n_b (∂lnS_b)(∂lnS_b)ᵀ.
    """
    rows, _ = linearized(slopes, count, count, count, weight)
    return np.asarray(0.5 * rows.T @ rows)


def profile_loss(
    power: Array, count: Array, columns: Array, best: Maximum, index: int
) -> Callable[[float], float]:
    """Function of the squared coefficient at `index`: loss of logL, nats, if all others are fitted again.

    The discrepancy is fitted again too, if `best` has one.
    """
    others, column = np.delete(columns, index, axis=1), columns[:, index]
    other_theta = np.delete(best.theta, index)

    def loss(theta: float) -> float:
        """Loss of logL, nats, if the squared coefficient is fixed at `theta` and all others are fitted again."""
        fixed = np.maximum(column * theta, 1e-300)
        found = climb(power, count, others, other_theta, best.scale, fixed)
        return best.log_likelihood - found.log_likelihood

    return loss


def loss_at_zero(power: Array, count: Array, columns: Array, best: Maximum, index: int) -> float:
    """Loss of logL, nats, if the squared coefficient at `index` is 0 and all others are fitted again; ∞ without others."""
    if columns.shape[1] == 1:
        return np.inf
    return profile_loss(power, count, columns, best, index)(0.0)


def profile_interval(
    power: Array, count: Array, columns: Array, best: Maximum, index: int, logl_scale: float = 1.0
) -> tuple[float, float, float]:
    """Tuple (low, high, drop): 95 % profile-likelihood interval of the squared coefficient θ at `index`, and loss at θ = 0.

    `logl_scale` multiplies logL to correct for correlated bins. It is the variance of the coefficient that the likelihood
    states, divided by the actual variance (Chandler & Bate 2007). `low` is 0 if 0 is inside. `drop` is infinite if the
    model has one coefficient.
    """
    from scipy.optimize import brentq

    loss = profile_loss(power, count, columns, best, index)
    at_zero = logl_scale * loss_at_zero(power, count, columns, best, index)

    def drop(theta: float) -> float:
        """Loss of the scaled logL if the squared coefficient is fixed at `theta` and all others are fitted again."""
        return logl_scale * loss(theta)

    def end(inside: float, outside: float) -> float:
        """Squared coefficient θ between `inside` and `outside` at an end of the 95 % interval.

        It is searched in √θ, where the profile is nearly a parabola.
        """
        a, b = np.sqrt(inside), np.sqrt(outside)
        root = brentq(lambda r: drop(r * r) - HALF_CHI2_95, a, b, xtol=1e-4 * abs(b - a))
        return float(root) ** 2

    center = float(best.theta[index])
    low = end(center, 0.0) if at_zero > HALF_CHI2_95 else 0.0
    # Start the search for the upper end at twice the standard error with all other coefficients fixed.
    slopes = columns[:, index] / best.spectrum
    known = logl_scale * float(information(count, best.weight, slopes[:, None])[0, 0])
    step = 1.0 / np.sqrt(max(known, 1e-300))
    outside = center + 2.0 * step
    for _ in range(60):
        if drop(outside) > HALF_CHI2_95:
            break
        outside = center + 2.0 * (outside - center)
    return low, end(center, outside), float(max(at_zero, 0.0))


def normal_scores(power: Array, count: Array, spectrum: Array) -> Array:
    """Standard normal scores of the bins under I/S ~ χ²_n/n, shape (bins,); 0 for empty bins (n < 0.01).

    I is `power`, S is `spectrum`, and n is `count`. The score is the signed root of the deviance with its higher-order
    correction (Barndorff-Nielsen's r*). It is at most 0.03 off for n = 1, and finite in the far tails.
    """
    nu = count / 2.0
    ratio = np.maximum(power / spectrum, 1e-300)
    deviance = 2.0 * nu * (ratio - 1.0 - np.log(ratio))
    w = np.sign(ratio - 1.0) * np.sqrt(np.maximum(deviance, 0.0))
    u = np.sqrt(nu) * (ratio - 1.0)
    near = np.abs(w) < 1e-3
    safe = np.where(near, 1.0, w)
    corrected = w + np.log(np.where(near, 1.0, np.abs(u)) / np.abs(safe)) / safe
    return np.where(
        count < MIN_SCORED_FREEDOM, 0.0, np.where(near, w + 1.0 / (3.0 * np.sqrt(nu)), corrected)
    )
