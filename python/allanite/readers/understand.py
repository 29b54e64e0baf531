"""What a column is by its numbers: a sensor, a clock, an index or a counter, whatever its name."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._split_time import is_split
from allanite.readers.sensor_names import sensor_kind
from allanite.recording.findings import Finding
from allanite.recording.timebase import read_stamps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.readers._choice import Choice, Request
    from allanite.readers._table import Table

__all__ = ["clocks_of", "kind_of", "understand"]

#: Rows looked at, and rows below which numbers tell nothing.
ROWS, FEWEST = 20_000, 20
#: Largest less smallest value of a counter that begins anew: of two to four decimal digits, or of 7, 8, 12 or 16 bits.
SPANS = (99, 127, 255, 999, 4095, 9999, 65535)


# A step beyond doubles, or beside ones near their smallest, is like no other.
@np.errstate(over="ignore", invalid="ignore")
def kind_of(values: NDArray[Any]) -> str | None:
    """Tell a column that counts from one that measures.

    Parameters
    ----------
    values : ndarray of shape (n,)
        A column; its first rows suffice.

    Returns
    -------
    str or None
        ``"index"`` (every row one more), ``"counter"`` (the same, beginning anew), ``"clock"`` (rises in
        nearly every row by much the same, or in whole steps that several rows share), or None.
    """
    x = np.asarray(values[:ROWS])
    if x.size < FEWEST or x.dtype.kind not in "iuf":
        return None
    x = x.astype(np.int64) if x.dtype.kind in "iu" else x
    if x.dtype.kind == "f" and not np.isfinite(x).all():
        return None
    steps = np.diff(x)
    if np.all(steps == 1):
        return "index"
    rising = steps > 0
    if not rising.any():
        return None
    usual = float(np.median(steps[rising]))
    alike = float(np.mean(np.abs(steps[rising] / usual - 1) < 0.5))
    if rising.mean() > 0.9 and alike > 0.8:
        again = steps < 0
        if usual == 1 and again.any() and np.ptp(x) in SPANS:
            return "counter"
        # A sensor that warms up rises too, but comes back within its noise now and then.
        return "clock" if rising.mean() > 0.98 or again.mean() < 0.02 else None
    # Whole seconds of a faster log: shared by several rows, never falling.
    few = rising.sum() >= 5 and np.all(steps >= 0) and bool(np.ptp(steps[rising]) <= 1e-6 * usual)
    return "clock" if few and float(np.ptp(np.diff(np.flatnonzero(rising)))) <= 3 else None


def understand(table: Table, choice: Choice, request: Request) -> tuple[Choice, list[Finding]]:
    """Leave out what counts and does not measure, and take a clock that no name gave away.

    Columns with a unit, a sensor's name, or asked for by name stay what they are; so do the phases of
    clocks and angles, which rise as time does.

    Returns
    -------
    choice : Choice
    told : list of Finding
        What was guessed.
    """
    told: list[Finding] = []
    kinds = {}
    if not request.columns and request.quantity in (None, "rate"):
        for i in choice.samples:
            if table.units[i] is None and sensor_kind(table.names[i]) is None:
                kind = kind_of(table[i])
                if kind is not None:
                    kinds[i] = kind
    if len(kinds) == len(choice.samples):
        kinds = {}  # nothing else is there: the phase of a clock, or an angle
    samples = tuple(i for i in choice.samples if i not in kinds)
    clocks = [i for i, kind in kinds.items() if kind == "clock"]
    stamped = table.time is not None or choice.time is not None
    if clocks and not stamped and not request.timeless:
        at = clocks.pop(0)
        choice = replace(choice, time=at)
        told.append(
            Finding(
                "time_column",
                "info",
                f"column {_shown(table, at)} rises by much the same in every row: taken as the time",
                values={"column_index": at},
                remedy=" ({column} takes it as a sensor)",
            )
        )
        kinds.pop(at)
    if kinds:
        names = ", ".join(f"{_shown(table, i)} ({kind})" for i, kind in kinds.items())
        told.append(
            Finding(
                "not_a_sensor",
                "info",
                f"left out by their numbers: {names}",
                values={"count": len(kinds)},
                remedy="; {column} takes a column as a sensor",
            )
        )
    time, rest = choice.time, choice.rest
    if (
        time is not None
        and rest is not None
        and not is_split(table[time], table[rest], table.names[rest])
    ):
        clocks.append(rest)
    others = tuple(dict.fromkeys((*choice.clocks, *clocks)))
    told += clocks_of(table, choice.time, others)
    return replace(choice, samples=samples, clocks=others), told


def clocks_of(table: Table, at: int | None, others: tuple[int, ...]) -> list[Finding]:
    """Tell of two clocks in one log, and whether they agree."""
    told = []
    for other in others:
        if at is None or other == at or table.columns[other] is None:
            continue
        both = f"{_shown(table, at)} and {_shown(table, other)} are both time; {_shown(table, at)} is used"
        ratio = _ratio(table[at], table[other])
        # Units of stamps differ by powers of ten.
        apart = abs(ratio / 10.0 ** round(float(np.log10(ratio))) - 1) if ratio > 0 else 0.0
        odd = apart > 1e-3
        told.append(
            Finding(
                "two_clocks",
                "warning" if odd else "info",
                both + (f"; their rates differ by {apart:.2%}" if odd else ""),
                values={"relative": apart},
                remedy=" (choose by {time_column})",
            )
        )
    return told


def _ratio(one: NDArray[Any], two: NDArray[Any]) -> float:
    try:
        return read_stamps(one, "s").rate / read_stamps(two, "s").rate
    except InputError:
        return 0.0


def _shown(table: Table, at: int) -> str:
    return table.names[at] or f"{at} (without a name)"
