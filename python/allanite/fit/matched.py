"""Matched filters: how much logL a slow effect would explain, at every point of its shape grid at once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.data import Data, Noise

__all__ = ["grid_points", "matched_gains", "regressor_ordinates"]

#: Ordinates of the filter; a step has all but 1/4096 of its weight there.
LOW = 4096
#: Ordinates of a function of time that are remembered, and of how many functions.
KEPT, MOST = 8192, 512
#: A column of a longer record is looked at by so many means: many to each of the ordinates that are kept.
MEANS = 16 * KEPT


def regressor_ordinates(
    points: Sequence[Deterministic], j: NDArray[np.int64], data: Data
) -> NDArray[np.float64]:
    """Every regressor of every point in the ordinates j, as `data` shows them, shape (regressors, ordinates)."""
    closed = points[0].regressor_ordinates(points, j, data.n, data.rate, data.start)
    if closed is not None:
        return data.seen(closed, j)
    return data.seen(np.concatenate([_transformed(p, j, data) for p in points]), j)


def _transformed(effect: Deterministic, j: NDArray[np.int64], data: Data) -> NDArray[np.float64]:
    """The same of one point; a climb comes back to the same shapes."""
    kept = j.size == 0 or int(j[-1]) < KEPT
    fitted = {p.name: p.role == "coefficient" for p in effect.parameters}
    key = (
        type(effect),
        *(v is None if fitted[name] else v for name, v in effect.values.items()),
    )
    if kept and key in data.functions:
        return data.functions[key][:, j]
    series = effect.regressors(data.time, data.covariates).T
    if kept and effect.follows is not None and data.n >= 2 * MEANS:
        out = np.array([_of_means(s, data) for s in series])
    else:
        out = np.array([data.transform(s) for s in series])
    if kept and len(data.functions) < MOST:
        data.functions[key] = out[:, :KEPT].copy()
    return out[:, j]


def _of_means(series: NDArray[np.float64], data: Data) -> NDArray[np.float64]:
    """The lowest ordinates of a slow series, from its means over a share of the record.

    What a mean loses at ordinate j is given back: sin(x)/x, x = πj/(2·`MEANS`), at least 0.994.
    """
    edges = np.arange(MEANS + 1, dtype=np.int64) * data.n // MEANS
    means = np.add.reduceat(series, edges[:-1]) / np.diff(edges)
    j = np.arange(KEPT)
    loss = np.sinc(j / (2.0 * MEANS))
    return np.asarray(data.transform(means)[:KEPT] * np.sqrt(data.n / MEANS) / loss)


def grid_points(blank: Deterministic, data: Data) -> list[Deterministic]:
    """The effect at every point of the grid of its shapes that have no value."""
    shapes = [
        p.name for p in blank.parameters if p.role == "shape" and blank.values[p.name] is None
    ]
    grids = [map(float, blank.grid(name, data.n, data.rate)) for name in shapes]
    return [blank.with_values(**dict(zip(shapes, v, strict=True))) for v in product(*grids)]


def matched_gains(
    points: list[Deterministic], residual: NDArray[np.float64], noise: Noise, data: Data
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gain ½z² of each point on residual ordinates (n,), and the whitened unit directions (points, ordinates)."""
    j = np.arange(1, min(data.n, LOW), dtype=np.int64)
    root = 1.0 / np.sqrt(noise.variance(j))
    whole = regressor_ordinates(points, j, data).reshape(len(points), -1, j.size) * root
    target = residual[j] * root
    unit = _units(whole[:, 0])
    gain = 0.5 * (unit @ target) ** 2
    if whole.shape[1] > 1:
        # A second regressor by what it adds; the direction is that of both at their best.
        second = whole[:, 1] - (whole[:, 1] * unit).sum(axis=1)[:, None] * unit
        second = _units(second)
        first, other = unit @ target, second @ target
        gain = gain + 0.5 * other**2
        unit = _units(first[:, None] * unit + other[:, None] * second)
    return gain, unit


def _units(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    norm = np.linalg.norm(rows, axis=1)
    return rows / np.where(norm > 0.0, norm, 1.0)[:, None]
