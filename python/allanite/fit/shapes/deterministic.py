"""Generalized least squares of known functions of time on the cosine ordinates.

In the ordinates the noise is uncorrelated with variance S_j, so that GLS is a weighted regression. Slow functions use only
the lowest ordinates, and lines only a window around their frequency.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.fit.shapes.drifting import ordinates_of_drift
from allanite.fit.shapes.matched import regressor_ordinates

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data

#: Number of lowest ordinates in which slow functions are regressed. Chosen by judgment; not measured.
LOWEST_ORDINATES = 8192
#: Number of ordinates to each side of a line in which the line is regressed. At most 0.3 % of its power lies beyond.
LINE_WINDOW = 128
#: Number of lines of a comb above which each line counts as 0 beyond its own window. The time for all windows grows with
#: the square of the number of lines. Chosen by judgment; not measured.
MAX_JOINT_DESIGN_LINES = 12
#: Minimum eigenvalue of the normal equations, relative to the largest; below, regressors are linearly dependent.
#: Chosen by judgment; not measured.
MIN_RELATIVE_EIGENVALUE = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Regressors of known functions of time, shape (k, p), at the ascending `ordinates`, shape (k,), that contain them.

    `blocks` are the parts (rows, columns) of `matrix` that are not 0: one for each line of a comb. By default, all.
    """

    ordinates: NDArray[np.int64]
    matrix: Array
    blocks: tuple[tuple[slice, slice], ...] = ((slice(None), slice(None)),)

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class Regression:
    """Result of a weighted regression of ordinates.

    `leverage` is that of each ordinate, shape (k,). `gain` is ΔlogL over amplitudes of 0, nats.
    """

    amplitudes: Array
    covariance: Array
    leverage: Array
    gain: float

    __repr__ = brief


def ordinates_near(frequency: float, data: Data, half: int = LINE_WINDOW) -> NDArray[np.int64]:
    """Indices of a record's ordinates, without the mean, that are at most `half` ordinates from a frequency in Hz."""
    center = round(2.0 * data.n * frequency / data.rate)
    return np.arange(
        max(1, center - half), min(data.ordinates.size, center + half + 1), dtype=np.int64
    )


def line_ordinates(frequency: float | Array, j: NDArray[np.int64], data: Data) -> Array:
    """Cosine ordinates j of sin 2πft and cos 2πft, in closed form, shape (…, k, 2).

    `frequency` is f in Hz, shape (…). Σ_k cos(θ(k+½)+ψ) = cos(nθ/2+ψ) sin(nθ/2)/sin(θ/2), with θ = ω ± πj/n. The product of
    the first two factors depends on j only through its parity, and is the same for both signs.
    """
    n = data.n
    w = 2.0 * np.pi * np.asarray(frequency)[..., None] / data.rate
    a = np.pi * j / n
    first = 2.0 * np.pi * np.asarray(frequency)[..., None] * data.start - w / 2.0  # phase at k = −½
    whole, odd = n * w / 2.0, j % 2 == 1
    sine, cosine = np.sin(whole), np.cos(whole)
    phase = whole + first
    across, along = np.sin(w / 2.0) * np.cos(a / 2.0), np.cos(w / 2.0) * np.sin(a / 2.0)
    up, down = across + along, across - along
    # Closer to the line than this, the quotient is a limit in which rounding errors do not cancel.
    near = np.nonzero((np.abs(up) * n < 1.0) | (np.abs(down) * n < 1.0))
    up[near] = down[near] = 1.0
    scale = data.attenuated(np.full(j.size, np.sqrt(0.5 / n)), j)
    both = scale * (1.0 / up + 1.0 / down)
    out = np.empty((*both.shape, 2))
    out[..., 0] = both * np.where(odd, cosine * np.cos(phase), sine * np.sin(phase))
    out[..., 1] = both * np.where(odd, -cosine * np.sin(phase), sine * np.cos(phase))
    at = near[-1]
    w, first = w[near[:-1]].ravel(), first[near[:-1]].ravel()
    out[near] = scale[at, None] * (
        _line_sums(w + a[at], first, n) + _line_sums(w - a[at], first, n)
    )
    return out


def _line_sums(theta: Array, phase: Array, n: int) -> Array:
    """Array of the sums of sin(θ(k+½) + phase) and of cos(θ(k+½) + phase) over k = 0 … n − 1, shape (θ, 2)."""
    half = theta / 2.0
    below = np.sin(half)
    small = np.abs(below) < 1e-12
    whole = n * half
    ratio = np.where(small, n, np.sin(whole) / np.where(small, 1.0, below))
    return ratio[:, None] * np.stack([np.sin(whole + phase), np.cos(whole + phase)], axis=-1)


def comb_ordinates(
    frequency: float | Array, multiples: Sequence[float], j: NDArray[np.int64], data: Data
) -> Array:
    """Cosine ordinates j of the sine and cosine of lines at `multiples` × `frequency`, Hz, shape (…, k, 2·lines)."""
    lines = line_ordinates(np.multiply.outer(frequency, multiples), j, data)
    return np.moveaxis(lines, -3, -2).reshape(*np.shape(frequency), j.size, 2 * len(multiples))


