"""Logged columns with coarse steps, such as a thermometer of whole degrees, and the curve behind the steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array, runs_of

#: Minimum mean number of samples between changes of a coarse column. A thermometer that changes more often resolves its
#: quantity by its own noise.
MIN_RUN = 20
#: Minimum share of changes by exactly one step. Changes by several steps come from slow sampling, not rounding.
MIN_ONE_STEP_SHARE = 0.9
#: Minimum number of changes from which a curve can be found.
MIN_CHANGES = 3
#: Points of the curve.
CURVE_POINTS = 1500
#: Maximum distance of the curve from the half steps around the codes, in steps: a thermometer's own noise.
TOLERANCE = 0.05
#: Standard error of a threshold between two codes, in steps.
THRESHOLD = 0.02
#: Weights of the squared third differences that are tried, from a parabola to the steps themselves, in squared steps.
SMOOTHNESS = 10.0 ** np.arange(12.0, -1.0, -2.0)
#: Rounds for each weight in which the curve is pulled back into the half steps.
ROUNDS = 4
#: Time constants of a relaxation that are tried, in lengths of the record; the best is refined between its neighbors.
RELAXATIONS = 2.0 ** np.arange(-6.0, 2.5, 0.5)


def coarse_step_of(values: Array) -> float:
    """Step of a column logged in coarse steps, in its unit; 0 for other columns.

    A coarse column changes at least 3 times, at one of 20 samples at most, and 90 % of the changes have the same
    size.
    """
    places = np.flatnonzero(values[1:] != values[:-1])
    if places.size < MIN_CHANGES or values.size < MIN_RUN * places.size:
        return 0.0
    sizes = np.abs(values[places + 1] - values[places])
    step = float(np.median(sizes))
    one = np.abs(sizes / step - 1.0) < 0.01
    return step if float(np.mean(one)) >= MIN_ONE_STEP_SHARE else 0.0


def without_steps(values: Array) -> Array:
    """Smoothest curve that rounds to a coarsely logged column, shape (n,); other columns are returned unchanged.

    Without this curve, rounding errors would look like noise of the sensor, because they last as long as a code. The
    quantity was at the threshold of two codes when the column changed, and within half a step of the code otherwise. A
    ramp with one exponential relaxation is preferred if it rounds to the column, because a warming body relaxes. Nothing
    else determines the curve before the first and after the last change. Otherwise the curve has the smallest squared
    third differences.
    """
    step = coarse_step_of(values)
    if step == 0.0:
        return values
    from scipy.interpolate import CubicSpline

    count = min(CURVE_POINTS, values.size)
    grid = np.linspace(0.0, values.size - 1.0, count)
    code = values[np.rint(grid).astype(np.int64)]
    curve = _curve_on_grid(values, grid, code, step)
    curve = np.clip(curve, code - (0.5 + TOLERANCE) * step, code + (0.5 + TOLERANCE) * step)
    return np.asarray(CubicSpline(grid, curve)(np.arange(values.size, dtype=np.float64)))


def _curve_on_grid(values: Array, grid: Array, code: Array, step: float) -> Array:
    """Smooth curve through a column logged in coarse steps, shape (points,), at the positions `grid` (in samples).

    `code` are the logged values at these positions, and `step` is their step. A relaxation curve is returned if it lies
    within half a step of `code`, otherwise the smoothest spline-like curve that does, or else the least smooth one.
    """
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import spsolve

    count = grid.size
    changes = np.flatnonzero(values[1:] != values[:-1])
    thresholds = 0.5 * (values[changes] + values[changes + 1])
    # A change lies between two samples, and these between two points of the grid.
    place = ((changes + 0.5) / (values.size - 1.0) * (count - 1.0)).astype(np.float64)
    third = diags_array(
        [-1.0, 3.0, -3.0, 1.0], offsets=[0, 1, 2, 3], shape=(count - 3, count)
    ).tocsc()
    rough = third.T @ third
    # Next to a change, the code of a grid point may be that of the other side.
    spacing = (values.size - 1.0) / (count - 1.0)
    after = np.clip(np.searchsorted(changes, grid), 0, changes.size - 1)
    before = np.maximum(after - 1, 0)
    apart = np.minimum(np.abs(grid - changes[after]), np.abs(grid - changes[before]))
    near = apart <= 2.0 * spacing
    edge_place, edge_value = np.empty(0), np.empty(0)

    def beyond_codes(curve: Array) -> Array:
        """Distance of each point of `curve` beyond the half step around its code, in steps; negative inside.

        Within two grid points of a change, where the code is uncertain, the limit is 1.5 steps instead of 0.5.
        """
        beyond: Array = np.abs(curve - code) / step - 0.5
        beyond[near] -= 1.0
        return beyond

    curve = _relaxation_curve(place, thresholds, count)
    if beyond_codes(curve).max() <= TOLERANCE:
        return curve
    for smoothness in SMOOTHNESS:
        for _ in range(ROUNDS):
            wanted = np.concatenate([thresholds, edge_value])
            seen = _interpolation_matrix(np.concatenate([place, edge_place]), count)
            normal = seen.T @ seen / THRESHOLD**2 + smoothness * rough
            curve = spsolve(normal.tocsc(), seen.T @ wanted / THRESHOLD**2)
            beyond = beyond_codes(curve)
            if beyond.max() <= TOLERANCE:
                return curve
            worst = _largest_per_run(beyond > TOLERANCE, beyond)
            edge_place = np.concatenate([edge_place, worst.astype(np.float64)])
            inside = code[worst] + 0.5 * step * np.sign(curve[worst] - code[worst])
            edge_value = np.concatenate([edge_value, inside])
        edge_place, edge_value = np.empty(0), np.empty(0)
    return curve


def _interpolation_matrix(at: Array, count: int) -> Any:
    """Sparse matrix, shape (positions, count), that interpolates linearly from positions 0 … count − 1 to `at`."""
    from scipy.sparse import csc_array

    low = np.minimum(np.floor(at).astype(np.int64), count - 2)
    rows, part = np.arange(at.size), at - low
    entries = np.concatenate([1.0 - part, part])
    places = np.concatenate([rows, rows]), np.concatenate([low, low + 1])
    return csc_array((entries, places), shape=(at.size, count))


def _relaxation_curve(place: Array, values: Array, count: int) -> Array:
    """Least-squares curve of constant, ramp and exponential relaxation at positions 0 … count − 1, shape (count,)."""
    from scipy.optimize import minimize_scalar

    def basis(at: Array, octave: float) -> Array:
        """Columns constant, ramp and relaxation with the time constant count·2^octave samples, at sample indices `at`."""
        u = at / count
        # Constant and slope are subtracted from the relaxation, so that a long one becomes a parabola.
        return np.column_stack(
            [np.ones(at.size), u, (np.expm1(-u / 2.0**octave) + u / 2.0**octave)]
        )

    def misfit(octave: float) -> float:
        """Sum of squared residuals of the least-squares curve with the time constant count·2^octave."""
        rows = basis(place, octave)
        rows /= np.linalg.norm(rows, axis=0)
        return float(np.sum((rows @ np.linalg.lstsq(rows, values, rcond=None)[0] - values) ** 2))

    octaves = np.log2(RELAXATIONS)
    best = int(np.argmin([misfit(octave) for octave in octaves]))
    ends = octaves[max(best - 1, 0)], octaves[min(best + 1, octaves.size - 1)]
    octave = float(minimize_scalar(misfit, bounds=ends, method="bounded").x)
    known = np.linalg.lstsq(basis(place, octave), values, rcond=None)[0]
    return np.asarray(basis(np.arange(count, dtype=np.float64), octave) @ known)


def _largest_per_run(mask: NDArray[np.bool_], size: Array) -> NDArray[np.int64]:
    """Index of the largest `size` within each run of True of the mask, shape (runs,)."""
    runs = zip(*runs_of(mask), strict=True)
    return np.array([first + np.argmax(size[first:end]) for first, end in runs], dtype=np.int64)
