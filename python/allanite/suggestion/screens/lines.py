"""Screen of lines: the whitened record is searched at every frequency, and lines are combined into harmonics and combs."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.threads import stop_if_unwanted
from allanite.effects import CATALOG, Deterministic
from allanite.fit.engine import solve
from allanite.fit.likelihood.remembered import trim_memory
from allanite.fit.likelihood.stop_band import is_empty
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.line_trials import known_bands, trials_at
from allanite.fit.shapes.deterministic import comb_window, line_ordinates, ordinates_near, regress
from allanite.fit.shapes.shape import ORDINATES_BESIDE_LINE, optimized_multiples, polish_line
from allanite.suggestion.constants import (
    MAIN_SHARE,
    MAX_EVENTS,
    MAX_FUNDAMENTAL_DIVISOR,
    MAX_LINE_BAND_DISTANCE,
    MAX_LINE_HARMONIC,
    MAX_LINES_REFITTED,
    MAX_PULSE_HARMONIC,
    MIN_COMB_FRACTION,
    MIN_DELTA_LOGL_OVER_SIMPLER,
    MIN_LINE_PEAK,
    MIN_PERIODS,
    MIN_SPACED_LINES,
)
from allanite.suggestion.p_values import Family, log_p_value
from allanite.suggestion.screens._screen import Candidate, Context, Screen

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution
    from allanite.spectrum import Bins

Array = NDArray[np.float64]
#: Number of ordinates on each side of a line in which its width is measured.
WIDTH_ORDINATES = 256
#: Half-width of a line in ordinates. Values so close to its peak are removed together with it, and so are its side lobes.
#: Chosen by judgment; not measured.
LINE_HALF_WIDTH = 8
#: Largest distance of a tooth of a comb from its place, in ordinates. Chosen by judgment; not measured.
TOOTH_TOLERANCE = 2
#: Median of χ²₁, the distribution of squared ordinates of white noise over their variance.
MEDIAN_CHI2_1 = 0.4549


def _divide_by_level(
    power: NDArray[np.float64], floor: float, bins: Bins
) -> list[tuple[int, float]]:
    """List of pairs (end, level), one for each frequency interval of the periodogram `power`. Changes `power` in place.

    Each interval of `power` is divided by its level: the median over ln 2, which a broad band raises but a line does not.
    If a bin in the interval is empty, the true level is unknown, and the level is at least 1.
    """
    empty = np.flatnonzero(is_empty(bins))
    edges = np.unique(
        np.concatenate(
            [
                np.arange(0, 256, 64),
                np.geomspace(256, power.size, max(2, int(24 * np.log10(power.size / 256 + 1.01)))),
            ]
        ).astype(np.int64)
    )
    edges = np.unique(np.append(edges[edges < power.size - 32], power.size))
    levels = []
    for low, high in itertools.pairwise(edges):
        is_next_to_empty = np.any((bins.edges[empty] < high) & (bins.edges[empty + 1] > low))
        least = 1.0 if is_next_to_empty else floor
        level = max(least, float(np.median(power[low:high])) / np.log(2.0))
        power[low:high] /= level
        levels.append((int(high), level))
    return levels


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple of refitted `Candidate` of up to 12 lines of the residual, the clearest first, each with its harmonics.

    Evenly spaced lines become one candidate. So do more than 12 lines far apart, if harmonics of the clearest have less
    than half of their power. The search ends at a peak of at most 6 nats, or of less than 3 above ln of the number of
    trials. A candidate that does not raise logL is left out.
    """
    solution, data, whitened = context.solution, context.data, context.whitened.samples
    if solution.best.scale is not None or data.gain is not None:
        # A discrepancy would absorb a line of a few cycles; a random draw for missing samples would dilute it.
        whitened = _kernels.inverse_cosine_transform(context.white)
    ratio = _kernels.padded_periodogram(whitened)
    levels = _divide_by_level(ratio, 1.0 if solution.best.scale is None else 0.01, data.bins)
    # A line of fewer periods is a drift, unless its period is known.
    known = np.zeros(ratio.size, dtype=bool)
    for low, high in 2.0 * data.duration * known_bands(data.n, data.rate):
        if low > 2.0:
            known[int(np.ceil(low)) : int(high) + 1] = True
    ratio[: 2 * MIN_PERIODS][~known[: 2 * MIN_PERIODS]] = 0.0
    ratio[-2:] = 0.0
    found: list[Candidate] = []
    no_comb = set[tuple[int, int]]()
    for _ in range(MAX_LINES_REFITTED):
        stop_if_unwanted()
        trim_memory(data.samples.size)
        top, above = _clearest_line(ratio, data)
        if ratio[top] <= MIN_LINE_PEAK or above < MAX_RIVAL_LOG_EVIDENCE:
            break
        level = next(level for end, level in levels if top < end)
        width, surplus = _best_width(top, solution, data, level)
        base: float
        multiples: Sequence[float]
        base, multiples = _fundamental_and_multiples(ratio, top, width)
        places = _line_indices(ratio, data)
        together = evenly_spaced(ratio, places, len(multiples), no_comb)
        is_comb = together is not None
        if not is_comb and len(places) > MAX_LINES_REFITTED:
            # More lines than are refitted one by one, and most of their power is in no harmonics of one.
            harmonics = ratio[[round(m * base) for m in multiples]].sum()
            alone = harmonics < MAIN_SHARE * ratio[places].sum()
            # Closer ones may be peaks of one band.
            alone = alone and np.median(np.diff(np.sort(places))) > 2.0 * MAX_LINE_BAND_DISTANCE
            together = _line_set(places, ratio) if alone else None
        if together is not None:
            (base, multiples), width, surplus = together, 0, 0.0
            reaches = [(round(m * base), LINE_HALF_WIDTH) for m in multiples]
        else:
            reaches = [(round(m * base), round(m * (LINE_HALF_WIDTH + width))) for m in multiples]
            reaches.append((top, LINE_HALF_WIDTH + width))
        for place, reach in reaches:
            _remove_line(ratio, place, reach)
        start = base * data.rate / (2.0 * data.n)
        for effect in _periodic_effects(start, multiples, solution, data):
            error = 2.0 if together is None else 2.0 / multiples[-1]
            candidate = _refitted(effect, start, error, solution, data, (width, surplus))
            if candidate is not None:
                found.append(candidate)
        if together is not None and not is_comb and len(places) == MAX_EVENTS:
            break  # the next check finds the further lines together, too
    return tuple(found)