def comb_gains(
    frequency: Array,
    multiples: Sequence[float],
    j: NDArray[np.int64],
    values: Array,
    variance: Array,
    data: Data,
) -> Array:
    """ΔlogL of a line with its harmonics, for each base frequency in `frequency` (Hz), shape (f,).

    All their sine and cosine amplitudes are fitted together. `values` are ordinates with the indices j, whose noise has the
    given `variance`.
    """
    root = 1.0 / np.sqrt(variance)
    white = comb_ordinates(frequency, multiples, j, data) * root[:, None]
    norm = np.linalg.norm(white, axis=1, keepdims=True)
    unit = white / np.where(norm > 0.0, norm, 1.0)
    score = np.einsum("fkp,k->fp", unit, values * root)
    inverse = np.linalg.pinv(unit.transpose(0, 2, 1) @ unit, rcond=1e-12, hermitian=True)
    return np.asarray(0.5 * np.einsum("fp,fpq,fq->f", score, inverse, score))


def comb_window(
    frequency: float, multiples: Sequence[float], data: Data, half: int = LINE_WINDOW
) -> NDArray[np.int64]:
    """Sorted array, without duplicates, of the ordinates within `half` ordinates of the `multiples` of a frequency, Hz."""
    windows = [ordinates_near(m * frequency, data, half) for m in multiples]
    return union(windows)


