"""Recognize tables of averaging times and deviations from other programs, which are no logs of samples."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.readers._table import Table

#: Names of columns of averaging times and of deviations.
_TAU = re.compile(
    r"^(?:taus?\d*|τ|averaging[ _]?(?:time|interval)|(?:avg|cluster)[ _]?time|m[ _]?tau)$",
    re.IGNORECASE,
)
_DEVIATION = re.compile(
    r"adev|avar|mdev|hdev|tdev|totdev|allan|hadamard|(?:^|[^a-z])(?:sigma|dev(?:iations?)?)(?:[^a-z]|$)",
    re.IGNORECASE,
)
#: Number of first rows that are examined, and minimum number of rows for a decision. Chosen by judgment; not measured.
ROWS, MIN_ROWS = 64, 8
#: Ratio of the last to the first averaging time between which the initial slope is computed.
SLOPE_SPAN = 8.0
#: Range of the initial slope of ln σ over ln τ. White noise has −1/2, quantization −1. A log whose columns all decay
#: smoothly from the first row is a warm-up, whose slope over the first eight rows is flatter than −0.2.
SLOPES = (-1.2, -0.2)
#: Maximum median of the second differences of ln σ. Deviations at neighboring τ share most of their samples, so that the
#: curve is smooth.
MAX_ROUGHNESS = 0.3


def is_deviation_table(names: Sequence[str], columns: Sequence[Array | None]) -> bool:
    """True if the columns are averaging times and deviations, by their names or, without names, by their numbers.

    The numbers must have at least 8 rows, all positive, regularly rising times, and further columns that fall smoothly.
    If a column was not read (None), only the names can show it.
    """
    if any(map(_TAU.match, names)) and any(map(_DEVIATION.search, names)):
        return True
    if len(columns) < 2 or any(not re.match(r"^x\d+$", name) for name in names):
        return False
    first, others = columns[0], columns[1:]
    if first is None or any(column is None for column in others):
        return False
    tau = np.asarray(first[:ROWS], dtype=np.float64)
    found = [np.asarray(column[:ROWS], dtype=np.float64) for column in others if column is not None]
    if tau.size < MIN_ROWS or not all(np.all(np.isfinite(c) & (c > 0)) for c in (tau, *found)):
        return False
    steps = np.diff(tau)
    if not np.all(steps > 0):
        return False
    # Averaging times are multiples of the first one, or have similar ratios: 1, 2, 4, … or 1, 2, 5, 10, …
    multiples = bool(np.allclose(steps, tau[0], rtol=1e-3))
    ratios = tau[1:] / tau[:-1]
    spread = bool(ratios.min() > 1.05 and ratios.max() < 12.0 and np.ptp(steps) > 2.0 * steps[0])
    return (multiples or spread) and all(_is_deviation(tau, column) for column in found)


def is_deviation_header(line: str) -> bool:
    """True if a line names averaging times and deviations, such as ``tau adev``.

    The number of words may differ from the number of columns below, as in files of Stable32.
    """
    words = re.split(r"[\s,;|]+", line.strip("#%; \t"))
    return any(map(_TAU.match, words)) and any(map(_DEVIATION.search, words))


def refuse_deviation_header(lines: Sequence[str]) -> None:
    """Raise `InputError` if a line above the first row of numbers names averaging times and deviations."""
    for line in lines:
        if re.match(r"^\s*[-+.]?\d", line):
            return
        if is_deviation_header(line):
            raise _deviation_table_error("")


def _is_deviation(tau: Array, column: Array) -> bool:
    """True if a column falls smoothly with the averaging time τ, as a deviation does.

    Its log-log slope up to 8 times the first τ is between −1.2 and −0.2. The median absolute second difference of its
    natural logarithm is below 0.3.
    """
    last = max(int(np.searchsorted(tau, SLOPE_SPAN * tau[0], side="right")) - 1, 1)
    slope = np.log(column[last] / column[0]) / np.log(tau[last] / tau[0])
    rough = np.abs(np.diff(np.log(column), 2))
    return bool(SLOPES[0] < slope < SLOPES[1] and np.median(rough) < MAX_ROUGHNESS)


def refuse_deviation_table(table: Table) -> None:
    """Raise `InputError` if a table holds averaging times and deviations instead of samples."""
    if not is_deviation_table(table.names, table.columns):
        return
    tau = next(
        (c for n, c in zip(table.names, table.columns, strict=True) if _TAU.match(n)),
        table.columns[0],
    )
    span = "" if tau is None or len(tau) == 0 else f" (τ from {tau[0]:.4g} to {tau[-1]:.4g} s)"
    raise _deviation_table_error(span)


def _deviation_table_error(span: str) -> InputError:
    """`InputError` (not raised) for a table of deviations; `span` is inserted into its message, such as " (τ from …)"."""
    return InputError(
        f"a table of deviations{span}, not a log of samples",
        missing="record_length",
        remedy=": give that log, or fit the table with allanite export, {unit} and {record_length}",
    )
