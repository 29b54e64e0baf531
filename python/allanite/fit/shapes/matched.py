"""Matched filters: rise of logL by a slow effect at every point of its shape grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.effects import (
    CATALOG,
    Deterministic,
    Effect,
    LaggedColumn,
    Model,
    followed_column,
    weighted_sum,
)

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise

#: Number of lowest ordinates used by the filter; they hold all but 1/4096 of the weight of a step.
FILTER_ORDINATES = 4096
#: Number of lowest ordinates of a function of time that are cached. Chosen by judgment; not measured.
CACHED_ORDINATES = 8192
#: Number of means into which a logged column of a long record is averaged first. With 16 means per cached ordinate, the
#: averaging attenuates by at most 0.6 %, which is corrected.
COLUMN_MEANS = 16 * CACHED_ORDINATES
#: A direction counts as linearly dependent if its remainder orthogonal to others is below this fraction of its norm.
#: Chosen by judgment; not measured.
MIN_INDEPENDENT_NORM = 1e-3


#: A class of effects.
Some = TypeVar("Some", bound=Effect)


def regressor_ordinates(points: Sequence[Deterministic], j: NDArray[np.int64], data: Data) -> Array:
    """Cosine ordinates j of the regressors of effects, attenuated by gaps, shape (effects · regressors, ordinates)."""
    rows = points[0].regressor_ordinates(points, j, data.n, data.rate, data.start)
    if rows is None:
        is_low = not j.size or int(j[-1]) < CACHED_ORDINATES
        parts = [
            _lowest_ordinates(p, data) if is_low else data.regressor_ordinates(p) for p in points
        ]
        rows = np.concatenate([part[:, j] for part in parts])
    return data.attenuated(rows, j)


def _lowest_ordinates(effect: Deterministic, data: Data) -> Array:
    """The first `CACHED_ORDINATES` cosine ordinates of every regressor of an effect, one row each.

    Filtered columns are cached for all effects that follow the column. In a long record, the ordinates of a logged column
    are computed from `COLUMN_MEANS` means of its samples.
    """

    def lowest(series: Array) -> Array:
        """Array of the first `CACHED_ORDINATES` ordinates (cosine-transform coefficients) of a series."""
        if effect.follows is not None and data.samples.size >= 2 * COLUMN_MEANS:
            return _ordinates_of_means(series, data)
        return data.transform(series)[:CACHED_ORDINATES]

    def of_lagged(part: LaggedColumn) -> Array:
        """Array of the first `CACHED_ORDINATES` ordinates of a filtered column."""
        return data.lowest.get(part, lambda: lowest(part.series(data.time, data.covariates)))

    if sums := effect.sums_of_lagged():
        followed_column(effect, data.covariates)
        return np.array([weighted_sum([(w, of_lagged(part)) for w, part in s]) for s in sums])
    return data.lowest.get(
        effect.seen_alike,
        lambda: np.array([lowest(row) for row in effect.regressors(data.time, data.covariates).T]),
    )


def _ordinates_of_means(series: Array, data: Data) -> Array:
    """The first `CACHED_ORDINATES` ordinates of a slow series, computed from `COLUMN_MEANS` means.

    The attenuation of the means, sin(x)/x with x = πj/(2·`COLUMN_MEANS`), at least 0.994, is corrected.
    """
    edges = np.arange(COLUMN_MEANS + 1, dtype=np.int64) * series.size // COLUMN_MEANS
    means = np.add.reduceat(series, edges[:-1]) / np.diff(edges)
    j = np.arange(CACHED_ORDINATES)
    loss = np.sinc(j / (2.0 * COLUMN_MEANS))
    return np.asarray(
        data.transform(means)[:CACHED_ORDINATES] * np.sqrt(series.size / COLUMN_MEANS) / loss
    )


def grid_points(blank: Some, n: int, rate: float) -> list[Some]:
    """List of copies of an effect: one for each variant and combination of the trial values of its unknown shapes.

    If the effect has several variants (e.g. filter designs), shapes that have a value are put on the grid, too. The trial
    values of a shape may depend on shapes that are declared before it.
    """
    variants, out = blank.variants(), []
    for variant in variants:
        values = variant.values
        names = [name for name in variant.free_shapes if values[name] is None]
        if len(variants) > 1:
            names = [name for name in variant.free_shapes if not isinstance(values[name], str)]
        points = [variant]
        for name in names:
            points = [
                point.with_values(**{name: float(value)})
                for point in points
                for value in point.searched(name, n, rate)
            ]
        out += points
    return out


def filter_ordinates(data: Data) -> NDArray[np.int64]:
    """Array of the indices 1 … 4095 of the ordinates that the matched filter uses; up to n − 1 of a shorter record."""
    return np.arange(1, min(data.n, FILTER_ORDINATES), dtype=np.int64)


def slow_families(
    model: Model, columns: Mapping[str, Array]
) -> dict[str, tuple[Deterministic, ...]]:
    """Dict from a family of effects (`Effect.family`) to a tuple of its slow functions of time, without values.

    They are the functions of the catalog that may be added to `model`, one for each column in `columns` that they can
    follow.
    """
    out: dict[str, tuple[Deterministic, ...]] = {}
    if any(filtering.blocks for filtering in model.filters):
        # A high-pass blocks drifts; leakage of the ends into the empty lowest ordinates would imitate a drift.
        return out
    for cls in CATALOG:
        if cls.screened == "slow" and issubclass(cls, Deterministic):
            blanks = cls.candidates(model, columns)
            if blanks:
                out[cls.family] = (*out.get(cls.family, ()), *blanks)
    return out


def matched_gains(
    points: list[Deterministic],
    residual: Array,
    noise: Noise,
    data: Data,
    together_with: Sequence[Deterministic] = (),
) -> tuple[Array, Array]:
    """Pair: ΔlogL of each point, shape (points,), and unit vectors of whitened ordinates, (points, ordinates).

    A point is a slow function of time with shape values; a unit vector is the direction of its best fit. `residual` are the
    residual ordinates, shape (n,). The amplitudes of the slow functions `together_with` are fitted together with each
    point, so that only the orthogonal part of a point counts. With one amplitude, ΔlogL is ½z².
    """
    j = filter_ordinates(data)
    root = 1.0 / np.sqrt(noise.variance(j))
    whole = regressor_ordinates(points, j, data)
    whole *= root  # of many points, in place
    target = residual[j] * root
    basis = _ignored_directions(together_with, j, root, data, noise)
    if basis.size:
        whole = orthogonal_to(basis, whole)
        target = target - basis @ (basis.T @ target)
    whole = whole.reshape(len(points), -1, j.size)
    unit = whole[:, 0]
    unit /= _row_norms(unit)  # of many points, in place
    gain = 0.5 * (unit @ target) ** 2
    if whole.shape[1] > 1:
        # Each further regressor adds its orthogonal part; the direction is that of the best combination.
        axes: list[Array] = [unit]
        for k in range(1, whole.shape[1]):
            more = whole[:, k]
            for axis in axes:
                more = more - (more * axis).sum(axis=1)[:, None] * axis
            axes.append(_unit_rows(more))
            gain = gain + 0.5 * (axes[-1] @ target) ** 2
        unit = _unit_rows(np.sum([(axis @ target)[:, None] * axis for axis in axes], axis=0))
    return gain, unit


def best_spans(
    cls: type[Deterministic],
    residual: Array,
    noise: Noise,
    data: Data,
    together_with: Sequence[Deterministic] = (),
) -> list[tuple[Deterministic, float]]:
    """List of pairs (effect, angle): effects with two times (begin and end) that explain `residual` best.

    The class `cls` proposes them. A bias step proposes an excursion (two opposite steps) and a transition (a ramp to a new
    level). Most classes propose nothing. `residual` are residual ordinates, shape (n,). The amplitudes of the slow
    functions `together_with` are fitted, too. The angle, rad, measures the number of independent trials. The whitened
    ordinates of the effect, as a vector, turn by this angle as one of its times moves over the whole record.
    """
    j = filter_ordinates(data)
    root = 1.0 / np.sqrt(noise.variance(j))
    basis = _ignored_directions(together_with, j, root, data, noise)
    spans = cls.best_spans(residual[j] * root, data.attenuated(root, j), basis, data.n, data.rate)
    return [(_shifted_in_time(effect, data.start), arc) for effect, arc in spans]


def _shifted_in_time(effect: Deterministic, start: float) -> Deterministic:
    """Copy of the effect with `start` added to all its times, s, which then count from the start of the recording."""
    times = {p.name: effect.values[p.name] for p in effect.parameters if p.unit == "s"}
    return effect.with_values(**{name: time + start for name, time in times.items()})


def _ignored_directions(
    effects: Sequence[Deterministic], j: NDArray[np.int64], root: Array, data: Data, noise: Noise
) -> Array:
    """Orthonormal basis of whitened ordinates j that a matched filter ignores, shape (ordinates, columns).

    These are the slow functions of time among `effects`, and single samples at the ends of the record that cause the
    leakage of a finite filter (`_end_samples`). `root` is 1/√variance of the ordinates.
    """
    rows = [regressor_ordinates([e], j, data) * root for e in effects if e.low]
    ends = _end_samples(noise, data.n)
    if ends.size:
        rows.append(np.cos(np.pi / data.n * np.outer(ends + 0.5, j)) * root)
    return basis_of(np.concatenate(rows)) if rows else np.zeros((j.size, 0))


def _end_samples(noise: Noise, n: int) -> NDArray[np.int64]:
    """Indices of samples at both ends that cause the leakage of the `noise` of n samples; may be empty.

    Without them the ordinates are independent. In a long record only every k-th of them is returned, since the lowest 4096
    ordinates do not resolve neighbors.
    """
    memory = max((term.memory for term in noise.terms), default=0)
    first = np.arange(0, min(memory, n // 2), max(1, n // FILTER_ORDINATES), dtype=np.int64)
    return np.concatenate([first, n - 1 - first])


def orthogonal_to(basis: Array, rows: Array) -> Array:
    """Components of `rows`, shape (r, ordinates), orthogonal to an orthonormal basis, shape (ordinates, k).

    A row that is nearly in the span of the basis becomes 0.
    """
    left = (rows @ basis) @ basis.T
    np.subtract(rows, left, out=left)  # of many rows, in place
    # A nearly dependent row would leave only rounding errors.
    left[_squared_norms(left) < MIN_INDEPENDENT_NORM**2 * _squared_norms(rows)] = 0.0
    return np.asarray(left)


def basis_of(rows: Array) -> Array:
    """Orthonormal basis that spans the rows, shape (ordinates, at most rows).

    The rows are first scaled to norm 1. Directions with a singular value of at most 1e-3 are left out.
    """
    left, singular, _ = np.linalg.svd(_unit_rows(rows).T, full_matrices=False)
    return np.asarray(left[:, singular > MIN_INDEPENDENT_NORM])


def _unit_rows(rows: Array) -> Array:
    """Array of rows divided by their Euclidean norms; zero rows stay zero."""
    return rows / _row_norms(rows)


def _row_norms(rows: Array) -> Array:
    """Array of the Euclidean norms of rows, 1 for zero rows, shape (rows, 1)."""
    norm = np.sqrt(_squared_norms(rows))
    return np.where(norm > 0.0, norm, 1.0)[:, None]


def _squared_norms(rows: Array) -> Array:
    """Array of the squared Euclidean norms of rows, shape (rows,)."""
    return np.asarray(np.einsum("ij,ij->i", rows, rows))
