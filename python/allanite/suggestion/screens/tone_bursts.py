"""Candidate tone bursts: lines that are there for a part of the record.

A resonance has the width of a burst and not its phase; a line has its phase for the wrong time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Moving
from allanite.fit.likelihood.discrepancy import EVIDENCE, best_scale, judge
from allanite.fit.shapes.drifting import MOST_WIDTH, Band
from allanite.fit.shapes.tones import louder, placed, polish_burst, search_burst, steady, trials
from allanite.suggestion.constants import MIN_BURST_CYCLES, MIN_DELTA_LOGL_OVER_SIMPLER
from allanite.suggestion.p_values import Family, line_trials, log_chance, may_show
from allanite.suggestion.screens.drifting_lines import wanted, with_it
from allanite.suggestion.screens.spectral import Candidate

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["screen_tones"]


def screen_tones(
    bands: tuple[Band, ...], lasting: tuple[Candidate, ...], solution: Solution, data: Data
) -> tuple[Candidate, ...]:
    """The best burst of each kind of the catalogue, refitted, where it beats the lines and bands that are `lasting`."""
    # A line that stays where it is needs no wide band.
    bands = tuple(band for band in bands if band.series.size <= MOST_WIDTH)
    blanks = wanted("passing line", solution, data)
    found = (_best(blank, bands, lasting, solution, data) for blank in blanks if bands)
    return tuple(c for c in found if c is not None)


def _best(
    blank: Deterministic,
    bands: tuple[Band, ...],
    lasting: tuple[Candidate, ...],
    solution: Solution,
    data: Data,
) -> Candidate | None:
    noise, T = solution.noise(data), data.duration
    tried = [(band, search_burst(band)) for band in bands]
    band, (middle, first, last, _) = max(tried, key=lambda one: one[1][3])
    middle, first, last, hope = placed(band, middle, first, last)
    # A stretch that is loud at all frequencies has no line.
    loud = louder(band, middle, first, last)
    hope /= loud
    frequency = middle / T
    there = [c.gain for c in lasting if _at(c, frequency, 1.0 / ((last - first) * T))]
    least = max([*there, steady(band, middle) / loud]) + MIN_DELTA_LOGL_OVER_SIMPLER
    family = Family("line", width=line_trials(data.n) * trials(band))
    if hope < least or frequency <= 0.0 or not may_show(family, hope):
        return None
    if middle * (last - first) < MIN_BURST_CYCLES or _on_a_course(frequency, solution):
        return None
    if _wrong_elsewhere(frequency, 1.0 / ((last - first) * T), solution, data):
        return None
    effect = blank.with_values(
        frequency=frequency, start=data.start + first * T, end=data.start + last * T
    )
    effect = polish_burst(effect, solution.ordinates, noise, data)
    refitted, burst, gain = with_it(effect, solution, data)
    # What swells and fades is no two bursts at a time.
    if any(_overlap(other, burst) for other in solution.model.deterministic):
        return None
    gain /= loud
    # Bursts one after the other describe anything: one is believed where nothing else is left.
    if gain < least or refitted.discrepancy > 0.0:
        return None
    return Candidate(burst, gain, "line", refitted, 5, log_chance=log_chance(family, gain))


def _on_a_course(frequency: float, solution: Solution) -> bool:
    """Whether a band of the model that moves passes a frequency: where it turns back it stands still for a while."""
    courses = [e.occupies for e in solution.model if isinstance(e, Moving)]
    return any(course is not None and course[0] <= frequency <= course[1] for course in courses)


def _wrong_elsewhere(frequency: float, width: float, solution: Solution, data: Data) -> bool:
    """Whether a model has a discrepancy in the bins farther than a width from a frequency."""
    edges = data.bins.edges / (2.0 * data.duration)
    far = (edges[1:] < frequency - width) | (edges[:-1] > frequency + width)
    if solution.best.scale is None or not far.any():
        return False
    part = solution.power[far], solution.count[far], solution.spectrum[far]
    return best_scale(*part)[1] > judge(*part, None).log_likelihood + EVIDENCE


def _overlap(one: Deterministic, other: Deterministic) -> bool:
    """Whether both are bursts of one line, at least for a while at the same time."""
    if one.kind != other.kind or one.when is None or other.when is None:
        return False
    (f, _), (g, _) = one.occupies or (0.0, 0.0), other.occupies or (0.0, 0.0)
    start, end = max(one.when[0], other.when[0]), min(one.when[1], other.when[1])
    length = min(one.when[1] - one.when[0], other.when[1] - other.when[0])
    return end > start and abs(f - g) * length < 1.0


def _at(candidate: Candidate, frequency: float, width: float) -> bool:
    """Whether a line or a band explains what is within a width of a frequency."""
    place = candidate.effect.occupies
    return place is not None and place[0] - width <= frequency <= place[1] + width
