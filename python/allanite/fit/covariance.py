"""Covariance of the fitted parameters of random effects, also with missing samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array, scaled_inverse
from allanite.common.documents import fields_dict
from allanite.effects import Model, Stochastic
from allanite.fit.likelihood.expected import columns
from allanite.fit.likelihood.peaks import bins_near, is_fitted_to_ordinates
from allanite.fit.likelihood.whittle import information
from allanite.fit.missing.shares import known_ordinates, mixing_of
from allanite.fit.models import parameter_label
from allanite.fit.shapes.narrow import Window
from allanite.fit.shapes.polish import Shapes
from allanite.fit.shapes.scan import free_shape_parameters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution
    from allanite.spectrum import Bins

#: Correlation above which two parameters cannot be distinguished: their standard errors are then five times (1/√(1 −
#: 0.98²)) those with the other parameter given.
MAX_CORRELATION = 0.98
#: Maximum correlation time, as a fraction of the record, that can be distinguished from a random walk. Chosen by judgment;
#: not measured.
MAX_CORRELATION_TIME_FRACTION = 0.25


def joint_covariance(solution: Solution, data: Data) -> tuple[list[tuple[int, str]], Array]:
    """Pair: names and covariance matrix of the fitted parameters of random effects and modifiers; both may be empty.

    Names are (index of the effect, parameter). Effects that are 0, held values and texts are omitted. The covariance is
    that of ln(parameter), or of the parameter itself if it may be negative. It is the inverse Fisher information, with
    slopes of ln S by differences. With missing samples it is the sandwich covariance.
    """
    effects = solution.model.effects
    names, slopes = spectral_slopes(solution.model, data)
    of_bins = [
        not (name in effects[place].free_shapes and is_fitted_to_ordinates(effects[place], data))
        for place, name in names
    ]
    names = [name for name, is_kept in zip(names, of_bins, strict=True) if is_kept]
    if not names:
        return [], np.zeros((0, 0))
    covariance = _covariance(solution, data, slopes[:, of_bins])
    return _with_narrow_bands(names, covariance, solution, data)


def spectral_slopes(model: Model, data: Data) -> tuple[list[tuple[int, str]], Array]:
    """Pair: free parameters of random effects and modifiers, and the slopes of ln(expected bin power), shape (bins, p).

    Parameters are (index of the effect, name). Effects that are 0 and texts are omitted. A slope is the derivative by
    ln(parameter), or by the parameter itself if it may be negative.
    """
    matrix = columns(model, data)
    theta = np.array([getattr(e, e.coefficient) for e in model.stochastic]) ** 2
    power = np.maximum(matrix @ theta, 1e-300)
    random = {place: e for place, e in enumerate(model) if isinstance(e, Stochastic)}
    active = [place for place, size in zip(random, theta, strict=True) if size > 0.0]
    names = [
        (p, random[p].coefficient) for p in active if random[p].coefficient not in random[p].held
    ]
    own = dict(zip(random, (2.0 * theta * matrix).T, strict=True))
    places = [(p, n) for p, n in free_shape_parameters(model) if p in active or p not in random]
    shapes = Shapes.of(model, places, data)
    parts = [own[place] for place, _ in names]
    # A band fitted to single ordinates may be narrower than the limits of the shapes of bins.
    parts += list(shapes.slopes(shapes.present(), power, theta, data).T)
    every = sorted(zip([*names, *places], parts, strict=True), key=lambda pair: pair[0][0])
    slopes = np.array([part for _, part in every]).reshape(-1, power.size).T
    return [name for name, _ in every], slopes / power[:, None]


def fitted_freedom(solution: Solution, data: Data) -> float:
    """Degrees of freedom that the fitted parameters take from the χ² of the groups of bins (ten per decade).

    It is the sum over the groups of the variance of their expected power that the errors of the parameters cause, relative
    to the variance of the measured power. A parameter of the whole spectrum takes up to one degree of freedom. A band much
    narrower than a group takes at most one with all of its parameters.
    """
    _, slopes = spectral_slopes(solution.model, data)
    weighted = solution.count[:, None] * slopes
    total = np.maximum(np.add.reduceat(solution.count, data.bins.groups), 1e-300)
    of_groups = np.add.reduceat(weighted, data.bins.groups) / np.sqrt(2.0 * total)[:, None]
    covariance = scaled_inverse(0.5 * weighted.T @ slopes)
    return float(np.einsum("gp,pq,gq", of_groups, covariance, of_groups))


def _with_narrow_bands(
    names: list[tuple[int, str]], covariance: Array, solution: Solution, data: Data
) -> tuple[list[tuple[int, str]], Array]:
    """Pair: parameter names and covariance, in which narrow bands have the variances from single ordinates.

    Parameters of narrow bands are uncorrelated with all others.
    """
    variances: dict[tuple[int, str], float] = {}
    for place, effect in enumerate(solution.model):
        if not isinstance(effect, Stochastic) or not is_fitted_to_ordinates(effect, data):
            continue
        if not effect.values[effect.coefficient]:
            continue
        window = Window.of(solution.model, place, data, solution.ordinates)
        near = bins_near(effect, data.bins, data.rate)
        # Correlated ordinates contain less information.
        share = min(solution.count[near].sum() / window.j.size, 1.0)
        variances |= {(place, name): e**2 / share for name, e in window.errors().items()}
    every = list(dict.fromkeys([*names, *variances]))
    covariance = np.pad(covariance, (0, len(every) - len(names)))
    for key, variance in variances.items():
        at = every.index(key)
        covariance[at, :], covariance[:, at] = 0.0, 0.0
        covariance[at, at] = variance
    return every, covariance


def _covariance(solution: Solution, data: Data, slopes: Array) -> Array:
    """Covariance of p parameters, shape (p, p), from the slopes ∂ln S/∂parameter, shape (bins, p)."""
    if data.missing is None or data.gain is None:
        return _independent_covariance(solution, slopes)
    return _sandwich_covariance(data.missing, data.gain, data.bins, solution.weight, slopes)


def _sandwich_covariance(
    missing: NDArray[np.bool_], gain: Array, bins: Bins, weight: Array, slopes: Array
) -> Array:
    """Covariance matrix of the parameters of a record with missing samples (sandwich estimator), shape (p, p).

    Missing samples correlate the power of different bins, which the inverse Fisher information neglects.

    The estimate solves Σ_b w_b (I_b/S_b − 1) ∂lnS_b/∂φ = 0, with the measured power I_b and the model S_b of bin b. Its
    covariance is A⁻¹BA⁻¹ (Godambe): A = Σ_b w_b ∂lnS_b/∂φ (∂lnS_b/∂φ)ᵀ, and B follows from the covariance of the I_b/S_b
    (`mixing_of`). `weight`, shape (bins,), are effective degrees of freedom; `slopes`, shape (bins, p), are ∂lnS_b/∂φ.
    """
    share = 1.0 - gain**2
    seen = known_ordinates(share, bins)
    shared = seen[:, None] * mixing_of(missing, share, bins)
    shared = 0.5 * (shared + shared.T)
    rows = slopes * (weight / seen)[:, None]
    answer = np.linalg.pinv((slopes * weight[:, None]).T @ slopes, rcond=1e-10, hermitian=True)
    return np.asarray(2.0 * answer @ (rows.T @ shared @ rows) @ answer)


def _independent_covariance(solution: Solution, slopes: Array) -> Array:
    """Covariance of p parameters, shape (p, p), if bins are independent: the inverse Fisher information."""
    fisher = information(solution.count, solution.weight, slopes)
    covariance = scaled_inverse(fisher)
    np.fill_diagonal(covariance, np.maximum(np.diag(covariance), 0.0))
    return covariance


def logl_scale(solution: Solution, own: Process, data: Data) -> float:
    """Factor by which to multiply logL to account for correlated bins when samples are missing.

    It is the variance of a squared coefficient by the likelihood, divided by its sandwich variance.
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
    """Ratio, at least 1, of two standard errors of ln(coefficient): with shapes fitted (`relative`) and fixed."""
    active = [process for process in solution.processes if process.theta > 0.0]
    slopes = np.column_stack([2.0 * process.power / solution.spectrum for process in active])
    index = active.index(own)
    fixed = float(np.sqrt(_covariance(solution, data, slopes)[index, index]))
    return max(1.0, relative / fixed) if fixed > 0 else 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Correlations:
    """Correlation matrix of the fitted parameters ``N``, ``GM.q_c``, … of random effects and modifiers.

    Parameters at zero are absent.
    """

    names: tuple[str, ...]
    matrix: Array

    def __post_init__(self) -> None:
        self.matrix.flags.writeable = False

    def to_dict(self) -> dict[str, Any]:
        """Dict of names and matrix (as nested lists), for JSON."""
        return fields_dict(self)


