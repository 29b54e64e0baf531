"""The 95 % band of the thermal law b(T), from the joint distribution of all fitted parameters and the noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.calibration.forms import design, law_of, with_near_best_evidence
from allanite.common.parameters import NORMAL
from allanite.common.showing import brief
from allanite.fit.marginal import joint_amplitudes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.calibration.forms import Tried
    from allanite.common.arrays import Array
    from allanite.fit import Fit

#: Number of random laws for the band. The width of the band then has a standard error of 2 %.
DRAWS = 4000
#: Number of temperatures of the curve, evenly spaced over the range of the logs.
POINTS = 101


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Law b(T) at constant temperature with its 95 % band, relative to the bias at the reference temperature.

    Attributes
    ----------
    reference : float
        °C.
    coefficients : ndarray, shape (3,)
        Coefficients of (T − reference), its square and its cube. With hysteresis, of the mean of both branches.
    temperature : ndarray, shape (k,)
        Temperatures over the range of the logs, °C.
    bias, low, high : ndarray, shape (k,)
        The law, and the band that contains the whole law with 95 % confidence, in the unit of the samples.
    loop : float
        Bias while cooling minus bias while warming, long after a change of direction; 0 without hysteresis.
    """

    reference: float
    coefficients: Array
    temperature: Array
    bias: Array
    low: Array
    high: Array
    loop: float

    __repr__ = brief


def curve_of(fit: Fit, temperature: Array, tried: Sequence[Tried] = ()) -> Curve:
    """`Curve` of a fitted law with its simultaneous 95 % band at 101 temperatures over the range of `temperature`, °C.

    Laws are drawn at random (seed 0) from the joint distribution of coefficients, lags and widths, over all noise
    models that agree with the record (`fit.marginal`). If several forms have similar evidence, each
    contributes laws in proportion to its evidence.

    The half-width is the root mean square deviation of random laws at each temperature, times the 95 % quantile of the
    largest ratio of a random law's deviation to this value. The quantile is at least 1.96.
    """
    reference = float(temperature.mean())
    grid = np.linspace(float(temperature.min()), float(temperature.max()), POINTS)
    coefficients, loop = _coefficients_and_loop(fit)
    bias = _bias_curves(coefficients[None], reference, grid, reference)[0]
    sources = [(one.fit, one.log_evidence) for one in with_near_best_evidence(tried)] or [
        (fit, 0.0)
    ]
    weight = np.exp([e - max(e for _, e in sources) for _, e in sources])
    rng = np.random.default_rng(0)
    deviations = []
    for (source, _), count in zip(
        sources, rng.multinomial(DRAWS, weight / weight.sum()), strict=True
    ):
        if count:
            center = float(np.mean(next(iter(source.data.covariates.values()))))
            deviations.append(
                _bias_curves(_random_coefficients(source, int(count), rng), center, grid, reference)
                - bias
            )
    deviation = np.concatenate(deviations)
    error = np.sqrt((deviation**2).mean(axis=0))
    known = error > 1e-9 * error.max(initial=0.0)
    if not known.any():
        return Curve(reference, coefficients, grid, bias, bias, bias, loop)
    largest = (np.abs(deviation[:, known]) / error[known]).max(axis=1)
    half = max(float(np.quantile(largest, 0.95)), NORMAL) * error
    return Curve(reference, coefficients, grid, bias, bias - half, bias + half, loop)


def _bias_curves(coefficients: Array, center: float, grid: Array, reference: float) -> Array:
    """Bias of several laws at the temperatures `grid`, minus that at the temperature `reference`, shape (laws, grid).

    `coefficients`, shape (laws, 3), are those of (T − `center`), its square and its cube.
    """
    powers = np.vander(np.append(grid, reference) - center, 4, increasing=True)[:, 1:]
    return coefficients @ (powers[:-1] - powers[-1]).T


def _power_matrix(fit: Fit) -> Array:
    """Matrix, shape (amplitudes, 3), of 0 and 1: fitted amplitudes @ matrix are the coefficients of T, T² and T³."""
    rows = []
    for own in fit.solution.functions:
        for k in range(own.amplitudes.size):
            row = np.zeros(3)
            if own.effect.column_powers:
                row[own.effect.column_powers[k] - 1] = 1.0
            rows.append(row)
    return np.array(rows).reshape(-1, 3)


def _coefficients_and_loop(fit: Fit) -> tuple[Array, float]:
    """(coefficients of T, T² and T³ of the fitted bias, shape (3,); height of the hysteresis loop)."""
    amplitudes = [own.amplitudes for own in fit.solution.functions]
    coefficients = np.concatenate([*amplitudes, np.zeros(0)]) @ _power_matrix(fit)
    return coefficients, sum(e.column_loop for e in law_of(fit))


def _random_coefficients(fit: Fit, count: int, rng: np.random.Generator) -> Array:
    """Random draws of the coefficients of T, T² and T³ from their posterior distribution, shape (count, 3)."""
    solution = fit.solution
    places = _power_matrix(fit)
    if not places.any():
        return np.zeros((count, 3))
    matrix, *_ = design(fit)
    more = matrix[:, len(places) :]
    slow = list(solution.functions)
    if more.size:
        last = slow[-1]
        slow[-1] = replace(
            last,
            matrix=np.hstack([last.matrix, more]),
            amplitudes=np.append(last.amplitudes, np.zeros(more.shape[1])),
        )
    law = joint_amplitudes(slow, solution, fit.data)
    return law.sample(count, rng)[:, : len(places)] @ places
