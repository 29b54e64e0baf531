"""Screen of a band whose level changes: one octave of the time map, or the band of a process, is louder for a while."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.criticism.over_time import overdispersion
from allanite.effects import CATALOG, Modifier
from allanite.fit.engine import solve
from allanite.fit.likelihood.bands_in_time import (
    band_ordinates,
    band_series,
    cell_shares,
    density_shares,
)
from allanite.fit.likelihood.whitened import MIN_WHITE_SHARE, Whitened
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    LEVEL_CELLS,
    MAX_EXPLAINED_REMAINDER,
    MIN_BAND_LEVEL_FRACTION,
    MIN_ORDINATES,
    MIN_POWER_VALUES,
    MIN_SEGMENT_SAMPLES,
)
from allanite.suggestion.p_values import best_interval, delta_logl_of_two_levels
from allanite.suggestion.screens._screen import Candidate
from allanite.suggestion.screens.exclusions import octaves_of
from allanite.suggestion.screens.level_borders import refined_interval
from allanite.suggestion.screens.level_forms import LEVELS, is_deformed_by_rounding
from allanite.suggestion.screens.spectral import bands_overlap

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution

Array = NDArray[np.float64]
#: Power over time of some ordinates, and the share of it that changes.
Cell = tuple[Array, float]

#: Number of frequencies that a spectrum of the interval resolves within an octave.
OCTAVE_CELLS = 32
#: Maximum number of samples whose spectra are computed at once; limits the memory.
SAMPLES_AT_ONCE = 1 << 16
#: Number of distances from the middle of a band at which the share of its process is computed, and the ratio of
#: neighboring distances.
DISTANCES, DISTANCE_RATIO = 24, 1.2
#: Maximum |ln| of the power inside over outside of an interval in the search for its level.
MAX_LOG_RATIO = 9.0
#: Loss of logL at the ends of a 95 % interval of one parameter: half of the 95 % quantile of χ²₁.
LOSS_AT_95_PERCENT = 1.92


def screen_band_level(solution: Solution, data: Data, whitened: Whitened) -> Candidate | None:
    """Refitted `Candidate` for the frequency band whose noise level differs most significantly in one interval; or None.

    The bands of the model's processes are searched first, octaves only if none of them is significant. None

    * for a summary, for coarsely rounded samples, or for a p-value above 1 %,
    * if the interval is shorter than 1/64 of the record or longer than 63/64,
    * if the factor differs from 1 by less than its error or the model discrepancy,
    * if the model has a change of level that overlaps the band, or if over 10 % of the ΔlogL remains in the band after it.
    """
    kinds = [cls for cls in CATALOG if issubclass(cls, Modifier) and cls.screened == "band level"]
    if not kinds or whitened.samples.size < data.n or is_deformed_by_rounding(data):
        return None  # a summary keeps no samples
    found, searches = _changed_bands(solution, data, whitened.with_normal_tails)
    if not found:
        return None
    log_p, begin, close, first, size, cells = min(found, key=lambda one: one[0])
    if not MIN_BAND_LEVEL_FRACTION < close - begin < 1.0 - MIN_BAND_LEVEL_FRACTION:
        return None  # a short ringing is a disturbance
    factor, gain, known, steady = _fitted_level_change(cells, begin, close)
    half = data.rate / (2.0 * data.n)
    band = first * half, (first + size) * half
    if any(bands_overlap(band, e.band) for e in solution.model.modifiers if e.band is not None):
        return None  # this band has a change of level already
    if largest_delta_logl(steady) > MAX_EXPLAINED_REMAINDER * gain:
        return None
    effect = kinds[0].from_values(
        low=band[0],
        high=band[1],
        start=data.start + begin * data.duration,
        end=data.start + close * data.duration,
        factor=factor,
    )
    if effect is None or abs(factor - 1.0) < max(solution.discrepancy, known):
        return None
    model = solution.model
    refitted = solve(data, model + effect, like=solution, settled=len(model), rounds=3)
    last = refitted.model.effects[-1]
    return Candidate(last, gain, LEVELS, refitted, last.numbers, min(0.0, log_p + searches))


def _changed_bands(
    solution: Solution, data: Data, whitened: Whitened
) -> tuple[list[tuple[float, float, float, int, int, list[Cell]]], float]:
    """Pair: list of (ln p, begin, end, first ordinate, number, cells) of bands with a changed level; ln(searches).

    Listed are bands with p < 1 % after correction for all searches. `begin` and `end` are fractions of the record, and
    `cells` as for `_fitted_level_change`. Octaves are searched only if no band of a process is listed.
    """
    ordinates = _kernels.cosine_transform(whitened.samples)
    octaves = octaves_of(whitened)
    bands = list(_dominated_bands(solution, data))
    searches = float(np.log(max(len(bands) + len(octaves), 1)))

    def series(first: int, size: int) -> Array:
        """Array of the power over time of the band of `size` ordinates from `first` on."""
        return np.asarray(band_series(ordinates[first : first + size]) ** 2)

    found: list[tuple[float, float, float, int, int, list[Cell]]] = []
    for own, first, size in bands:
        parts: Iterable[tuple[int, int, float]] = cell_shares(own, solution, data, data.n)
        if own.effect.unsteady is not None:
            # The line is now here, now there: only the power of the whole band shows its level over time.
            first, size = band_ordinates(own.effect.unsteady, data, data.n)
            there = solution.ordinates[first : first + size]
            ordinates[first : first + size] = there / np.sqrt(np.mean(there**2))
            shares = density_shares(own, solution, data, np.arange(first, first + size))
            over = float(np.mean(shares / (1.0 - shares)))
            parts = [(first, size, over / (1.0 + over))]
        power = series(first, size)
        start, end, log_p = _interval(power)
        if log_p + searches < np.log(FALSE_ALARM_PROBABILITY):
            cells = [(series(at, many), share) for at, many, share in parts]
            found.append((log_p, start, end, first, size, cells))
    for low, high, octave, freedom in () if found else octaves:
        start, end, _, log_p = best_interval(octave, freedom, min(LEVEL_CELLS, octave.size // 8))
        if log_p + searches < np.log(FALSE_ALARM_PROBABILITY):
            when = start / octave.size, end / octave.size
            seen = _changed_band(whitened.samples, (low / data.n, high / data.n), when, data.rate)
            first, size = (0, 0) if seen is None else band_ordinates(seen, data, data.n)
            if size >= MIN_POWER_VALUES:
                power = series(first, size)
                found.append((log_p, *_interval(power)[:2], first, size, [(power, 1.0)]))
    return found, searches


def best_levels(found: Sequence[Candidate | None], n: int) -> list[Candidate]:
    """List of the candidates of level changes whose ΔlogL minus BIC cost for `n` samples is within 3 nats of the best.

    None entries of `found` are left out.
    """
    price = 0.5 * np.log(max(n, 2))
    worth = [(c.gain - price * c.parameters, c) for c in found if c is not None]
    best = max((w for w, _ in worth), default=0.0)
    return [c for w, c in worth if w > best - MAX_RIVAL_LOG_EVIDENCE]


def _interval(power: Array) -> tuple[float, float, float]:
    """Tuple (start, end, ln p-value) of the interval whose mean `power` differs most significantly from the rest.

    `power` is a series over time; start and end are fractions of its length.
    """
    size = power.size
    freedom = 1.0 / overdispersion(power)
    cells = min(LEVEL_CELLS, size // 8)
    start, end, _, log_p = best_interval(power, freedom, cells)
    if size > cells:
        start, end, _ = refined_interval(power, freedom, start, end, size // cells)
    return start / size, end / size, log_p


def largest_delta_logl(power: Array) -> float:
    """ΔlogL, divided by the overdispersion, of the most significant interval with another mean of the series `power`."""
    cells = min(LEVEL_CELLS, power.size // 8)
    if cells < 2:
        return 0.0
    return best_interval(power, 1.0 / overdispersion(power), cells)[2]


def _fitted_level_change(
    cells: list[Cell], begin: float, close: float
) -> tuple[float, float, float, Array]:
    """Tuple (factor, ΔlogL, standard error of ln factor, steady power): a changed level of one process in an interval.

    `factor` is the standard deviation of the process inside over outside of the fractions `begin` to `close` of the record.
    Each of `cells` is a pair: power over time of a frequency range, and part of the process in that power. `steady power`
    is the most informative series, with the change divided out. If the process may be absent inside or outside, `factor` is
    the end of its 95 % interval nearer to 1.
    """
    from scipy.optimize import brentq, minimize_scalar

    inside = close - begin
    seen, counts, owned = [], [], []
    for power, own in cells:
        start, end = round(begin * power.size), round(close * power.size)
        if 0 < end - start < power.size:
            there = power[start:end].sum(), power.sum() - power[start:end].sum()
            counts.append((end - start, power.size - end + start))
            seen.append(np.array(there) / counts[-1])
            owned.append(own)
    if not owned:
        return 1.0, 0.0, 1.0, cells[0][0]
    measured, count, shares = np.array(seen), np.array(counts, dtype=float), np.array(owned)

    def expected(log_ratio: float, of: Array) -> Array:
        """Expected power inside and outside, relative to the mean over time, for parts `of` of it, shape (shares, 2)."""
        ratio = np.exp(log_ratio)
        mean = ratio * inside + 1.0 - inside
        return np.asarray(1.0 + of[:, None] * (np.array([ratio, 1.0]) / mean - 1.0))

    def loss(log_ratio: float) -> float:
        """Negative logL if ln of the power of the process inside over outside of the interval is `log_ratio`."""
        model = expected(log_ratio, shares)
        return float(0.5 * np.sum(count * (np.log(model) + measured / model)))

    best = minimize_scalar(loss, bounds=(-MAX_LOG_RATIO, MAX_LOG_RATIO), method="bounded")
    gain, found = loss(0.0) - float(best.fun), float(best.x)
    worst = float(best.fun) + LOSS_AT_95_PERCENT
    if loss(np.sign(found) * MAX_LOG_RATIO) < worst < loss(0.0):
        # The process may be absent inside or outside: take the 95 % bound of the factor.
        found = float(brentq(lambda x: loss(x) - worst, 0.0, found))
    # Overdispersion of the most informative cell after the change is divided out.
    telling, own = max(cells, key=lambda cell: cell[1] ** 2 * cell[0].size)
    first, last = round(begin * telling.size), round(close * telling.size)
    there, elsewhere = expected(found, np.array([own]))[0]
    steady = telling / elsewhere
    steady[first:last] *= elsewhere / there
    scatter = overdispersion(steady)
    known = float(np.sqrt(scatter / (2.0 * (shares**2 @ count).min())))
    return float(np.exp(0.5 * found)), gain / scatter, known, steady


def _dominated_bands(solution: Solution, data: Data) -> Iterator[tuple[Process, int, int]]:
    """Iterator over (process, first ordinate, number): the band in which a process has at least half of the power.

    Omitted are processes whose level the model already changes over time, and bands with fewer than 64 ordinates.
    """
    half = data.rate / (2.0 * data.n)
    for own in solution.processes:
        place = own.effect.occupies
        if place is None or any(e.changes_level_of(own.effect) for e in solution.model.modifiers):
            continue
        middle, width = 0.5 * (place[0] + place[1]) / half, 0.5 * (place[1] - place[0]) / half
        ends = []
        for sign in (-1.0, 1.0):
            steps = middle + sign * width * 0.2 * DISTANCE_RATIO ** np.arange(DISTANCES)
            at = np.round(steps).astype(np.int64).clip(1, data.n - 1)
            shares = density_shares(own, solution, data, at) * (at == np.round(steps))
            reach = int(np.argmin(np.append(shares >= MIN_WHITE_SHARE, False)))
            ends.append(steps[reach - 1] if reach else middle)
        first, size = band_ordinates((ends[0] * half, ends[1] * half), data, data.n)
        if size >= MIN_POWER_VALUES:
            yield own, first, size


def _changed_band(
    samples: Array, octave: tuple[float, float], when: tuple[float, float], rate: float
) -> tuple[float, float] | None:
    """Pair (low, high), Hz: the frequency band whose power differs most inside and outside of an interval of time; or None.

    `octave` is a pair of frequencies as fractions of the Nyquist frequency; the band lies between half its lower and twice
    its upper end. `when` is the interval as fractions of the record.
    """
    low, high = octave
    n = samples.size
    start, end = (round(part * n) for part in when)
    length = min(round(2.0 * OCTAVE_CELLS / (high - low)), (end - start) // MIN_ORDINATES)
    if length < MIN_SEGMENT_SAMPLES:
        return None
    inside = _segments(samples[start:end], length)
    before, after = _segments(samples[:start], length), _segments(samples[end:], length)
    many = len(before) + len(after)
    if not many:
        return None
    place = 2.0 * np.fft.rfftfreq(length)[1:-1]
    here, there = _summed_spectrum(inside), _summed_spectrum(before) + _summed_spectrum(after)
    usable = np.flatnonzero((place > 0.5 * low) & (place < 2.0 * high))
    if usable.size < 2:
        return None
    # The window spreads each ordinate over 1.5 neighbors.
    counts = np.array([len(inside), many]) * 2.0 / 1.5
    own = np.concatenate([[0.0], np.cumsum(here[usable] / len(inside))])
    other = np.concatenate([[0.0], np.cumsum(there[usable] / many)])
    a, b = np.triu_indices(usable.size + 1, 1)
    width = (b - a).astype(float)
    inside_sum, outside_sum = (own[b] - own[a]), (other[b] - other[a])
    gain = delta_logl_of_two_levels(
        counts[0] * inside_sum,
        counts[0] * width,
        counts[0] * inside_sum + counts[1] * outside_sum,
        counts.sum() * width,
        1.0,
    )
    top = int(np.argmax(gain))
    step = 1.0 / length
    first, last = place[usable[a[top]]] - step, place[usable[b[top] - 1]] + step
    return 0.5 * rate * float(first), 0.5 * rate * float(last)


def _segments(samples: Array, length: int) -> Array:
    """Array of consecutive segments of `length` samples, shape (segments, length); a remainder at the end is dropped."""
    many = samples.size // length
    return samples[: many * length].reshape(many, length)


def _summed_spectrum(pieces: Array) -> Array:
    """Sum of the power spectra of segments, `pieces`, shape (segments, samples), without the first and last frequency."""
    length = pieces.shape[1]
    window, rows = np.hanning(length), max(1, SAMPLES_AT_ONCE // length)
    total = np.zeros(length // 2 + 1)
    for first in range(0, len(pieces), rows):
        spectra = np.fft.rfft(pieces[first : first + rows] * window, axis=1)
        total += (spectra.real**2 + spectra.imag**2).sum(axis=0)
    return total[1:-1]
