"""Candidate bands that move: each band of a model is looked for in sections of the record.

A band whose frequency changes slowly is wider in the mean spectrum than at any time, with one steep side: others come to
stand for what it leaves. Where it is in each section says more than any shape of the mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Effect, Model, Moving, Stochastic
from allanite.fit.engine import solve
from allanite.suggestion.constants import (
    MAX_SECTIONS,
    MIN_COURSE_HALF_WIDTHS,
    MIN_ORDINATES_PER_HALF_WIDTH,
    MIN_SECTIONS,
)
from allanite.suggestion.screens.band_levels import overlap
from allanite.suggestion.screens.spectral import Candidate

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.sections import Cells
    from allanite.fit.solution import Process, Solution

__all__ = ["bands_to_follow", "screen_moving"]

Array = NDArray[np.float64]
#: Distances from its mean frequency within which a band is searched, half-widths; the next if it is found at an end.
REACHES = (6.0, 12.0, 24.0)
#: Half-widths of spectrum beyond the reach that are compared as well.
MARGIN = 3.0
#: Frequencies tried in a half-width.
PLACES_PER_HALF_WIDTH = 4
#: Widths of the band that moves, over its width in the mean spectrum: at no time is it wider.
WIDTH_RATIOS = (1.0, 0.5, 0.25)
#: Strengths, over the mean strength, that a steady band may have in a section: a band that is quiet has not moved.
STRENGTHS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
#: Searches for a course: numbers of sections × widths (and twice that of the fit) × reaches. They multiply the p-value.
SEARCHES = (1 + int(np.log2(MAX_SECTIONS / MIN_SECTIONS))) * (len(WIDTH_RATIOS) + 2) * len(REACHES)


def bands_to_follow(solution: Solution, data: Data) -> list[Process]:
    """The bands of a model that are wide enough to be placed in a section; none where much is missing.

    Beside one that moves, what is left of it moves too.
    """
    known = [e.occupies for e in solution.model if isinstance(e, Moving) and e.occupies is not None]
    bands = [own for own in solution.processes if _may_move(own, data)]
    return [
        own
        for own in bands
        if not any(overlap(own.effect.occupies or (0.0, 0.0), course) for course in known)
    ]


def screen_moving(bands: list[Process], solution: Solution, data: Data) -> tuple[Candidate, ...]:
    """For each of the bands that is elsewhere in other sections, the model with one that moves in its place."""
    if not bands:
        return ()
    found = (_candidate(own, solution, data) for own in bands)
    return tuple(c for c in found if c is not None)


def _may_move(own: Process, data: Data) -> bool:
    return own.theta > 0.0 and _movable(own.effect) and _sections(own.effect, data) >= MIN_SECTIONS


def _movable(effect: Stochastic) -> bool:
    if effect.occupies is None or effect.held:
        return False
    return _moving(effect, (1.0, 1.1)) is not None


def _sections(band: Stochastic, data: Data) -> int:
    """In how many sections it can be placed, at most."""
    return data.most_sections(
        band.occupies or (0.0, 0.0), MAX_SECTIONS, MIN_ORDINATES_PER_HALF_WIDTH
    )


def _moving(band: Stochastic, course: tuple[float, ...]) -> Moving | None:
    """The effect of the catalogue that is this band along a course."""
    kinds = (cls for cls in CATALOGUE if issubclass(cls, Moving))
    return next((one for cls in kinds if (one := cls.along(band, course)) is not None), None)


def _candidate(own: Process, solution: Solution, data: Data) -> Candidate | None:
    low, high = own.effect.occupies or (0.0, 0.0)
    width = (high - low) / (high + low)
    sections = _Sections(own, solution, data)
    course = sections.course([width * w for w in WIDTH_RATIOS], own.theta, (own.effect,))
    if course is None:
        return None
    refitted = _along(course, solution, data)
    # Of the width and strength that it has at any time it is found more exactly; and without what stood for it elsewhere.
    moving = refitted.processes[-1]
    for gone in _gone(own, moving, solution):
        if moving.theta > 0.0:
            again = sections.course([_width(moving.effect)], moving.theta, gone)
            if again is not None and again.risen > course.risen:
                course = again
                refitted = _along(course, solution, data)
                moving = refitted.processes[-1]
    if not moving.theta:
        return None
    chance = min(0.0, float(np.log(SEARCHES)) - course.risen)
    effect = moving.effect
    note = f"It stands in the place of {_names(course.gone)}"
    return Candidate(effect, course.risen, effect.family, refitted, log_chance=chance, note=note)


def _names(gone: tuple[Effect, ...]) -> str:
    """The bands that leave, by their middles."""
    at = sorted(0.5 * sum(e.occupies) for e in gone if e.occupies is not None)
    titles = dict.fromkeys(e.title for e in gone)
    return f"the {' and '.join(titles)} at {' and '.join(f'{f:.3g}' for f in at)} Hz"


def _gone(own: Process, moving: Process, solution: Solution) -> list[tuple[Effect, ...]]:
    """What may leave for a band that moves: the band itself, and with it all that lie on its course."""
    course = moving.effect.occupies
    if course is None:
        return []
    bands = (e.effect for e in solution.processes if e is not own and _movable(e.effect))
    beside = tuple(e for e in bands if overlap(e.occupies or (0.0, 0.0), course))
    return [(own.effect,), *([(own.effect, *beside)] if beside else [])]


def _along(course: _Course, solution: Solution, data: Data) -> Solution:
    """The model with a band that moves in the place of what leaves for it, refitted."""
    effect = _moving(course.band, tuple(course.places.tolist()))
    assert effect is not None
    others = _without(solution.model, course.gone)
    return solve(data, Model((*others, effect)), like=solution, settled=len(others), rounds=3)


def _without(model: Model, gone: tuple[Effect, ...]) -> tuple[Effect, ...]:
    return tuple(e for e in model if not any(e is other for other in gone))


def _width(moving: Effect) -> float:
    """Half-width over middle of a band that moves, at any time."""
    assert isinstance(moving, Moving)
    low, high = moving.stretches[0].occupies or (0.0, 0.0)
    return (high - low) / (high + low)


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """A band as wide as it is at any time, its places in turn, Hz, and what they explain beyond what telling them takes.

    What is `gone` leaves the model for it.
    """

    band: Stochastic
    places: Array
    risen: float
    gone: tuple[Effect, ...]


class _Sections:
    """Sections of a record, in which a band of a model is looked for."""

    def __init__(self, own: Process, solution: Solution, data: Data) -> None:
        self.own, self.model, self.data = own, solution.model, data
        self.sections = data.sections(solution.model, _sections(own.effect, data))

    def course(self, widths: list[float], theta: float, gone: tuple[Effect, ...]) -> _Course | None:
        """Where a band of one of some half-widths (over the middle) and of a strength is, as explains most.

        In the place of what is `gone` from the model. None where all places are within a half-width of each other.
        """
        low, high = self.own.effect.occupies or (0.0, 0.0)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        found: _Course | None = None
        for reach in REACHES:
            lowest, highest = self.sections.limits
            first = max(middle - reach * half, lowest + half, 2.0 * half)
            last = min(middle + reach * half, highest - half)
            courses = [self._course(w, theta, (first, last), gone) for w in widths]
            found = max(filter(None, courses), key=lambda course: course.risen, default=None)
            if found is None:
                break
            ends = found.places.min() - half, found.places.max() + half
            if ends[0] > first and ends[1] < last:
                break
        if found is None or found.risen <= 0.0:
            return None
        if float(np.ptp(found.places)) < MIN_COURSE_HALF_WIDTHS * _half(found.band):
            return None
        return found

    def _course(
        self, width: float, theta: float, within: tuple[float, float], gone: tuple[Effect, ...]
    ) -> _Course | None:
        """The same of one width with places within two frequencies, of as many sections as explains most."""
        step = width * 0.5 * sum(within) / PLACES_PER_HALF_WIDTH
        places = np.arange(*within, step)
        effect = self.own.effect
        if places.size <= MIN_COURSE_HALF_WIDTHS * PLACES_PER_HALF_WIDTH:
            return None  # none of them is far enough from another
        bands = [b for f in places if (b := effect.banded(f * (1 - width), f * (1 + width)))]
        if len(bands) < places.size:
            return None
        cells = self._cells(within, step)

        def gains(rest: Array, band: Stochastic, strength: float) -> Array:
            there = Model(tuple(band if e is effect else e for e in self.model))
            of_band = cells.expected(there.unit_terms(band, self.data.rate))
            return cells.log_likelihood(rest + strength * of_band)

        rest = self._rest((effect,), cells)
        levels = [level * self.own.theta for level in STRENGTHS]
        known = np.max([gains(rest, effect, level) for level in levels], axis=0)
        rest = self._rest(gone, cells)
        rows = np.stack([gains(rest, band, theta) - known for band in bands], axis=1)
        best: _Course | None = None
        while rows.shape[0] >= MIN_SECTIONS:
            path, risen = likeliest(rows)
            if best is None or risen > best.risen:
                course = places[path] + step * _beside(rows, path)
                best = _Course(bands[0], course, risen, gone)
            rows = rows[::2] + rows[1::2]
        return best

    def _rest(self, gone: tuple[Effect, ...], cells: Cells) -> Array:
        """What the model without some effects expects of squared ordinates."""
        others = Model(_without(self.model, gone))
        return cells.expected(self.data.terms(others) if others.stochastic else ())

    def _cells(self, within: tuple[float, float], step: float) -> Cells:
        """Where a band may be, and beside it."""
        low, high = self.own.effect.occupies or (0.0, 0.0)
        aside = 0.5 * MARGIN * (high - low)
        return self.sections.cells((within[0] - aside, within[1] + aside), step)


def _half(band: Stochastic) -> float:
    low, high = band.occupies or (0.0, 0.0)
    return 0.5 * (high - low)


def likeliest(gains: Array) -> tuple[NDArray[np.int64], float]:
    """A place for each section, shape (sections,), of gains of shape (sections, places), and their sum less what they take.

    The first is any place; from one to the next a step x of half-widths has a probability as 1/(1 + x²). A sum
    s so reduced is met by chance with a probability of at most e⁻ˢ (the union bound): where none moves the mean of e to a
    gain is at most 1.
    """
    sections, places = gains.shape
    steps = np.arange(places)
    told = -np.log1p(((steps[:, None] - steps) / PLACES_PER_HALF_WIDTH) ** 2)
    told -= np.log(np.exp(told).sum(axis=1))[:, None]
    score = gains[0] - np.log(places)
    came = np.zeros((sections, places), dtype=np.int64)
    for k in range(1, sections):
        ways = score[:, None] + told
        came[k] = ways.argmax(axis=0)
        score = ways.max(axis=0) + gains[k]
    path = np.zeros(sections, dtype=np.int64)
    path[-1] = score.argmax()
    for k in range(sections - 1, 0, -1):
        path[k - 1] = came[k, path[k]]
    return path, float(score.max())


def _beside(gains: Array, path: NDArray[np.int64]) -> Array:
    """By how much of a step, at most half of one, the top of a parabola through the gains lies beside each place."""
    at = path.clip(1, gains.shape[1] - 2)
    row = np.arange(at.size)
    low, mid, high = gains[row, at - 1], gains[row, at], gains[row, at + 1]
    bent = low - 2.0 * mid + high
    aside = 0.5 * (low - high) / np.where(bent < 0.0, bent, -np.inf)
    return np.where(at == path, aside.clip(-0.5, 0.5), 0.0)