SCREEN = Screen(
    "lines",
    "lines of constant frequency, with their harmonics, at all frequencies",
    "frequency",
    look,
)


def _refitted(
    effect: Deterministic,
    start: float,
    error: float,
    solution: Solution,
    data: Data,
    band: tuple[int, float],
) -> Candidate | None:
    """`Candidate` of a line, or of a line with multiples, refitted near the frequency `start`, Hz; None if ΔlogL is ≤ 0.

    `error` is that of `start`, in ordinates. `band` is the half-width in ordinates and the ΔlogL of a narrow band of noise.
    """
    multiples = optimized_multiples(effect)
    j = comb_window(start, multiples, data, ORDINATES_BESIDE_LINE)
    left, noise = solution.ordinates[j], solution.noise(data)
    frequency = polish_line(start, j, left, noise, data, multiples, error)
    model = solution.model + effect.with_values(frequency=frequency)
    refitted = solve(data, model, like=solution, polish=False, rounds=3)
    last = refitted.model.effects[-1]
    assert isinstance(last, Deterministic)
    # The noise model is that of the refit, so that the line does not count as discrepancy.
    noise, frequency = refitted.noise(data), last.base_frequency or frequency
    gains, multiples = [], [m for m, _, _ in effect.lines]
    for m in multiples:
        j = ordinates_near(m * frequency, data, ORDINATES_BESIDE_LINE)
        line = line_ordinates(m * frequency, j, data)
        gains.append(regress(line, solution.ordinates[j], noise.variance(j)).gain)
    # With missing samples the bins share degrees of freedom, and logL of the spectrum understates a line.
    risen = refitted.log_likelihood - solution.log_likelihood if data.gain is None else np.inf
    whole = min(sum(gains), risen)
    if whole <= 0.0:
        return None
    # The p-value is that of the strongest line; its frequency was searched.
    judged = min(whole, max(gains))
    cycles = multiples[int(np.argmax(gains))] * frequency * data.duration
    family = Family("line", width=float(trials_at(np.array([cycles]), data.n, data.rate)[0]))
    return Candidate(
        last,
        whole,
        family,
        refitted,
        last.numbers,
        log_p_value=log_p_value(family, judged),
        judged_gain=judged,
        note=_wandering_note(frequency, band[0], band[1] - max(gains), data),
    )


