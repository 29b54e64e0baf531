"""Screen of changes of the noise level, after the outliers that would be taken for them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Modifier
from allanite.fit.engine import solve
from allanite.fit.likelihood.changing_power import mean_squared_level, peak_level
from allanite.fit.likelihood.whitened import Whitened, end_samples, white_power, whiten
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    LEVEL_CELLS,
    MAIN_SHARE,
    MIN_POWER_VALUES,
)
from allanite.suggestion.p_values import best_interval
from allanite.suggestion.screens._screen import Candidate, Context, Screen
from allanite.suggestion.screens.band_levels import best_levels, screen_band_level
from allanite.suggestion.screens.exclusions import screen_outliers
from allanite.suggestion.screens.level_borders import (
    borders_between_values,
    borders_within_cells,
    interval_powers,
    refined_interval,
)
from allanite.suggestion.screens.level_forms import (
    LEVELS,
    Series,
    is_deformed_by_rounding,
    level_effect,
    refined_gate,
    screen_columns,
    screen_cycle,
    screen_several,
    series_of,
)

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple of refitted `Candidate` of outliers and of the best changes of the noise level."""
    given = context.solution, context.data, context.whitened
    outliers, levels = _outliers_and_levels(*given)
    levels = best_levels((*levels, screen_band_level(*given)), context.data.n)
    return (*levels, *(() if outliers is None else (outliers,)))


#: Searches: outliers, and levels of one interval, several intervals, a period, one band, and each logged column.
SCREEN = Screen(
    "levels",
    "changes of the noise level of all frequencies or one band, and outliers, which would be taken for them",
    "both",
    look,
    searches=lambda context: 5 + len(context.data.covariates),
)


def _outliers_and_levels(
    solution: Solution, data: Data, whitened: Whitened
) -> tuple[Candidate | None, list[Candidate]]:
    """Pair: `Candidate` that excludes outliers or None, and list of `Candidate` of changes of the noise level.

    With outliers, the level changes are searched without the outlier samples, and then refitted to the given data. If a
    level change found with all samples also changes the median size of the samples, there are no outliers, only louder
    times. The pair is then None and the level changes found with all samples.
    """
    refit_outliers = screen_outliers(solution, data, whitened.samples)
    found = screen_levels(solution, data, whitened)
    if refit_outliers is None or any(_changes_median_size(c, data, whitened) for c in found):
        return None, found
    outliers = refit_outliers()
    if outliers is None or outliers.solution is None or outliers.data is None:
        return outliers, found
    cleaned = outliers.solution
    found = screen_levels(cleaned, outliers.data, whiten(cleaned, outliers.data))
    return outliers, [_refitted_candidate(c, solution, data) for c in found]


def _changes_median_size(candidate: Candidate, data: Data, whitened: Whitened) -> bool:
    """True if a candidate changes the noise level of most samples, not only of a few outliers.

    Whitened samples where the candidate's level is high are compared with all others. The ratio of the median absolute
    values, minus 1, must exceed half of the ratio of the rms values, minus 1. False for a summary, for a constant level,
    and for a p-value that is above 1 % or unknown.
    """
    effect = candidate.effect
    assert isinstance(effect, Modifier)
    if whitened.samples.size != data.n or candidate.log_p_value is None:
        return False
    gain = effect.gain(data.time, data.covariates)
    loud = gain > np.sqrt(gain.min() * gain.max())
    if candidate.log_p_value > np.log(FALSE_ALARM_PROBABILITY) or loud.all():
        return False
    usual = [float(np.median(np.abs(whitened.samples[part]))) for part in (loud, ~loud)]
    power = [float(np.mean(whitened.samples[part] ** 2)) for part in (loud, ~loud)]
    return usual[0] / usual[1] > 1.0 + MAIN_SHARE * (np.sqrt(power[0] / power[1]) - 1.0)


def screen_levels(solution: Solution, data: Data, whitened: Whitened) -> list[Candidate]:
    """List of refitted `Candidate` of changes of the white-noise level over time; empty if none is found.

    Four forms are searched: one interval, several intervals, a periodic level, and a level that follows a logged column.
    Candidates within 3 nats of the best (ΔlogL minus BIC cost) are returned. Empty if the power over time is not known
    (`level_series`). If the model has a level change already, candidates must make the power clearly steadier.
    """
    series = level_series(solution, data, whitened)
    if series is None:
        return []
    cycle = screen_cycle(series, solution.model)
    if cycle is not None and _repeats_waveform(cycle, data, whitened):
        cycle = None
    found = [c for c in (_one_interval(series, solution), cycle) if c is not None]
    found += screen_columns(series, solution.model, data.covariates)
    found += screen_several(series, solution.model)
    if not found:
        return []
    price = 0.5 * np.log(max(series.freedom * series.power.size, 2.0))
    best = max(c.gain - price * c.parameters for c in found)
    kept = [c for c in found if c.gain - price * c.parameters > best - MAX_RIVAL_LOG_EVIDENCE]
    kept = [
        _refitted_candidate(
            _with_refined_times(c, series, solution, data, whitened), solution, data
        )
        for c in kept
    ]
    if any(effect.changes_level for effect in solution.model.modifiers):
        kept = [c for c in kept if _makes_power_steadier(c, data, series)]
    return kept


