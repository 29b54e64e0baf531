"""Expected record: each bin holds its expected power under the true model.

A fit of this one record (the "Asimov data set" of Cowan, Cranmer, Gross & Vitells 2011, EPJ C 71, 1554) is the limit of
the fits of many records. Twice its loss of logL without an effect is the non-centrality of the test for that effect.
No array has the length of the record: bins are evaluated at nodes, and slow functions of time on a coarse grid whose
lowest ordinates are the record's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError
from allanite.effects import Deterministic, Model
from allanite.fit.engine import with_coefficients
from allanite.fit.likelihood.data import MIN_SAMPLES, Data
from allanite.fit.likelihood.expected import column, columns
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.shapes.deterministic import comb_ordinates, ordinates_of_line
from allanite.fit.shapes.shape import fit_shapes
from allanite.fit.solution import Residual, Solution, fitted
from allanite.spectrum import bins_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Columns = Mapping[str, Callable[[Array], Array]]

#: Maximum number of samples of the coarse grid. All but 1e-4 of the energy of slow effects lies in its lowest quarter of
#: ordinates.
COARSE_SAMPLES = 32768
#: Directions (unit vectors) with a singular value below this are linearly dependent and dropped.
MIN_SINGULAR_VALUE = 1e-3
#: Largest number of samples that a double holds exactly: three years at 100 MHz.
MAX_SAMPLES = 2**53


def blank_data(n: int, rate: float) -> Data:
    """`Data` of a planned record of n samples at a rate (Hz), without values; its arrays take no memory.

    `TooShortError` for fewer than 32 samples, `InputError` for more than 2⁵³.
    """
    if n < MIN_SAMPLES:
        raise TooShortError(f"a record of {n} samples; a fit needs at least {MIN_SAMPLES}")
    if n > MAX_SAMPLES:
        raise InputError(
            f"a record of {n:.3g} samples at {rate:g} Hz: more than {MAX_SAMPLES:.3g} are not planned,"
            " lower the rate or the duration"
        )
    nothing = np.broadcast_to(np.float64(0.0), (n,))
    return Data(nothing, nothing, rate, bins_of(n))


def coarse_data(data: Data, covariates: Columns | None = None) -> Data:
    """`Data` of the same time span at a lower rate (at most 32768 samples), with the expected values of the covariates."""
    n = min(data.n, COARSE_SAMPLES)
    rate = n / data.duration
    # Cells of the coarse grid begin and end where the record's do.
    start = 0.5 / rate - 0.5 / data.rate
    time = start + np.arange(n) / rate
    given = {
        name: np.ascontiguousarray(make(time), dtype=np.float64)
        for name, make in (covariates or {}).items()
    }
    nothing = np.broadcast_to(np.float64(0.0), (n,))
    return Data(nothing, nothing, rate, bins_of(n), given, start)


def require_values(model: Model) -> None:
    """Raise `InputError` unless every parameter of the model, except optional ones, has a value. Returns None."""
    for effect in model:
        for p in effect.parameters:
            optional = p.role in {"derived", "choice"} or p.optional
            if not optional and effect.values[p.name] is None:
                raise InputError(
                    f"{effect.kind}: {p.name} has no value. Write the size you expect: {effect.short}({p.name}=…)"
                )


def random_part(model: Model) -> Model:
    """Copy of a model without known functions of time; noise processes, filters and other modifiers stay."""
    return Model(tuple(e for e in model if not isinstance(e, Deterministic)))


def ordinates_of(effect: Deterministic, data: Data, grid: Data) -> NDArray[np.int64]:
    """Ordinates j of the record at which a known function of time is evaluated.

    The lowest ordinates for a slow function (`effect.low`), otherwise those near the frequencies of its lines.
    """
    if not effect.low:
        return ordinates_of_line(effect, data)
    last = grid.n // 4 if grid.n < data.n else grid.n
    return np.arange(1, last, dtype=np.int64)


def signal_ordinates(effect: Deterministic, j: NDArray[np.int64], data: Data, grid: Data) -> Array:
    """Cosine transform (unit U) of a known function of time over the record, at the ordinates j, shape of j.

    Periodic functions are exact; slow functions are computed on the coarse `grid`, others at every sample of `data`.
    Raises `InputError` if `grid` lacks the column that a slow function follows.
    """
    if effect.periodic:
        multiples = [m for m, _, _ in effect.lines]
        lines = comb_ordinates(effect.base_frequency or 0.0, multiples, j, data)
        return np.asarray(lines @ effect.amplitudes())
    if not effect.low:
        whole = effect.signal(np.arange(data.n) / data.rate, {})
        return np.asarray(_kernels.cosine_transform(whole)[j])
    if effect.follows is not None and effect.follows not in grid.covariates:
        raise InputError(
            f"{effect.kind}: the model follows the column {effect.follows!r}: give covariates= with "
            "its expected values as a function of time in s"
        )
    series = np.ascontiguousarray(effect.signal(grid.time, grid.covariates))
    return np.asarray(_kernels.cosine_transform(series)[j] * np.sqrt(data.n / grid.n))


def signal_power(effect: Deterministic, data: Data, grid: Data) -> Array:
    """Power of a known function of time in each bin (sum of its squared cosine transform), shape (bins,)."""
    j = ordinates_of(effect, data, grid)
    return _bin_sums(signal_ordinates(effect, j, data, grid) ** 2, j, data)


def whitened_signal_power(
    effect: Deterministic, directions: Array, null: Solution, data: Data, grid: Data
) -> Array:
    """Sum over each bin of the power of a known function of time, relative to the noise of `null`, shape (bins,).

    The part of a slow function that the basis `directions` (`known_directions`) can fit is subtracted first.
    """
    j = ordinates_of(effect, data, grid)
    values = signal_ordinates(effect, j, data, grid) / np.sqrt(null.spectrum[_bin_of(j, data)])
    if effect.low and directions.size:
        values = values - directions @ (directions.T @ values)
    return _bin_sums(values**2, j, data)


def _bin_sums(values: Array, j: NDArray[np.int64], data: Data) -> Array:
    """Array of the sums of `values` in each bin, shape (bins,). `values[i]` belongs to the frequency with index `j[i]`."""
    total = np.zeros(data.bins.count.size)
    np.add.at(total, _bin_of(j, data), values)
    return total


def best_fit(model: Model, power: Array, data: Data) -> Solution:
    """`Solution`: fit of a model to expected bin powers. The fit starts from the shape values of the model."""
    count = data.bins.count

    part = RandomPart(data, power, count, is_expected=True)
    model, best = fit_shapes(model, part)
    matrix = columns(model, data)
    model = with_coefficients(model, best.theta)
    return Solution(
        fitted(model, best.theta, matrix),
        best.spectrum,
        best.weight,
        best.scale,
        best.log_likelihood,
        power,
        count,
        Residual(data, ()),
        best.log_likelihood,
    )


def known_directions(model: Model, null: Solution, data: Data, grid: Data) -> Array:
    """Orthonormal basis, shape (ordinates, directions), of all changes that the slow known functions of a model can fit.

    Each function gives its cosine transform and the changes of this transform with its shape parameters, whitened by
    `null`. Functions with held parameters are omitted. Shape (0, 0) without slow functions.
    """
    low = [e for e in model if isinstance(e, Deterministic) and e.low and not e.held]
    if not low:
        return np.zeros((0, 0))
    j = ordinates_of(low[0], data, grid)
    rows = []
    for effect in low:
        own = signal_ordinates(effect, j, data, grid)
        rows.append(own)
        for p in effect.parameters:
            value = effect.values[p.name]
            if p.role in {"shape", "time"} and isinstance(value, float):
                # The step must reach the next cell of the grid for a function that jumps.
                step = max(1e-3 * data.duration if p.unit == "s" else 0.0, 0.01 * abs(value))
                step = step if value + step <= p.high else -step
                moved = effect.with_values(**{p.name: value + step})
                rows.append(signal_ordinates(moved, j, data, grid) - own)
    whitened = np.array(rows) / np.sqrt(null.spectrum[_bin_of(j, data)])
    size = np.linalg.norm(whitened, axis=1, keepdims=True)
    left, singular, _ = np.linalg.svd((whitened / np.maximum(size, 1e-300)).T, full_matrices=False)
    return np.asarray(left[:, singular > MIN_SINGULAR_VALUE])


def absorbed_ordinates(directions: Array, data: Data) -> Array:
    """Degrees of freedom that the basis `directions` (`known_directions`) removes from each bin, shape (bins,)."""
    j = np.arange(1, len(directions) + 1)
    return _bin_sums((directions**2).sum(axis=1), j, data)


def _bin_of(j: NDArray[np.int64], data: Data) -> NDArray[np.int64]:
    """Integer array, shape of j: index of the bin to which each ordinate belongs."""
    return np.searchsorted(data.bins.edges, j, side="right") - 1


def expected_power(model: Model, data: Data) -> Array:
    """Expected power of each bin under the random processes of a model with values, shape (bins,)."""
    noise = random_part(model)
    return column(data.terms(noise), data)
