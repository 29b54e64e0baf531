"""Candidates that change the spectrum: every random process and filter of the catalogue, at every shape of its grid.

Every point of a grid is climbed from several starts: a model that lacks an effect has others standing for it, so that no
slope of the likelihood at the model tells what is missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.effects import CATALOGUE, Effect, Model, Modifier, Stochastic
from allanite.fit.engine import solve, with_coefficients
from allanite.fit.likelihood.expected import column_of
from allanite.fit.likelihood.peaks import FEW, by_ordinates
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.whittle import climb_many
from allanite.fit.shapes.narrow import flat_about
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.scan import ALIKE, added, other_form, simplest, worth_polishing
from allanite.fit.shapes.shape import free_places
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAX_DESIGNS_POLISHED,
    MAX_FORMS_EXTENDED,
    MAX_NARROW_POINTS_CLIMBED,
    MAX_REFIT_GAIN_RATIO,
    MIN_DELTA_LOGL_OVER_SIMPLER,
    MIN_GAIN_PER_DESIGN_PARAMETER,
    MIN_SPECTRAL_SCREEN_GAIN,
)
from allanite.suggestion.p_values import Family, arc_length, line_trials, log_chance
from allanite.suggestion.screens.narrow_bands import narrow_bands, widths_tried

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whittle import Maximum
    from allanite.fit.solution import Solution

__all__ = ["Candidate", "Screen", "directions", "screen_spectral"]

#: Fisher steps of the scan over other designs of a filter.
DESIGN_SCAN_STEPS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """An effect with starting values, the rise of logL it promises or brings, and its refitted solution."""

    effect: Effect
    gain: float
    family: str
    solution: Solution | None = None
    #: Numbers it adds to the model, for BIC.
    parameters: int = 1
    #: ln of the chance of such a gain, where the family has its own law.
    log_chance: float | None = None
    #: The part of `gain` that chance is asked about, where that is not all of it.
    judged: float | None = None
    #: The record it was refitted to, where samples were taken out.
    data: Data | None = None
    #: What else there is to say of it, a clause.
    note: str = ""

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class Screen:
    """Candidates of a family and the angle that each kind's grid spans."""

    candidates: tuple[Candidate, ...]
    arcs: tuple[float, ...]
    #: Family of each of the arcs where a screen serves several.
    families: tuple[str, ...] = ()

    __repr__ = brief


@lru_cache(maxsize=64)
def _points(blank: Effect, n: int, rate: float) -> tuple[Effect, ...]:
    """Every point of an effect's grid; that of a shape may depend on the shapes declared after it."""
    out: list[Effect] = list(blank.variants())
    for name in reversed(blank.free_shapes):
        out = [
            point.with_values(**{name: float(value)})
            for point in out
            for value in point.grid(name, n, rate)
        ]
    return tuple(out)


def _tangent(effect: Effect, solution: Solution, data: Data) -> NDArray[np.float64]:
    """Change of bin power for a small amount of the effect, shape (bins,)."""
    model = solution.model
    if isinstance(effect, Modifier):
        if model.white is None:
            return np.zeros_like(solution.spectrum)
        white = next(own for own in solution.processes if own.effect.white)
        # Its direction alone matters, also where another effect has taken all of the white noise.
        changed = column_of(model + effect, model.white, data)
        return changed - white.column
    assert isinstance(effect, Stochastic)
    return column_of(model, effect, data)


def directions(
    solution: Solution, data: Data
) -> Iterator[tuple[type[Effect], list[Effect], NDArray[np.float64]]]:
    """Every kind that may be missing, the points of its shape grid, and the way each moves the spectrum.

    Unit vectors of the change of bin power in units of its scatter, shape (points, bins), with what the model can do
    by itself projected out; points that differ from it in nothing are left out.
    """
    root = np.sqrt(0.5 * solution.count)
    # Directions that the model can already move in, and into which it will after the refit.
    own = solution.columns[:, solution.theta > 0.0]
    basis, _ = np.linalg.qr((own / solution.spectrum[:, None]) * root[:, None])
    for cls in CATALOGUE:
        if cls.screened != "spectral":
            continue
        blanks = cls.candidates(solution.model, data.covariates)
        points = [p for blank in blanks for p in _points(blank, data.n, data.rate)]
        if not points:
            continue
        # A thousand points of a thousand bins: one array, in place.
        moved = np.empty((len(points), root.size))
        for row, point in zip(moved, points, strict=True):
            row[:] = _tangent(point, solution, data) / solution.spectrum * root
        size = np.linalg.norm(moved, axis=1)
        for row, share in zip(moved, moved @ basis, strict=True):
            row -= basis @ share
        norm = np.linalg.norm(moved, axis=1)
        usable = norm > 1e-3 * np.maximum(size, 1e-300)
        if usable.any():
            kept = [p for p, keep in zip(points, usable, strict=True) if keep]
            moved = moved if usable.all() else moved[usable]
            moved /= norm[usable, None]
            yield cls, kept, moved