def level_series(solution: Solution, data: Data, whitened: Whitened) -> Series | None:
    """`Series`: power of the white noise over time; or None.

    None with fewer than 64 values, or if the samples are so coarsely rounded that the level depends on the bias.
    """
    calm = whitened.without_outliers
    power, share, freedom = white_power(solution, data, calm)
    if power is None or power.size < MIN_POWER_VALUES or is_deformed_by_rounding(data):
        return None
    steady = whitened.with_normal_tails
    judged = power if steady is calm else white_power(solution, data, steady)[0]
    assert judged is not None
    return series_of(power, judged, freedom, share, data.span)


def _repeats_waveform(candidate: Candidate, data: Data, whitened: Whitened) -> bool:
    """True if the loud samples of a periodic noise level repeat a waveform: then it is a spectral line, not a noise level.

    The mean product of the loud samples and those one period later must exceed half of their excess power. False for a
    summary, and for a period of one sample or of the whole record.
    """
    effect = candidate.effect
    assert isinstance(effect, Modifier)
    samples, period = whitened.samples, round(effect.values["period"] * data.rate)
    if samples.size != data.n or not 1 < period < data.n - 1:
        return False
    gain = effect.gain(data.time, data.covariates)
    loud = gain > np.sqrt(gain.min() * gain.max())
    excess = float(np.mean(samples[loud] ** 2) - np.mean(samples[~loud] ** 2))
    # The period is known to one sample.
    alike = [
        float(np.mean((samples[:-shift] * samples[shift:])[loud[:-shift]]))
        for shift in (period - 1, period, period + 1)
    ]
    return max(alike) > MAIN_SHARE * excess


def _makes_power_steadier(candidate: Candidate, data: Data, series: Series) -> bool:
    """True if the white-noise power varies clearly less over time with the refitted model of the candidate than without it.

    The rise of logL of the power must be at least half of the candidate's ΔlogL.
    """
    # The model may contain this change of level already; then the remainder is not white noise.
    assert candidate.solution is not None
    after = white_power(candidate.solution, data, whiten(candidate.solution, data))[0]
    power = series.power
    if after is None or after.size != power.size:
        return True
    seen = (power > 0.0) & (after > 0.0)
    before, after = power[seen] / power[seen].mean(), after[seen] / after[seen].mean()
    return bool(-0.5 * series.freedom * np.log(before / after).sum() >= MAIN_SHARE * candidate.gain)


