"""Screen of drifting bands: each band of the model, or that it lacks, is located in sections of the record.

A band whose frequency changes slowly is wider in the mean spectrum than at any time, with one steep side. A model of the
mean spectrum then needs two or three resonances for this one band. The candidate is one moving band that replaces the
located band, alone or together with all others in the range of its course.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOG, Effect, Model, Stochastic
from allanite.fit.engine import solve
from allanite.suggestion.constants import (
    MAX_BAND_SECTIONS,
    MIN_BAND_SECTIONS,
    MIN_DELTA_LOGL_OVER_SIMPLER,
    MIN_ORDINATES,
)
from allanite.suggestion.p_values import Family
from allanite.suggestion.screens._screen import Candidate, Context, Screen
from allanite.suggestion.screens.spectral import bands_overlap

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.sections import Cells
    from allanite.fit.solution import Process, Solution

Array = NDArray[np.float64]
#: Maximum distances from its mean frequency within which a band is searched, half-widths. A larger one is used if the band
#: is found at an end of the range.
REACHES = (6.0, 12.0, 24.0)
#: Width of the spectrum beyond the range that is compared as well, half-widths.
MARGIN = 3.0
#: Number of frequencies tried per half-width.
PLACES_PER_HALF_WIDTH = 4
#: Tried widths of the moving band, relative to its width in the mean spectrum; at no time is the band wider. Of six
#: drifting bands, 5 are named with these widths or with 1 and 1/4, none with 1 alone (benches/decisions/chosen_values.py
#: courses).
WIDTH_RATIOS = (1.0, 0.5, 0.25, 0.125, 0.0625)
#: Tried powers of a steady band in a section, relative to its mean power: a band that is quiet has not moved.
STRENGTHS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
#: Tried numbers of straight parts of a course. Without straight parts 2 of these six bands are named, with 1 and 2 parts 5.
STRAIGHT_PARTS = (1, 2, 4, 8)
#: Number of searches for a course, which multiplies the p-value: numbers of sections or straight parts × widths (and twice
#: that of the fit) × reaches.
SEARCHES = (
    (1 + int(np.log2(MAX_BAND_SECTIONS / MIN_BAND_SECTIONS)) + len(STRAIGHT_PARTS))
    * (len(WIDTH_RATIOS) + 2)
    * len(REACHES)
)


def bands_that_may_move(solution: Solution, data: Data) -> list[Process]:
    """List of the noise bands (`Process`) of the model whose center frequency may be searched for movement over time.

    The record must resolve a band in at least 8 sections of time; it does not if many samples are missing. The catalog must
    have the band with a moving frequency. Omitted are bands in the range of a moving band of the model.
    """
    known = [e.occupies for e in solution.model if e.moving and e.occupies is not None]
    return [
        own
        for own in solution.processes
        if own.theta > 0.0
        and _is_movable(own.effect)
        and _section_count(own.effect, data) >= MIN_BAND_SECTIONS
        and not any(bands_overlap(own.effect.occupies or (0.0, 0.0), course) for course in known)
    ]


def screen_drifting_bands(
    bands: list[Process], solution: Solution, data: Data
) -> tuple[Candidate, ...]:
    """Tuple of a refitted `Candidate` for each of `bands` that moves: a moving band replaces it and others in its range."""
    found = (_moving_band_candidate(own, solution, data) for own in bands)
    return tuple(c for c in found if c is not None)


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple of a refitted `Candidate` for each band that moves: of the model, or a candidate of the spectrum.

    A candidate of the spectrum within the range of a band that moves is a part of this band.
    """
    solution, data = context.solution, context.data
    found = [*screen_drifting_bands(bands_that_may_move(solution, data), solution, data)]
    for missing, band in _missing_bands(context):
        courses = [one.effect.occupies or (0.0, 0.0) for one in found]
        if any(bands_overlap(band.effect.occupies or (0.0, 0.0), course) for course in courses):
            continue
        assert missing.solution is not None
        moving = screen_drifting_bands([band], missing.solution, data)
        found += [
            replace(
                one,
                gain=missing.gain + one.gain,
                parameters=missing.parameters + one.parameters,
                note="",
            )
            for one in moving
        ]
    return tuple(found)


def _missing_bands(context: Context) -> list[tuple[Candidate, Process]]:
    """List of the candidates of the spectrum that are bands which may move, each with its fitted band."""
    found = []
    for one in context.found["spectral"]:
        if one.solution is not None and one.gain > MIN_DELTA_LOGL_OVER_SIMPLER:
            bands = bands_that_may_move(one.solution, context.data)
            found += [(one, own) for own in bands if own.effect is one.solution.model.effects[-1]]
    return found


