"""Covariance of fitted numbers of the random part, and what a unit of logL tells of one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Deterministic, Model, Stochastic
from allanite.fit.likelihood.expected import column
from allanite.fit.likelihood.peaks import bins_near, is_fitted_to_ordinates
from allanite.fit.likelihood.whittle import information
from allanite.fit.missing.mixing import known_ordinates, mixing_of
from allanite.fit.shapes.narrow import Window

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution

__all__ = ["joint_covariance", "shape_widening", "told"]


def joint_covariance(
    solution: Solution, data: Data
) -> tuple[list[tuple[int, str]], NDArray[np.float64]]:
    """Covariance of the logarithms of all active numbers (of a signed shape itself), and whose they are.

    The inverse of their Fisher information; slopes of lnS by central differences. Names are (place of the effect,
    parameter).
    """
    model, spectrum = solution.model, solution.spectrum
    names: list[tuple[int, str]] = []
    slopes: list[NDArray[np.float64]] = []
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
            up, down = (_total(model, position, name, v, data) for v in moved)
            width = moved[0] - moved[1] if signed else float(np.log(moved[0] / moved[1]))
            names.append((position, name))
            slopes.append((up - down) / width / spectrum)
    if not names:
        return [], np.zeros((0, 0))
    covariance = _covariance(solution, data, np.column_stack(slopes))
    return _with_narrow(names, covariance, solution, data)


def _with_narrow(
    names: list[tuple[int, str]],
    covariance: NDArray[np.float64],
    solution: Solution,
    data: Data,
) -> tuple[list[tuple[int, str]], NDArray[np.float64]]:
    """With what single ordinates tell of narrow bands, which depends on nothing else of the model."""
    own = {(place, name): i for i, (place, name) in enumerate(names)}
    for place, effect in enumerate(solution.model):
        if not isinstance(effect, Stochastic) or not is_fitted_to_ordinates(effect, data):
            continue
        if not effect.values[effect.coefficient]:
            continue
        window = Window.of(solution.model, place, data, solution.ordinates)
        near = bins_near(effect, data.bins, data.rate)
        # Ordinates that share what they show tell less.
        share = solution.count[near].sum() / window.j.size
        for name, error in window.errors().items():
            at = own.get((place, name), covariance.shape[0])
            if at == covariance.shape[0]:
                covariance = np.pad(covariance, (0, 1))
                names = [*names, (place, name)]
            covariance[at, :], covariance[:, at] = 0.0, 0.0
            covariance[at, at] = error**2 / min(share, 1.0)
    return names, covariance


def _covariance(solution: Solution, data: Data, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Covariance of numbers with these slopes of lnS, fitted together."""
    shared = _by_scores(data, solution.weight, slopes)
    return _claimed(solution, slopes) if shared is None else shared


def _by_scores(
    data: Data, weight: NDArray[np.float64], slopes: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Covariance of fitted numbers where holes make the power of bins depend on each other.

    The estimate solves Σ_b w_b (I_b/S_b − 1) ∂lnS_b/∂φ = 0, and I_a/S_a and I_b/S_b have the covariance
    2 Σ (δ_ji − c_ji)² over the degrees of freedom of both (Godambe's sandwich).

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
        None where nothing is missing.
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


def _claimed(solution: Solution, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same as if no two bins depended on each other: the inverse of the Fisher information."""
    fisher = information(solution.count, solution.weight, slopes)
    scale = np.sqrt(np.maximum(np.diag(fisher), 1e-300))
    inverse = np.linalg.pinv(fisher / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    np.fill_diagonal(inverse, np.maximum(np.diag(inverse), 0.0))
    return np.asarray(inverse / np.outer(scale, scale))


def told(solution: Solution, own: Process, data: Data) -> float:
    """Variance that the likelihood claims for a coefficient over its sandwich variance."""
    if data.gain is None:
        return 1.0
    beside = [other.column for other in solution.processes if other.theta > 0.0 and other != own]
    # Of θ itself: its logarithm has no slope at 0.
    slopes = np.column_stack([own.column, *beside]) / solution.spectrum[:, None]
    slopes /= np.maximum(np.abs(slopes).max(axis=0), 1e-300)
    real = float(_covariance(solution, data, slopes)[0, 0])
    claimed = float(_claimed(solution, slopes)[0, 0])
    return claimed / real if real > 0.0 else 1.0


def _total(model: Model, position: int, name: str, value: float, data: Data) -> NDArray[np.float64]:
    effects = list(model.effects)
    effects[position] = effects[position].with_values(**{name: value})
    return column(data.terms(Model(tuple(effects))), data)


def shape_widening(solution: Solution, own: Process, relative: float, data: Data) -> float:
    """How much wider the standard error `relative` of ln(coefficient) is than at fixed shapes; at least 1."""
    active = [process for process in solution.processes if process.theta > 0.0]
    slopes = np.column_stack([2.0 * process.power / solution.spectrum for process in active])
    index = active.index(own)
    fixed = float(np.sqrt(_covariance(solution, data, slopes)[index, index]))
    return max(1.0, relative / fixed) if fixed > 0 else 1.0
