"""Detection of motion: changes, turns and sway of a platform, and the longest segment without them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from allanite.common.arrays import Array, runs_of
from allanite.common.units import ACCELERATION, ANGULAR_RATE, SI_UNITS, parse_unit
from allanite.recording.axis_names import axis_letter

if TYPE_CHECKING:
    from allanite.recording.recording import Recording

#: Averaging time, s: long enough to average white noise, short enough to keep motion.
AVERAGING_TIME = 0.2
#: Averages in a window that is judged as a whole (about 5 s).
WINDOW_AVERAGES = 25
#: Averaging time for slow motion, and length of a window of such averages, s: thirty changes give the usual change to a
#: fifth.
SLOW_AVERAGING_TIME, SLOW_WINDOW = 1.0, 30.0
#: Changes between averages of 0.2 s that no sensor at rest shows, SI units: ten times the noise of the worst gyroscopes
#: (0.15 deg/s/√Hz → 0.3 deg/s) and accelerometers (2 mg/√Hz → 4 mg).
FAST_LIMITS = {ANGULAR_RATE: math.radians(1.0), ACCELERATION: 0.3}
#: Changes between averages of 1 s that no sensor at rest shows, SI units, for slow motion such as driving or a boat.
SLOW_LIMITS = {ANGULAR_RATE: math.radians(0.6), ACCELERATION: 0.12}
#: Factor on SLOW_LIMITS if shorter averages measure the white noise, which the limits then need not include. The limits
#: are ten times the bias instability of the worst gyroscopes (100 °/h → 0.3 deg/s) and accelerometers (0.6 mg → 6 mg).
FACTOR_WITHOUT_WHITE = 0.5
#: Averaging time from which the noise is measured by three neighbors, s: motion changes little within it, and most filters
#: of a sensor are faster.
NOISE_AVERAGING_TIME = 0.05
#: Maximum ratio of the usual change between longer averages to that of white noise, up to which the noise is white. A road
#: and rotors cause more.
MAX_WHITE_RATIO = 1.5
#: Standard errors by which an activity must exceed that of white noise. With five changes in a window, one window in 10 000
#: does by chance; with more changes fewer. Steps of a walker are found from three times the noise of an average on, slow
#: turns from eight times.
MIN_STANDARD_ERRORS = 6.0
#: Change of the direction of gravity that exceeds a drift of three accelerometers, degrees.
MAX_TILT = 10.0
#: Maximum sway of a building, degrees: ten times the 0.01° of a tall one in wind.
MAX_SWAY = 0.1
#: Minimum number of turns that are motion; two could be burst noise of a faulty sensor.
MIN_TURNS = 3
#: Maximum activity of a quiet window, relative to the quietest quarter of the record. This rule applies from the second
#: value on: the minimum ratio of the activity to the limit of motion.
MAX_QUIET_RATIO, MIN_LIMIT_SHARE = 6.0, 0.2
#: Relative standard error of an activity from k changes, times √k. The median of k normal magnitudes has a standard error
#: of 0.787/√k of their standard deviation, and lies at 0.6745 of it.
ACTIVITY_SCATTER = 1.17
#: Minimum number of samples of an average that is the median of three thirds.
MIN_SAMPLES_FOR_THIRDS = 9
#: Maximum number of consecutive averages that a tap changes.
MAX_TAP_AVERAGES = 4
#: Share of the windows in motion above which the record moves.
MAX_MOVING_SHARE = 0.2
#: Share of the record that the longest quiet segment must have; else the record is mostly motion.
MIN_QUIET_SHARE = 0.5
#: Averaging time of the search for turns, s.
TURN_AVERAGING_TIME = 1.0
#: Minimum rate within a turn, deg/s. The bias instability of the worst MEMS gyroscopes is 0.05 deg/s.
MIN_TURN_RATE = 1.0
#: Minimum rate of a turn in standard errors of the averages, and minimum number of averages in a row: three of 6 σ do not
#: occur by chance.
MIN_TURN_ERRORS, MIN_TURN_AVERAGES = 6.0, 3
#: Minimum angle of a turn, degrees.
MIN_TURN_ANGLE = 10.0
#: Longest turn, s. A rate that stays longer is a step or a warm-up of the bias.
MAX_TURN_SECONDS = 60.0
#: Averages of 0.2 s in a window of 20 s: swell and hands are slower than an average, faster than a window.
SWAY_WINDOW_AVERAGES = 100
#: Minimum correlation of the direction of gravity in the accelerometers with that of the gyroscopes over the whole record.
#: Independent noise of ten windows or more stays below 0.5 with probability 1 − 1e-6.
MIN_SWAY_CORRELATION = 0.5
#: Minimum number of windows of 20 s.
MIN_SWAY_WINDOWS = 10
#: Range of the ratio of the angles from accelerometers and gyroscopes. It is 1 for pure rotation; outside of the range
#: accelerations dominate.
ANGLE_RATIOS = (0.3, 3.0)
#: Standard gravity, m/s².
GRAVITY = parse_unit("g").scale


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion in a recording, and its longest quiet segment.

    Attributes
    ----------
    share : float
        Share of the windows with motion.
    activity, limit : float
        Usual change between averages of the column that moves most, during its motion, and the limit of a sensor at
        rest including the measured white noise, in `unit`.
    column, unit : str
        The column that moves most, and the SI unit of its activity.
    tilt : float
        Change of the direction of gravity, degrees; 0 without three accelerometers.
    turns : int
        Number of turns of the gyroscope that turns most often.
    largest_turn : float
        Angle of the largest turn, degrees.
    sway : float
        Usual standard deviation of the tilt within 20 s, degrees; 0 if it does not exceed that of a building.
    quiet : tuple of float or None
        Start and end of the longest quiet segment, s.
    duration : float
        Length of the record, s.
    """

    share: float
    activity: float
    limit: float
    column: str
    unit: str
    tilt: float
    turns: int
    largest_turn: float
    sway: float
    quiet: tuple[float, float] | None
    duration: float

    @property
    def moves(self) -> bool:
        """True if the record moves for over a fifth of its length, turns at least 3 times, or tilts by over 10°."""
        return self.share > MAX_MOVING_SHARE or self.tilt > MAX_TILT or self.turns >= MIN_TURNS

    @property
    def mostly_moves(self) -> bool:
        """True if `moves` is true and the longest quiet segment is shorter than half of the record."""
        length = 0.0 if self.quiet is None else self.quiet[1] - self.quiet[0]
        return self.moves and length < MIN_QUIET_SHARE * self.duration


