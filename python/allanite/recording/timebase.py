"""Time stamps → sampling rate and a regular grid, with everything odd about them counted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.common.showing import brief

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Stamps", "read_stamps"]

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

# Spacing in the column's own numbers above which the next smaller unit is the likelier one: below
# 2 it is seconds (faster than 0.5 Hz), 2…500 milliseconds (2…500 Hz), 500…2e5 microseconds.
_SPACING_LIMITS = ((2.0, "s"), (500.0, "ms"), (2e5, "us"), (math.inf, "ns"))
# Stamps of the present epoch give their unit away: 1.7e9 s, 1.7e12 ms, 1.7e15 µs since 1970.
_EPOCH_LIMITS = ((1e11, "s"), (1e14, "ms"), (1e17, "us"), (math.inf, "ns"))


@dataclass(frozen=True, slots=True)
class Stamps:
    """What a time column says.

    Attributes
    ----------
    rate : float
        Samples per second: steps taken over time passed.
    unit : str
        Unit of the column: s, ms, us or ns.
    guessed : bool
        Whether the unit was guessed from the magnitude.
    n : int
        Number of stamps.
    jitter : float
        Standard deviation of the spacing, gaps left out, s.
    resolution : float
        Smallest positive step of the stamps, s.
    duplicates, backwards : int
        Stamps equal to, or earlier than, the one before.
    first_backwards : int
        Row of the first stamp that runs backwards, or −1.
    gaps : tuple of (int, int)
        (row after which samples are missing, number missing).
    coarse : bool
        The stamps resolve no single sample (whole seconds of a 5 Hz log): gaps cannot be found.
    """

    rate: float
    unit: str
    guessed: bool
    n: int
    jitter: float
    resolution: float
    duplicates: int
    backwards: int
    first_backwards: int
    gaps: tuple[tuple[int, int], ...]
    coarse: bool

    __repr__ = brief

    @property
    def missing(self) -> int:
        """Samples missing in all gaps."""
        return sum(count for _, count in self.gaps)


def read_stamps(time: ArrayLike, unit: str | None = None) -> Stamps:
    """Read a time column.

    Parameters
    ----------
    time : array_like of shape (n,)
        Stamps, integer or float.
    unit : str, optional
        s, ms, us or ns; guessed from the magnitude if left out.

    Raises
    ------
    InputError
        Fewer than two stamps, stamps that are not finite, or that do not advance.
    """
    t = np.asarray(time)
    if t.ndim != 1 or t.size < 2:
        raise InputError(
            f"the time column needs at least two stamps in one column, found shape {t.shape}"
        )
    if t.dtype.kind == "M":
        t = t.astype("datetime64[ns]").astype(np.int64)
        unit = "ns"
    if t.dtype.kind == "f" and not np.isfinite(t).all():
        row = int(np.flatnonzero(~np.isfinite(t))[0])
        raise InputError(
            f"the time column holds {t[row]} at row {row}; give rate= and leave the column out"
        )
    # Differences before the conversion to float keep nanoseconds since 1970 exact.
    steps = np.diff(t.astype(np.int64) if t.dtype.kind in "iu" else t).astype(np.float64)
    advancing = steps[steps > 0]
    span = float(steps.sum())
    if advancing.size == 0 or span <= 0:
        raise InputError("the time column does not advance; give rate= and leave the column out")
    median = float(np.median(advancing))
    mean = span / steps.size
    guessed = unit is None
    if unit is None:
        unit = _guess(
            float(t[0]), min(median, mean) if advancing.size < 0.7 * steps.size else median
        )
    second = TIME_UNITS[unit]

    late = np.flatnonzero(steps > 1.5 * median)
    # Stamps shared by several samples, or bursts, say nothing about single samples.
    coarse = bool(advancing.size < 0.7 * steps.size or late.size > 0.05 * steps.size)
    gaps: list[tuple[int, int]] = []
    if not coarse:
        for i in late.tolist():
            # A late stamp followed by an early one is jitter; in a gap, time does not come back.
            around = steps[max(i - 1, 0) : i + 3]
            missing = round(float(around.sum()) / median) - around.size
            alone = round(float(steps[i]) / median) - 1
            if missing >= 1 and alone >= 1:
                gaps.append((i, min(missing, alone) if alone < 3 else alone))
    regular = np.ones(steps.size, dtype=bool)
    regular[[i for i, _ in gaps]] = False
    count = steps.size + sum(n for _, n in gaps)
    return Stamps(
        rate=count / (span * second),
        unit=unit,
        guessed=guessed,
        n=int(t.size),
        jitter=float(np.std(steps[regular])) * second if regular.any() else 0.0,
        resolution=float(advancing.min()) * second,
        duplicates=int(np.count_nonzero(steps == 0)),
        backwards=int(np.count_nonzero(steps < 0)),
        first_backwards=int(np.flatnonzero(steps < 0)[0]) + 1 if (steps < 0).any() else -1,
        gaps=tuple(gaps),
        coarse=coarse,
    )


def _guess(start: float, spacing: float) -> str:
    if abs(start) > 1e8:
        return next(unit for limit, unit in _EPOCH_LIMITS if abs(start) < limit)
    return next(unit for limit, unit in _SPACING_LIMITS if spacing <= limit)


def fill_gaps(array: NDArray[np.generic], stamps: Stamps) -> NDArray[np.generic]:
    """Rows of NaN where the stamps show missing samples; the array itself if there are none."""
    if not stamps.gaps:
        return array
    rows = np.concatenate([np.full(count, after + 1) for after, count in stamps.gaps])
    return np.insert(array.astype(np.float64), rows, np.nan, axis=0)