SCREEN = Screen(
    "drifting bands",
    "bands whose frequency changes: their most likely course over sections of the record",
    "both",
    look,
    after=("spectral",),
    searches=lambda context: int(
        bool(bands_that_may_move(context.solution, context.data) or _missing_bands(context))
    ),
)


def _is_movable(effect: Stochastic) -> bool:
    """True if `effect` is a band, the catalog has one like it with a moving frequency, and no parameter is held."""
    if effect.occupies is None or effect.held:
        return False
    return _moving_band(effect, (1.0, 1.1)) is not None


def _section_count(band: Stochastic, data: Data) -> int:
    """Number of time sections of the record that resolve the band: 64, or 32, 16, … for a narrower band; 0 if none does."""
    return data.resolved_sections(band.occupies or (0.0, 0.0), MAX_BAND_SECTIONS, MIN_ORDINATES)


def _moving_band(band: Stochastic, course: tuple[float, ...]) -> Stochastic | None:
    """Moving band with the shape of `band` and the center frequencies `course`, Hz, one for each segment; or None."""
    kinds = (cls for cls in CATALOG if issubclass(cls, Stochastic) and cls.moving)
    return next((one for cls in kinds if (one := cls.like(band, course=course)) is not None), None)


def _moving_band_candidate(own: Process, solution: Solution, data: Data) -> Candidate | None:
    """Refitted `Candidate` in which a moving band replaces `own`, alone or with all bands in its range; or None."""
    width = _relative_half_width(own.effect)
    sections = _Sections(own, solution, data)
    # A wandering line is wide in each section, too; a moving band is narrower there.
    ratios = WIDTH_RATIOS if own.effect.unsteady is None else WIDTH_RATIOS[1:]
    course = sections.course([width * w for w in ratios], own.theta, (own.effect,))
    if course is None:
        return None
    refitted = _refitted_with(course, solution, data)
    # Search again with the width and strength of the refit, also without the bands that stood for it elsewhere.
    moving = refitted.processes[-1]
    for replaced in _replaceable_sets(own, moving, solution):
        if moving.theta > 0.0:
            width = _relative_half_width(moving.effect.segments[0])
            again = sections.course([width], moving.theta, replaced)
            if again is not None and again.risen > course.risen:
                course = again
                refitted = _refitted_with(course, solution, data)
                moving = refitted.processes[-1]
    if not moving.theta:
        return None
    log_p = min(0.0, float(np.log(SEARCHES)) - course.risen)
    effect = moving.effect
    family = Family(effect.family, scatter="none")
    note = f"It stands in the place of {_replaced_text(course.replaced)}"
    return Candidate(effect, course.risen, family, refitted, log_p_value=log_p, note=note)


def _replaced_text(replaced: tuple[Effect, ...]) -> str:
    """Text that lists the replaced bands by title and ascending center frequency: "the resonance at 9.5 and 10.1 Hz"."""
    at = sorted(0.5 * sum(e.occupies) for e in replaced if e.occupies is not None)
    titles = dict.fromkeys(e.title for e in replaced)
    return f"the {' and '.join(titles)} at {' and '.join(f'{f:.3g}' for f in at)} Hz"


def _replaceable_sets(
    own: Process, moving: Process, solution: Solution
) -> list[tuple[Effect, ...]]:
    """List of tuples of the effects that a moving band may replace: the band alone, and all bands within its range.

    Only the first if no other band that may move is in its range; empty if the moving band has no range of frequencies.
    """
    course = moving.effect.occupies
    if course is None:
        return []
    bands = (e.effect for e in solution.processes if e is not own and _is_movable(e.effect))
    within_range = tuple(e for e in bands if bands_overlap(e.occupies or (0.0, 0.0), course))
    return [(own.effect,), *([(own.effect, *within_range)] if within_range else [])]


def _refitted_with(course: _Course, solution: Solution, data: Data) -> Solution:
    """Refitted solution in which a moving band on this course replaces the effects of `course.replaced`."""
    effect = _moving_band(course.band, tuple(course.places.tolist()))
    assert effect is not None
    others = _without(solution.model, course.replaced)
    return solve(data, Model((*others, effect)), like=solution, settled=len(others), rounds=3)