# Sums of samples near the largest double overflow to infinity, which counts as motion.
@np.errstate(over="ignore", invalid="ignore")
def motion_of(recording: Recording) -> Motion | None:
    """`Motion` of a recording of gyroscopes or accelerometers: signs of motion and the longest quiet segment.

    None for other sensors, for angles, and for fewer than 100 samples or 0.4 s. Four things show motion. The first are
    changes between averages of 0.2 s and of 1 s beyond those of a sensor at rest. They are medians over windows, which
    outliers do not affect. The others are turns of a gyroscope, sway (gravity follows the gyroscopes), and a change of
    the direction of gravity.
    """
    if recording.quantity == "angle" or recording.n < 4 * WINDOW_AVERAGES:
        return None
    if recording.duration < 2.0 * AVERAGING_TIME:  # there is no change between averages
        return None
    kinds = [parse_unit(unit).kind for unit in recording.units]
    inertial = [at for at, kind in enumerate(kinds) if kind in (ANGULAR_RATE, ACCELERATION)]
    if not inertial:
        return None
    rate, length = recording.rate, _window_samples(recording)
    windows = max(recording.n // length, 1)
    moving, loud = np.zeros((2, windows), dtype=bool)
    columns: list[_ColumnMotion] = []
    turns: list[tuple[float, float, float]] = []
    for at in inertial:
        x = _si_samples(recording, at)
        columns.append(_column_motion(x, rate, kinds[at], length, windows))
        moving |= columns[-1].moving
        loud |= columns[-1].loud
        if kinds[at] == ANGULAR_RATE:
            found = _turns_of(np.degrees(x), rate)
            turns = max(turns, found, key=len)
            moving |= _windows_with_turns(found, windows, length / rate)
    sways = _sway_per_window(recording, kinds)
    places = np.minimum(np.arange(windows) * sways.size // windows, sways.size - 1)
    swaying = sways[places] > MAX_SWAY
    moving |= swaying
    # Of equal columns, the last one counts; ratios of infinities do not.
    activities = [
        (one, at) for at, column in zip(inertial, columns, strict=True) for one in column.activities
    ]
    ratios = np.nan_to_num([one.usual / one.limit for one, _ in activities][::-1], nan=-1.0)
    most, column_of_most = activities[-1 - int(np.argmax(ratios))]
    return Motion(
        share=float(moving.mean()),
        activity=most.usual,
        limit=most.limit,
        column=recording.columns[column_of_most],
        unit=SI_UNITS[kinds[column_of_most]],
        tilt=_largest_tilt(recording, kinds),
        turns=len(turns),
        largest_turn=max((abs(angle) for *_, angle in turns), default=0.0),
        sway=float(np.median(sways[sways > MAX_SWAY])) if swaying.any() else 0.0,
        quiet=_longest_still_segment(recording, columns, ~(loud | moving), length),
        duration=float(recording.duration),
    )


@dataclass(frozen=True, slots=True)
class _Activity:
    """Activity of one column: the standard deviation of its averages, measured by their changes, against limits.

    `excess` is the activity in each window over the limit of a sensor at rest, `excess_over_white` the same without white
    noise. `significance` is the activity over the largest one that limit, white noise and chance explain; above 1 the
    window moves. `usual` is the median of the windows that move (of all if none moves), and `limit` includes white noise;
    both in SI units.
    """

    excess: Array
    excess_over_white: Array
    significance: Array
    usual: float
    limit: float


@dataclass(frozen=True, slots=True)
class _Averages:
    """Changes between averages of one column.

    `n`, `m` and `short` count the samples of the column, of an average, and of a short average that measures the white
    noise. `changes` are absolute changes between averages, and `bends` absolute second differences of the short ones, in
    SI units.
    """

    n: int
    m: int
    short: int
    changes: Array
    bends: Array

    @classmethod
    def of(cls, x: Array, rate: float, seconds: float) -> _Averages:
        """`_Averages` over `seconds` of the samples `x` in SI units."""
        m = max(1, round(seconds * rate))
        short = min(max(1, round(NOISE_AVERAGING_TIME * rate)), m)
        return cls(x.size, m, short, _absolute_changes(x, m), _absolute_changes(x, short, order=2))

    def activity(
        self, limit: float, length: int, windows: int, *, without_white: bool = False
    ) -> _Activity:
        """`_Activity` in each of `windows` of `length` samples, against the largest activity `limit` at rest (SI units).

        White noise raises the limit if it explains the usual activity. With `without_white`, `limit` is halved if
        shorter averages measure the white noise.
        """
        found = _activity_per_window(self.changes, self.m, length, windows)
        white = _white_noise_activity(self.bends, self.m, self.short, length, windows)
        level = limit * (FACTOR_WITHOUT_WHITE if without_white and self.short < self.m else 1.0)
        # Few changes make a noisy window: noise must not pass the limit by chance.
        scatter = ACTIVITY_SCATTER / math.sqrt(_change_count(self.m, length))
        chance = MIN_STANDARD_ERRORS * scatter / math.sqrt(max(self.n // length, 1))
        is_white = not np.median(found) > MAX_WHITE_RATIO * (1.0 + chance) * np.median(white)
        noise = white if is_white else np.zeros(windows)
        least = np.hypot(
            level * (1.0 + 2.0 * scatter), noise * (1.0 + MIN_STANDARD_ERRORS * scatter)
        )
        moving = found > least
        typical = moving if moving.any() else np.ones(windows, dtype=bool)
        over_white = np.sqrt(np.maximum(found**2 - (white * (1.0 + scatter)) ** 2, 0.0))
        return _Activity(
            found / limit,
            over_white / limit,
            found / least,
            float(np.median(found[typical])),
            math.hypot(level, np.median(noise[typical])),
        )


@dataclass(frozen=True, slots=True)
class _ColumnMotion:
    """Motion in one column.

    `moving` windows have motion, and `loud` ones are not quiet. `activities` are those of averages of 0.2 s, and of 1 s in
    the longest windows. `changes` are absolute changes between averages of 0.2 s, and `limit` is that of a sensor at rest,
    in SI units.
    """

    moving: NDArray[np.bool_]
    loud: NDArray[np.bool_]
    activities: tuple[_Activity, _Activity]
    changes: Array
    limit: float


def _column_motion(x: Array, rate: float, kind: str, length: int, windows: int) -> _ColumnMotion:
    """`_ColumnMotion` of the samples `x` of one column in SI units.

    A window moves if the changes within it are significant. It also moves if two conditions hold: the changes of a longer
    window around it are significant, and its own changes exceed white noise by a fifth of the limit. A window is loud if
    its changes are above a fifth of the limit, and above six times those of the quietest quarter of the windows.
    """
    fast = _Averages.of(x, rate, AVERAGING_TIME)
    slow = _Averages.of(x, rate, SLOW_AVERAGING_TIME)
    within = (
        fast.activity(FAST_LIMITS[kind], length, windows),
        slow.activity(SLOW_LIMITS[kind], length, windows),
    )
    moving = (within[0].significance > 1.0) | (within[1].significance > 1.0)
    last = within[1]
    # Slow motion needs a longer window for as many changes; the short window finds its end.
    longer = round(SLOW_WINDOW * rate)
    if longer > length:
        last = slow.activity(SLOW_LIMITS[kind], longer, windows, without_white=True)
        over_white = np.maximum(*(one.excess_over_white for one in within))
        moving |= (last.significance > 1.0) & (over_white > MIN_LIMIT_SHARE)
    excess = np.maximum(*(one.excess for one in within))
    loud = excess > max(MAX_QUIET_RATIO * float(np.quantile(excess, 0.25)), MIN_LIMIT_SHARE)
    return _ColumnMotion(moving, loud, (within[0], last), fast.changes, FAST_LIMITS[kind])


def _windows_with_turns(
    turns: list[tuple[float, float, float]], windows: int, seconds: float
) -> NDArray[np.bool_]:
    """Mask of the windows of `seconds` with a turn; `turns` are (start, end, angle), s and degrees."""
    found = np.zeros(windows, dtype=bool)
    for start, end, _ in turns:
        found[int(start / seconds) : math.ceil(end / seconds)] = True
    return found


def _sway_per_window(recording: Recording, kinds: list[str]) -> Array:
    """Standard deviation of the tilt in each window of 20 s, degrees, shape (windows,); a single 0 without sway.

    A sway needs three gyroscopes and three accelerometers (x, y, z), logged as rates.
    """
    places: dict[tuple[str, str | None], int] = {}
    for at, (name, kind) in enumerate(zip(recording.columns, kinds, strict=True)):
        places.setdefault((kind, axis_letter(name)), at)
    wanted = [(kind, axis) for kind in (ANGULAR_RATE, ACCELERATION) for axis in "xyz"]
    if recording.quantity != "rate" or not all(one in places for one in wanted):
        return np.zeros(1)
    m = max(1, round(AVERAGING_TIME * recording.rate))
    size = recording.n // m * m
    means = [
        _si_samples(recording, places[one])[:size].reshape(-1, m).mean(axis=1) for one in wanted
    ]
    return _sway_of(np.stack(means[:3], axis=1), np.stack(means[3:], axis=1), m / recording.rate)


def _window_samples(recording: Recording) -> int:
    """Samples per window: 25 averages of 0.2 s, at most a tenth of the record, but at least 16 samples and 4 s."""
    length = WINDOW_AVERAGES * max(1, round(AVERAGING_TIME * recording.rate))
    return max(min(length, recording.n // 10), 4 * max(1, round(recording.rate)), 16)


def _change_count(m: int, length: int) -> int:
    """Number of changes of averages of m samples per window of `length` samples: `length` // m, or 3 if that is less."""
    return max(length // m, 3)


def _si_samples(recording: Recording, at: int) -> Array:
    """Rates of the column with index `at` in SI units, shape (n,); increments are divided by the sampling interval."""
    x = recording.samples if recording.samples.ndim == 1 else recording.samples[:, at]
    factor = parse_unit(recording.units[at]).scale
    factor *= recording.rate if recording.quantity == "increment" else 1.0
    return np.multiply(x, factor, dtype=np.float64)


def _absolute_changes(x: Array, m: int, order: int = 1) -> Array:
    """Absolute first or second differences (`order`) of successive averages of m samples, shape (averages − order,).

    An average of 9 samples or more is the median of the means of three thirds, which resists outliers. An average that
    lacks a sample is NaN. An incomplete last average is dropped.
    """
    groups = x[: x.size // m * m].reshape(-1, m)
    if m < MIN_SAMPLES_FOR_THIRDS:
        return np.abs(np.diff(groups.mean(axis=1), order))
    third = m // 3
    a, b, c = groups[:, : 3 * third].reshape(-1, 3, third).mean(axis=2).T
    # This median of three takes a fraction of the time of np.median.
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return np.abs(np.diff(middle, order))


def _white_noise_activity(bends: Array, m: int, short: int, length: int, windows: int) -> Array:
    """Standard deviation that averages of m samples would have in each window if all noise were white, shape (windows,).

    `bends` are the absolute second differences of averages of `short` samples (0.05 s or less).
    """
    # The median of three thirds scatters 0.670 √3 times as much as their mean.
    middle = 1.16 if short < MIN_SAMPLES_FOR_THIRDS <= m else 1.0
    return _activity_per_window(bends, short, length, windows, order=2) * (
        middle * math.sqrt(short / m)
    )


def _activity_per_window(
    changes: Array, m: int, length: int, windows: int, order: int = 1
) -> Array:
    """Standard deviation of averages of m samples in each window, shape (windows,); zeros without `changes`.

    `changes` are the absolute first or second differences (`order`) of the averages. Their median over `length` samples
    gives the standard deviation as for normal noise.
    """
    per = _change_count(m, length)
    if not changes.size:
        return np.zeros(windows)
    count = max(changes.size // per, 1)
    changes = changes[: count * per].reshape(count, -1)
    finite = np.isfinite(changes)
    with np.errstate(invalid="ignore"):
        # np.nanmedian takes several times as long as np.median.
        found = (
            np.median(changes, axis=1)
            if finite.all()
            else np.nanmedian(np.where(finite.any(axis=1, keepdims=True), changes, 0.0), axis=1)
        )
    # Median of |difference of two averages| → their standard deviation: Φ⁻¹(¾) = 0.6745; of three (1, −2, 1) √6.
    found = found / (0.6745 * math.sqrt(2 if order == 1 else 6))
    if count < windows // 2:  # long windows are not interpolated
        return np.asarray(found[np.arange(windows) * count // windows])
    return np.interp(np.linspace(0, 1, windows), np.linspace(0, 1, count), found)


def _largest_tilt(recording: Recording, kinds: list[str]) -> float:
    """Largest angle between the direction of gravity in one tenth of the record and its median direction, degrees.

    0 unless exactly three accelerometers are logged as rates and measure 0.5 to 1.5 times gravity in every tenth. A
    tenth without samples of an axis is skipped.
    """
    axes = [i for i, kind in enumerate(kinds) if kind == ACCELERATION]
    if len(axes) != 3 or recording.quantity != "rate":
        return 0.0
    each = [np.array_split(_si_samples(recording, i), 10) for i in axes]
    # A direction needs all three axes, so a tenth without samples of an axis is skipped.
    parts = [p for p in zip(*each, strict=True) if all(np.isfinite(axis).any() for axis in p)]
    if not parts:
        return 0.0
    mean = np.array([[np.nanmedian(axis) for axis in part] for part in parts])
    level = np.linalg.norm(mean, axis=1)
    if not np.all((level > 0.5 * GRAVITY) & (level < 1.5 * GRAVITY)):
        return 0.0  # not three axes of one sensor, or without gravity
    unit = mean / level[:, np.newaxis]
    middle = np.median(unit, axis=0)
    cosine = unit @ middle / np.linalg.norm(middle)
    return float(np.degrees(np.arccos(np.clip(cosine.min(), -1, 1))))


def _longest_still_segment(
    recording: Recording,
    columns: Sequence[_ColumnMotion],
    calm: NDArray[np.bool_],
    length: int,
) -> tuple[float, float] | None:
    """Start and end, s, of the longest segment without motion where `calm` (one entry per window) is True, or None.

    A change between averages of 0.2 s in one of the `columns` ends the segment, unless it lasts at most 4 averages within
    the segment, like a tap. Changes within 5 s of an end are cut off.
    """
    m = max(1, round(AVERAGING_TIME * recording.rate))
    moved = np.zeros(max(recording.n // m, 1), dtype=bool)
    quiet = calm[np.minimum(np.arange(moved.size) * m // length, calm.size - 1)]
    if not quiet.any():
        return None
    for column in columns:
        moves = column.changes / math.sqrt(2)
        there = moves[quiet[1:] & np.isfinite(moves)]
        usual = float(np.median(there)) / 0.6745 if there.size else 0.0
        over = moves > max(MAX_QUIET_RATIO * usual, MIN_LIMIT_SHARE * column.limit)
        moved[1:] |= over
        moved[:-1] |= over
    still = quiet.copy()
    for first, last in zip(*runs_of(moved), strict=True):
        if last - first > MAX_TAP_AVERAGES:
            still[first:last] = False
    starts, ends = runs_of(still)
    if not starts.size:
        return None
    longest = np.argmax(ends - starts)
    first, last = int(starts[longest]), int(ends[longest])
    near = min(WINDOW_AVERAGES, (last - first) // 2)
    after, before = (
        np.flatnonzero(moved[first : first + near]),
        np.flatnonzero(moved[last - near : last]),
    )
    end = float(recording.duration) if last == moved.size and not before.size else None
    first += int(after[-1]) + 1 if after.size else 0
    last -= near - int(before[0]) if before.size else 0
    return first * m / recording.rate, last * m / recording.rate if end is None else end


def _turns_of(rates: Array, rate: float) -> list[tuple[float, float, float]]:
    """Turns (start in s, end in s, angle in degrees) in the samples of a gyroscope, deg/s, sorted by start.

    A turn lasts 3 to 60 s, reaches at least 10°, and exceeds 1 deg/s and six times the noise of averages of 1 s. Empty
    for fewer than six averages, and for sampling rates below 0.04 Hz. Missing samples are NaN.
    """
    m = max(1, round(TURN_AVERAGING_TIME * rate))
    seconds = m / rate
    count = rates.size // m
    window = 2 * round(MAX_TURN_SECONDS / seconds) + 1
    if count < 2 * MIN_TURN_AVERAGES or window < 2 * MIN_TURN_AVERAGES:
        return []
    groups = rates[: count * m].reshape(count, m)
    present = np.isfinite(groups)
    average = np.where(present, groups, 0.0).sum(axis=1) / np.maximum(present.sum(axis=1), 1)
    places = np.flatnonzero(present.any(axis=1))
    average = average[places]
    if places.size < 2 * MIN_TURN_AVERAGES:
        return []
    # A step of the bias moves the median with it; a turn is shorter than half of the window.
    usual = median_filter(average, size=min(window, average.size), mode="nearest")
    change = average - usual
    # Noise may be louder for a while. A turn is smooth: its second differences are those of the noise.
    bends = np.abs(np.diff(average, 2, prepend=average[:1], append=average[-1:])) / np.sqrt(6.0)
    local = median_filter(bends, size=min(window, average.size), mode="nearest") / 0.6745
    error = np.maximum(local, float(np.median(np.abs(change))) / 0.6745)
    limit = np.maximum(MIN_TURN_RATE, MIN_TURN_ERRORS * error)
    found = []
    for sign in (1.0, -1.0):
        fast = sign * change > limit
        for first, end in zip(*(edge.tolist() for edge in runs_of(fast)), strict=True):
            angle = float(change[first:end].sum()) * seconds
            short = end - first < MIN_TURN_AVERAGES or (end - first) * seconds > MAX_TURN_SECONDS
            if not short and abs(angle) >= MIN_TURN_ANGLE:
                # A turn begins and ends slower than the limit.
                start, stop = max(int(places[first]) - 2, 0), int(places[end - 1]) + 3
                found.append((start * seconds, min(stop, count) * seconds, angle))
    return sorted(found)


def _sway_of(rates: Array, force: Array, interval: float) -> Array:
    """Standard deviation of the tilt in each window of 20 s, degrees, shape (windows,); a single 0 without sway.

    If a platform turns, the integrated rates equal the change of the direction of gravity: df/dt = −ω × f. The
    covariance of the two is the variance of the tilt, and independent of sensor noise. `rates` (rad/s) and `force` (any
    unit) are averages over `interval`, shape (averages, 3), NaN if samples are missing. A single 0 also for fewer than
    10 windows.
    """
    windows = len(rates) // SWAY_WINDOW_AVERAGES
    if windows < MIN_SWAY_WINDOWS:
        return np.zeros(1)
    kept = windows * SWAY_WINDOW_AVERAGES
    omega, seen = np.nan_to_num(rates[:kept]), np.nan_to_num(force[:kept])
    middle = np.median(seen, axis=0)
    level = float(np.linalg.norm(middle))
    if level == 0.0:
        return np.zeros(1)
    up = middle / level
    turned = np.cumsum(-np.cross(omega, up), axis=0) * interval
    # Averages refer to the middle of their interval, sums to its end.
    turned = 0.5 * (turned + np.vstack([np.zeros(3), turned[:-1]]))
    tilted = seen / level
    predicted, measured = _without_parabolas(turned, windows), _without_parabolas(tilted, windows)
    # Along gravity accelerometers show no tilt.
    predicted -= (predicted @ up)[..., np.newaxis] * up
    measured -= (measured @ up)[..., np.newaxis] * up
    both = np.einsum("wki,wki->w", predicted, measured)
    gyro, accel = np.sum(predicted**2), np.sum(measured**2)
    total = float(both.sum())
    if not total > MIN_SWAY_CORRELATION * float(np.sqrt(gyro * accel)):
        return np.zeros(1)
    if not ANGLE_RATIOS[0] < float(accel) / total < ANGLE_RATIOS[1]:
        return np.zeros(1)
    return np.asarray(np.degrees(np.sqrt(np.maximum(both, 0.0) / SWAY_WINDOW_AVERAGES)))


def _without_parabolas(x: Array, windows: int) -> Array:
    """Averages minus the least-squares parabola of each window and axis, shape (windows, averages, 3)."""
    basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, SWAY_WINDOW_AVERAGES), 3))[0]
    parts = x.reshape(windows, SWAY_WINDOW_AVERAGES, 3)
    return np.asarray(parts - basis @ (basis.T @ parts))
