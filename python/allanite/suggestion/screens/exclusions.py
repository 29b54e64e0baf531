"""Screens for samples to exclude: outliers, disturbances (segments in which the sensor was moved) and stuck values."""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import medians
from allanite.criticism.over_time import overdispersion
from allanite.effects import CATALOG, Model, Modifier
from allanite.fit.engine import solve
from allanite.fit.likelihood.data import Data, without_samples
from allanite.fit.likelihood.whitened import Whitened, end_samples, rounding_step
from allanite.fit.missing.completion import complete
from allanite.recording.repeats import longest_run, share_of_repeats_followed
from allanite.recording.tails import outlier_limit
from allanite.suggestion.constants import (
    END_NEIGHBORS,
    END_OUTLIER_PROBABILITY,
    FALSE_ALARM_PROBABILITY,
    LEVEL_CELLS,
    MAX_EQUAL_NEIGHBOR_FRACTION,
    MAX_EXCLUDED_FRACTION,
    MAX_EXCLUSION_PROBABILITY,
    MAX_EXPLAINED_REMAINDER,
    MAX_QUIET_POWER_RATIO,
    MIN_DISTURBANCE_POWER_RATIO,
    MIN_NARROW_PEAK,
    MIN_ORDINATES,
    MIN_POWER_VALUES,
    MIN_RINGING_POWER_RATIO,
    MIN_SEGMENT_SAMPLES,
    WINDOW_PERIODS,
)
from allanite.suggestion.p_values import Family, best_interval, delta_logl_of_two_levels
from allanite.suggestion.screens._screen import Candidate, Context, Screen
from allanite.suggestion.screens.level_borders import refined_interval

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from allanite.fit.solution import Solution

#: Maximum number of places of the record at which the usual distance between neighbors is measured.
MAX_PLACES = 1 << 14
#: Number of bands per octave in which a disturbance is compared with other times.
BANDS_PER_OCTAVE = 7
#: Maximum number of segments elsewhere with which a disturbance is compared.
SEGMENTS_ELSEWHERE = 16
#: Interval of an octave with a disturbance: ln p, start and end as fractions of the record, relative power over time,
#: degrees of freedom of each value.
_SeenByOctave = tuple[float, float, float, NDArray[np.float64], float]
#: Number of windows that begin within the length of one window.
OVERLAPPING_WINDOWS = 4


def end_outlier_scores(solution: Solution, data: Data) -> NDArray[np.float64]:
    """Standardized size (positive) of the outliers at both ends of the record; 0 for all other samples, shape (n,).

    The whitened record has no values at the ends. Each sample there, from the middle outwards, is compared with the median
    of the next samples towards the middle that are no outliers. The distance is divided by the robust standard deviation of
    such distances. In normal noise, one record in a thousand has an outlier.
    """
    from scipy.special import ndtri

    found = np.zeros(data.n)
    ends = end_samples(data.n)
    if ends < 1:
        return found
    samples = data.residual(solution.model)
    reach = np.arange(END_NEIGHBORS)

    def distances(at: NDArray[np.int64] | int, way: int) -> NDArray[np.float64]:
        """Absolute distances of the samples `at` from the median of neighbors before (`way` −1) or after them (1).

        The nearest neighbor used is `gap` samples away; a larger gap omits outliers next to the sample.
        """
        behind = np.asarray(at)[..., None] + way * reach
        return np.abs(samples[at] - medians(samples[behind + way * gap]))

    places = np.linspace(0, data.n - 1 - END_NEIGHBORS - ends, min(data.n, MAX_PLACES)).astype(
        np.int64
    )
    gap = 1
    usual = distances(places, 1)
    scales = {gap: _robust_std(usual)}
    if scales[gap] == 0.0:
        return found
    tail = END_OUTLIER_PROBABILITY / (2 * ends)
    limit = -float(ndtri(0.5 * tail))

    @cache
    def limit_of_own_tail() -> float:
        """Limit from the tail of the distances themselves."""
        step = rounding_step(data, usual) / scales[1]
        return outlier_limit(usual / scales[1], tail, step)

    for first, way in ((ends - 1, 1), (data.n - ends, -1)):
        gap = 1
        for at in range(first, first - way * ends, -way):
            if data.missing is not None and data.missing[at]:
                continue
            if gap not in scales:
                scales[gap] = _robust_std(distances(places, 1))
            z = float(distances(at, way)) / scales[gap]
            is_outlier = z > limit and z > limit_of_own_tail()
            found[at] = z if is_outlier else 0.0
            gap = gap + 1 if is_outlier else 1
    return found