def _clearest_line(ratio: NDArray[np.float64], data: Data) -> tuple[int, float]:
    """Pair (index, height): the most significant spectral line of a periodogram.

    `ratio` is the periodogram divided by its expectation; index k is the frequency of k/2 cycles per record. `height` is
    `ratio` at the line minus ln of the number of trials, nats. It is −inf if no peak is above 6 nats.
    """
    # Octaves and known frequencies have their own shares of the trials.
    octaves = [(2**k, 2 ** (k + 1)) for k in range(1, (ratio.size - 1).bit_length())]
    known = 2.0 * data.n / data.rate * known_bands(data.n, data.rate)
    ranges = [*octaves, *((int(np.ceil(low)), int(high) + 1) for low, high in known)]
    ranges = [(low, high) for low, high in ranges if low < min(high, ratio.size)]
    tops = np.array([low + int(np.argmax(ratio[low:high])) for low, high in ranges])
    surplus = ratio[tops] - np.log(trials_at(tops / 2.0, data.n, data.rate))
    surplus[ratio[tops] <= MIN_LINE_PEAK] = -np.inf
    best = int(np.argmax(surplus))
    return int(tops[best]), float(surplus[best])


def _line_indices(ratio: NDArray[np.float64], data: Data) -> list[int]:
    """List of the indices of at most 32 separate spectral lines of the periodogram `ratio`, most significant first.

    A line has a ratio above 6 and at least 3 above ln of the number of trials.
    """
    left, found = ratio.copy(), []
    for _ in range(MAX_EVENTS):
        top, above = _clearest_line(left, data)
        if left[top] <= MIN_LINE_PEAK or above < MAX_RIVAL_LOG_EVIDENCE:
            break
        found.append(top)
        _remove_line(left, top, LINE_HALF_WIDTH)
    return found


def evenly_spaced(
    ratio: NDArray[np.float64],
    places: Sequence[int],
    harmonics: int = 1,
    no_comb: set[tuple[int, int]] | None = None,
) -> tuple[float, list[float]] | None:
    """Pair (lowest, multiples) of the evenly spaced lines of a periodogram that are most complete; or None.

    `ratio` is the periodogram divided by its expectation. The distances of any two of `places`, indices of the clearest
    lines, are tried as spacing. `multiples` are the lines, ascending, divided by the lowest one. Their frequencies are
    those of a straight line through the maxima.

    At least 5 lines, and more than `harmonics`, must stand out, at 60 % of the positions from the lowest to the highest.
    Most complete means the largest number of lines minus 60 % of these positions. Lines that are harmonics of their spacing
    are left out. Lines on both sides of the multiples of the spacing are one comb (`_both_sides`).

    Pairs of places in `no_comb` are skipped. Pairs with too few lines are added to it, since they gain no line while other
    lines are removed from `ratio`.
    """
    no_comb = set() if no_comb is None else no_comb
    best: tuple[float, float, list[float]] | None = None
    pairs = sorted({*itertools.combinations(sorted(places), 2)} - no_comb)
    if not pairs:
        return None  # as in most records; the maxima of a long periodogram take time
    highest = ratio[4:].copy()
    for k in range(4):
        np.maximum(highest, ratio[k : k - 4], out=highest)
    stands_out_at = np.append([False] * 2, highest > MIN_DELTA_LOGL_OVER_SIMPLER + np.log(5.0))
    for a, b in pairs:
        start, step, reach, peaks = float(a), float(b - a), 2, np.zeros(0)
        # The spacing is known better the more lines are used.
        while step > 2.0 * MAX_LINE_BAND_DISTANCE and reach * step < 2.0 * ratio.size:
            reach *= 2
            order, peaks = _teeth(ratio, stands_out_at, start, step, reach)
            if peaks.size < 3:
                break
            start, step = _straight_line(order, peaks)
        if (
            peaks.size < MIN_SPACED_LINES
            or abs(start / step - round(start / step)) * step <= TOOTH_TOLERANCE
        ):
            no_comb.add((a, b))
            continue
        stands_out = np.zeros(int(np.ptp(order)) + 1)
        stands_out[order - order[0]] = 1.0
        total = np.append(0.0, np.cumsum(stands_out - MIN_COMB_FRACTION))
        last = int(np.argmax(total - np.minimum.accumulate(total)))
        first = int(np.argmin(total[: last + 1]))
        inside = order[(order >= order[0] + first) & (order < order[0] + last)]
        complete = float(total[last] - total[first])
        if inside.size > max(harmonics, MIN_SPACED_LINES - 1) and (
            best is None or complete > best[0]
        ):
            lines = _both_sides(start + inside * step, step, ratio, stands_out_at)
            best = complete, float(lines[0]), [float(line / lines[0]) for line in lines]
    return None if best is None else best[1:]


def _straight_line(order: NDArray[np.int64], places: Array) -> tuple[float, float]:
    """Pair (start, step) of the line `start` + order·`step` through `places`; ten times as fast as `np.polyfit`."""
    apart = order - order.mean()
    step = float(apart @ places) / float(apart @ apart)
    return float(places.mean()) - step * float(order.mean()), step