def _without(model: Model, replaced: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Tuple of the model's effects except those that are identical (``is``) to one of `replaced`."""
    return tuple(e for e in model if not any(e is other for other in replaced))


def _relative_half_width(band: Effect) -> float:
    """Half-width of a band relative to its center frequency."""
    low, high = band.occupies or (0.0, 0.0)
    return (high - low) / (high + low)


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """Course of the center frequency of a moving band.

    `band` is the band at one place, `places` the frequency in each section, Hz. `risen` is ΔlogL less the cost of
    describing the course, nats. The effects in `replaced` leave the model for it.
    """

    band: Stochastic
    places: Array
    risen: float
    replaced: tuple[Effect, ...]


class _Sections:
    """Time sections of a record in which the band of a process is located."""

    def __init__(self, own: Process, solution: Solution, data: Data) -> None:
        self.own, self.model, self.data = own, solution.model, data
        number = _section_count(own.effect, data)
        self.sections = data.sections(solution.model, number)
        #: Half the distance of the ordinates of a section, Hz.
        self.resolution = 0.25 * number / data.duration

    def course(
        self, widths: list[float], theta: float, replaced: tuple[Effect, ...]
    ) -> _Course | None:
        """Most likely course (`_Course`) of the center frequency of the band over time; None if no course raises logL.

        A course must span at least a half-width. `widths` are the tried half-widths divided by the center frequency, widest
        first. `theta` is the squared coefficient of the moving band, which replaces the effects `replaced`.
        """
        low, high = self.own.effect.occupies or (0.0, 0.0)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        found: _Course | None = None
        for reach in REACHES:
            lowest, highest = self.sections.limits
            first = max(middle - reach * half, lowest + half, 2.0 * half)
            last = min(middle + reach * half, highest - half)
            found = None
            for width in widths:
                course = self._course(width, theta, (first, last), replaced)
                if found is not None and (course is None or course.risen <= found.risen):
                    break  # a narrower one explains less
                found = course or found
            if found is None:
                break
            ends = found.places.min() - half, found.places.max() + half
            if ends[0] > first and ends[1] < last:
                break
        if found is None or found.risen <= 0.0:
            return None
        if float(np.ptp(found.places)) < _half_width(found.band):
            return None  # a band that moves by less than its half-width is steady
        return found

    def _course(
        self,
        relative_width: float,
        theta: float,
        within: tuple[float, float],
        replaced: tuple[Effect, ...],
    ) -> _Course | None:
        """Most likely course (`_Course`) of the center frequency of a band over time, for one width of the band; or None.

        The frequency stays between the two values `within`, Hz. The half-width of the band is `relative_width` times its
        frequency, and `theta` its squared coefficient. The band replaces the effects `replaced`. Two forms are compared: a
        constant frequency in each time section, and a polygon.

        None if the range holds at most four tried frequencies, or if the band is not possible at one of them. None as well
        if a section does not resolve neighboring tried frequencies.
        """
        step = relative_width * 0.5 * sum(within) / PLACES_PER_HALF_WIDTH
        if step < self.resolution:
            return None
        places = np.arange(*within, step)
        effect = self.own.effect
        if places.size <= PLACES_PER_HALF_WIDTH:
            return None  # none of them is far enough from another
        bands = [
            b
            for f in places
            if (b := effect.banded(f * (1 - relative_width), f * (1 + relative_width)))
        ]
        if len(bands) < places.size:
            return None
        aside = MARGIN * _half_width(effect)
        cells = self.sections.cells((within[0] - aside, within[1] + aside), step)

        def log_likelihoods(other_power: Array, band: Stochastic, strength: float) -> Array:
            """LogL of each time section, shape (sections,), for `other_power` plus `strength` times that of `band`."""
            there = Model(tuple(band if e is effect else e for e in self.model))
            of_band = cells.expected(there.unit_terms(band, self.data.rate))
            return cells.log_likelihood(other_power + strength * of_band)

        other_power = self._remaining_power((effect,), cells)
        levels = [level * self.own.theta for level in STRENGTHS]
        known = np.max([log_likelihoods(other_power, effect, level) for level in levels], axis=0)
        other_power = self._remaining_power(replaced, cells)
        rows = np.stack(
            [log_likelihoods(other_power, band, theta) - known for band in bands], axis=1
        )
        best: _Course | None = None
        for parts in STRAIGHT_PARTS:
            # Half of the places suffice for the corners: one is at most a quarter of a half-width away.
            corners, risen = most_likely_polygon(rows[:, ::2], parts)
            if best is None or risen > best.risen:
                course = _thinned(places[0] + 2.0 * step * corners, _half_width(bands[0]))
                best = _Course(bands[0], course, risen, replaced)
        while rows.shape[0] >= MIN_BAND_SECTIONS:
            path, risen = most_likely_course(rows)
            if best is None or risen > best.risen:
                course = places[path] + step * _parabola_offset(rows, path)
                best = _Course(bands[0], course, risen, replaced)
            rows = rows[::2] + rows[1::2]
        return best

    def _remaining_power(self, replaced: tuple[Effect, ...], cells: Cells) -> Array:
        """Expected power of the model without the effects `replaced`, shape (cells,)."""
        others = Model(_without(self.model, replaced))
        return cells.expected(self.data.terms(others) if others.stochastic else ())


def _half_width(band: Stochastic) -> float:
    """Half-width of the frequency range of a band, Hz; 0 if the effect has no range."""
    low, high = band.occupies or (0.0, 0.0)
    return 0.5 * (high - low)


def most_likely_course(gains: Array) -> tuple[NDArray[np.int64], float]:
    """Pair: index of the most likely frequency in each time section, shape (sections,), and score of this course, nats.

    `gains`, shape (sections, frequencies), are the ΔlogL of each frequency. The score is the sum of the gains along the
    course plus ln of the prior probability of the course. The first frequency is uniform. A step of x half-widths has a
    prior proportional to 1/(1 + x²). Without a movement, a score of s occurs with a probability of at most e⁻ˢ.
    """
    sections, places = gains.shape
    steps = np.arange(places)
    log_transition = -np.log1p(((steps[:, None] - steps) / PLACES_PER_HALF_WIDTH) ** 2)
    log_transition -= np.log(np.exp(log_transition).sum(axis=1))[:, None]
    score = gains[0] - np.log(places)
    previous = np.zeros((sections, places), dtype=np.int64)
    for k in range(1, sections):
        scores_from = score[:, None] + log_transition
        previous[k] = scores_from.argmax(axis=0)
        score = scores_from[previous[k], steps] + gains[k]
    path = np.zeros(sections, dtype=np.int64)
    path[-1] = score.argmax()
    for k in range(sections - 1, 0, -1):
        path[k - 1] = previous[k, path[k]]
    return path, float(score.max())


def most_likely_polygon(gains: Array, parts: int) -> tuple[Array, float]:
    """Pair: most likely piecewise linear course, as a fractional frequency index in each section; and its score, nats.

    `gains`, ΔlogL, has shape (sections, frequencies). The course has `parts` straight parts of equal length. The score is
    the sum of the gains along the course minus ln of the number of possible courses: all frequencies are equally probable
    at the start and at the end of each part. A score s occurs by chance with a probability of at most e⁻ˢ.
    """
    sections, places = gains.shape
    size, at = sections // parts, np.arange(places)
    passed = (np.arange(size) + 0.5) / size
    score, previous = np.full(places, -np.log(places)), []
    for k in range(parts):
        scores_from = np.repeat(score[:, None] - np.log(places), places, axis=1)
        for row, share in zip(gains[k * size : (k + 1) * size], passed, strict=True):
            scores_from += row[np.rint(at[:, None] + share * (at - at[:, None])).astype(np.int64)]
        previous.append(scores_from.argmax(axis=0))
        score = scores_from.max(axis=0)
    corners = [int(score.argmax())]
    for before in reversed(previous):
        corners.insert(0, int(before[corners[0]]))
    middles = (np.arange(sections) + 0.5) / size
    return np.interp(middles, np.arange(parts + 1), corners), float(score.max())


def _thinned(course: Array, half: float) -> Array:
    """The course, averaged over pairs of sections again and again while neighbors differ by at most `half`.

    `half` is the half-width of the band, in the unit of the course. At least 8 sections remain.
    """
    while course.size >= 2 * MIN_BAND_SECTIONS:
        fewer = course.reshape(-1, 2).mean(axis=1)
        if float(np.abs(np.diff(fewer)).max()) > half:
            break
        course = fewer
    return course


def _parabola_offset(gains: Array, path: NDArray[np.int64]) -> Array:
    """Offsets, at most ±½, from the index in `path` to the maximum of a parabola through the gains of each section."""
    at = path.clip(1, gains.shape[1] - 2)
    row = np.arange(at.size)
    low, mid, high = gains[row, at - 1], gains[row, at], gains[row, at + 1]
    bent = low - 2.0 * mid + high
    aside = 0.5 * (low - high) / np.where(bent < 0.0, bent, -np.inf)
    return np.where(at == path, aside.clip(-0.5, 0.5), 0.0)