def _with_refined_times(
    candidate: Candidate, series: Series, solution: Solution, data: Data, whitened: Whitened
) -> Candidate:
    """Copy of a candidate whose times of level changes are refined to single samples, with new factors.

    A summary has no samples; the finest power over time that it keeps is used. A periodic level is refined by
    `_with_refined_gate`. The same candidate is returned if it has no times, and for a summary whose refined times are not
    in order or whose power is not known.
    """
    effect = candidate.effect
    if isinstance(effect, Modifier) and "period" in effect.values:
        return _with_refined_gate(candidate, solution, data, whitened)
    if not isinstance(effect, Modifier) or not effect.switches[0]:
        return candidate
    times, factors = effect.switches
    if whitened.samples.size != data.n:
        # Use the octave that a summary keeps in its shortest segments.
        octaves = [replace(whitened, bands=(band,)) for band in whitened.bands if band[3] != 1.0]
        seen = (white_power(solution, data, octave) for octave in octaves)
        power, share, freedom = next((one for one in seen if one[0] is not None), (None, 0.0, 0.0))
        if power is None:
            return candidate
        cells = Series(power, power, freedom, share, *data.span)
        borders, relative = borders_within_cells(
            power, [cells.place(time) for time in times], factors
        )
        if not all(np.diff(borders) > 0.0):
            return candidate
        factors = tuple(float(np.sqrt(cells.white_ratio(level))) for level in relative)
        return replace(
            candidate, effect=effect.switching_at(tuple(map(cells.time, borders)), factors)
        )
    square = _square_with_ends(whitened)
    places = np.round((np.array(times) - data.start) * data.rate).astype(np.int64)
    places = borders_between_values(square, places, factors, max(1, data.n // LEVEL_CELLS))
    moments = tuple((data.start + places / data.rate).tolist())
    near = np.round([series.place(time) for time in moments]).astype(np.int64)
    levels = interval_powers(series.power, near, factors) / series.power.mean()
    white = np.array([series.white_ratio(float(level)) for level in levels])
    factors = tuple(np.sqrt(white[1:] / white[0]).tolist())
    return replace(candidate, effect=effect.switching_at(moments, factors))


def _with_refined_gate(
    candidate: Candidate, solution: Solution, data: Data, whitened: Whitened
) -> Candidate:
    """Copy of a candidate of a periodic level; period, start, share and factor are refined from single samples."""
    effect = candidate.effect
    if whitened.samples.size != data.n:
        return candidate
    square, values = _square_with_ends(whitened), effect.values
    first = (values["start"] - data.start) * data.rate
    period, first, share = refined_gate(
        square, values["period"] * data.rate, first, values["share"]
    )
    inside = (np.arange(data.n) - first) / period % 1.0 < share
    if inside.all() or not inside.any():
        return candidate
    # Octaves ring beyond an edge and would attenuate the change, so the samples themselves are compared.
    power = whitened.without_outliers.samples**2
    ratio = float(power[inside].mean() / power[~inside].mean())
    factor = float(np.sqrt(max(1e-6, 1.0 + (ratio - 1.0) / _white_fraction(solution))))
    start = data.start + first / data.rate
    gated = effect.with_values(period=period / data.rate, start=start, share=share, factor=factor)
    return replace(candidate, effect=gated)


def _white_fraction(solution: Solution) -> float:
    """Fraction, 0 … 1, of the power of the whitened record that comes from white noise. The model must have white noise."""
    white = next(own for own in solution.processes if own.effect.white)
    return float(solution.count @ (white.power / solution.spectrum) / solution.count.sum())


def _square_with_ends(whitened: Whitened) -> NDArray[np.float64]:
    """Squares of the whitened samples with normal tails, shape (n,).

    The unknown samples at both ends get the mean square of their neighbors, four times as many samples as the end has.
    """
    square = whitened.with_normal_tails.samples**2
    n, ends = square.size, end_samples(square.size)
    square[:ends] = square[ends : 5 * ends].mean()
    square[n - ends :] = square[n - 5 * ends : n - ends].mean()
    return square


def _refitted_candidate(candidate: Candidate, solution: Solution, data: Data) -> Candidate:
    """Copy of the candidate with the refitted solution of the model plus its effect."""
    model = solution.model
    refitted = solve(data, model + candidate.effect, like=solution, settled=len(model), rounds=3)
    return replace(candidate, effect=refitted.model.effects[-1], solution=refitted)


def overdispersion_without(
    base: Solution, data: Data, levels: list[Candidate], searches: int
) -> tuple[float, float]:
    """Pair (overdispersion, largest relative power) that the best significant change of level would cause; or (1, 1).

    The first value is the factor by which the variance of the spectrum is larger than for constant noise.
    """
    significant = [
        c
        for c in levels
        if c.log_p_value is not None
        and c.log_p_value + np.log(searches) < np.log(FALSE_ALARM_PROBABILITY)
    ]
    if not significant:
        return 1.0, 1.0
    model = base.model + max(significant, key=lambda c: c.gain).effect
    return mean_squared_level(model, data), peak_level(model, data)


def _one_interval(series: Series, solution: Solution) -> Candidate | None:
    """`Candidate` (not refitted) for the interval whose white-noise level differs most significantly; or None.

    None if ΔlogL is below 3, or if the level differs from 1 by less than the model discrepancy or its standard error.
    """
    power, size = series.judged, series.judged.size
    cells = min(LEVEL_CELLS, size // 8)
    start, end, gain, log_p = best_interval(power, series.freedom, cells)
    if size > cells:
        # Refining the ends concerns the estimate; the p-value is that of the coarse search.
        start, end, gain = refined_interval(power, series.freedom, start, end, size // cells)
    inside = series.power[start:end].mean()
    outside = np.delete(series.power, np.s_[start:end]).mean() if end - start < size else 1.0
    factor = float(np.sqrt(series.white_ratio(float(inside / outside))))
    times = {"start": series.time(start), "end": series.time(end)}
    effect = level_effect(solution.model, **times, factor=factor)
    # A change smaller than the discrepancy of the model, or than its standard error, is no effect.
    least = max(solution.discrepancy, float(1.0 / np.sqrt(2.0 * series.freedom * (end - start))))
    if effect is None or gain < MAX_RIVAL_LOG_EVIDENCE or abs(factor - 1.0) < least:
        return None
    return Candidate(effect, gain, LEVELS, None, 3, min(0.0, log_p))
