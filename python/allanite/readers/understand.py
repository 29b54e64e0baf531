"""What a column is by its numbers: a sensor, a clock, an index or a counter, whatever its name."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._split_time import is_split
from allanite.readers.sensor_names import sensor_kind
from allanite.recording.findings import Finding
from allanite.recording.stamp_units import PRESENT
from allanite.recording.timebase import read_stamps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.readers._choice import Choice, Request
    from allanite.readers._table import Table

__all__ = ["clocks_of", "falls", "kind_of", "understand"]

#: Rows looked at, and rows below which numbers tell nothing.
ROWS, FEWEST = 20_000, 20
#: Largest less smallest value of a counter that begins anew: of two to four decimal digits, or of 7, 8, 12 or 16 bits.
SPANS = (99, 127, 255, 999, 4095, 9999, 65535)
#: Rows in which a time that begins anew rises for each in which it falls.
AGAIN = 20
#: Seconds of a day.
DAY = 86_400


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
        ``"index"`` (every row one more), ``"counter"`` (the same, beginning anew), ``"date"`` (of one day, in all rows),
        ``"clock"`` (rises in nearly every row by much the same or never falls, or in whole steps that several rows share),
        or None.
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
        day = x.dtype.kind in "iu" or float(x[0]).is_integer()
        day = day and int(x[0]) % DAY == 0 and PRESENT[0] < x[0] < PRESENT[1]
        return "date" if day and not steps.any() else None
    usual = float(np.median(steps[rising]))
    alike = float(np.mean(np.abs(steps[rising] / usual - 1) < 0.5))
    if rising.mean() > 0.9 and alike > 0.8:
        again = steps < 0
        if usual == 1 and again.any() and np.ptp(x) in SPANS:
            return "counter"
        # A sensor that warms up rises too, but comes back within its noise now and then.
        return "clock" if rising.mean() > 0.98 or again.mean() < 0.02 else None
    if rising.all():
        return "clock"  # that of a log which is sent in bursts
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
            if table.units[i] is None:
                kind = kind_of(table[i])
                # A name tells more, but of what rises in every row.
                named = sensor_kind(table.names[i]) is not None
                if kind is not None and not (named and np.any(np.diff(table[i]) <= 0)):
                    kinds[i] = kind
    if len(kinds) == len(choice.samples):
        kinds = {}  # nothing else is there: the phase of a clock, or an angle
    samples = tuple(i for i in choice.samples if i not in kinds)
    clocks = [i for i, kind in kinds.items() if kind == "clock"]
    stamped = table.time is not None or choice.time is not None
    if request.columns and not stamped:
        beside = (i for i, x in enumerate(table.columns) if x is not None and i not in choice.all)
        clocks = [i for i in beside if table.units[i] is None and kind_of(table[i]) == "clock"][:1]
        kinds = dict.fromkeys(clocks, "clock")
    if clocks and not stamped and not request.timeless:
        at = clocks.pop(0)
        choice = replace(choice, time=at)
        told.append(
            Finding(
                "time_column",
                "info",
                f"column {_shown(table, at)} rises as time does: taken as the time",
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
    # A time that falls, and not to begin anew, is something else of that name: a temperature T.
    steady = (i for i in choice.clocks if table.columns[i] is None or not falls(table[i]))
    others = tuple(dict.fromkeys((*steady, *clocks)))
    told += clocks_of(table, choice.time, others)
    return replace(choice, samples=samples, clocks=others), told


def falls(values: NDArray[Any]) -> bool:
    """Whether numbers are no time: they fall, and not to begin anew."""
    steps = np.diff(np.asarray(values[:ROWS], dtype=np.float64))
    return bool(0 < np.count_nonzero(steps > 0) < AGAIN * np.count_nonzero(steps < 0))


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
