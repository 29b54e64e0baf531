"""Detection of motion: whether a sensor is at rest, and when. Noise models describe a sensor at rest, not its motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import runs_of
from allanite.common.errors import InputError, TooShortError
from allanite.common.numbers import percent_text
from allanite.common.units import ACCELERATION, ANGULAR_RATE, conversion, parse_unit
from allanite.recording.axis_names import axis_letter
from allanite.recording.findings import Finding
from allanite.recording.sway import averages_for_sway, sway_of
from allanite.recording.turns import turns_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.common.arrays import Array
    from allanite.recording import Recording

#: Averaging time, s: long enough to average white noise, short enough to keep motion.
AVERAGING_TIME = 0.2
#: Averages in a window that is judged as a whole (about 5 s).
WINDOW_AVERAGES = 25
#: Length of the window of 1 s averages, s: thirty changes give the usual change to a fifth.
SLOW_WINDOW = 30.0
#: Changes between averages of 0.2 s that no sensor at rest shows: ten times the noise of the worst gyroscopes
#: (0.15 deg/s/√Hz → 0.3 deg/s) and accelerometers (2 mg/√Hz → 4 mg).
FAST_LIMITS = {ANGULAR_RATE: (math.radians(1.0), "rad/s"), ACCELERATION: (0.3, "m/s^2")}
#: Changes between averages of 1 s that no sensor at rest shows, for slow motion such as driving or a boat.
SLOW_LIMITS = {ANGULAR_RATE: (math.radians(0.6), "rad/s"), ACCELERATION: (0.12, "m/s^2")}
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
        The column that moves most, and the unit of its activity.
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
    if not set(kinds) & set(FAST_LIMITS):
        return None
    worst: tuple[float, ...] = (0.0, 0.0, 0.0)
    name = unit = ""
    length = _window_samples(recording)
    windows = max(recording.n // length, 1)
    loud, moving, turning, swaying = np.zeros((4, windows), dtype=bool)
    turns: list[tuple[float, float, float]] = []
    changes: dict[int, Array] = {}
    for at, kind in enumerate(kinds):
        if kind not in FAST_LIMITS:
            continue
        x = _rate_samples(recording, at)
        fast = max(1, round(AVERAGING_TIME * recording.rate))
        changes[at] = _absolute_changes(x, fast)
        excess = beyond = sure = slowly = np.zeros(windows)
        for average, limits in ((AVERAGING_TIME, FAST_LIMITS), (1.0, SLOW_LIMITS)):
            full, si = limits[kind]
            m = max(1, round(average * recording.rate))
            to_si = conversion(recording.units[at], si)
            moves = changes[at] if m == fast else _absolute_changes(x, m)
            short = min(max(1, round(NOISE_AVERAGING_TIME * recording.rate)), m)
            bends = _absolute_changes(x, short, order=2)
            # Slow motion needs a longer window for as many changes; the short window finds its end.
            longer = (
                length
                if limits is FAST_LIMITS
                else max(length, round(SLOW_WINDOW * recording.rate))
            )
            for own in dict.fromkeys((length, longer)):
                found = _activity_per_window(moves, m, own, windows) * to_si
                white = noise = _white_noise_activity(bends, m, short, own, windows) * to_si
                level = full * (FACTOR_WITHOUT_WHITE if own > length and short < m else 1.0)
                # Few changes make a noisy window: noise must not pass the limit by chance.
                scatter = ACTIVITY_SCATTER / math.sqrt(_change_count(m, own))
                chance = MIN_STANDARD_ERRORS * scatter / math.sqrt(max(recording.n // own, 1))
                if np.median(found) > MAX_WHITE_RATIO * (1.0 + chance) * np.median(noise):
                    noise = np.zeros(found.size)
                least = np.hypot(
                    level * (1.0 + 2.0 * scatter), noise * (1.0 + MIN_STANDARD_ERRORS * scatter)
                )
                if own == length:
                    excess = np.maximum(excess, found / full)
                    slow = np.maximum(found**2 - (white * (1.0 + scatter)) ** 2, 0.0)
                    beyond = np.maximum(beyond, np.sqrt(slow) / full)
                    sure = np.maximum(sure, found / least)
                else:
                    slowly = np.maximum(slowly, found / least)
            some = found > least if np.any(found > least) else np.ones(found.size, dtype=bool)
            usual, limit = float(np.median(found[some])), math.hypot(level, np.median(noise[some]))
            if usual / limit >= worst[0]:
                worst = (usual / limit, usual, limit)
                name, unit = recording.columns[at], si
        quieter = float(np.quantile(excess, 0.25))
        loud |= (sure > 1.0) | (excess > max(MAX_QUIET_RATIO * quieter, MIN_LIMIT_SHARE))
        # A long window that moves may hold short ones that do not.
        loud |= (slowly > 1.0) & (beyond > MIN_LIMIT_SHARE)
        moving |= (sure > 1.0) | ((slowly > 1.0) & (beyond > MIN_LIMIT_SHARE))
        if kind == ANGULAR_RATE:
            more = turns_of(x * conversion(recording.units[at], "deg/s"), recording.rate)
            turns = max(turns, more, key=len)
            turning |= _windows_with_turns(more, windows, length / recording.rate)
    sways = _sway_per_window(recording, kinds)
    if sways is not None:
        places = np.minimum(np.arange(windows) * sways.size // windows, sways.size - 1)
        swaying = sways[places] > MAX_SWAY
    sway = float(np.median(sways[sways > MAX_SWAY])) if sways is not None and swaying.any() else 0.0
    moving |= turning | swaying
    span = _longest_still_segment(recording, changes, ~(loud | turning | swaying), length)
    return Motion(
        share=float(moving.mean()),
        activity=worst[1],
        limit=worst[2],
        column=name,
        unit=unit,
        tilt=_largest_tilt(recording, kinds),
        turns=len(turns),
        largest_turn=max((abs(angle) for *_, angle in turns), default=0.0),
        sway=sway,
        quiet=span,
        duration=float(recording.duration),
    )


def _windows_with_turns(
    turns: list[tuple[float, float, float]], windows: int, seconds: float
) -> NDArray[np.bool_]:
    """Mask of shape (windows,): True if the platform turns at some time within the window of `seconds`.

    `turns` are (start, end, angle), s and degrees.
    """
    found = np.zeros(windows, dtype=bool)
    for start, end, _ in turns:
        found[int(start / seconds) : math.ceil(end / seconds)] = True
    return found


def _sway_per_window(recording: Recording, kinds: list[str]) -> Array | None:
    """Standard deviation of the tilt in each window of 20 s, degrees, shape (windows,), or None.

    None if no sway is found, or unless three gyroscopes and three accelerometers (x, y, z) are logged as rates.
    """
    places: dict[tuple[str, str | None], int] = {}
    for at, (name, kind) in enumerate(zip(recording.columns, kinds, strict=True)):
        places.setdefault((kind, axis_letter(name)), at)
    wanted = [(kind, axis) for kind in (ANGULAR_RATE, ACCELERATION) for axis in "xyz"]
    if recording.quantity != "rate" or not all(one in places for one in wanted):
        return None
    gyro, accel = (
        np.stack(
            [
                averages_for_sway(_rate_samples(recording, places[kind, axis]), recording.rate)
                * conversion(recording.units[places[kind, axis]], FAST_LIMITS[kind][1])
                for axis in "xyz"
            ],
            axis=1,
        )
        for kind in (ANGULAR_RATE, ACCELERATION)
    )
    return sway_of(gyro, accel, recording.rate)


def _window_samples(recording: Recording) -> int:
    """Number of samples per window: 25 averages of 0.2 s, at most a tenth of the record, at least 16 samples and 4 s."""
    length = WINDOW_AVERAGES * max(1, round(AVERAGING_TIME * recording.rate))
    return max(min(length, recording.n // 10), 4 * max(1, round(recording.rate)), 16)


def _change_count(m: int, length: int) -> int:
    """Number of changes between averages of m samples in a window of `length` samples; at least 3."""
    return max(length // m, 3)


def _rate_samples(recording: Recording, at: int) -> NDArray[Any]:
    """Samples of the column with index `at` as doubles, shape (n,); increments are divided by the sampling interval."""
    x = recording.samples if recording.samples.ndim == 1 else recording.samples[:, at]
    x = np.ascontiguousarray(x, dtype=np.float64)
    return x * recording.rate if recording.quantity == "increment" else x


def _absolute_changes(x: Array, m: int, order: int = 1) -> Array:
    """Absolute differences between successive averages of m samples, shape (averages − order,).

    An average is the median of the means of three thirds if m is large enough. `order` is 1 or 2: the difference of two
    averages, or a − 2 b + c of three. NaN if an average lacks a sample; an incomplete last group is dropped.
    """
    groups = x[: x.size // m * m].reshape(-1, m)
    # The median of three thirds resists outliers if a group has enough samples.
    mean = (
        groups.mean(axis=1)
        if m < MIN_SAMPLES_FOR_THIRDS
        else _median_of_three(*_means_of_thirds(groups).T)
    )
    return np.abs(np.diff(mean, order))


def _white_noise_activity(bends: Array, m: int, short: int, length: int, windows: int) -> Array:
    """Activity (`_activity_per_window`) that averages of m samples would have if all noise were white, shape (windows,).

    The white noise is measured by `bends`, absolute second differences of averages of `short` samples (0.05 s or less).
    """
    # The median of three thirds scatters 0.670 √3 times as much as their mean.
    middle = 1.16 if short < MIN_SAMPLES_FOR_THIRDS <= m else 1.0
    return _activity_per_window(bends, short, length, windows, order=2) * (
        middle * math.sqrt(short / m)
    )


def _activity_per_window(moves: Array, m: int, length: int, windows: int, order: int = 1) -> Array:
    """Standard deviation of averages of m samples in each window, from their median absolute change, shape (windows,).

    `moves` are the absolute differences of the averages, of this `order` (`_absolute_changes`). Each median is over
    `length` samples. If there are fewer than half as many medians as windows, medians are repeated; otherwise they are
    interpolated to the windows. Zeros for too few samples.
    """
    per = _change_count(m, length)
    if not moves.size:
        return np.zeros(windows)
    count = max(moves.size // per, 1)
    moves = moves[: count * per].reshape(count, -1)
    finite = np.isfinite(moves)
    with np.errstate(invalid="ignore"):
        # np.nanmedian takes several times as long as np.median.
        found = (
            np.median(moves, axis=1)
            if finite.all()
            else np.nanmedian(np.where(finite.any(axis=1, keepdims=True), moves, 0.0), axis=1)
        )
    # Median of |difference of two averages| → their standard deviation: Φ⁻¹(¾) = 0.6745; of three (1, −2, 1) √6.
    found = found / (0.6745 * math.sqrt(2 if order == 1 else 6))
    if count < windows // 2:  # long windows are not interpolated
        return np.asarray(found[np.arange(windows) * count // windows])
    return np.interp(np.linspace(0, 1, windows), np.linspace(0, 1, count), found)


def _median_of_three(a: Array, b: Array, c: Array) -> Array:
    """Median of the three values at each index, shape (n,); NaN if one of them is. Faster than `np.median`."""
    return np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))


def _means_of_thirds(groups: Array) -> Array:
    """Means of the first, second and last third of each row of `groups`, shape (groups, 3).

    If the length is no multiple of 3, the last one or two samples are omitted.
    """
    third = groups.shape[1] // 3
    return groups[:, : 3 * third].reshape(len(groups), 3, third).mean(axis=2)


def _largest_tilt(recording: Recording, kinds: list[str]) -> float:
    """Largest angle between the direction of gravity in one tenth of the record and its median direction, degrees.

    0 unless exactly three accelerometers are logged as rates and measure 0.5 to 1.5 times gravity in every tenth. A
    tenth without samples of an axis is skipped.
    """
    axes = [i for i, kind in enumerate(kinds) if kind == ACCELERATION]
    if len(axes) != 3 or recording.quantity != "rate":
        return 0.0
    each = [np.array_split(_rate_samples(recording, i), 10) for i in axes]
    # A direction needs all three axes, so a tenth without samples of an axis is skipped.
    parts = [p for p in zip(*each, strict=True) if all(np.isfinite(axis).any() for axis in p)]
    if not parts:
        return 0.0
    mean = np.array([[np.nanmedian(axis) for axis in part] for part in parts])
    level = np.linalg.norm(mean, axis=1)
    gravity = 9.81 / conversion(recording.units[axes[0]], "m/s^2")
    if not np.all((level > 0.5 * gravity) & (level < 1.5 * gravity)):
        return 0.0  # not three axes of one sensor, or without gravity
    unit = mean / level[:, np.newaxis]
    middle = np.median(unit, axis=0)
    cosine = unit @ middle / np.linalg.norm(middle)
    return float(np.degrees(np.arccos(np.clip(cosine.min(), -1, 1))))


def _longest_still_segment(
    recording: Recording, changes: dict[int, Array], calm: NDArray[np.bool_], length: int
) -> tuple[float, float] | None:
    """Tuple (start, end), s, of the longest segment without motion where `calm` is True; None without any.

    `changes` maps the index of a column to its absolute changes between averages of 0.2 s. `calm` has one entry for each
    window of `length` samples. A change ends the segment, unless it lasts at most 4 averages within the
    segment, like a tap.
    """
    m = max(1, round(AVERAGING_TIME * recording.rate))
    moved = np.zeros(max(recording.n // m, 1), dtype=bool)
    quiet = calm[np.minimum(np.arange(moved.size) * m // length, calm.size - 1)]
    if not quiet.any():
        return None
    for at, own in changes.items():
        level, si = FAST_LIMITS[parse_unit(recording.units[at]).kind]
        moves = own / math.sqrt(2)
        there = moves[quiet[1:] & np.isfinite(moves)]
        usual = float(np.median(there)) / 0.6745 if there.size else 0.0
        least = max(
            MAX_QUIET_RATIO * usual, MIN_LIMIT_SHARE * level / conversion(recording.units[at], si)
        )
        over = moves > least
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


def quiet_span(recording: Recording) -> tuple[float, float]:
    """Tuple (start, end) of the longest quiet segment, s since the first sample.

    Raises
    ------
    InputError
        No gyroscope or accelerometer with a unit.
    TooShortError
        No segment is quiet.
    """
    motion = recording.motion
    if motion is None:
        raise InputError(
            "a quiet segment needs a gyroscope or accelerometer with a known unit",
            missing="unit",
            remedy=": give {unit}, or {trim}",
        )
    if motion.quiet is None:
        raise TooShortError("no segment of the log is quiet: it moves all the time")
    return motion.quiet


def quiet_segment(recording: Recording) -> Recording:
    """`Recording` of the longest quiet segment, with a finding of kind ``quiet_stretch``. Raises as `quiet_span`."""
    start, end = quiet_span(recording)
    found = f"kept the longest quiet segment, {start:.6g}–{end:.6g} s of {recording.duration:.6g} s"
    finding = Finding("quiet_stretch", "info", found, values={"start_s": start, "end_s": end})
    return recording.trim(start, end).with_findings([finding])


def motion_findings(recording: Recording, least: float = MAX_MOVING_SHARE) -> list[Finding]:
    """List with one `Finding` of kind ``motion`` if the recording moves; else empty.

    It moves if more than the fraction `least` of its windows shows motion, if it turns at least 3 times, or if it tilts
    by over 10°.
    """
    motion = recording.motion
    if motion is None or not (motion.moves or motion.share > least):
        return []
    values = {"share": motion.share, "tilt_deg": motion.tilt, "turns": motion.turns}
    if motion.quiet is not None:
        values |= {"quiet_start_s": motion.quiet[0], "quiet_end_s": motion.quiet[1]}
    return [
        Finding(
            "motion",
            "warning",
            f"not at rest: {_motion_text(motion, least)}; a noise model describes a sensor at rest, not its motion;"
            f" {_quiet_text(motion)}",
            values=values,
            remedy="" if motion.quiet is None else f" ({_quiet_remedy(motion.quiet)})",
        )
    ]


def motion_error(recording: Recording) -> InputError | None:
    """`InputError` (not raised) if the recording moves and its longest quiet segment is under half of it; else None."""
    motion = recording.motion
    if motion is None or not motion.mostly_moves:
        return None
    use = "" if motion.quiet is None else f": use {_quiet_remedy(motion.quiet)};"
    return InputError(
        f"not at rest: {_motion_text(motion, 0.0)}; {_quiet_text(motion)}",
        remedy=f"{use or ';'} {{anyway}} fits the motion as noise",
    )


def _motion_text(motion: Motion, least: float) -> str:
    """Text of the signs of motion, joined by ", and ": ``3 turns of up to 90°``, changes, sway and tilt.

    Changes and sway are stated if they occur in more than the fraction `least` of the record. If there is no sign to
    state, the text is the moving fraction of the record.
    """
    why = []
    if motion.turns >= MIN_TURNS:
        why.append(f"{motion.turns} turns of up to {motion.largest_turn:.0f}°")
    if motion.share > least and motion.activity > motion.limit:
        why.append(
            f"{motion.column} changes by {motion.activity:.2g} {motion.unit} within a second, more than a sensor"
            f" at rest ({motion.limit:.2g}), in {percent_text(motion.share)} of the record"
        )
    if motion.sway and motion.share > least:
        why.append(f"it sways by {motion.sway:.2g}° rms, in gyroscopes and accelerometers alike")
    if motion.tilt > MAX_TILT:
        why.append(f"the direction of gravity turns by {motion.tilt:.0f}°")
    return ", and ".join(why) or f"motion in {percent_text(motion.share)} of the record"


def _quiet_text(motion: Motion) -> str:
    """Text ``"longest quiet segment 10–60 s"``, or ``"no segment is quiet"``."""
    if motion.quiet is None:
        return "no segment is quiet"
    start, end = motion.quiet
    return f"longest quiet segment {start:.6g}–{end:.6g} s"


def _quiet_remedy(quiet: tuple[float, float]) -> str:
    """Text of a remedy with placeholders: use the segment (start, end), s, or the method for the quiet segment."""
    return f"{{this_span:{quiet[0]:.6g}:{quiet[1]:.6g}}}, or {{quiet}}"