def screen_spectral(solution: Solution, data: Data, white: NDArray[np.float64]) -> Screen:
    """Refitted best candidate of every kind, from every point of its grid; `white` are ordinates by the model alone."""
    part = RandomPart(data, solution.power, solution.count)
    found: list[Candidate] = []
    arcs: list[float] = []
    families: list[str] = []
    for cls, points, unit in directions(solution, data):
        arcs.append(arc_length(unit))
        families.append(cls.family)
        if points[0].occupies is not None:
            points = _promising(points, unit, solution)
        if white.size == data.n:
            points = [*points, *cls.seen_in(white**2, data.rate)]
        best = _refit(points, solution, part, arcs[-1])
        narrow = _within_a_bin(points[0], solution, part, white, arcs[-1])
        both = [c for c in (best, narrow) if c is not None]
        if both:
            found.append(max(both, key=lambda c: c.gain))
    return Screen(tuple(found), tuple(arcs), tuple(families))


def _within_a_bin(
    point: Effect, base: Solution, part: RandomPart, white: NDArray[np.float64], arc: float
) -> Candidate | None:
    """The band narrower than a bin that stands out most in single ordinates; bins would not see a weak one."""
    data = part.data
    if not isinstance(point, Stochastic) or point.banded(1.0, 1.001) is None:
        return None
    if data.lost > FEW:
        return None
    best = max(narrow_bands(base, data, white), key=lambda band: band.gain, default=None)
    if best is None or _chance(MAX_REFIT_GAIN_RATIO * best.gain, data) > np.log(
        FALSE_ALARM_PROBABILITY
    ):
        return None
    made = point.banded(best.low, best.high)
    assert made is not None
    effect = made.with_values(**{point.coefficient: float(np.sqrt(best.variance))})
    solution = solve(data, base.model + effect, like=base, rounds=3, polish=False)
    return _candidate(solution, base, data, arc)


def _chance(gain: float, data: Data) -> float:
    """Ln of the chance of a rise of logL by a narrow band: looked for at every ordinate, as a line is, and every width."""
    return log_chance(Family("line", width=line_trials(data.n) * widths_tried(data.n)), gain)


def _promising(points: list[Effect], unit: NDArray[np.float64], solution: Solution) -> list[Effect]:
    """Points of an effect in whose direction the residual lies more than in their neighbours', the best of them.

    Of a narrow effect: what stands for it elsewhere in the model has not absorbed it there.
    """
    residual = (solution.power / solution.spectrum - 1.0) * np.sqrt(0.5 * solution.count)
    score = unit @ residual
    beside = np.maximum(np.append(score[1:], -np.inf), np.append(-np.inf, score[:-1]))
    best = np.argsort(-np.where(score >= beside, score, -np.inf), kind="stable")[
        :MAX_NARROW_POINTS_CLIMBED
    ]
    return [points[i] for i in np.sort(best)]


def _extended(
    ends: list[tuple[Model, Maximum]], model: Model, best: Maximum, part: RandomPart
) -> tuple[Model, Maximum]:
    """The richer form of an effect, where the plain one leaves a discrepancy that it lessens by more than it costs."""
    if best.scale is None:
        return model, best
    last = len(model) - 1
    found = model, best
    for plain, start in sorted(ends, key=lambda end: -end[1].log_likelihood)[:MAX_FORMS_EXTENDED]:
        for effect in plain.effects[last].extended():
            richer = Model((*plain.effects[:last], effect))
            places = [p for p in free_places(richer) if p[0] == last]
            climbed = part.climb(part.linear(richer), start.theta, start.scale)
            tried = polish(richer, places, climbed, part, roughly=True)
            if tried[1].log_likelihood > max(
                found[1].log_likelihood, best.log_likelihood + MIN_DELTA_LOGL_OVER_SIMPLER
            ):
                found = tried
    return found


