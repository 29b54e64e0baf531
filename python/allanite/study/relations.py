"""Relations between effects: at one feature of the spectrum, inside an excluded segment, parts of one wandering line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic, Effect, Modifier
from allanite.suggestion.constants import (
    MAX_BAND_WIDTH_RATIO,
    MAX_EXPLAINED_REMAINDER,
    MAX_LINE_BAND_DISTANCE,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.fit.result import Fit


def is_same_feature(one: Effect, other: Effect, fit: Fit) -> bool:
    """True if two effects describe one hump or gap of the spectrum.

    * A line within 10/T of a band. T is the duration of the record.
    * Two bands, one with its middle in the other, whose half-widths differ by less than a factor of 3.
    * An effect whose middle is in the range of a moving band.
    * A band or line, and a notch that overlaps it or is within 10/T.

    False for two lines, two filters, or an effect without a frequency.
    """
    a, b = one.occupies, other.occupies
    if a is None or b is None:
        return False
    if isinstance(one, Modifier) and isinstance(other, Modifier):
        return False
    lines = (a[0] == a[1]) + (b[0] == b[1])
    if lines == 2:
        return False
    for effect, (low, high), (first, last) in ((one, a, b), (other, b, a)):
        if effect.moving and low <= 0.5 * (first + last) <= high:
            return True
    if not (lines or isinstance(one, Modifier) or isinstance(other, Modifier)):
        widths = sorted((0.5 * (a[1] - a[0]), 0.5 * (b[1] - b[0])))
        return 0.5 * abs(sum(a) - sum(b)) < widths[1] < MAX_BAND_WIDTH_RATIO * widths[0]
    apart = max(a[0], b[0]) - min(a[1], b[1])
    return apart <= MAX_LINE_BAND_DISTANCE / fit.data.duration


def line_distance(one: Effect, other: Effect) -> float:
    """Distance of the frequencies of two lines, Hz; infinite if one of the effects has no frequency."""
    a, b = one.occupies, other.occupies
    return abs(a[0] - b[0]) if a is not None and b is not None else np.inf


def lies_mostly_within(effect: Effect, when: tuple[float, float], fit: Fit) -> bool:
    """True if most of an effect lies between the two times `when`, s. False for effects without times.

    * Outliers: at least half of the single samples.
    * A function of time, or a noise level over time: at least 90 % of its squared deviation from the mean at other
      times.
    * An excluded segment: at least half of it.
    * A change of level of one band: at least half of its interval, or of the rest of the record.
    """
    first, last = when
    if isinstance(effect, Modifier) and effect.moments:
        inside = sum(first <= moment <= last for moment in effect.moments)
        return 2 * inside >= len(effect.moments)
    course = _values_over_time(effect, fit)
    if course is not None:
        time = fit.data.time
        there = (first <= time) & (time <= last)
        course = (course - course[~there].mean()) ** 2 if not there.all() else course
        return bool(course[there].sum() >= (1.0 - MAX_EXPLAINED_REMAINDER) * course.sum())
    if not isinstance(effect, Modifier) or effect.when is None:
        return False
    begin, end = effect.when
    shared = max(0.0, min(end, last) - max(begin, first))
    within = 2.0 * shared >= end - begin
    without = 2.0 * (last - first - shared) >= fit.data.duration - (end - begin)
    return (effect.removes and within) or (effect.changes_level and (within or without))


def _values_over_time(effect: Effect, fit: Fit) -> NDArray[np.float64] | None:
    """Values of a function of time, or gain of a level of all frequencies, shape (n,); None for other effects."""
    if isinstance(effect, Deterministic) and not effect.periodic:
        return fit.data.signal((effect,))
    if isinstance(effect, Modifier) and effect.changes_level and effect.band is None:
        return effect.gain(fit.data.time, fit.data.covariates)
    return None
