"""Matched filters: how much logL a slow effect would explain, at every point of its shape grid at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Deterministic, Model

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise

__all__ = [
    "basis_of",
    "best_spans",
    "grid_points",
    "left_by",
    "lowest",
    "matched_gains",
    "regressor_ordinates",
    "slow_families",
]

#: Ordinates of the filter; a step has all but 1/4096 of its weight there.
LOW = 4096
#: Ordinates of a function of time that are remembered.
KEPT = 8192
#: A column of a longer record is looked at by so many means: many to each of the ordinates that are kept.
MEANS = 16 * KEPT
#: A direction of which so little is left beside others is one of theirs.
SAME = 1e-3


def regressor_ordinates(
    points: Sequence[Deterministic], j: NDArray[np.int64], data: Data
) -> NDArray[np.float64]:
    """Every regressor of every point in the ordinates j, as `data` shows them, shape (regressors, ordinates)."""
    closed = points[0].regressor_ordinates(points, j, data.n, data.rate, data.start)
    if closed is not None:
        return data.seen(closed, j)
    if j.size and int(j[-1]) >= KEPT:
        return data.seen(np.concatenate([data.rows(p)[:, j] for p in points]), j)
    return data.seen(np.concatenate([_lowest(p, data)[:, j] for p in points]), j)


def _lowest(effect: Deterministic, data: Data) -> NDArray[np.float64]:
    """The first `KEPT` ordinates of every regressor of an effect; a search comes back to the same shapes."""

    def made() -> NDArray[np.float64]:
        series = effect.regressors(data.time, data.covariates).T
        if effect.follows is not None and data.samples.size >= 2 * MEANS:
            return np.array([_of_means(s, data)[:KEPT] for s in series])
        return np.array([data.transform(s)[:KEPT] for s in series])

    return data.lowest.get(effect.seen_alike, made)


def _of_means(series: NDArray[np.float64], data: Data) -> NDArray[np.float64]:
    """The lowest ordinates of a slow series, from its means over a share of the record.

    What a mean loses at ordinate j is given back: sin(x)/x, x = πj/(2·`MEANS`), at least 0.994.
    """
    edges = np.arange(MEANS + 1, dtype=np.int64) * series.size // MEANS
    means = np.add.reduceat(series, edges[:-1]) / np.diff(edges)
    j = np.arange(KEPT)
    loss = np.sinc(j / (2.0 * MEANS))
    return np.asarray(data.transform(means)[:KEPT] * np.sqrt(series.size / MEANS) / loss)


def grid_points(blank: Deterministic, data: Data) -> list[Deterministic]:
    """The effect at every point of the grid of its shapes that have no value."""
    shapes = [
        p.name for p in blank.parameters if p.role == "shape" and blank.values[p.name] is None
    ]
    grids = [map(float, blank.searched(name, data.n, data.rate)) for name in shapes]
    return [blank.with_values(**dict(zip(shapes, v, strict=True))) for v in product(*grids)]


def lowest(data: Data) -> NDArray[np.int64]:
    """Ordinates that the filter looks at."""
    return np.arange(1, min(data.n, LOW), dtype=np.int64)


def slow_families(
    model: Model, columns: Mapping[str, NDArray[np.float64]]
) -> dict[str, tuple[Deterministic, ...]]:
    """What may be missing of the slow functions of time, family by family, in the order of the catalogue."""
    out: dict[str, tuple[Deterministic, ...]] = {}
    if any(filtering.blocks for filtering in model.filters):
        # No drift passes; what the ends of a record leave in its empty lowest ordinates would be called one.
        return out
    for cls in CATALOGUE:
        if cls.screened == "slow" and issubclass(cls, Deterministic):
            blanks = cls.candidates(model, columns)
            if blanks:
                out[cls.family] = (*out.get(cls.family, ()), *blanks)
    return out


def matched_gains(
    points: list[Deterministic],
    residual: NDArray[np.float64],
    noise: Noise,
    data: Data,
    beside: Sequence[Deterministic] = (),
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gain ½z² of each point on residual ordinates (n,), and the whitened unit directions (points, ordinates).

    What the slow functions `beside` it can do themselves is taken out of each: their amplitudes move with it.
    """
    j = lowest(data)
    root = 1.0 / np.sqrt(noise.variance(j))
    whole = regressor_ordinates(points, j, data)
    whole *= root  # of many points, in place
    target = residual[j] * root
    basis = _beside(beside, j, root, data)
    if basis.size:
        whole = left_by(basis, whole)
        target = target - basis @ (basis.T @ target)
    whole = whole.reshape(len(points), -1, j.size)
    unit = whole[:, 0]
    unit /= _lengths(unit)  # of many points, in place
    gain = 0.5 * (unit @ target) ** 2
    if whole.shape[1] > 1:
        # Further regressors by what they add; the direction is that of all at their best.
        axes: list[NDArray[np.float64]] = [unit]
        for k in range(1, whole.shape[1]):
            more = whole[:, k]
            for axis in axes:
                more = more - (more * axis).sum(axis=1)[:, None] * axis
            axes.append(_units(more))
            gain = gain + 0.5 * (axes[-1] @ target) ** 2
        unit = _units(np.sum([(axis @ target)[:, None] * axis for axis in axes], axis=0))
    return gain, unit


def best_spans(
    cls: type[Deterministic],
    residual: NDArray[np.float64],
    noise: Noise,
    data: Data,
    beside: Sequence[Deterministic] = (),
) -> list[tuple[Deterministic, float]]:
    """What is there from one time of an effect to another, each with its arc (`Deterministic.best_spans`)."""
    j = lowest(data)
    root = 1.0 / np.sqrt(noise.variance(j))
    basis = _beside(beside, j, root, data)
    spans = cls.best_spans(residual[j] * root, data.seen(root, j), basis, data.n, data.rate)
    return [(_later(effect, data.start), arc) for effect, arc in spans]


def _later(effect: Deterministic, start: float) -> Deterministic:
    """The effect with its times counted from the first sample of the recording."""
    times = {p.name: effect.values[p.name] for p in effect.parameters if p.unit == "s"}
    return effect.with_values(**{name: time + start for name, time in times.items()})


def _beside(
    effects: Sequence[Deterministic],
    j: NDArray[np.int64],
    root: NDArray[np.float64],
    data: Data,
) -> NDArray[np.float64]:
    """Orthonormal columns of whitened ordinates that slow functions can do themselves, shape (ordinates, columns)."""
    rows = [regressor_ordinates([e], j, data) * root for e in effects if e.low]
    return basis_of(np.concatenate(rows)) if rows else np.zeros((j.size, 0))


def left_by(basis: NDArray[np.float64], rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """What orthonormal columns (ordinates, k) leave of rows (r, ordinates)."""
    left = (rows @ basis) @ basis.T
    np.subtract(rows, left, out=left)  # of many rows, in place
    # One of them in other words: what is left of it is rounding.
    left[_squares(left) < SAME**2 * _squares(rows)] = 0.0
    return np.asarray(left)


def basis_of(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal columns that span the rows, shape (ordinates, at most rows)."""
    left, singular, _ = np.linalg.svd(_units(rows).T, full_matrices=False)
    return np.asarray(left[:, singular > SAME])


def _units(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    return rows / _lengths(rows)


def _lengths(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Euclidean norms, 1 of nothing, shape (rows, 1)."""
    norm = np.sqrt(_squares(rows))
    return np.where(norm > 0.0, norm, 1.0)[:, None]


def _squares(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared norms, shape (rows,)."""
    return np.asarray(np.einsum("ij,ij->i", rows, rows))