def correlations(solution: Solution, data: Data) -> Correlations:
    """`Correlations` of the fitted parameters of random effects and modifiers, from their joint covariance.

    They are those of the logarithms of the parameters, or of the parameter itself if it may be negative.
    """
    places, covariance = joint_covariance(solution, data)
    labels = solution.model.labels
    names = tuple(parameter_label(labels[place], name) for place, name in places)
    spread = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return Correlations(names, covariance / np.outer(spread, spread))


def degeneracies(found: Correlations, model: Model, data: Data) -> list[str]:
    """List of a sentence for each correlation time or pair of parameters that this record cannot determine.

    A correlation time is determined between the sampling interval and `MAX_CORRELATION_TIME_FRACTION` of the duration, a
    pair up to a correlation of ±`MAX_CORRELATION`.
    """
    out = []
    for effect, label in zip(model, model.labels, strict=True):
        time = effect.values.get("correlation_time")
        if time is None or isinstance(time, (str, tuple)):
            continue
        if time > MAX_CORRELATION_TIME_FRACTION * data.duration:
            out.append(
                f"{label}: a correlation time of {time:.3g} s in a record of {data.duration:.3g} s cannot be distinguished "
                f"from a rate random walk; only q_c is known"
            )
        elif time * data.rate < 1.0:
            out.append(
                f"{label}: a correlation time below the sampling interval cannot be distinguished from white noise"
            )
    for a in range(len(found.names)):
        for b in range(a):
            value = float(found.matrix[a, b])
            if abs(value) > MAX_CORRELATION:
                out.append(
                    f"{found.names[b]} and {found.names[a]} cannot be distinguished (correlation {value:+.3f}); "
                    f"hold or remove one of them"
                )
    return out
