"""Is the sensor at rest? Noise models describe one that is; motion fitted as noise means nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError, TooShortError
from allanite.common.units import ACCELERATION, ANGULAR_RATE, conversion, parse_unit
from allanite.recording.findings import Finding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.recording import Recording

__all__ = ["Rest", "quiet", "quiet_span", "rest_of"]

#: Averaging time over which motion shows and white noise does not, s.
AVERAGE = 0.2
#: Averages in a window that is judged as a whole: about 5 s.
WINDOW = 25
#: Changes from one average to the next that no sensor at rest shows, however bad it is: ten times
#: the noise of the worst gyroscopes (0.15 deg/s/√Hz → 0.3 deg/s) and accelerometers (2 mg/√Hz → 4 mg).
LIMITS = {ANGULAR_RATE: (math.radians(1.0), "rad/s"), ACCELERATION: (0.3, "m/s^2")}
#: The same of averages of 1 s, where motion is slow: driving, a boat.
SLOW = {ANGULAR_RATE: (math.radians(0.6), "rad/s"), ACCELERATION: (0.12, "m/s^2")}
#: Averages of which three neighbours tell what is noise, s: motion changes little within them, and most filters of a sensor
#: are faster.
SHORT = 0.05
#: Noise of these is white, and that of longer averages, where the usual change between such is at most so many times what
#: white noise makes. A road and rotors make more.
WHITE = 1.5
#: Standard errors of an activity by which it then has to exceed what that noise makes: one window of a column in 10 000
#: does by chance, where five changes make a window, of more changes fewer. Steps of a walker in a part of a record are said
#: from three times the noise of an average on, slow turns from eight times.
SURELY = 6.0
#: Change of direction of gravity that is no drift of three accelerometers, degrees.
TILT = 10.0
#: Activity against that of the quietest quarter of the record, above which a window is not quiet, but
#: for less than this share of what motion shows.
LOUD, LEAST = 6.0, 0.2
#: Relative scatter of an activity found from k changes is this over √k: the median of k normal magnitudes has a standard
#: error of 0.787/√k of their deviation, and lies at 0.6745 of it.
SCATTER = 1.17
#: Samples of an average from which on it is the middle of three.
MANY = 9
#: Averages in a row, and the one before, that a tap takes at most.
BRIEF = 4
#: Share of the windows in motion above which the record is said to move.
SHARE = 0.2


@dataclass(frozen=True, slots=True)
class Rest:
    """Where a recording is at rest.

    Attributes
    ----------
    moves : bool
        Whether it moves for more than a fifth of its length, or is turned over.
    share : float
        Share of the windows that move more than any noise.
    activity, limit : float
        Usual change between averages of the column that moves most, where it moves, and that of the worst
        sensor at rest with the white noise that neighbouring samples tell of, in `unit`.
    column, unit : str
        That column.
    tilt : float
        Change of the direction of gravity, degrees; 0 without three accelerometers.
    quiet : tuple of float or None
        Start and end of the longest quiet stretch, s.
    """

    moves: bool
    share: float
    activity: float
    limit: float
    column: str
    unit: str
    tilt: float
    quiet: tuple[float, float] | None


# Sums of samples near the largest double are infinite: such a sensor moves.
@np.errstate(over="ignore", invalid="ignore")
def rest_of(recording: Recording) -> Rest | None:
    """Judge whether a recording of a gyroscope or accelerometer is at rest; None of other sensors.

    Two scales are looked at, differences between averages of 0.2 s and of 1 s, each by its median over
    windows of some seconds, which outliers do not move; and the direction of gravity where there are
    three accelerometers.
    """
    if recording.quantity == "angle" or recording.n < 4 * WINDOW:
        return None
    kinds = [parse_unit(unit).kind for unit in recording.units]
    if not set(kinds) & set(LIMITS):
        return None
    worst: tuple[float, ...] = (0.0, 0.0, 0.0)
    name = unit = ""
    loud: NDArray[np.bool_] | None = None
    moving: NDArray[np.bool_] | None = None
    length = _length(recording)
    for at, kind in enumerate(kinds):
        if kind not in LIMITS:
            continue
        x = _column(recording, at)
        excess = sure = np.zeros(1)
        for average, limits in ((AVERAGE, LIMITS), (1.0, SLOW)):
            level, si = limits[kind]
            m = max(1, round(average * recording.rate))
            to_si = conversion(recording.units[at], si)
            found = _activity(x, m, length) * to_si
            noise = _noise(x, m, recording.rate, length) * to_si
            if np.median(found) > WHITE * np.median(noise):
                noise = np.zeros(found.size)
            # Few changes make a noisy window: noise must not pass the limit by chance.
            scatter = SCATTER / math.sqrt(_changes(m, length))
            least = np.hypot(level * (1.0 + 2.0 * scatter), noise * (1.0 + SURELY * scatter))
            excess = np.maximum(excess, found / level)
            sure = np.maximum(sure, found / least)
            some = found > least if np.any(found > least) else np.ones(found.size, dtype=bool)
            usual, limit = float(np.median(found[some])), math.hypot(level, np.median(noise[some]))
            if usual / limit >= worst[0]:
                worst = (usual / limit, usual, limit)
                name, unit = recording.columns[at], si
        quieter = float(np.quantile(excess, 0.25))
        noisy = (sure > 1.0) | (excess > max(LOUD * quieter, LEAST))
        loud = noisy if loud is None else loud | noisy
        moving = sure > 1.0 if moving is None else moving | (sure > 1.0)
    assert loud is not None
    assert moving is not None
    tilt = _tilt(recording, kinds)
    share = float(moving.mean())
    moves = share > SHARE or tilt > TILT
    span = _stillest(recording, kinds, ~loud, length)
    return Rest(moves, share, worst[1], worst[2], name, unit, tilt, span)


def _length(recording: Recording) -> int:
    """Samples of a window: 25 averages of 0.2 s or 1 sample, at most a tenth of the record, at least four."""
    length = WINDOW * max(1, round(AVERAGE * recording.rate))
    return max(min(length, recording.n // 10), 4 * max(1, round(recording.rate)), 16)


def _changes(m: int, length: int) -> int:
    """Changes between averages of m samples in a window."""
    return max(length // m, 3)


def _column(recording: Recording, at: int) -> NDArray[Any]:
    x = recording.samples if recording.samples.ndim == 1 else recording.samples[:, at]
    x = x.astype(np.float64, copy=False)
    return x * recording.rate if recording.quantity == "increment" else x


def _moves(x: NDArray[np.float64], m: int, order: int = 1) -> NDArray[np.float64]:
    """Change from each average of m samples to the next, shape (averages − order,); or changes of those."""
    groups = x[: x.size // m * m].reshape(-1, m)
    # A few outliers in a group must not move it: the middle of three thirds where there are so many.
    mean = groups.mean(axis=1) if m < MANY else np.median(_thirds(groups), axis=1)
    return np.abs(np.diff(mean, order))


def _noise(x: NDArray[np.float64], m: int, rate: float, length: int) -> NDArray[np.float64]:
    """Activity of averages of m samples, of each window, that white noise makes, by changes of changes of short ones.

    0 where such averages are no shorter: of few samples a second none tells noise from motion.
    """
    short = max(1, round(SHORT * rate))
    if short >= m:
        return np.zeros(max(x.size // length, 1))
    # The middle of three thirds scatters by 0.670 √3 of what their mean does.
    middle = 1.16 if short < MANY <= m else 1.0
    return _activity(x, short, length, order=2) * (middle * math.sqrt(short / m))


def _activity(x: NDArray[np.float64], m: int, length: int, order: int = 1) -> NDArray[np.float64]:
    """Usual change between averages of m samples, of each window: shape (windows,)."""
    moves = _moves(x, m, order)
    per = _changes(m, length)
    windows = max(x.size // length, 1)
    if not moves.size:
        return np.zeros(windows)
    count = max(moves.size // per, 1)
    moves = moves[: count * per].reshape(count, -1)
    with np.errstate(invalid="ignore"):
        found = np.nanmedian(
            np.where(np.isfinite(moves).any(axis=1, keepdims=True), moves, 0.0), axis=1
        )
    # Median of |difference of two averages| → their standard deviation: Φ⁻¹(¾) = 0.6745; of three (1, −2, 1) √6.
    found = found / (0.6745 * math.sqrt(2 if order == 1 else 6))
    return np.interp(np.linspace(0, 1, windows), np.linspace(0, 1, count), found)


def _thirds(groups: NDArray[np.float64]) -> NDArray[np.float64]:
    third = groups.shape[1] // 3
    return groups[:, : 3 * third].reshape(len(groups), 3, third).mean(axis=2)


def _tilt(recording: Recording, kinds: list[str]) -> float:
    """Largest angle between the direction of gravity in a tenth of the record and that of all, degrees."""
    axes = [i for i, kind in enumerate(kinds) if kind == ACCELERATION]
    if len(axes) != 3 or recording.quantity != "rate":
        return 0.0
    force = np.stack([_column(recording, i) for i in axes], axis=1)
    # A direction needs all three: of a tenth in which an axis has no sample nothing is known.
    parts = [p for p in np.array_split(force, 10) if np.isfinite(p).any(axis=0).all()]
    if not parts:
        return 0.0
    mean = np.array([np.nanmedian(part, axis=0) for part in parts])
    level = np.linalg.norm(mean, axis=1)
    gravity = 9.81 / conversion(recording.units[axes[0]], "m/s^2")
    if not np.all((level > 0.5 * gravity) & (level < 1.5 * gravity)):
        return 0.0  # not three axes of one sensor, or no gravity in it
    unit = mean / level[:, np.newaxis]
    middle = np.median(unit, axis=0)
    cosine = unit @ middle / np.linalg.norm(middle)
    return float(np.degrees(np.arccos(np.clip(cosine.min(), -1, 1))))


def _stillest(
    recording: Recording, kinds: list[str], calm: NDArray[np.bool_], length: int
) -> tuple[float, float] | None:
    """Start and end, s, of the longest stretch of `calm` windows of this length in which no axis is moved for a moment.

    The usual change of a window does not tell of a turn within it. A tap is shorter than `BRIEF`, and a sensor at rest has
    some; but a stretch neither begins nor ends with what is left of a motion.
    """
    m = max(1, round(AVERAGE * recording.rate))
    moved = np.zeros(max(recording.n // m, 1), dtype=bool)
    quiet = calm[np.minimum(np.arange(moved.size) * m // length, calm.size - 1)]
    if not quiet.any():
        return None
    for at, kind in enumerate(kinds):
        if kind not in LIMITS:
            continue
        level, si = LIMITS[kind]
        moves = _moves(_column(recording, at), m) / math.sqrt(2)
        there = moves[quiet[1:] & np.isfinite(moves)]
        usual = float(np.median(there)) / 0.6745 if there.size else 0.0
        least = max(LOUD * usual, LEAST * level / conversion(recording.units[at], si))
        over = moves > least
        moved[1:] |= over
        moved[:-1] |= over
    still = quiet.copy()
    for first, last in _runs(moved):
        if last - first > BRIEF:
            still[first:last] = False
    runs = _runs(still)
    if not runs:
        return None
    first, last = max(runs, key=lambda run: run[1] - run[0])
    near = min(WINDOW, (last - first) // 2)
    after, before = (
        np.flatnonzero(moved[first : first + near]),
        np.flatnonzero(moved[last - near : last]),
    )
    end = float(recording.duration) if last == moved.size and not before.size else None
    first += int(after[-1]) + 1 if after.size else 0
    last -= near - int(before[0]) if before.size else 0
    return first * m / recording.rate, last * m / recording.rate if end is None else end


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and end of each run of what is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(int), [0])))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def quiet_span(recording: Recording) -> tuple[float, float]:
    """Start and end of the longest quiet stretch, s.

    Raises
    ------
    InputError
        No gyroscope or accelerometer with a unit.
    TooShortError
        No quiet stretch at all.
    """
    rest = rest_of(recording)
    if rest is None:
        raise InputError(
            "a quiet stretch is found by a gyroscope or accelerometer whose unit is known",
            missing="unit",
            remedy=": give {unit}, or {trim}",
        )
    if rest.quiet is None:
        raise TooShortError("no stretch of the log is quiet: it moves all the time")
    return rest.quiet


def quiet(recording: Recording) -> Recording:
    """Return the longest quiet stretch of a recording."""
    start, end = quiet_span(recording)
    found = f"kept the longest quiet stretch, {start:.6g}–{end:.6g} s of {recording.duration:.6g} s"
    told = Finding("quiet_stretch", "info", found, values={"start_s": start, "end_s": end})
    return recording.trim(start, end).told_of([told])


def finding_of(recording: Recording, least: float = SHARE) -> list[Finding]:
    """Return the finding that a recording moves for more than this share of it, or is turned over; or none."""
    rest = rest_of(recording)
    if rest is None or not (rest.moves or rest.share > least):
        return []
    why = []
    if rest.share > least:
        why.append(
            f"{rest.column} changes by {rest.activity:.2g} {rest.unit} within a second, more than a sensor"
            f" at rest ({rest.limit:.2g}), in {rest.share:.0%} of the record"
        )
    if rest.tilt > TILT:
        why.append(f"the direction of gravity turns by {rest.tilt:.0f}°")
    stretch = "no stretch is quiet"
    if rest.quiet is not None:
        start, end = rest.quiet
        stretch = f"longest quiet stretch {start:.6g}–{end:.6g} s"
    return [
        Finding(
            "moving",
            "warning",
            f"not at rest: {', and '.join(why)}; a noise model describes a sensor at rest, not its"
            f" motion; {stretch}",
            values={"share": rest.share, "tilt_deg": rest.tilt}
            | (
                {}
                if rest.quiet is None
                else {"quiet_start_s": rest.quiet[0], "quiet_end_s": rest.quiet[1]}
            ),
            remedy=""
            if rest.quiet is None
            else f" ({{this_span:{rest.quiet[0]:.6g}:{rest.quiet[1]:.6g}}}, or {{quiet}})",
        )
    ]
