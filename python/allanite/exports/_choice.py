"""Choose the numbers for formats with white noise and one slow process: N and K, or N and a Gauss-Markov process."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.exports._follow import SLACK, follow_lag, follow_walk, negligible_walk
from allanite.exports._held import Choice, random_walk_effect
from allanite.exports._overbound import overbound_lag, overbound_walk

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.effects.model import Model
    from allanite.exports._axis import Axis

#: Comment of files with a Gauss-Markov bias: where its correlation time comes from.
TIME_NOTE = "T follows the Allan deviation of the model up to the horizon. It need not be a time constant of the sensor."
#: Remark on a coefficient that was not detected.
LIMIT = "not detected, this is the 95 % upper limit"


def choose(axis: Axis, *, overbound: bool = False, simulator: bool = False) -> Choice:
    """`Choice` with the N and K to be written for an axis: covering its limits, as fitted, or following its model.

    Parameters
    ----------
    axis : Axis
        The axis. Its attributes also state the horizon, and whether the coefficients are written as fitted.
    overbound : bool
        True if N and K must cover the upper limits of the model. `axis.as_fitted` is then ignored.
    simulator : bool
        Whether the numbers are for a simulator. Otherwise they are for a filter.
    """
    if overbound:
        return overbound_walk(axis)
    return _fitted_choice(axis) if axis.as_fitted else follow_walk(axis, simulator=simulator)


def choose_lag(
    axis: Axis, time: float | None = None, *, overbound: bool = False, simulator: bool = False
) -> Choice:
    """`Choice` with N and a Gauss-Markov process to be written for an axis. `time` fixes the correlation time, s.

    The other parameters are those of `choose`. As fitted, the first Gauss-Markov process of the model is written if it
    has this time; otherwise numbers follow the model.
    """
    if overbound:
        return overbound_lag(axis, time)
    if axis.as_fitted:
        own = next((e.gauss_markov for e in axis.model.stochastic if e.gauss_markov), None)
        if own is not None and time in (None, own[1]):
            first = _fitted_choice(axis)
            held = tuple(name for name in first.holds or () if name != "K")
            return replace(
                first,
                K=0.0,
                q_c=axis.scale * own[0],
                correlation_time=own[1],
                holds=(*held, "GM"),
            )
    return follow_lag(axis, time, simulator=simulator)


def _fitted_choice(axis: Axis) -> Choice:
    """`Choice` with the fitted N and K; for a coefficient that was not detected, its upper limit.

    Without white noise in the model, N comes from the Allan deviation at one sample. Without a random walk, K is
    negligibly small. A changing white-noise level is averaged over the record.
    """
    numbers = {"N": 0.0, "K": 0.0}
    remarks, holds = [], []
    for name in numbers:
        estimate = axis.coefficients.get(name)
        if estimate is None:
            continue
        limit = not estimate.detected and estimate.interval is not None
        numbers[name] = float(estimate.interval[1] if limit and estimate.interval else estimate)
        if name == "N" and axis.model.levels:
            numbers["N"] *= axis.model.mean_level(axis.span)
        if numbers[name] > 0.0:
            holds.append(name)
            remarks += [(name, LIMIT)] if limit else []
    if not numbers["N"] > 0.0:
        tau = axis.taus[:1]
        numbers["N"] = float(np.sqrt(_allan_variance(axis, axis.broad_model, tau) * tau)[0])
        remarks.append(
            (
                "N",
                "the model has no white noise: this N has the model's Allan deviation at one sample",
            )
        )
    if not numbers["K"] > 0.0:
        numbers["K"] = negligible_walk(numbers["N"], axis)
        remarks.append(("K", "the model has no random walk: this K is negligibly small"))
    return Choice(numbers["N"], numbers["K"], remarks=tuple(remarks), holds=tuple(holds))


def _allan_variance(axis: Axis, part: Model, tau: NDArray[np.float64]) -> NDArray[np.float64]:
    """Allan variance of the model `part` of an axis at the averaging times `tau` (s), SI, shape of `tau`."""
    return axis.scale**2 * part.allan_variance(tau, axis.sampling)


def smallest_covering_walk(axis: Axis, rest: Model) -> float:
    """Smallest coefficient K (SI) of a random walk that, added to the model `rest`, covers the noise of the axis.

    Covered means at least 98 % of the Allan deviation of the white and slow noise of the axis at every τ. The result is
    0 if `rest` alone is sufficient.
    """
    tau = axis.taus
    slow = (1.0 - SLACK) ** 2 * _allan_variance(axis, axis.slow_model, tau)
    missing = slow - rest.allan_variance(tau, axis.sampling)
    needed = float((missing / random_walk_effect(1.0).allan_variance(tau, axis.sampling)).max())
    return float(np.sqrt(max(0.0, needed)))
