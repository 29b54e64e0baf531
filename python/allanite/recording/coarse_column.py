"""Logged columns in coarse steps, such as a thermometer of whole degrees: the curve behind the steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["coarse_step_of", "without_steps"]

#: Mean number of samples between two changes from which on the steps are visible as such. A thermometer that changes
#: more often resolves its quantity by its own noise.
MIN_RUN = 20
#: Least share of the changes that are exactly one step. Changes of several steps are a slow sampler, not rounding.
ONE_STEP = 0.9
#: Changes below which no curve can be told from the steps.
MIN_CHANGES = 3
#: Points of the curve.
POINTS = 1500
#: How far the curve may leave the half step to each side, in steps: a thermometer's own noise.
TOLERANCE = 0.05
#: Standard error of a threshold between two codes, in steps.
THRESHOLD = 0.02
#: Weights of the squared third differences that are tried, from a parabola to the steps, in squared steps.
SMOOTHNESS = 10.0 ** np.arange(12.0, -1.0, -2.0)
#: Rounds in which the curve is pulled back into the half steps for one weight.
ROUNDS = 4
#: Time constants of a relaxation that are tried, in lengths of the record; the best is refined between its neighbors.
RELAXATIONS = 2.0 ** np.arange(-6.0, 2.5, 0.5)


def coarse_step_of(values: NDArray[np.float64]) -> float:
    """Return the step in which a column of shape (n,) is logged if it is coarse, else 0."""
    places = np.flatnonzero(values[1:] != values[:-1])
    if places.size < MIN_CHANGES or values.size < MIN_RUN * places.size:
        return 0.0
    sizes = np.abs(values[places + 1] - values[places])
    step = float(np.median(sizes))
    one = np.abs(sizes / step - 1.0) < 0.01
    return step if float(np.mean(one)) >= ONE_STEP else 0.0


def without_steps(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the smoothest curve that rounds to a coarse column; a column that is not coarse as it is.

    The quantity was at the threshold of two codes where the column changed, and within half a step of the code elsewhere.
    If a ramp with one exponential relaxation is such a curve, it is taken: a body that warms up relaxes, and before the
    first change and after the last one nothing else tells the curve. Otherwise it is the one with the least squared third
    differences. Rounding errors of up to half a step, correlated over as long as a code stands, would pass for noise of
    the sensor.
    """
    step = coarse_step_of(values)
    if step == 0.0:
        return values
    from scipy.interpolate import CubicSpline

    count = min(POINTS, values.size)
    grid = np.linspace(0.0, values.size - 1.0, count)
    code = values[np.rint(grid).astype(np.int64)]
    curve = _curve(values, grid, code, step)
    curve = np.clip(curve, code - (0.5 + TOLERANCE) * step, code + (0.5 + TOLERANCE) * step)
    found: NDArray[np.float64] = CubicSpline(grid, curve)(np.arange(values.size, dtype=np.float64))
    return found


def _curve(
    values: NDArray[np.float64], grid: NDArray[np.float64], code: NDArray[np.float64], step: float
) -> NDArray[np.float64]:
    from scipy.sparse import csc_array, diags_array
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
    # Beside a change the code of a point of the grid may be the other one.
    spacing = (values.size - 1.0) / (count - 1.0)
    after = np.clip(np.searchsorted(changes, grid), 0, changes.size - 1)
    before = np.maximum(after - 1, 0)
    apart = np.minimum(np.abs(grid - changes[after]), np.abs(grid - changes[before]))
    near = apart <= 2.0 * spacing
    edge_place, edge_value = np.empty(0), np.empty(0)

    def beyond_codes(curve: NDArray[np.float64]) -> NDArray[np.float64]:
        """By how much the curve leaves the half steps about its codes, in steps."""
        beyond: NDArray[np.float64] = np.abs(curve - code) / step - 0.5
        beyond[near] -= 1.0
        return beyond

    curve = _relaxation(place, thresholds, count)
    if beyond_codes(curve).max() <= TOLERANCE:
        return curve
    for smoothness in SMOOTHNESS:
        for _ in range(ROUNDS):
            at = np.concatenate([place, edge_place])
            wanted = np.concatenate([thresholds, edge_value])
            low = np.minimum(np.floor(at).astype(np.int64), count - 2)
            part = at - low
            rows = np.arange(at.size)
            seen = csc_array(
                (
                    np.concatenate([1.0 - part, part]),
                    (np.concatenate([rows, rows]), np.concatenate([low, low + 1])),
                ),
                shape=(at.size, count),
            )
            normal = seen.T @ seen / THRESHOLD**2 + smoothness * rough
            curve = spsolve(normal.tocsc(), seen.T @ wanted / THRESHOLD**2)
            beyond = beyond_codes(curve)
            if beyond.max() <= TOLERANCE:
                return curve
            worst = _worst_of_runs(beyond > TOLERANCE, beyond)
            edge_place = np.concatenate([edge_place, worst.astype(np.float64)])
            inside = code[worst] + 0.5 * step * np.sign(curve[worst] - code[worst])
            edge_value = np.concatenate([edge_value, inside])
        edge_place, edge_value = np.empty(0), np.empty(0)
    return curve


def _relaxation(
    place: NDArray[np.float64], values: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """Return the ramp with an exponential relaxation nearest to values at some places, at all places 0 … count − 1."""
    from scipy.optimize import minimize_scalar

    def basis(at: NDArray[np.float64], octave: float) -> NDArray[np.float64]:
        u = at / count
        # expm1 and the ramp: of long relaxations the constant and the slope are taken out, which leaves a parabola.
        return np.column_stack(
            [np.ones(at.size), u, (np.expm1(-u / 2.0**octave) + u / 2.0**octave)]
        )

    def misfit(octave: float) -> float:
        rows = basis(place, octave)
        rows /= np.linalg.norm(rows, axis=0)
        return float(np.sum((rows @ np.linalg.lstsq(rows, values, rcond=None)[0] - values) ** 2))

    octaves = np.log2(RELAXATIONS)
    best = int(np.argmin([misfit(octave) for octave in octaves]))
    ends = octaves[max(best - 1, 0)], octaves[min(best + 1, octaves.size - 1)]
    octave = float(minimize_scalar(misfit, bounds=ends, method="bounded").x)
    known = np.linalg.lstsq(basis(place, octave), values, rcond=None)[0]
    found: NDArray[np.float64] = basis(np.arange(count, dtype=np.float64), octave) @ known
    return found


def _worst_of_runs(mask: NDArray[np.bool_], size: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the place of the largest value in each run of a mask."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return np.array(
        [first + int(np.argmax(size[first:end])) for first, end in pairs], dtype=np.int64
    )
