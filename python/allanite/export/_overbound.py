"""Smallest N and K (or N and a lag) above the model's upper limits at every τ and frequency of use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.effects import white_noise
from allanite.export._held import Choice, lag, walk

if TYPE_CHECKING:
    from allanite.effects._base import Effect
    from allanite.export._axis import Axis

__all__ = ["overbound_lag", "overbound_walk"]

#: Tried time constants a decade.
PER_DECADE = 12


def overbound_walk(axis: Axis) -> Choice:
    """N and K, by linear programming in their squares."""
    sizes, _ = _smallest(axis, walk(1.0))
    return Choice(float(np.sqrt(sizes[0])), float(np.sqrt(sizes[1])), overbound=True)


def overbound_lag(axis: Axis, time: float | None = None) -> Choice:
    """N and a Gauss-Markov process of the best time constant, or of the one given."""
    tau = axis.taus
    low, high = 4.0 * tau[0], 10.0 * tau[-1]
    count = max(2, int(PER_DECADE * np.log10(high / low)))
    times = np.geomspace(low, high, count) if time is None else np.array([time])
    found = [(_smallest(axis, lag(1.0, T)), T) for T in times]
    (sizes, _), best = min(found, key=lambda item: item[0][1])
    white, slow = np.sqrt(sizes)
    return Choice(float(white), 0.0, float(slow), float(best), overbound=True)


def _smallest(axis: Axis, slow: Effect) -> tuple[NDArray[np.float64], float]:
    """Squares of N and of the slow coefficient, and the mean of the variance they stand for over the limits'."""
    from scipy.optimize import linprog

    tau, fs = axis.taus, axis.sampling
    f = np.geomspace(1.0 / tau[-1], 0.4999 * fs, 8 * int(np.log10(fs * tau[-1]) + 1))
    limit = np.concatenate([axis.allan(upper=True), axis.psd(f, upper=True)])
    columns = [
        np.concatenate([e.allan_variance(tau, fs), e.psd(f, fs)]) for e in (white_noise(1.0), slow)
    ]
    there = limit > 0.0
    design = np.column_stack(columns)[there] / limit[there, None]
    size = design.max(axis=0)
    # Both curves count alike, whatever their grids.
    weight = np.concatenate([np.full(tau.size, 1.0 / tau.size), np.full(f.size, 1.0 / f.size)])
    cost = weight[there] @ design / size
    found = linprog(cost, A_ub=-design / size, b_ub=-np.ones(len(design)), method="highs")
    if found.x is None:
        raise InputError(f"{axis.name}: no overbound was found ({found.message})")
    scaled = np.maximum(found.x, 0.0)
    # The solver holds its constraints to 1e-7 of their size.
    scaled *= max(1.0, 1.0 / float((design / size @ scaled).min()))
    return scaled / size, float(cost @ scaled)