def _both_sides(lines: Array, step: float, ratio: Array, stands_out_at: NDArray[np.bool_]) -> Array:
    """Indices of evenly spaced `lines` of a periodogram and of their mirror images, ascending; or `lines` alone.

    A line that modulates a pulse train, or that is sampled and held, has an image on both sides of every multiple of
    `step`. At least 60 % of the images up to the highest line must stand out.
    """
    offset = lines[0] % step
    # Images so close to the lines are the lines themselves, or their leakage.
    if abs(2.0 * offset / step - round(2.0 * offset / step)) * step <= 2 * LINE_HALF_WIDTH:
        return lines
    order, peaks = _teeth(ratio, stands_out_at, -offset, step, ratio.size)
    inside = peaks < lines[-1] + step
    order, peaks = order[inside], peaks[inside]
    possible = int((lines[-1] + step + offset) / step)
    if order.size < max(MIN_SPACED_LINES, MIN_COMB_FRACTION * possible):
        return lines
    start, own_step = _straight_line(order, peaks)
    images = start + order * own_step
    # Another comb has other places.
    is_image = np.abs(images - (order * step - offset)).max() <= TOOTH_TOLERANCE
    return np.sort(np.append(lines, images)) if is_image else lines


def _teeth(
    ratio: NDArray[np.float64],
    stands_out_at: NDArray[np.bool_],
    start: float,
    step: float,
    reach: int,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Pair (order, maximum): lines of the comb `start` + order·`step` that stand out in a periodogram, order ≤ `reach`.

    `stands_out_at` is True for the indices at most two away from a value above 8 plus ln of the number of values searched.
    """
    first, last = ((end - start) / step for end in (0, ratio.size))
    order = np.arange(max(-reach, int(first) - 1), min(reach, int(last) + 1) + 1)
    center = np.round(start + order * step).astype(np.int64)
    inside = (center >= 4) & (center < ratio.size - 4)
    order, center = order[inside], center[inside]
    there = stands_out_at[center]
    order, center = order[there], center[there]
    near = ratio[center[:, None] + np.arange(-TOOTH_TOLERANCE, TOOTH_TOLERANCE + 1)]
    return order, _maxima(ratio, center + near.argmax(axis=1) - TOOTH_TOLERANCE)


def _line_set(places: list[int], ratio: NDArray[np.float64]) -> tuple[float, list[float]]:
    """Pair (lowest, multiples) of the lines at the indices `places`, first moved to the maxima of `ratio` near them.

    `lowest` is an index with a fraction; `multiples` are all lines, ascending, divided by it.
    """
    peaks = _maxima(ratio, np.sort(np.array(places)))
    return float(peaks[0]), [float(peak / peaks[0]) for peak in peaks]


def _maxima(ratio: NDArray[np.float64], at: NDArray[np.int64]) -> NDArray[np.float64]:
    """Places of the maxima of the periodogram `ratio` near the indices `at`, by parabolas through the logarithms."""
    before, here, after = (np.log(np.maximum(ratio[at + d], 1e-3)) for d in (-1, 0, 1))
    shift = 0.5 * (before - after) / np.minimum(before - 2.0 * here + after, -1e-3)
    return np.asarray(at + np.clip(shift, -0.5, 0.5))


def _remove_line(ratio: NDArray[np.float64], place: int, reach: int) -> None:
    """Set a line of the periodogram `ratio`, from `place` − `reach` to `place` + `reach`, and its side lobes to 0.

    A side lobe d half cycles from the line has sin²(πd/2)/(πd/2)² of its power.
    """
    first = max(0, place - reach)
    height = float(ratio[first : place + reach + 1].max(initial=0.0))
    beyond = int(2.0 / np.pi * np.sqrt(height / MIN_LINE_PEAK))
    ratio[max(0, first - beyond) : place + reach + beyond + 1] = 0.0


def _periodic_effects(
    start: float, multiples: Sequence[float], solution: Solution, data: Data
) -> Iterator[Deterministic]:
    """Iterator over effects with a line at `start`, Hz, and its `multiples`, one for each suitable kind of the catalog.

    The kinds come in reverse order of the catalog, so those of users come first.
    """
    for cls in reversed(tuple(CATALOG)):
        if cls.screened == "line" and issubclass(cls, Deterministic):
            found = cls.at(start, multiples)
            if found is not None and cls.candidates(solution.model, data.covariates):
                yield found


def _best_width(top: int, solution: Solution, data: Data, level: float) -> tuple[int, float]:
    """Pair: half-width, in ordinates, and ΔlogL of the narrow-band noise that explains a line at the ordinate `top` best.

    Half-widths of 1 and 2 are returned as 0, and so is a larger one that beats them by less than 8 nats. If `level` is
    above 1, the noise near the line is first divided by its own median, if that is higher than expected.
    """
    j = np.arange(
        max(1, top - WIDTH_ORDINATES),
        min(solution.ordinates.size, top + WIDTH_ORDINATES),
        dtype=np.int64,
    )
    z = solution.ordinates[j] ** 2 / solution.noise(data).variance(j)
    z /= max(float(np.median(z)) / MEDIAN_CHI2_1, 1.0) if level > 1.0 else 1.0
    gains = {}
    for half in (1, 2, 4, 8, 16, 32, 64):
        shape = 1.0 / (1.0 + ((j[:, None] - top) / half) ** 2)
        height = np.geomspace(0.1, 10.0 * max(float(z.max()), 1.0), 40)
        total = 1.0 + shape * height
        gain = (0.5 * z[:, None] * (1.0 - 1.0 / total) - 0.5 * np.log(total)).sum(0).max()
        gains[half] = float(gain)
    best = max(gains, key=lambda half: gains[half])
    wide = gains[best] > max(gains[1], gains[2]) + MIN_DELTA_LOGL_OVER_SIMPLER
    return (best if wide else 0), gains[best]


def _wandering_note(frequency: float, width: int, surplus: float, data: Data) -> str:
    """Sentence that a line is a narrow band of noise, with its half-width in ordinates; "" if the line is a pure line.

    `surplus` is the ΔlogL of the band minus that of a pure line.
    """
    if width == 0 or surplus < MIN_DELTA_LOGL_OVER_SIMPLER:
        return ""
    hertz = width * data.rate / (2.0 * data.n)
    return (
        f"It is not a pure line: it wanders by ±{hertz:.2g} Hz. A narrow resonance at {frequency:.4g} Hz "
        f"(damping {hertz / frequency:.2g}) fits clearly better (ΔlogL {surplus:.0f})"
    )


def _fundamental_and_multiples(
    ratio: NDArray[np.float64], top: int, width: int
) -> tuple[int, list[int]]:
    """Pair (index, multiples): fundamental frequency of the line at index `top`, and its harmonics, such as [1, 2, 3].

    The fundamental `top`, `top`/2, `top`/3, … with the most harmonics above the noise is taken. Harmonics 1 … 12 count for
    `top` … `top`/3, those up to the 64th while at least 60 % of all lower harmonics are there.
    """
    best = (top, [1])
    for divisor in range(1, MAX_PULSE_HARMONIC // 2 + 1):
        base = round(top / divisor)
        if base < 4 * MIN_PERIODS + 2 * width:
            break
        highest = min(MAX_PULSE_HARMONIC, (ratio.size - 2) // base)
        multiples = _harmonics_found(ratio, top, divisor, width, highest)
        if multiples[:1] != [1]:
            continue
        # Unrelated lines lie at a few multiples by chance, but not at most of the lowest ones.
        dense = max(k for k, m in enumerate(multiples, 1) if k >= MIN_COMB_FRACTION * m)
        few = sum(m <= MAX_LINE_HARMONIC for m in multiples) * (divisor <= MAX_FUNDAMENTAL_DIVISOR)
        if max(dense, few) > len(best[1]):
            best = (base, multiples[: max(dense, few)])
    return best


def _harmonics_found(
    ratio: NDArray[np.float64], top: int, divisor: int, width: int, highest: int
) -> list[int]:
    """Ascending list of the multiples of the frequency `top`/`divisor`, up to `highest`, that stand out of the noise.

    A peak stands out if it is above 8 plus ln of the number of values searched for it. Its maximum, by a parabola, must lie
    at the multiple: the flank of a line beside it is no harmonic.
    """
    found = []
    exact = float(_maxima(ratio, np.array([top]))[0]) if top + 1 < ratio.size else float(top)
    for m in range(1, highest + 1):
        # The place of the line is known to half an ordinate plus its width; fractions scale with it.
        place = round(m * top / divisor)
        reach = 1 + m * (1 + width) // divisor
        first = max(0, place - reach)
        near = ratio[first : place + reach + 1]
        if near.size and near.max() > MIN_DELTA_LOGL_OVER_SIMPLER + np.log(near.size):
            at = min(first + int(near.argmax()), ratio.size - 2)
            apart = abs(float(_maxima(ratio, np.array([at]))[0]) - m * exact / divisor)
            if apart <= 1.0 + m * (0.5 + width) / divisor:
                found.append(m)
    return found