def union(ordinates: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Ascending array of all indices in several ascending arrays, each once; a single array is returned as it is."""
    if len(ordinates) == 1:
        return ordinates[0]
    # A stable sort merges ascending arrays; `np.unique` takes ten times as long.
    every = np.sort(np.concatenate(ordinates), kind="stable")
    return every[np.append(True, every[1:] != every[:-1])]


def design_of(
    effects: tuple[Deterministic, ...], data: Data, at: NDArray[np.int64] | None = None
) -> Design:
    """`Design`: regressors of the effects at their present shapes, at the ordinates `at`.

    By default these are ordinates near lines, and the lowest 8191 if an effect is slow. `effects` must not be empty.
    """
    if at is None and len(effects) == 1 and len(effects[0].lines) > MAX_JOINT_DESIGN_LINES:
        return _design_of_lines(effects[0], data)
    if at is None:
        parts = [ordinates_of_line(e, data) for e in effects if not e.low]
        if any(e.low for e in effects):
            parts.append(np.arange(1, min(data.n, LOWEST_ORDINATES), dtype=np.int64))
        at = union(parts)
    return Design(at, np.column_stack([regressors_at(e, at, data) for e in effects]))


def _design_of_lines(effect: Deterministic, data: Data) -> Design:
    """`Design` of a comb; each line is set to 0 at ordinates outside its own window."""
    frequencies = [m * (effect.base_frequency or 0.0) for m, _, _ in effect.lines]
    windows = [ordinates_near(f, data) for f in frequencies]
    at = union(windows)
    matrix, blocks = np.zeros((at.size, 2 * len(windows))), []
    for k, (f, window) in enumerate(zip(frequencies, windows, strict=True)):
        first = int(np.searchsorted(at, window[0])) if window.size else 0
        blocks.append((slice(first, first + window.size), slice(2 * k, 2 * k + 2)))
        matrix[blocks[-1]] = line_ordinates(f, window, data)
    return Design(at, matrix, tuple(blocks))


def parts_of(designs: Sequence[Design]) -> list[slice]:
    """List of slices, one for each design: its columns in the matrix of all designs side by side."""
    ends = np.cumsum([0, *(design.matrix.shape[1] for design in designs)]).tolist()
    return [slice(*pair) for pair in itertools.pairwise(ends)]


def ordinates_of_line(effect: Deterministic, data: Data) -> NDArray[np.int64]:
    """Array of the indices of the ordinates on which a line, a comb or a drifting line is regressed."""
    if effect.periodic:
        return comb_window(effect.base_frequency or 0.0, [m for m, _, _ in effect.lines], data)
    return ordinates_of_drift(effect, data)


def regressors_at(effect: Deterministic, j: NDArray[np.int64], data: Data) -> Array:
    """Array of the cosine ordinates j of the regressors of an effect, shape (k, p); a line has two, sine and cosine."""
    if effect.periodic:
        return comb_ordinates(
            effect.base_frequency or 0.0, [m for m, _, _ in effect.lines], j, data
        )
    return regressor_ordinates([effect], j, data).T


def shape_slope(
    effect: Deterministic, name: str, ordinates: NDArray[np.int64], data: Data
) -> Array | None:
    """Derivative of an effect's cosine ordinates with respect to the shape `name`; None if it cannot be changed."""
    value = effect.values[name]
    steps = {"Hz": 1e-4 / data.duration, "Hz/s": 1e-4 / data.duration**2}
    steps["s"] = max(
        1e-3 * abs(value), 1.0 / data.rate
    )  # a smaller step than a sample changes nothing
    step = steps.get(str(effect.parameter(name).unit), 1e-3 * abs(value))
    if step == 0.0:
        return None
    try:
        moved = [effect.with_values(**{name: value + s}) for s in (step, -step)]
    except ValueError:
        return None
    up, down = (regressors_at(m, ordinates, data) for m in moved)
    return np.asarray((up - down) @ effect.amplitudes() / (2.0 * step))


def residual_ordinates_at(
    effects: Sequence[Deterministic], j: NDArray[np.int64], data: Data
) -> Array:
    """Ordinates j of the record minus the `effects`, which have values for all parameters, shape (k,)."""
    left = data.ordinates[j]
    for effect in effects:
        left = left - regressors_at(effect, j, data) @ effect.amplitudes()
    return left


def delta_logl_of(rows: Array, target: Array) -> float:
    """ΔlogL, nats, of a regression of `target`, shape (k,), on `rows`, shape (p, k); both are whitened.

    Nearly dependent directions of the rows are omitted, as in `regress_designs`.
    """
    norm = np.sqrt(np.einsum("pk,pk->p", rows, rows))
    norm[norm == 0.0] = 1.0
    score = rows @ target / norm
    normal = rows @ rows.T / np.outer(norm, norm)
    inverse = np.linalg.pinv(normal, rcond=MIN_RELATIVE_EIGENVALUE, hermitian=True)
    return 0.5 * float(score @ inverse @ score)


def regress(matrix: Array, values: Array, variance: Array) -> Regression:
    """`Regression`: fit of the columns of `matrix` to the ordinates `values`, with the weights 1/`variance`.

    Nearly dependent directions are left out, as in a pseudo-inverse (`regress_designs`).
    """
    at = np.arange(values.size, dtype=np.int64)
    return regress_designs((Design(at, matrix),), at, values, variance)


def regress_designs(
    designs: Sequence[Design], at: NDArray[np.int64], values: Array, variance: Array
) -> Regression:
    """`Regression` of all `designs` together; a regressor counts as 0 at ordinates that its design does not contain.

    `values` and `variance` are those of the ordinates `at`, ascending, which contain those of all designs. The columns of
    the designs follow each other. The gain, ΔlogL, is ½ bᵀA⁻¹b for the normal equations A x = b of regressors of norm 1.
    Directions whose eigenvalue of A is at most 1e-12 of the largest are left out. Blocks of regressors in different ranges
    of ordinates are regressed separately.
    """
    root = 1.0 / np.sqrt(variance)
    target = values * root
    count = sum(design.matrix.shape[1] for design in designs)
    amplitudes, covariance = np.zeros(count), np.zeros((count, count))
    leverage, gain = np.zeros(at.size), 0.0
    for blocks in _overlapping(_blocks_of(designs, at)):
        rows = union([block[0] for block in blocks])
        columns = np.concatenate([block[1] for block in blocks])
        white = np.zeros((rows.size, columns.size))
        last = 0
        for own, _, matrix in blocks:
            first, last = last, last + matrix.shape[1]
            white[np.searchsorted(rows, own), first:last] = matrix * root[own, None]
        norm = np.sqrt(np.einsum("kp,kp->p", white, white))
        norm[norm == 0.0] = 1.0
        unit = white / norm
        score = unit.T @ target[rows]
        # Drop directions that other regressors already span.
        strength, axes = np.linalg.eigh(unit.T @ unit)
        kept = strength > MIN_RELATIVE_EIGENVALUE * strength.max(initial=0.0)
        inverse = (axes[:, kept] / strength[kept]) @ axes[:, kept].T
        solution = inverse @ score
        amplitudes[columns] = solution / norm
        covariance[np.ix_(columns, columns)] = inverse / np.outer(norm, norm)
        leverage[rows] += np.einsum("kp,kp->k", unit @ inverse, unit)
        gain += 0.5 * float(score @ solution)
    return Regression(amplitudes, covariance, leverage, gain)


#: Rows in the array of all ordinates, columns in the matrix of all designs side by side, and regressors of a block.
_Block = tuple[NDArray[np.int64], NDArray[np.int64], Array]


def _blocks_of(designs: Sequence[Design], at: NDArray[np.int64]) -> list[_Block]:
    """List of the blocks of all `designs`, without empty ones; `at` are the ordinates of all designs."""
    found = []
    for design, part in zip(designs, parts_of(designs), strict=True):
        places = np.searchsorted(at, design.ordinates)
        every = np.arange(part.start, part.stop)
        found += [(places[r], every[c], design.matrix[r, c]) for r, c in design.blocks]
    return [block for block in found if block[0].size]


def _overlapping(blocks: list[_Block]) -> list[list[_Block]]:
    """List of groups of `blocks`; the ranges of rows of different groups do not overlap."""
    groups: list[list[_Block]] = []
    last = -1
    for block in sorted(blocks, key=lambda block: int(block[0][0])):
        if block[0][0] > last:
            groups.append([])
        groups[-1].append(block)
        last = max(last, int(block[0][-1]))
    return groups