def _redesigned(model: Model, best: Maximum, part: RandomPart) -> tuple[Model, Maximum]:
    """The maximum over all shapes; where the model is known to be wrong, of the other designs of its filters too.

    Shapes and designs that were there may stand for what is missing: a cutoff, or more sections of a filter, for a rise
    towards the Nyquist frequency.
    """
    found = polish(model, free_places(model), best, part, roughly=True)
    if best.scale is None:
        return found
    for place, effect in enumerate(model.effects[:-1]):
        choices = [p.name for p in effect.parameters if p.role == "choice"]
        if not choices or effect.held or effect.screened != "spectral":
            continue
        # In their plain form, and at shapes of their own: what one design needs beside it another does not.
        others = [
            Model((*model.effects[:place], point, *model.effects[place + 1 :]))
            for point in _points(type(effect)(), part.data.n, part.data.rate)
            if _near(point, effect)
        ]
        if not others:
            continue
        here = model, part.linear(model)
        columns = np.stack([part.linear(other, here).matrix for other in others])
        starts = np.stack([best.theta] * len(others))
        thetas, values, scales = climb_many(
            part.power, part.count, columns, starts, best.scale, DESIGN_SCAN_STEPS
        )
        designs: dict[tuple[object, ...], int] = {}
        for k in map(int, np.argsort(-values, kind="stable")):
            designs.setdefault(tuple(others[k].effects[place].values[c] for c in choices), k)
        for k in list(designs.values())[:MAX_DESIGNS_POLISHED]:
            start = part.climb(part.linear(others[k]), thetas[k], scales[k])
            tried = polish(others[k], free_places(others[k]), start, part, roughly=True)
            spared = sum(e.numbers for e in found[0]) - sum(e.numbers for e in tried[0])
            if (
                tried[1].log_likelihood
                > found[1].log_likelihood - MIN_GAIN_PER_DESIGN_PARAMETER * spared
            ):
                found = tried
    return found


def _near(point: Effect, effect: Effect) -> bool:
    """Whether the shapes of a point are within a factor of two of an effect's."""
    return all(
        0.5 * effect.values[name] < point.values[name] < 2.0 * effect.values[name]
        for name in point.free_shapes
    )


def _refit(points: list[Effect], base: Solution, part: RandomPart, arc: float) -> Candidate | None:
    """The best of many starting points, shapes polished from the best few that differ."""
    scanned = added(base.model, points, base.best, part)
    if scanned[0][0].log_likelihood - base.best.log_likelihood < MIN_SPECTRAL_SCREEN_GAIN:
        return None
    last = len(base.model)
    ends = [
        polish(model, [p for p in free_places(model) if p[0] == last], found, part, roughly=True)
        for found, model in worth_polishing(scanned)
    ]
    model, best = simplest(ends, last)
    if best.log_likelihood > base.best.log_likelihood + MIN_DELTA_LOGL_OVER_SIMPLER:
        top = sorted(ends, key=lambda end: -end[1].log_likelihood)[:MAX_DESIGNS_POLISHED]
        others = [other_form(plain, last, start, part) for plain, start in top]
        model, best = max(
            [(model, best), *others],
            key=lambda end: end[1].log_likelihood + ALIKE * (end[0] is model),
        )
    model, best = _extended(ends, model, best, part)
    model, best = _redesigned(model, best, part)
    # Steps and lines are found again beside the best.
    model = with_coefficients(model, best.theta)
    solution = solve(part.data, model, start=best, like=base, rounds=3, polish=False)
    return _candidate(solution, base, part.data, arc)


def _candidate(solution: Solution, base: Solution, data: Data, arc: float) -> Candidate | None:
    """What the last effect of a refitted model brings, if anything; `arc` is that of its kind in the bins."""
    fitted = solution.model.effects[-1]
    if not fitted.shows(solution.model, data.rate, data.duration):
        return None
    gain = solution.log_likelihood - base.log_likelihood
    if gain <= 0.0:
        return None
    narrow = by_ordinates(fitted, data)
    if narrow and not flat_about(solution.model, len(solution.model) - 1, data):
        return None
    chance = None
    if narrow:
        # Found in the bins, of which there are few, or among all ordinates: the better of two tests.
        in_bins = min(gain, solution.best.log_likelihood - base.best.log_likelihood)
        by_bins = log_chance(Family(fitted.family, (arc,)), max(in_bins, 0.0))
        chance = min(_chance(gain, data), by_bins) + np.log(2.0)
    return Candidate(fitted, gain, fitted.family, solution, fitted.numbers, log_chance=chance)