def excludes_only_ends(effect: Modifier, data: Data) -> bool:
    """True if the effect excludes samples, and only among the first and the last `end_samples(n)`."""
    if not effect.removes:
        return False
    taken = effect.missing(data.n, data.rate)
    ends = end_samples(data.n)
    return bool(taken.any()) and not taken[ends : data.n - ends].any()


def _robust_std(size: NDArray[np.float64]) -> float:
    """Robust standard deviation of values with the absolute values `size`: the largest estimate from three quantiles.

    The quantiles are at 0.6745, 1 and 2 σ of a normal law. With the largest, noise that is merely not normal has no
    outliers.
    """
    # numpy sorts faster than it selects.
    place = np.array([0.5, 0.6827, 0.9545]) * (size.size - 1)
    low = place.astype(np.int64)
    rising = np.sort(size)
    values = rising[low] + (place - low) * (rising[low + 1] - rising[low])
    return float(np.max(values / [0.6745, 1.0, 2.0]))


def screen_outliers(
    solution: Solution, data: Data, samples: NDArray[np.float64]
) -> Callable[[], Candidate | None] | None:
    """Function without arguments that returns the refitted `Candidate` to exclude outliers; None if there are no outliers.

    An outlier is a value of the whitened record `samples` beyond two limits: the limit that normal noise exceeds in 1 % of
    records, and the limit of the record's own tail. The ΔlogL is that of a separate level for each outlier, minus ln n
    each. None if more than 20 % of the samples are outliers, for a summary, or if nearly all samples are equal.
    """
    from scipy.special import log_ndtr

    kinds = [c for c in CATALOG if issubclass(c, Modifier) and c.screened == "outlier"]
    wanted = [c for c in kinds if c.candidates(solution.model, data.covariates)]
    if not wanted or samples.size < data.n:
        return None
    z = samples - medians(samples)
    scale = _robust_std(np.abs(z))
    if scale == 0.0:
        return None
    z /= scale
    there = data.present(z)
    step = rounding_step(data, samples) / scale
    usual = (z <= _outlier_limit(there, data.n, step)) & (
        z >= -_outlier_limit(-there, data.n, step)
    )
    del there
    np.abs(z, out=z)
    z[usual] = 0.0
    z += end_outlier_scores(solution, data)
    index = np.flatnonzero(z)
    if index.size == 0 or index.size > MAX_EXCLUDED_FRACTION * data.n:
        return None
    seen = data.present(data.samples)
    if float(np.ptp(np.quantile(seen, [0.01, 0.99]))) == 0.0:
        return None  # a column of few codes would keep hardly more than one of them
    gain = float(np.sum(0.5 * z[index] ** 2 - np.log(data.n)))
    if gain <= 0.0:
        return None
    largest = float(np.log(2.0 * data.n) + log_ndtr(-float(z.max())))
    times = tuple((data.start + index / data.rate).tolist())
    effect = wanted[0].from_values(count=float(len(times)), times=times)
    return partial(_exclusion_candidate, effect, solution, data, gain, 1, largest)


def _outlier_limit(distance: NDArray[np.float64], n: int, step: float) -> float:
    """Limit of a standardized distance from the median for outliers: of normal noise or the own tail, the larger.

    `step` is the rounding step in the same unit. This limit is for samples above the median. For samples below, call the
    function with −`distance`: the tails of a skewed distribution differ.
    """
    from scipy.special import ndtri_exp

    limit = -float(ndtri_exp(np.log(0.5 * FALSE_ALARM_PROBABILITY / n)))
    if distance.max() <= limit:
        return limit
    # Samples within the tail of the record's own distribution are no outliers; a coarse step rounds up.
    own = outlier_limit(distance[distance > 0.0], FALSE_ALARM_PROBABILITY / n, step)
    return max(limit, own)


