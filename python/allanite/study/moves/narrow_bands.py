"""Harmonics and side bands of a narrow band: the m-th harmonic of a wandering line wanders m times as far."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOG, Effect, Model, Stochastic
from allanite.fit import refitted
from allanite.fit.likelihood.peaks import has_ordinates_near
from allanite.fit.likelihood.whitened import whitened_ordinates
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.study.judgement import no_error_rises, score_change
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAIN_SHARE,
    MAX_LINE_HARMONIC,
    MAX_SIDE_BAND_FRACTION,
    MIN_SIDE_BAND_HALF_WIDTHS,
)
from allanite.suggestion.p_values import min_significant_score
from allanite.suggestion.screens.drifting_bands import bands_that_may_move, screen_drifting_bands

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.study.state import State


def with_harmonics_or_side_bands(before: State, after: State) -> State:
    """`State` in which a newly added narrow band, the last effect, also has side bands, or else harmonics; else `after`.

    A result that lets an error rise beyond its scatter is not used.
    """
    place = len(after.fit.model) - 1
    band = after.fit.model.effects[place]
    if after.new_since(before)[:1] != (place,) or not _is_band(band, before.fit.data):
        return after
    modulated = _with_side_bands(after, place)
    if modulated is not after and not _has_moving_frequency(after.fit, band):
        return modulated if no_error_rises(after.fit, modulated.fit) else after
    fit = _with_harmonics(after.fit, band)
    better = fit is not after.fit and no_error_rises(after.fit, fit)
    return after.after(fit) if better else after


def _is_band(effect: Effect, data: Data) -> bool:
    """True if the effect is a noise band with free shapes, and single frequencies of the record are kept near it."""
    if not isinstance(effect, Stochastic) or effect.occupies is None:
        return False
    free = len(effect.free_shapes) == sum(p.role == "shape" for p in effect.parameters)
    return free and effect.banded(1.0, 1.001) is not None and has_ordinates_near(effect, data)


def _has_moving_frequency(fit: Fit, band: Effect) -> bool:
    """True if the center frequency of the fitted `band` changes over the record with a p-value below 1 %."""
    bands = [b for b in bands_that_may_move(fit.solution, fit.data) if b.effect is band]
    found = screen_drifting_bands(bands, fit.solution, fit.data)
    return any((c.log_p_value or 0.0) < np.log(FALSE_ALARM_PROBABILITY) for c in found)


def _modulated_effect(band: Effect, rate: float, depth: float) -> Stochastic | None:
    """Effect of the catalog that is the `band` with sidebands at ±`rate` Hz and modulation `depth`; or None."""
    kinds = (cls for cls in CATALOG if issubclass(cls, Stochastic))
    made = (cls.like(band, modulation=rate, depth=depth) for cls in kinds)
    return next((effect for effect in made if effect is not None), None)


def _with_harmonics(fit: Fit, effect: Effect) -> Fit:
    """`Fit` with the harmonics (up to the 12th) of a narrow band that raise the score by 3 nats, lowest first.

    The same fit if none does, or if the 12th harmonic is so wide that it overlaps the next.
    """
    assert isinstance(effect, Stochastic)
    assert effect.occupies is not None
    low, high = effect.occupies
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    data = fit.data
    if 2.0 * MAX_LINE_HARMONIC * half > middle:
        return fit
    white = _relative_power(fit)
    for m in range(2, MAX_LINE_HARMONIC + 1):
        # The phase of the m-th harmonic wanders m times as far. If it is a random walk, the band is m² times as wide.
        wide = m * m * half
        first, last = (round(2.0 * (m * middle + s * wide) * data.duration) for s in (-1.0, 1.0))
        if last >= white.size or first < 1:
            break
        excess = white[first : last + 1]
        count = excess.size
        if (excess.mean() - 1.0) * np.sqrt(0.5 * count) < min_significant_score(MAX_LINE_HARMONIC):
            continue
        there = [e.occupies for e in fit.model if e.occupies is not None]
        if any(b > m * middle - wide and a < m * middle + wide for a, b in there):
            continue
        made = effect.banded(m * low, m * high)
        assert made is not None
        power = _excess_variance(fit, first, last, float(excess.mean()))
        added = made.with_values(**{effect.coefficient: float(np.sqrt(power))})
        better = refitted(fit, Model((*fit.model.effects, added)))
        own = better.model.effects[-1]
        if own.occupies is None:
            continue
        at = 0.5 * sum(own.occupies)
        close = abs(at - m * middle) < wide
        if close and score_change(fit, better) > MAX_RIVAL_LOG_EVIDENCE:
            fit = better
            white = _relative_power(fit)
    return fit


def _with_side_bands(state: State, place: int) -> State:
    """`State` in which a modulated band replaces the band at index `place`; or the same state.

    Side bands lie at equal distances on both sides of a narrow band, and have its width. The distance at which their power
    stands out most is tried. The score must rise by more than 3 nats plus ln of the number of possible distances. It must
    also be higher than with a separate band on only one side.
    """
    fit = state.fit
    effect, data = fit.model.effects[place], fit.data
    if not _is_band(effect, data):
        return state
    assert isinstance(effect, Stochastic)
    if not effect.values[effect.coefficient]:
        return state
    assert effect.occupies is not None
    low, high = (2.0 * data.duration * f for f in effect.occupies)
    middle, half = round(0.5 * (low + high)), max(1, round(0.5 * (high - low)))
    first = int(MIN_SIDE_BAND_HALF_WIDTHS * half)
    last = min(
        int(MAX_SIDE_BAND_FRACTION * middle), fit.solution.ordinates.size - 1 - middle - 2 * half
    )
    if last - first < 4 * half or _modulated_effect(effect, 1.0, 1.0) is None:
        return state
    sides = _mean_power_beside(fit, effect, middle, half, first, last)
    score = (sides - 1.0) * np.sqrt(half + 0.5)
    distances = (last - first) / half
    least = min_significant_score(distances)
    best = int(np.argmax(score.sum(axis=0) * (score.min(axis=0) > MAIN_SHARE * least)))
    if score[:, best].sum() < np.sqrt(2.0) * least or score[:, best].min() < MAIN_SHARE * least:
        return state
    apart = first + best
    power = [
        _excess_variance(fit, middle + s * apart - half, middle + s * apart + half, m)
        for s, m in ((-1, sides[0, best]), (1, sides[1, best]))
    ]
    strength = float(np.mean(power)) / float(effect.values[effect.coefficient]) ** 2
    made = _modulated_effect(effect, apart / (2.0 * data.duration), 2.0 * float(np.sqrt(strength)))
    assert made is not None
    effects = fit.model.effects
    better = refitted(fit, Model((*effects[:place], *effects[place + 1 :], made)))
    # The best of many distances leads by chance, so it pays for their number.
    if score_change(fit, better) <= MAX_RIVAL_LOG_EVIDENCE + float(np.log(distances)):
        return state
    # Another band on one side also raises the mean of both sides.
    shift = (apart if power[1] > power[0] else -apart) / (2.0 * data.duration)
    one = effect.banded(*(f + shift for f in effect.occupies))
    assert one is not None
    one = one.with_values(**{one.coefficient: float(np.sqrt(max(power)))})
    one_sided = refitted(fit, Model((*effects, one)))
    return state.after(better, (place,)) if score_change(one_sided, better) > 0.0 else state


def _mean_power_beside(
    fit: Fit, band: Effect, middle: int, half: int, first: int, last: int
) -> NDArray[np.float64]:
    """Mean relative power at the distances `first` … `last` below and above the middle of a band, shape (2, distances).

    It is 0 at the peaks of other effects of the model, which are no side bands.
    """
    total = np.cumsum(_relative_power(fit)[middle - last - 2 * half : middle + last + 2 * half + 1])
    mean = (total[2 * half :] - np.append(0.0, total[: -2 * half - 1])) / (2 * half + 1)
    own, distances = mean.size // 2, np.arange(first, last + 1)
    sides = np.array([mean[own - distances], mean[own + distances]])
    for peak in (peak for e in fit.model if e is not band for peak in e.peaks):
        for at in (round(2.0 * fit.data.duration * f) - middle for f in peak):
            sides[int(at > 0), abs(distances - abs(at)) <= 2 * half] = 0.0
    return sides


def _excess_variance(fit: Fit, first: int, last: int, mean: float) -> float:
    """Variance of the samples, U², that exceeds the model between the ordinates `first` and `last` (inclusive); at least 0.

    `mean` is the mean ratio of measured to expected power at these ordinates.
    """
    power = float(np.sum(fit.solution.ordinates[first : last + 1] ** 2))
    return power * max(1.0 - 1.0 / mean, 0.0) / fit.data.n


def _relative_power(fit: Fit) -> NDArray[np.float64]:
    """Array of the residual power at each single frequency (ordinate) divided by its expected power, shape (n,)."""
    white = whitened_ordinates(fit.solution, fit.data, np.ones(fit.solution.count.size))
    return np.square(white, out=white)
