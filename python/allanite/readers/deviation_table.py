"""Tables of deviations that other tools write: averaging times and deviations are no samples."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.readers._table import Table

__all__ = [
    "is_deviation_header",
    "is_deviation_table",
    "refuse_deviation_header",
    "refuse_deviation_table",
]

_TAU = re.compile(
    r"^(?:taus?\d*|τ|averaging[ _]?(?:time|interval)|(?:avg|cluster)[ _]?time|m[ _]?tau)$",
    re.IGNORECASE,
)
_DEVIATION = re.compile(
    r"adev|avar|mdev|hdev|tdev|totdev|allan|hadamard|(?:^|[^a-z])(?:sigma|dev(?:iations?)?)(?:[^a-z]|$)",
    re.IGNORECASE,
)
#: Rows that are looked at, and those below which numbers say nothing.
ROWS, FEWEST_ROWS = 64, 8
#: Ratio of averaging times over which the slope at the shortest is taken.
OCTAVES = 8.0
# White noise has the slope −1/2 over log τ, quantization −1; a log that decays so smoothly from its very first rows in
# every column is a warm-up, whose slope over the first eight rows is flatter than this.
SLOPES = (-1.2, -0.2)
#: Largest second difference of ln σ over the rows looked at; neighbouring τ share most of their samples.
ROUGH = 0.3


def is_deviation_table(names: Sequence[str], columns: Sequence[NDArray[np.float64] | None]) -> bool:
    """Tell a table of averaging times and deviations from a log.

    Parameters
    ----------
    names : sequence of str
        Names of all columns; x0, x1, … where the file has none.
    columns : sequence of (ndarray of shape (n,) or None)
        Their numbers; None where a column was not read.
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
    if tau.size < FEWEST_ROWS or not all(np.all(np.isfinite(c) & (c > 0)) for c in (tau, *found)):
        return False
    steps = np.diff(tau)
    if not np.all(steps > 0):
        return False
    # Multiples of the first averaging time, or averaging times at equal ratios: 1, 2, 4, … or 1, 2, 5, 10, …
    multiples = bool(np.allclose(steps, tau[0], rtol=1e-3))
    ratios = tau[1:] / tau[:-1]
    spread = bool(ratios.min() > 1.05 and ratios.max() < 12.0 and np.ptp(steps) > 2.0 * steps[0])
    return (multiples or spread) and all(_is_deviation(tau, column) for column in found)


def is_deviation_header(line: str) -> bool:
    """Tell a line that names averaging times and deviations, though not as many columns as the rows have: Stable32's."""
    words = re.split(r"[\s,;|]+", line.strip("#%; \t"))
    return any(map(_TAU.match, words)) and any(map(_DEVIATION.search, words))


def refuse_deviation_header(lines: Sequence[str]) -> None:
    """Raise an InputError where a line before the first row of numbers is the header of a table of deviations."""
    for line in lines:
        if re.match(r"^\s*[-+.]?\d", line):
            return
        if is_deviation_header(line):
            raise _refusal("")


def _is_deviation(tau: NDArray[np.float64], column: NDArray[np.float64]) -> bool:
    """Whether a column falls smoothly, as the deviation of white or rounding noise does over the shortest τ."""
    last = max(int(np.searchsorted(tau, OCTAVES * tau[0], side="right")) - 1, 1)
    slope = np.log(column[last] / column[0]) / np.log(tau[last] / tau[0])
    rough = np.abs(np.diff(np.log(column), 2))
    return bool(SLOPES[0] < slope < SLOPES[1] and np.median(rough) < ROUGH)


def refuse_deviation_table(table: Table) -> None:
    """Raise an InputError where a table is one of deviations."""
    if not is_deviation_table(table.names, table.columns):
        return
    tau = next(
        (c for n, c in zip(table.names, table.columns, strict=True) if _TAU.match(n)),
        table.columns[0],
    )
    span = "" if tau is None or len(tau) == 0 else f" (τ from {tau[0]:.4g} to {tau[-1]:.4g} s)"
    raise _refusal(span)


def _refusal(span: str) -> InputError:
    return InputError(
        f"a table of deviations{span}, not a log of samples",
        missing="record_length",
        remedy=": give the log it was computed from, or fit the table with allanite export and {record_length}",
    )