def _exclusion_candidate(
    effect: Modifier | None,
    solution: Solution,
    data: Data,
    gain: float,
    numbers: int,
    log_p: float,
    note: str = "",
) -> Candidate | None:
    """`Candidate` that excludes samples, refitted to the remaining samples; or None.

    `gain` is its ΔlogL, `numbers` its number of parameters, and `log_p` its ln p.
    """
    if effect is None or not data.whole:
        return None
    taken = effect.missing(data.n, data.rate)
    if not np.any(data.present(taken)):
        return None
    cleaned = without_samples(data, taken)
    cleaned = complete(cleaned, solution.model, solution.level, starts=())
    refitted = solve(cleaned, Model((*solution.model.effects, effect)), rounds=3)
    found = refitted.model.effects[-1]
    return Candidate(
        found,
        gain,
        Family(effect.family, scatter="none"),
        refitted,
        numbers,
        min(0.0, log_p),
        data=cleaned,
        note=note,
    )


def look(context: Context) -> Iterator[Candidate]:
    """Iterator over one `Candidate`, or none: it excludes a stuck value, otherwise the most significant loud segment.

    A loud segment has at least twice its usual power in one octave of frequency. Its p-value is at most 1e-6, and its
    length at most 20 % of the record. Segments with sharp ends take precedence. If other octaves are loud just before or
    after the segment, the segment is extended.
    """
    solution, data = context.solution, context.data
    stuck = _stuck_value(solution, data)
    if stuck is not None:
        yield stuck
        return
    bands = octaves_of(context.whitened.with_normal_tails)
    samples = data.residual(solution.model)
    found: list[_SeenByOctave] = []
    with_sharp_ends: list[_SeenByOctave] = []
    for low, high, power, freedom in bands:
        size = power.size
        start, end, _, log_p = best_interval(power, freedom, min(LEVEL_CELLS, size // 8))
        log_p += float(np.log(len(bands)))
        if log_p > np.log(MAX_EXCLUSION_PROBABILITY) or end - start > MAX_EXCLUDED_FRACTION * size:
            continue
        if size > LEVEL_CELLS:
            start, end, _ = refined_interval(power, freedom, start, end, size // LEVEL_CELLS)
        outside = np.delete(power, np.s_[start:end]).mean()
        loud = _power_ratio(samples, low, high, start / size, end / size)
        if (
            power[start:end].mean() / outside if loud is None else loud
        ) < MIN_DISTURBANCE_POWER_RATIO:
            continue
        # The ends are known to one value of the octave.
        times = max(start - 1, 0) / size, min(end + 1, size) / size
        ends = without_ringing(samples, low, high, *times)
        (found if ends is None else with_sharp_ends).append(
            (log_p, *(ends or times), power / outside, freedom)
        )
    # Octaves without sharp ends ring, so those with sharp ends take precedence.
    found = sorted(with_sharp_ends or found, key=lambda one: one[0])
    if not found:
        return
    log_p, first, last, _, _ = found[0]
    reach = last - first
    for _, begin, close, power, freedom in found[1:]:
        # Another octave extends the segment by at most its length; anything longer is another disturbance.
        if first - reach < begin < first and _is_loud(power, freedom, begin, first):
            first = begin
        if last < close < last + reach and _is_loud(power, freedom, last, close):
            last = close
    begin, close = (data.start + part * data.duration for part in (first, last))
    gain = delta_logl_of_octave_levels(bands, first, last, only_louder=True)
    made = _exclusion_candidate(_segment_effect(begin, close), solution, data, gain, 2, log_p)
    if made is not None:
        yield made


SCREEN = Screen(
    "disturbances",
    "time segments that are louder at some frequencies, and stuck values",
    "time",
    look,
    needs_samples=True,
)


def _segment_effect(start: float, end: float) -> Modifier | None:
    """Effect of the catalog that excludes the samples from `start` to `end`, s; None if no kind does."""
    kinds = [c for c in CATALOG if issubclass(c, Modifier) and c.screened == "stretch"]
    return kinds[0].from_values(start=start, end=end) if kinds else None


def _stuck_value(solution: Solution, data: Data) -> Candidate | None:
    """`Candidate` that excludes the longest run of equal samples (stuck sensor, lost link); or None.

    None if the run has fewer than 16 samples, more than 20 % of the record, or a p-value above 1e-6. None as well if more
    than 10 % of the other pairs of successive samples are equal.
    """
    samples = data.samples
    if data.missing is not None:
        samples = np.where(data.missing, np.nan, samples)
    first, count, equal = longest_run(samples)
    share = max(equal - count + 1, 1) / (data.n - 1)
    if (
        share > MAX_EQUAL_NEIGHBOR_FRACTION
        or count < MIN_SEGMENT_SAMPLES
        or count > MAX_EXCLUDED_FRACTION * data.n
    ):
        return None
    # Probability of a run of this length anywhere, if runs begin and continue as often as elsewhere. If the record
    # often holds its value, the longest run belongs to the distribution of the others.
    followed = max(share, share_of_repeats_followed(samples, MIN_SEGMENT_SAMPLES))
    log_p = float(np.log(data.n * share) + (count - 2) * np.log(followed))
    if log_p > np.log(MAX_EXCLUSION_PROBABILITY):
        return None
    begin = data.start + first / data.rate
    note = f"One value stands for {count} samples from {begin:.6g} s: a stuck sensor or a lost link"
    effect = _segment_effect(begin, begin + (count - 1) / data.rate)
    return _exclusion_candidate(effect, solution, data, -log_p, 2, log_p, note)


def _power_ratio(
    samples: NDArray[np.float64], low: int, high: int, first: float, last: float
) -> float | None:
    """Ratio of the power in a segment to the median power in up to 16 other segments of equal length; or None.

    The octave with the ordinates `low` … `high` is divided into 7 bands, of which the largest ratio counts. The segment
    lies between the fractions `first` and `last` of the record. The ratio is divided by 10 if at least half of the other
    segments have a narrow peak in the octave, because its power may vary.
    """
    from scipy.fft import next_fast_len, rfft

    n = samples.size
    start, end = round(first * n), round(last * n)
    length = end - start
    padded = next_fast_len(length, real=True)
    # Two more bands on each side serve as neighbors of the first and the last.
    steps = (high / low) ** (np.arange(-2, BANDS_PER_OCTAVE + 3) / BANDS_PER_OCTAVE)
    edges = np.unique(np.round(low * padded / (2 * n) * steps).astype(int))
    others = [*range(0, start - length + 1, length), *range(end, n - length + 1, length)]
    if edges[-1] > padded // 2 or edges.size < steps.size or np.diff(edges).min() < MIN_ORDINATES:
        return None

    def spectrum(at: int) -> NDArray[np.float64]:
        """Array of the mean power in each band of the segment that begins at sample `at`, shape (bands,)."""
        found = rfft(samples[at : at + length] * window, padded)[: edges[-1]]
        power = found.real**2 + found.imag**2
        return np.asarray(np.add.reduceat(power, edges[:-1]) / np.diff(edges))

    window = np.hanning(length)
    some = sorted(
        {others[k * len(others) // SEGMENTS_ELSEWHERE] for k in range(SEGMENTS_ELSEWHERE)}
    )
    usual = np.array([spectrum(at) for at in some])
    # Two values of a band with this many ordinates differ by less by chance.
    clearly = 1.0 + MIN_NARROW_PEAK / np.sqrt(np.diff(edges)[2:-2])
    peaks = usual[:, 2:-2] > clearly * np.maximum(usual[:, :-4], usual[:, 4:])
    louder = float(np.max((spectrum(start) / np.median(usual, axis=0))[2:-2]))
    return (
        louder * MAX_EXPLAINED_REMAINDER
        if 2 * np.count_nonzero(peaks.any(axis=1)) >= len(some)
        else louder
    )


def _is_loud(power: NDArray[np.float64], freedom: float, first: float, last: float) -> bool:
    """True if the mean relative power between two fractions of the record is significantly (1 %) above 1.

    The first and the last value in between are ignored. False if no values remain.
    """
    from scipy.special import chdtrc

    part = power[round(first * power.size) + 1 : round(last * power.size) - 1]
    return bool(
        part.size and chdtrc(freedom * part.size, freedom * part.sum()) < FALSE_ALARM_PROBABILITY
    )


def octaves_of(steady: Whitened) -> list[tuple[int, int, NDArray[np.float64], float]]:
    """List of (first ordinate, end, power over time, degrees of freedom of each value) for each whitened octave.

    The degrees of freedom are reduced by the overdispersion. Octaves with fewer than 64 values or without power are
    omitted.
    """
    return [
        (low, high, power, each / overdispersion(power, each))
        for low, high, power, each in steady.bands
        if power.size >= MIN_POWER_VALUES and float(power.max()) > 0.0
    ]


def delta_logl_of_octave_levels(
    bands: list[tuple[int, int, NDArray[np.float64], float]],
    first: float,
    last: float,
    only_louder: bool = False,
) -> float:
    """ΔlogL, nats, at least 0, if every one of `octaves_of` has another noise level between two fractions of the record.

    With `only_louder`, octaves that are quieter in the segment add nothing.
    """
    total = 0.0
    for _, _, power, freedom in bands:
        start, end = (round(part * power.size) for part in (first, last))
        if not 0 < end - start < power.size:
            continue
        inside, whole = float(power[start:end].sum()), float(power.sum())
        if only_louder and inside * power.size <= whole * (end - start):
            continue
        counts = np.array([inside]), np.array([float(end - start)])
        total += float(delta_logl_of_two_levels(*counts, whole, float(power.size), freedom)[0])
    return total


def without_ringing(
    samples: NDArray[np.float64], low: int, high: int, first: float, last: float
) -> tuple[float, float] | None:
    """Pair (start, end) of the part of a segment that is really loud in an octave, as fractions of the record; or None.

    The band-pass filter of an octave rings before and after a loud part, so the segment is too long. Power in short windows
    (8 periods of the octave) does not ring. `low` and `high` are the ordinates of the octave; `first` and `last` are the
    ends of the segment, as fractions of the record. A window must have 100 times the median power of windows outside.
    """
    n = samples.size
    length = WINDOW_PERIODS * 4 * n // (low + high)
    start, end = round(first * n), round(last * n)
    if end - start < 2 * length:
        return None
    window = np.hanning(length)
    inside = slice(low * length // (2 * n), high * length // (2 * n) + 1)

    def power(at: NDArray[np.int64]) -> NDArray[np.float64]:
        """Array of the power within the octave in each window that begins at one of the samples `at`."""
        pieces = np.lib.stride_tricks.sliding_window_view(samples, length)[at]
        found = np.fft.rfft(pieces * window, axis=1)[:, inside]
        return np.asarray((found.real**2 + found.imag**2).sum(axis=1))

    hop = length // OVERLAPPING_WINDOWS
    at = np.arange(max(0, start - length), min(n, end + length) - length + 1, hop)
    others = np.concatenate(
        [np.arange(0, start - length + 1, hop), np.arange(end, n - length + 1, hop)]
    )
    if others.size < MIN_POWER_VALUES:
        return None
    usual = float(np.median(power(others[:: others.size // MIN_POWER_VALUES])))
    there = power(at) / usual if usual > 0.0 else np.zeros(at.size)
    loud = at[there > MAX_QUIET_POWER_RATIO]
    if not there.size or there.max() < MIN_RINGING_POWER_RATIO:
        return None
    half = length // 2
    # A disturbance that reaches an end of the record begins or ends there.
    begin = start if loud[0] <= half else max(start, int(loud[0]) + half)
    close = end if loud[-1] + length + hop > n else min(end, int(loud[-1]) + half)
    return (begin / n, close / n) if begin < close else None
