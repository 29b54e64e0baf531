"""Time stamps → sampling rate and a regular grid, with everything odd about them counted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.recording.stamp_units import TIME_UNITS, numbers_of, unit_of_stamps
from allanite.recording.steps import Steps

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["TIME_UNITS", "Stamps", "epoch_of", "pieces_of", "read_stamps", "uneven_times"]

#: Missing samples to each sample that is there, above which a record is no longer one piece.
FILL = 4
#: Gaps of fewer samples part nothing: a record of which every tenth sample is there is sparse.
SPARSE = 64
#: Standard deviation of the spacing over the interval, above which each sample keeps its own time: a random walk, of which
#: the step grows with the spacing, then differs by 1 % from one on a grid.
UNEVEN = 0.01
#: Samples above which times of their own are not kept.
MOST_TIMES = 1 << 20


@dataclass(frozen=True, slots=True)
class Stamps:
    """What a time column says.

    Attributes
    ----------
    rate : float
        Samples per second: samples taken over time passed, long gaps left out.
    unit : str
        Unit of the column: s, ms, us, ns, min, h or d.
    why : str
        How the unit is known: ``"given"``, or a guess by ``"rate"`` (the one stated), ``"epoch"``
        (seconds since 1970 of this century), ``"usual"`` (fractions of a second) or ``"size"``.
    n : int
        Number of stamps.
    jitter : float
        Standard deviation of the spacing, gaps left out, s.
    resolution : float
        Smallest positive step of the stamps, s.
    duplicates, backwards : int
        Stamps equal to, or earlier than, the one before.
    first_duplicate, first_backwards : int
        Rows of the first of these, counted from 0, or −1.
    gaps : tuple of (int, int)
        (row after which samples are missing, number missing); one is put at a seam.
    coarse : bool
        The stamps resolve no single sample (whole seconds of a 5 Hz log): short gaps cannot be found.
    lost : bool
        Jitter is as large as the interval, or samples come in bursts: only long gaps can be found.
    seams : tuple of (int, float)
        (row after which time runs back for good, by how many s): logs joined, or a clock set back.
    wraps : tuple of int
        Rows after which a counter began anew.
    wrap : float
        Span of that counter, s.
    drift : float
        Largest interval of 16 stretches over the smallest, less 1, where beyond jitter; else 0.
    changed : int
        Row about which the rate changes by more than 2 %, or −1.
    pieces : tuple of (int, int)
        First row, and row behind the last, of the pieces that gaps too long to be filled leave.
    piece : int
        The one that is used.
    """

    rate: float
    unit: str
    why: str
    n: int
    jitter: float
    resolution: float
    duplicates: int
    backwards: int
    first_backwards: int
    gaps: tuple[tuple[int, int], ...]
    coarse: bool
    first_duplicate: int = -1
    lost: bool = False
    seams: tuple[tuple[int, float], ...] = ()
    wraps: tuple[int, ...] = ()
    wrap: float = 0.0
    drift: float = 0.0
    changed: int = -1
    pieces: tuple[tuple[int, int], ...] = ()
    piece: int = 0

    __repr__ = brief

    @property
    def guessed(self) -> bool:
        """Whether the unit is a guess that nothing but the size of the numbers supports."""
        return self.why == "size"

    @property
    def missing(self) -> int:
        """Samples missing in all gaps."""
        return sum(count for _, count in self.gaps)

    @property
    def rows(self) -> tuple[int, int]:
        """First row of the piece used, and the row behind its last."""
        return self.pieces[self.piece] if self.pieces else (0, self.n)

    @property
    def inside(self) -> tuple[tuple[int, int], ...]:
        """Gaps of the piece used."""
        first, end = self.rows
        return tuple((row, count) for row, count in self.gaps if first <= row < end - 1)


#: Wider steps of damaged stamps count as this, narrower ones than its reciprocal as none: squares and ratios are numbers.
WIDEST = 1e140


def read_stamps(
    time: ArrayLike,
    unit: str | None = None,
    rate: float | None = None,
    piece: int | None = None,
) -> Stamps:
    """Read a time column.

    Parameters
    ----------
    time : array_like of shape (n,)
        Stamps: integers, floats or date-times.
    unit : str, optional
        s, ms, us, ns, min, h or d; guessed if left out.
    rate : float, optional
        The rate that was stated, Hz: helps to guess the unit.
    piece : int, optional
        Which of the pieces that very long gaps leave, counted from 1; the one of most samples if left
        out.

    Raises
    ------
    InputError
        Fewer than two stamps, stamps that are not finite, that do not advance, or whose unit cannot
        be told; an unknown piece.
    """
    t, unit = numbers_of(time, unit)
    # Differences before the conversion to float keep nanoseconds since 1970 exact.
    with np.errstate(over="ignore"):
        raw = np.clip(np.diff(t).astype(np.float64), -WIDEST, WIDEST)
    raw[np.abs(raw) < 1.0 / WIDEST] = 0.0
    steps = Steps(raw, t)
    why = "given"
    if unit is None:
        unit, why = unit_of_stamps(t, 1.0 / steps.rate, rate)
    elif unit not in TIME_UNITS:
        raise InputError(f"unknown unit of time {unit!r}: one of {', '.join(TIME_UNITS)}")
    second = TIME_UNITS[unit]
    late = [row for row, _ in steps.gaps]
    regular = np.ones(raw.size, dtype=bool)
    regular[late] = False
    forward = raw[raw > 0]
    resolution = float(forward.min()) * second
    jitter = float(np.std(steps.clean[regular])) * second if regular.any() else 0.0
    drift, changed = (0.0, -1)
    if not (steps.coarse or steps.lost):
        drift, changed = _drift(steps.clean[regular] * second, jitter, resolution)
    equal, back = np.flatnonzero(raw == 0), np.flatnonzero(raw < 0)
    back = np.setdiff1d(back, steps.wraps, assume_unique=True)
    pieces = pieces_of(int(t.size), steps.gaps)
    return Stamps(
        rate=steps.rate / second,
        unit=unit,
        why=why,
        n=int(t.size),
        jitter=jitter,
        resolution=resolution,
        duplicates=int(equal.size),
        backwards=int(back.size),
        first_backwards=int(back[0]) + 1 if back.size else -1,
        gaps=tuple(steps.gaps),
        coarse=steps.coarse,
        first_duplicate=int(equal[0]) + 1 if equal.size else -1,
        lost=steps.lost,
        seams=tuple((row, -float(raw[row]) * second) for row in steps.seams),
        wraps=tuple(steps.wraps),
        wrap=steps.wrap * second,
        drift=drift,
        changed=int(np.flatnonzero(regular)[changed]) if changed >= 0 else -1,
        pieces=pieces,
        piece=_chosen(pieces, piece),
    )


def _drift(steps: NDArray[np.float64], jitter: float, resolution: float) -> tuple[float, int]:
    """Change of the interval over the record, and where it is more than 2 %."""
    blocks = 16
    length = steps.size // blocks
    if length < 50:
        return 0.0, -1
    mean = steps[: length * blocks].reshape(blocks, length).mean(axis=1)
    # The mean of consecutive steps is the difference of two stamps: white jitter and rounding of both.
    noise = (jitter + resolution * (resolution < 0.5 * mean.mean())) / length
    change = float(mean.max() / mean.min() - 1)
    if change < 5e-5 or mean.max() - mean.min() < 6 * noise:
        return 0.0, -1
    worst = int(np.argmax(np.abs(np.diff(mean))))
    return change, (worst + 1) * length if change > 0.02 else -1


def pieces_of(n: int, gaps: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """Stretches of rows between gaps so long that filling them would be most of the record.

    The longest gaps part the record, until what is missing in each piece is at most four times what is
    there.
    """
    if sum(count for _, count in gaps) <= FILL * n:
        return ((0, n),)
    rows = np.array([row for row, _ in gaps])
    counts = np.array([count for _, count in gaps], dtype=np.float64)
    limit = float(counts.max())
    if limit < SPARSE:
        return ((0, n),)
    while True:
        limit /= 2
        cuts = rows[counts > limit] + 1
        starts, ends = np.concatenate(([0], cuts)), np.concatenate((cuts, [n]))
        kept = counts <= limit
        inside = np.bincount(
            np.searchsorted(cuts, rows[kept], side="right"), counts[kept], minlength=starts.size
        )
        if np.all(inside <= FILL * (ends - starts)) or limit < SPARSE:
            return tuple(zip(starts.tolist(), ends.tolist(), strict=True))


def _chosen(pieces: tuple[tuple[int, int], ...], piece: int | None) -> int:
    if piece is None:
        return int(np.argmax([end - first for first, end in pieces]))
    if not 1 <= piece <= len(pieces):
        raise InputError(
            f"piece {piece}: the time column has {len(pieces)} piece{'s' * (len(pieces) > 1)},"
            f" counted from 1"
        )
    return piece - 1


def fill_gaps(array: NDArray[np.generic], stamps: Stamps) -> NDArray[np.generic]:
    """Rows of the piece used, with rows of NaN where the stamps show missing samples."""
    first, end = stamps.rows
    if end - first < len(array):
        array = array[first:end]
    gaps = stamps.inside
    if not gaps:
        return array
    rows = np.repeat([after + 1 - first for after, _ in gaps], [count for _, count in gaps])
    with np.errstate(invalid="ignore"):  # a NaN that signals is one like others
        return np.insert(array.astype(np.float64), rows, np.nan, axis=0)


def uneven_times(time: ArrayLike, stamps: Stamps) -> NDArray[np.float64] | None:
    """Return the time of each row of the regular grid, s from its first, if the stamps are unevenly spaced; else None.

    Rows of missing samples have times between those of their neighbors. Stamps that run back have no such times.
    """
    first, end = stamps.rows
    if stamps.jitter * stamps.rate <= UNEVEN or end - first > MOST_TIMES or stamps.seams:
        return None
    t, _ = numbers_of(time, stamps.unit)
    seconds = (t[first:end] - t[first]).astype(np.float64) * TIME_UNITS[stamps.unit]
    if (np.diff(seconds) < 0.0).any():
        return None
    missing = np.zeros(end - first, dtype=np.int64)
    for after, count in stamps.inside:
        missing[after + 1 - first] += count
    rows = np.arange(end - first) + np.cumsum(missing)
    return np.interp(np.arange(rows[-1] + 1), rows, seconds)


def epoch_of(time: ArrayLike, stamps: Stamps) -> float | None:
    """Return the time of the first row used, s since 1970, if the stamps are date-times or decimal years."""
    kind = np.asarray(time).dtype.kind
    t, _ = numbers_of(time, stamps.unit)
    first = float(t[stamps.rows[0]])
    if kind in "OUSMT":
        return first * 1e-9
    if stamps.unit == "y" and 1900.0 <= first <= 2200.0:
        return (first - 1970.0) * TIME_UNITS["y"]
    return None
