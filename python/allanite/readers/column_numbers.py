"""Recognize columns by their numbers: a clock, an index, a counter, an identifier, a magnitude."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.recording.stamp_units import PRESENT

#: Maximum period of identifiers that repeat, in rows. Chosen by judgment; not measured.
MAX_PERIOD = 16
#: Number of first rows that are examined, and minimum number of rows for a decision. Chosen by judgment; not measured.
ROWS, MIN_ROWS = 20_000, 20
#: Range (maximum minus minimum) of a counter that wraps: two to four decimal digits, or 7, 8, 12 or 16 bits.
COUNTER_RANGES = (99, 127, 255, 999, 4095, 9999, 65535)
#: Minimum ratio of rising to falling steps of a time that restarts. Chosen by judgment; not measured.
MIN_RISING_PER_FALLING = 20
#: Seconds of a day.
DAY = 86_400


# Steps may overflow; such steps are infinite and similar to no other step.
@np.errstate(over="ignore", invalid="ignore")
def kind_of_numbers(values: NDArray[Any]) -> str | None:
    """``"index"``, ``"counter"``, ``"date"`` or ``"clock"`` if a column counts or holds times, else None.

    An index rises by 1 in every row, and a counter also wraps. A date is the same midnight, s since 1970, in all rows. A
    clock rises in nearly every row by similar steps, or in every row, or by equal steps that several rows share. None
    for under 20 rows or non-finite numbers. Only the first 20 000 rows are used.
    """
    x = np.asarray(values[:ROWS])
    if x.size < MIN_ROWS or x.dtype.kind not in "iuf":
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
    alike = float(np.mean(np.abs(steps[rising] - usual) < 0.5 * usual))
    if rising.mean() > 0.9 and alike > 0.8:
        again = steps < 0
        if usual == 1 and again.any() and np.ptp(x) in COUNTER_RANGES:
            return "counter"
        # A sensor that warms up also rises, but falls now and then within its noise.
        return "clock" if rising.mean() > 0.98 or again.mean() < 0.02 else None
    if rising.all():
        return "clock"  # the clock of a log that is sent in bursts
    # Whole seconds in a faster log: several rows share a value, and the values never fall.
    few = rising.sum() >= 5 and np.all(steps >= 0) and bool(np.ptp(steps[rising]) <= 1e-6 * usual)
    return "clock" if few and float(np.ptp(np.diff(np.flatnonzero(rising)))) <= 3 else None


def falls_often(values: NDArray[Any]) -> bool:
    """True if the first 20 000 values fall more often than once per 20 rises; a time column may restart now and then.

    False if the values never rise.
    """
    steps = np.diff(np.asarray(values[:ROWS], dtype=np.float64))
    rising, falling = np.count_nonzero(steps > 0), np.count_nonzero(steps < 0)
    return bool(0 < rising < MIN_RISING_PER_FALLING * falling)


def repeats_exactly(values: NDArray[Any]) -> bool:
    """True if whole numbers repeat with a period of 2 to 16 rows, such as identifiers of alternating devices.

    Only the first 20 000 rows count. False for constant or non-finite numbers and for fewer than 80 rows.
    """
    x = np.asarray(values[:ROWS])
    if x.size < 5 * MAX_PERIOD or not np.isfinite(x).all() or not np.all(x == np.rint(x)):
        return False
    periods = range(2, MAX_PERIOD + 1)
    return bool(np.any(x != x[0])) and any(np.array_equal(x[k:], x[:-k]) for k in periods)


def is_serial_number(values: NDArray[Any]) -> bool:
    """True if a column holds the same whole number of at least 100 in its first 20 000 rows.

    False for fewer than 20 rows.
    """
    x = np.asarray(values[:ROWS])
    return bool(
        x.size >= MIN_ROWS and x[0] >= 100 and np.all(x == x[0]) and float(x[0]).is_integer()
    )


def indices_of_magnitudes(columns: Sequence[NDArray[Any]]) -> list[int]:
    """Indices of columns that are the Euclidean norm of the three columns before or after them.

    The root mean square of the difference must be below 5 % of the column's standard deviation; independent noise
    reaches 100 %. Only the first `ROWS` rows are used. Columns with under 20 rows, non-finite or negative values do not
    count.
    """
    found = []
    # The squares of numbers in a damaged log may overflow.
    with np.errstate(all="ignore"):
        for place, column in enumerate(columns):
            x = np.asarray(column[:ROWS], dtype=np.float64)
            if x.size < MIN_ROWS or not np.isfinite(x).all() or x.min() < 0:
                continue
            for others in (columns[max(place - 3, 0) : place], columns[place + 1 : place + 4]):
                if len(others) < 3:
                    continue
                norm = np.sqrt(sum(np.asarray(y[:ROWS], dtype=np.float64) ** 2 for y in others))
                off = float(np.sqrt(np.mean((norm - x) ** 2)))
                if off < 0.05 * float(np.std(x)):
                    found.append(place)
                    break
    return found
