"""Candidates that take samples out: single ones, and stretches in which something moved the sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.criticism.over_time import overdispersion
from allanite.effects import CATALOGUE, Model, Modifier
from allanite.fit.engine import solve
from allanite.fit.likelihood.data import without_samples
from allanite.fit.likelihood.whitened import ends_of, step_in, with_normal_tails
from allanite.fit.missing.completion import complete
from allanite.recording.repeats import longest_run
from allanite.recording.tails import outlier_limit
from allanite.suggestion.constants import (
    END_NEIGHBORS,
    END_OUTLIER_PROBABILITY,
    FALSE_ALARM_PROBABILITY,
    LEVEL_CELLS,
    MAX_EQUAL_NEIGHBOR_FRACTION,
    MAX_EXCLUDED_FRACTION,
    MAX_EXCLUSION_PROBABILITY,
    MIN_DISTURBANCE_ORDINATES,
    MIN_DISTURBANCE_POWER_RATIO,
    MIN_POWER_VALUES,
    MIN_STUCK_SAMPLES,
    NARROW_DISTURBANCE_FACTOR,
)
from allanite.suggestion.p_values import (
    best_interval,
    refine,
    two_levels,
)
from allanite.suggestion.screens.disturbance_ends import without_ringing
from allanite.suggestion.screens.spectral import Candidate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whitened import Whitened
    from allanite.fit.solution import Solution

__all__ = [
    "at_the_ends",
    "differs_by",
    "octaves_of",
    "only_at_the_ends",
    "screen_disturbance",
    "screen_outliers",
]

#: Most places of the record at which the usual distance between neighbors is measured.
MAX_PLACES = 1 << 14
#: Bands of an octave in which a disturbance is compared with other times.
BANDS_PER_OCTAVE = 7
#: Segments elsewhere with which a disturbance is compared.
SEGMENTS_ELSEWHERE = 16


#: Of an octave that hears a stretch: ln of its chance, from and to which part of the record, relative power, its freedom.
_Heard = tuple[float, float, float, NDArray[np.float64], float]


def at_the_ends(solution: Solution, data: Data) -> NDArray[np.float64]:
    """How far samples of the two ends stand out, in standard deviations where they do, shape (n,), else 0.

    The whitened record says nothing of the ends, where a sensor that just began, or a filter that was
    empty, puts its outliers. From the middle outwards, each is compared with the median of those behind it that do not
    stand out, and with how far samples that far apart usually are. One record of noise in a thousand has one.
    """
    from scipy.special import ndtri

    found = np.zeros(data.n)
    ends = ends_of(data.n)
    if ends < 1:
        return found
    samples = data.residual(solution.model)
    reach = np.arange(END_NEIGHBORS)

    def apart(at: NDArray[np.int64] | int, way: int) -> NDArray[np.float64]:
        behind = np.asarray(at)[..., None] + way * reach
        return np.abs(samples[at] - np.median(samples[behind + way * gap], axis=-1))

    places = np.linspace(0, data.n - 1 - END_NEIGHBORS - ends, min(data.n, MAX_PLACES)).astype(
        np.int64
    )
    gap = 1
    usual = apart(places, 1)
    scales = {gap: _scale(usual)}
    if scales[gap] == 0.0:
        return found
    chance = END_OUTLIER_PROBABILITY / (2 * ends)
    limit = -float(ndtri(0.5 * chance))
    step = step_in(data, usual) / scales[gap]
    limit = max(limit, outlier_limit(usual / scales[gap], chance, step))
    for first, way in ((ends - 1, 1), (data.n - ends, -1)):
        gap = 1
        for at in range(first, first - way * ends, -way):
            if data.missing is not None and data.missing[at]:
                continue
            if gap not in scales:
                scales[gap] = _scale(apart(places, 1))
            z = float(apart(at, way)) / scales[gap]
            found[at] = z if z > limit else 0.0
            gap = gap + 1 if z > limit else 1
    return found


def only_at_the_ends(effect: Modifier, data: Data) -> bool:
    """Whether it takes samples out, all of them some of the first and the last."""
    if not effect.removes:
        return False
    taken = effect.missing(data.n, data.rate)
    ends = ends_of(data.n)
    return bool(taken.any()) and not taken[ends : data.n - ends].any()


def _scale(size: NDArray[np.float64]) -> float:
    """Standard deviation by the widest of three quantiles (of a normal law 0.6745, 1 and 2 σ).

    Noise that is merely not normal has no outliers.
    """
    return float(np.max(np.quantile(size, [0.5, 0.6827, 0.9545]) / [0.6745, 1.0, 2.0]))


def screen_outliers(
    solution: Solution, data: Data, samples: NDArray[np.float64]
) -> Candidate | None:
    """Samples of the whitened record beyond what n normal ones reach once in a hundred records.

    The scale is that of quantiles, which a few per cent of outliers do not move; the gain is what giving each
    its own level would raise logL by, less the ln n of choosing it.
    """
    from scipy.special import log_ndtr, ndtri_exp

    kinds = [c for c in CATALOGUE if issubclass(c, Modifier) and c.screened == "outlier"]
    wanted = [c for c in kinds if c.candidates(solution.model, data.covariates)]
    if not wanted or samples.size < data.n:
        return None
    centre = np.median(samples)
    size = np.abs(samples - centre)
    scale = _scale(size)
    if scale == 0.0:
        return None
    z = np.abs(samples - centre) / scale
    limit = -float(ndtri_exp(np.log(0.5 * FALSE_ALARM_PROBABILITY / data.n)))
    if z.max() > limit:
        # What the record's own tail reaches is none; a coarse step rounds up.
        there = size if data.missing is None else size[~data.missing]
        limit = max(
            limit,
            outlier_limit(
                there / scale, FALSE_ALARM_PROBABILITY / data.n, step_in(data, samples) / scale
            ),
        )
    z = np.where(z > limit, z, 0.0)
    z += at_the_ends(solution, data)
    index = np.flatnonzero(z)
    if index.size == 0 or index.size > MAX_EXCLUDED_FRACTION * data.n:
        return None
    seen = data.samples if data.missing is None else data.samples[~data.missing]
    if float(np.ptp(np.quantile(seen, [0.01, 0.99]))) == 0.0:
        return None  # a column of few codes: hardly anything but one of them would be left
    gain = float(np.sum(0.5 * z[index] ** 2 - np.log(data.n)))
    if gain <= 0.0:
        return None
    largest = float(np.log(2.0 * data.n) + log_ndtr(-float(z.max())))
    effect = wanted[0].at((data.start + index / data.rate).tolist())
    return _taken_out(effect, solution, data, gain, 1, largest)


def _taken_out(
    effect: Modifier | None,
    solution: Solution,
    data: Data,
    gain: float,
    numbers: int,
    chance: float,
    note: str = "",
) -> Candidate | None:
    """The model refitted to what an effect of so many `numbers` leaves of the record; None where it takes nothing."""
    if effect is None:
        return None
    taken = effect.missing(data.n, data.rate)
    if not np.any(taken if data.missing is None else taken & ~data.missing):
        return None
    cleaned = without_samples(data, taken)
    cleaned = complete(cleaned, solution.model, solution.level)
    refitted = solve(cleaned, Model((*solution.model.effects, effect)), rounds=3)
    found = refitted.model.effects[-1]
    return Candidate(
        found,
        gain,
        effect.screened,
        refitted,
        numbers,
        min(0.0, chance),
        data=cleaned,
        note=note,
    )


def screen_disturbance(solution: Solution, data: Data, whitened: Whitened) -> Candidate | None:
    """The disturbance with the lowest p-value, or a stuck value if the record has one; None if there is neither.

    A disturbance is a segment in which some band has `MIN_DISTURBANCE_POWER_RATIO` times its usual power. The segment is at
    most `MAX_EXCLUDED_FRACTION` of the record. Each octave is searched for one interval; octaves that see the same
    disturbance begin earlier or end later extend the segment.
    """
    if whitened.samples.size < data.n:
        return None  # a summary keeps no samples to take out
    stuck = _standing_still(solution, data)
    if stuck is not None:
        return stuck
    bands = octaves_of(with_normal_tails(whitened))
    samples = data.residual(solution.model)
    found: list[_Heard] = []
    told: list[_Heard] = []
    for low, high, power, freedom in bands:
        size = power.size
        start, end, _, chance = best_interval(power, freedom, min(LEVEL_CELLS, size // 8))
        chance += float(np.log(len(bands)))
        if chance > np.log(MAX_EXCLUSION_PROBABILITY) or end - start > MAX_EXCLUDED_FRACTION * size:
            continue
        if size > LEVEL_CELLS:
            start, end, _ = refine(power, freedom, start, end, size // LEVEL_CELLS)
        outside = np.delete(power, np.s_[start:end]).mean()
        loud = _narrowly(samples, low, high, start / size, end / size)
        if (
            power[start:end].mean() / outside if loud is None else loud
        ) < MIN_DISTURBANCE_POWER_RATIO:
            continue
        # A value of the octave is known to itself.
        times = max(start - 1, 0) / size, min(end + 1, size) / size
        ends = without_ringing(samples, low, high, *times)
        (found if ends is None else told).append(
            (chance, *(ends or times), power / outside, freedom)
        )
    # Where some octaves tell when it was, the others ring.
    found = sorted(told or found, key=lambda one: one[0])
    if not found:
        return None
    chance, first, last, _, _ = found[0]
    reach = last - first
    for _, begin, close, power, freedom in found[1:]:
        # Another octave may hear it begin earlier or end later: less long than it lasts, else that is another one.
        if first - reach < begin < first and _loud(power, freedom, begin, first):
            first = begin
        if last < close < last + reach and _loud(power, freedom, last, close):
            last = close
    begin, close = (data.start + part * data.duration for part in (first, last))
    return _taken_out(
        _stretch(begin, close), solution, data, _louder_by(bands, first, last), 2, chance
    )


def _stretch(start: float, end: float) -> Modifier | None:
    """The effect of the catalogue that takes this interval out."""
    kinds = [c for c in CATALOGUE if issubclass(c, Modifier) and c.screened == "stretch"]
    return kinds[0].during(start, end, MIN_DISTURBANCE_POWER_RATIO) if kinds else None


def _standing_still(solution: Solution, data: Data) -> Candidate | None:
    """The longest stretch of one value, where neighbours are hardly ever equal: a stuck sensor or a lost link."""
    samples = data.samples
    if data.missing is not None:
        samples = np.where(data.missing, np.nan, samples)
    first, count, equal = longest_run([(0, samples)], data.n)
    # By chance alone: that many in a row, anywhere in the record, of neighbours that are equal as often as elsewhere.
    share = max(equal - count + 1, 1) / (data.n - 1)
    chance = float(np.log(data.n) + (count - 1) * np.log(share))
    if (
        share > MAX_EQUAL_NEIGHBOR_FRACTION
        or count < MIN_STUCK_SAMPLES
        or count > MAX_EXCLUDED_FRACTION * data.n
        or chance > np.log(MAX_EXCLUSION_PROBABILITY)
    ):
        return None
    begin = data.start + first / data.rate
    note = f"One value stands for {count} samples from {begin:.6g} s: a stuck sensor or a lost link"
    effect = _stretch(begin, begin + (count - 1) / data.rate)
    return _taken_out(effect, solution, data, -chance, 2, chance, note)


def _narrowly(
    samples: NDArray[np.float64], low: int, high: int, first: float, last: float
) -> float | None:
    """Largest ratio, over the bands within some ordinates, of the power in a segment to the median power elsewhere.

    The segment is given in fractions of the record. The ratio is divided by `NARROW_DISTURBANCE_FACTOR` if half of the
    other segments have something narrow in these ordinates: that may swell or wander. None if the segment is too short.
    """
    from scipy.fft import next_fast_len, rfft

    n = samples.size
    start, end = round(first * n), round(last * n)
    length = end - start
    padded = next_fast_len(length, real=True)
    # Two more to either side, beside which the first and the last stand out.
    steps = (high / low) ** (np.arange(-2, BANDS_PER_OCTAVE + 3) / BANDS_PER_OCTAVE)
    edges = np.unique(np.round(low * padded / (2 * n) * steps).astype(int))
    others = [*range(0, start - length + 1, length), *range(end, n - length + 1, length)]
    if (
        edges[-1] > padded // 2
        or edges.size < steps.size
        or np.diff(edges).min() < MIN_DISTURBANCE_ORDINATES
    ):
        return None

    def spectrum(at: int) -> NDArray[np.float64]:
        found = rfft(samples[at : at + length] * window, padded)[: edges[-1]]
        power = found.real**2 + found.imag**2
        return np.asarray(np.add.reduceat(power, edges[:-1]) / np.diff(edges))

    window = np.hanning(length)
    some = sorted(
        {others[k * len(others) // SEGMENTS_ELSEWHERE] for k in range(SEGMENTS_ELSEWHERE)}
    )
    usual = np.array([spectrum(at) for at in some])
    # Of a band with as many ordinates two values differ by so much by chance.
    clearly = 1.0 + 8.0 / np.sqrt(np.diff(edges)[2:-2])
    peaks = usual[:, 2:-2] > clearly * np.maximum(usual[:, :-4], usual[:, 4:])
    louder = float(np.max((spectrum(start) / np.median(usual, axis=0))[2:-2]))
    return (
        louder / NARROW_DISTURBANCE_FACTOR
        if 2 * np.count_nonzero(peaks.any(axis=1)) >= len(some)
        else louder
    )


def _loud(power: NDArray[np.float64], freedom: float, first: float, last: float) -> bool:
    """Whether relative power between two parts of the record, short of the values at either, is beyond chance."""
    from scipy.special import chdtrc

    part = power[round(first * power.size) + 1 : round(last * power.size) - 1]
    return bool(
        part.size and chdtrc(freedom * part.size, freedom * part.sum()) < FALSE_ALARM_PROBABILITY
    )


def octaves_of(steady: Whitened) -> list[tuple[int, int, NDArray[np.float64], float]]:
    """First ordinate, end, power over time and the freedom of a value of each octave."""
    return [
        (low, high, power, each / overdispersion(power, each))
        for low, high, power, each in steady.bands
        if power.size >= MIN_POWER_VALUES and float(power.max()) > 0.0
    ]


def differs_by(whitened: Whitened, first: float, last: float) -> float:
    """Rise of logL by another level of each octave, louder or quieter, between two parts of the record."""
    return sum(rise for rise, _ in _levels(octaves_of(with_normal_tails(whitened)), first, last))


def _louder_by(
    bands: list[tuple[int, int, NDArray[np.float64], float]], first: float, last: float
) -> float:
    """The same of the octaves that are louder."""
    return sum(rise for rise, louder in _levels(bands, first, last) if louder)


def _levels(
    bands: list[tuple[int, int, NDArray[np.float64], float]], first: float, last: float
) -> Iterator[tuple[float, bool]]:
    """Rise of logL by another level of each octave between two parts of the record, and whether it is louder there."""
    for _, _, power, freedom in bands:
        start, end = (round(part * power.size) for part in (first, last))
        if 0 < end - start < power.size:
            inside, whole = float(power[start:end].sum()), float(power.sum())
            counts = np.array([inside]), np.array([float(end - start)])
            rise = float(two_levels(*counts, whole, float(power.size), freedom)[0])
            yield rise, inside * (power.size - end + start) > (whole - inside) * (end - start)
