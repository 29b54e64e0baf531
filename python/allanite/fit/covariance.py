"""Covariance of the fitted parameters of random effects, also with missing samples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array, scaled_inverse
from allanite.effects import Deterministic, Stochastic
from allanite.fit.likelihood.expected import column
from allanite.fit.likelihood.peaks import bins_near, is_fitted_to_ordinates
from allanite.fit.likelihood.whittle import information
from allanite.fit.missing.mixing import known_ordinates, mixing_of
from allanite.fit.shapes.narrow import Window

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution


def joint_covariance(solution: Solution, data: Data) -> tuple[list[tuple[int, str]], Array]:
    """Pair: names and covariance matrix of the fitted parameters of random effects and modifiers; both may be empty.

    Names are (index of the effect, parameter). Effects that are 0, held values and texts are omitted. The covariance is
    that of ln(parameter), or of the parameter itself if it may be negative. It is the inverse Fisher information, with
    slopes of ln S by central differences. With missing samples it is the sandwich covariance.
    """
    model, spectrum = solution.model, solution.spectrum
    names: list[tuple[int, str]] = []
    slopes: list[Array] = []
    processes = iter(solution.processes)
    for position, effect in enumerate(model):
        if isinstance(effect, Deterministic):
            continue
        if isinstance(effect, Stochastic):
            own = next(processes)
            if own.theta == 0.0:
                continue
            if effect.coefficient not in effect.held:
                names.append((position, effect.coefficient))
                slopes.append(2.0 * own.theta * own.column / spectrum)
        for name in () if is_fitted_to_ordinates(effect, data) else effect.free_shapes:
            value = effect.values[name]
            if isinstance(value, str) or value is None:
                continue
            step = 1e-3
            declared = effect.parameter(name)
            signed = declared.low < 0.0
            moved = [value + s if signed else value * np.exp(s) for s in (step, -step)]
            moved = [min(max(float(v), declared.low), declared.high) for v in moved]
            up, down = (
                column(data.terms(model.replaced(position, **{name: v})), data) for v in moved
            )
            width = moved[0] - moved[1] if signed else float(np.log(moved[0] / moved[1]))
            names.append((position, name))
            slopes.append((up - down) / width / spectrum)
    if not names:
        return [], np.zeros((0, 0))
    covariance = _covariance(solution, data, np.column_stack(slopes))
    return _with_narrow_bands(names, covariance, solution, data)


def _with_narrow_bands(
    names: list[tuple[int, str]], covariance: Array, solution: Solution, data: Data
) -> tuple[list[tuple[int, str]], Array]:
    """Pair: parameter names and covariance, in which narrow bands have the variances from single ordinates.

    Parameters of narrow bands are uncorrelated with all others. Names that are not in `names` are appended. The given
    `covariance` may be changed in place.
    """
    own = {(place, name): i for i, (place, name) in enumerate(names)}
    for place, effect in enumerate(solution.model):
        if not isinstance(effect, Stochastic) or not is_fitted_to_ordinates(effect, data):
            continue
        if not effect.values[effect.coefficient]:
            continue
        window = Window.of(solution.model, place, data, solution.ordinates)
        near = bins_near(effect, data.bins, data.rate)
        # Correlated ordinates contain less information.
        share = solution.count[near].sum() / window.j.size
        for name, error in window.errors().items():
            at = own.get((place, name), covariance.shape[0])
            if at == covariance.shape[0]:
                covariance = np.pad(covariance, (0, 1))
                names = [*names, (place, name)]
            covariance[at, :], covariance[:, at] = 0.0, 0.0
            covariance[at, at] = error**2 / min(share, 1.0)
    return names, covariance


def _covariance(solution: Solution, data: Data, slopes: Array) -> Array:
    """Array of the covariance of p parameters, shape (p, p), from the slopes ∂ln S/∂parameter, shape (bins, p).

    The sandwich covariance if samples are missing, otherwise the inverse Fisher information.
    """
    shared = _sandwich_covariance(data, solution.weight, slopes)
    return _independent_covariance(solution, slopes) if shared is None else shared


def _sandwich_covariance(data: Data, weight: Array, slopes: Array) -> Array | None:
    """Covariance matrix of the parameters (sandwich estimator), or None for a record without missing samples.

    Missing samples correlate the power of different bins, which the inverse Fisher information neglects.

    The estimate solves Σ_b w_b (I_b/S_b − 1) ∂lnS_b/∂φ = 0, with the measured power I_b and the model S_b of bin b. Its
    covariance is A⁻¹BA⁻¹ (Godambe): A = Σ_b w_b ∂lnS_b/∂φ (∂lnS_b/∂φ)ᵀ, and B follows from the covariance of the I_b/S_b
    (`mixing_of`).

    Parameters
    ----------
    data : Data
    weight : ndarray, shape (bins,)
        Effective degrees of freedom.
    slopes : ndarray, shape (bins, p)
        ∂lnS_b/∂φ.

    Returns
    -------
    ndarray, shape (p, p), or None
    """
    if data.missing is None or data.gain is None:
        return None
    share = 1.0 - data.gain**2
    seen = known_ordinates(share, data.bins)
    shared = seen[:, None] * mixing_of(data.missing, share, data.bins)
    shared = 0.5 * (shared + shared.T)
    rows = slopes * (weight / seen)[:, None]
    answer = np.linalg.pinv((slopes * weight[:, None]).T @ slopes, rcond=1e-10, hermitian=True)
    return np.asarray(2.0 * answer @ (rows.T @ shared @ rows) @ answer)


def _independent_covariance(solution: Solution, slopes: Array) -> Array:
    """Array of the covariance of p parameters, shape (p, p), if bins are independent: the inverse Fisher information.

    `slopes` are ∂ln S/∂parameter, shape (bins, p).
    """
    fisher = information(solution.count, solution.weight, slopes)
    covariance = scaled_inverse(fisher)
    np.fill_diagonal(covariance, np.maximum(np.diag(covariance), 0.0))
    return covariance


def logl_scale(solution: Solution, own: Process, data: Data) -> float:
    """Factor by which to multiply logL to account for correlated bins when samples are missing.

    It is the variance of a squared coefficient by the likelihood, divided by its sandwich variance. It is 1 without missing
    samples, or if the sandwich variance is 0.
    """
    if data.gain is None:
        return 1.0
    other_columns = [
        other.column for other in solution.processes if other.theta > 0.0 and other != own
    ]
    # Slopes by θ itself, since ln θ has no slope at 0.
    slopes = np.column_stack([own.column, *other_columns]) / solution.spectrum[:, None]
    slopes /= np.maximum(np.abs(slopes).max(axis=0), 1e-300)
    real = float(_covariance(solution, data, slopes)[0, 0])
    claimed = float(_independent_covariance(solution, slopes)[0, 0])
    return claimed / real if real > 0.0 else 1.0


def shape_widening(solution: Solution, own: Process, relative: float, data: Data) -> float:
    """Ratio, at least 1, of two standard errors of ln(coefficient): with shapes fitted (`relative`), and with shapes fixed.

    1 if the standard error with fixed shapes is 0.
    """
    active = [process for process in solution.processes if process.theta > 0.0]
    slopes = np.column_stack([2.0 * process.power / solution.spectrum for process in active])
    index = active.index(own)
    fixed = float(np.sqrt(_covariance(solution, data, slopes)[index, index]))
    return max(1.0, relative / fixed) if fixed > 0 else 1.0
