"""Screen of tone bursts: lines that are present for a part of the record.

A resonance has the width of a burst but not its phase. A line has its phase but at the wrong times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.fit.rivals.line_trials import line_trials
from allanite.fit.shapes.drifting import MAX_EXHAUSTIVE_FREQUENCIES, Band
from allanite.fit.shapes.tones import (
    effective_trials,
    place_burst,
    polish_burst,
    relative_power,
    search_burst,
    steady_line_gain,
)
from allanite.suggestion.constants import (
    MIN_DELTA_LOGL_OVER_SIMPLER,
    MIN_PERIODS,
)
from allanite.suggestion.p_values import Family, log_p_value, may_become_significant
from allanite.suggestion.screens._screen import Candidate, Context, Screen
from allanite.suggestion.screens.drifting_lines import (
    bands_with_excess,
    blanks_of_screen,
    solved_with,
)

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple with at most one refitted `Candidate` of each kind of tone burst: the best burst.

    It must explain more than the lines and bands that last. Bands of more than 4096 values are not searched.
    """
    solution, data = context.solution, context.data
    lasting = tuple(c for name in SCREEN.after for c in context.found[name])
    # A burst does not drift, so wide bands are not needed.
    bands = context.shared(bands_with_excess)
    bands = tuple(band for band in bands if band.series.size <= MAX_EXHAUSTIVE_FREQUENCIES)
    blanks = blanks_of_screen("passing line", solution, data)
    found = (_best_candidate(blank, bands, lasting, solution, data) for blank in blanks if bands)
    return tuple(c for c in found if c is not None)


SCREEN = Screen(
    "tone bursts",
    "lines that are present for a part of the record: all intervals of time in bands with excess power",
    "both",
    look,
    after=("lines", "drifting lines", "spectral"),
    needs_samples=True,
    searches=lambda _: 0,
)


def _best_candidate(
    blank: Deterministic,
    bands: tuple[Band, ...],
    lasting: tuple[Candidate, ...],
    solution: Solution,
    data: Data,
) -> Candidate | None:
    """Refitted `Candidate` of the best tone burst, a sinusoid between two times; or None.

    Its ΔlogL, divided by the relative noise power during the burst, must be 8 above that of a line over the whole record,
    and of a nearby line or band in `lasting`. Bursts that a moving band passes or another burst overlaps are omitted, as
    those with which the model still has a discrepancy.
    """
    noise, T = solution.noise(data), data.duration
    tried = [(band, search_burst(band)) for band in bands]
    band, (middle, first, last, _) = max(tried, key=lambda one: one[1][3])
    middle, first, last, search_gain = place_burst(band, middle, first, last)
    # A segment that is loud at all frequencies is no line: divide by its loudness.
    loud = relative_power(band, middle, first, last)
    search_gain /= loud
    frequency = middle / T
    there = [c.gain for c in lasting if _is_near(c, frequency, 1.0 / ((last - first) * T))]
    least = max([*there, steady_line_gain(band, middle) / loud]) + MIN_DELTA_LOGL_OVER_SIMPLER
    family = Family("line", width=line_trials(data.n) * effective_trials(band))
    if search_gain < least or frequency <= 0.0:
        return None
    if not may_become_significant(family, search_gain):
        return None
    if middle * (last - first) < MIN_PERIODS or _is_on_course(frequency, solution):
        return None
    effect = blank.with_values(
        frequency=frequency, start=data.start + first * T, end=data.start + last * T
    )
    effect = polish_burst(effect, solution.ordinates, noise, data)
    refitted, burst, gain = solved_with(effect, solution, data)
    # A line that swells and fades must not become two overlapping bursts.
    if any(_is_same_line(other, burst) for other in solution.model.deterministic):
        return None
    gain /= loud
    # A series of bursts describes anything, so a burst is accepted only if no discrepancy remains.
    if gain < least or refitted.discrepancy > 0.0:
        return None
    return Candidate(burst, gain, family, refitted, 5, log_p_value=log_p_value(family, gain))


def _is_on_course(frequency: float, solution: Solution) -> bool:
    """True if the frequency, Hz, lies in the range of a moving band of the model, which may look like a burst there."""
    courses = [e.occupies for e in solution.model if e.moving]
    return any(course is not None and course[0] <= frequency <= course[1] for course in courses)


def _is_same_line(one: Deterministic, other: Deterministic) -> bool:
    """True if two tone bursts of a kind overlap in time, and their frequencies differ by less than 1/(shorter length)."""
    if one.kind != other.kind or one.when is None or other.when is None:
        return False
    (f, _), (g, _) = one.occupies or (0.0, 0.0), other.occupies or (0.0, 0.0)
    start, end = max(one.when[0], other.when[0]), min(one.when[1], other.when[1])
    length = min(one.when[1] - one.when[0], other.when[1] - other.when[0])
    return end > start and abs(f - g) * length < 1.0


def _is_near(candidate: Candidate, frequency: float, width: float) -> bool:
    """True if the candidate is a line, band or gap whose range contains the frequency, Hz, or is at most `width` away."""
    place = candidate.effect.occupies
    return place is not None and place[0] - width <= frequency <= place[1] + width
