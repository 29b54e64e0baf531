"""Choose the numbers for formats with white noise and one slow process: N and K, or N and a Gauss-Markov process."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from allanite.exports._axis import Axis, value_or_limit
from allanite.exports._follow import (
    follow_gauss_markov,
    follow_walk,
    followed_model,
    negligible_walk,
)
from allanite.exports._held import NoiseParameters
from allanite.exports._overbound import overbound_gauss_markov, overbound_walk

#: Comment of files with a Gauss-Markov bias: where its correlation time comes from.
TIME_NOTE = "T follows the Allan deviation of the model up to the horizon. It need not be a time constant of the sensor."


def choose(axis: Axis, *, overbound: bool = False, simulator: bool = False) -> NoiseParameters:
    """`NoiseParameters` with the N and K that a file of a filter, or of a `simulator`, states for an axis.

    They follow the whole model, cover its upper limits (`overbound`), or are the fitted ones (`Axis.as_fitted`).
    `overbound` takes precedence over `Axis.as_fitted`, and both over `simulator`.
    """
    if overbound:
        return overbound_walk(axis)
    return (
        _fitted_choice(axis)
        if axis.as_fitted
        else follow_walk(followed_model(axis, simulator=simulator))
    )


def choose_gauss_markov(
    axis: Axis, time: float | None = None, *, overbound: bool = False, simulator: bool = False
) -> NoiseParameters:
    """`NoiseParameters` with the N and the Gauss-Markov process that a file states for an axis; see `choose`.

    `time` (s) fixes the correlation time; a fitted process with another time is not used. With `Axis.as_fitted` but
    without such a process, the numbers follow the whole model.
    """
    if overbound:
        return overbound_gauss_markov(axis, time)
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
    return follow_gauss_markov(followed_model(axis, simulator=simulator), time)


def _fitted_choice(axis: Axis) -> NoiseParameters:
    """`NoiseParameters` with the fitted N and K; for a coefficient that was not detected, its 95 % upper limit.

    Without white noise in the model, N is that with the model's Allan deviation at one sample. Without a random walk, K
    adds 1 % to the Allan variance at the horizon. If the level of white noise changes, N is its rms over the record.
    """
    numbers = {"N": 0.0, "K": 0.0}
    remarks, holds = [], []
    for name in numbers:
        estimate = axis.coefficients.get(name)
        if estimate is None:
            continue
        numbers[name], remark = value_or_limit(estimate)
        if name == "N" and axis.model.levels:
            numbers["N"] *= axis.model.mean_level(axis.span)
        if numbers[name] > 0.0:
            holds.append(name)
            remarks += [(name, remark)] if remark else []
    if not numbers["N"] > 0.0:
        tau = axis.taus[:1]
        variance = axis.scale**2 * axis.broad_model.allan_variance(tau, axis.sampling)
        numbers["N"] = float(np.sqrt(variance * tau)[0])
        remarks.append(
            (
                "N",
                "the model has no white noise: this N has the model's Allan deviation at one sample",
            )
        )
    if not numbers["K"] > 0.0:
        numbers["K"] = negligible_walk(numbers["N"], axis.horizon, axis.sampling)
        remarks.append(("K", "the model has no random walk: this K is negligibly small"))
    return NoiseParameters(numbers["N"], numbers["K"], remarks=tuple(remarks), holds=tuple(holds))
