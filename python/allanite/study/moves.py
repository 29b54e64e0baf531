"""Moves of the search after an addition: drop what is no longer needed, replace what stands for something else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOGUE, Deterministic, Effect, Model, Modifier, Stochastic
from allanite.fit import fit_model
from allanite.fit.engine import solve, with_coefficients
from allanite.fit.matched import grid_points, matched_gains
from allanite.fit.polish import polish
from allanite.fit.random_part import RandomPart
from allanite.fit.result import Fit
from allanite.fit.scan import added, simplest, worth_polishing
from allanite.fit.shape import free_places, grid_models

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.fit.engine import Solution

__all__ = ["Alternative", "alternatives", "numbers", "pruned", "refitted", "swapped"]

#: An effect is kept while it explains half of what its numbers cost in BIC; one that the start asked for and the record
#: showed once, while it explains more than what is not there does by chance.
KEEP, NEEDLESS = 0.5, 0.5
#: Rise of ln(evidence) for which one effect takes the place of another.
CLEARLY = 2.0
#: Of two that explain the record equally well, the one that leaves this much of the Allan error (of its logarithm).
NEARER = 0.8


@dataclass(frozen=True, eq=False)
class Alternative:
    """A model in which another kind stands where an effect stood.

    Attributes
    ----------
    effect : Effect
        What stands there now, with values.
    solution : Solution
    evidence : float
        ln of its evidence over that of the model it was made from: ΔlogL − ½ Δk ln n.
    """

    effect: Effect
    solution: Solution
    evidence: float


def refitted(fit: Fit, model: Model) -> Fit:
    """The recording with another model; its transforms are used again where the same samples are missing."""
    if _removing(model) != _removing(fit.model):
        return fit_model(fit.recording, model)
    return _of(fit, solve(fit.data, model))


def _removing(model: Model) -> list[Effect]:
    return [e for e in model.modifiers if e.removes]


def _of(fit: Fit, solution: Solution) -> Fit:
    return Fit(fit.recording, solution.model, fit.method, fit.data, solution)


def numbers(effect: Effect) -> int:
    """Numbers that an effect adds to a model."""
    return sum(
        p.role in {"coefficient", "shape", "time"} and effect.values[p.name] is not None
        for p in effect.parameters
    )


def price(fit: Fit) -> float:
    """½ ln n of the effective observations: what a number costs in evidence."""
    return 0.5 * float(np.log(max(fit.solution.weight.sum(), 2.0)))


def pruned(fit: Fit, before: Fit, asked: int, gone: set[str]) -> tuple[Fit, list[str]]:
    """The fit without what is no longer needed, and the kinds taken out.

    Parameters
    ----------
    fit, before : Fit
        After and before the addition, which is the last effect of the model.
    asked : int
        How many effects, from the first, are the start's.
    gone : set of str
        Kinds that were taken out on an earlier rung and came back: needed.
    """
    removed: list[str] = []
    # The interval of a function of time counts on the slow noise that the start asked for.
    first = asked if isinstance(fit.model.effects[-1], Deterministic) else 0
    place = len(fit.model.effects) - 2
    while place >= first:
        effect = fit.model.effects[place]
        own = place < asked
        if (
            _may_leave(effect)
            and effect.kind not in gone
            and not (own and not _shown(before, place))
        ):
            least = NEEDLESS if own else KEEP * numbers(effect) * price(fit)
            without = _without(fit, place, least)
            if without is not None:
                removed.append(effect.kind)
                fit = without
                asked -= own
        place -= 1
    return fit, removed[::-1]


def _may_leave(effect: Effect) -> bool:
    white = isinstance(effect, Stochastic) and effect.white
    removes = isinstance(effect, Modifier) and effect.removes
    return not (white or removes or effect.held)


def _may_come(effect: Effect) -> bool:
    """Whether an effect may take another's place unasked: what happens once, filters and a last resort are suggested."""
    once = isinstance(effect, Deterministic) and effect.happens_once
    return not (once or effect.last_resort or isinstance(effect, Modifier))


def _without(fit: Fit, place: int, least: float) -> Fit | None:
    """The fit without an effect, if that costs less than `least` of logL."""
    effects = fit.model.effects
    less = Model(effects[:place] + effects[place + 1 :])
    if effects[place].screened not in {"spectral", "slow", "line"}:
        return None  # the evidence of what happens in time is not in the mean spectrum
    found = refitted(fit, less)
    lost = fit.solution.log_likelihood - found.solution.log_likelihood
    return found if lost < least else None


def _shown(fit: Fit, place: int) -> bool:
    """Whether the record distinguished the coefficient of an effect from 0."""
    effect = fit.model.effects[place]
    values = fit.estimates[place]
    return all(
        getattr(values[p.name], "detected", True)
        for p in effect.parameters
        if p.role == "coefficient"
    )


def alternatives(fit: Fit, place: int) -> Iterator[Alternative]:
    """What else might stand where an effect stands: every kind that is its declared rival, fitted anew."""
    effects = fit.model.effects
    out = effects[place]
    less = Model(effects[:place] + effects[place + 1 :])
    if not len(less):
        return
    base = solve(fit.data, less)
    part = RandomPart(fit.data, base.power, base.count)
    spent = numbers(out)
    for cls in CATALOGUE:
        if not (cls.kind in out.rivals or out.kind in cls.rivals) or cls.kind == out.kind:
            continue
        solution = _instead(cls, base, part)
        if solution is None:
            continue
        effect = solution.model.effects[-1]
        gain = solution.log_likelihood - fit.solution.log_likelihood
        yield Alternative(effect, solution, gain - (numbers(effect) - spent) * price(fit))


def _instead(cls: type[Effect], base: Solution, part: RandomPart) -> Solution | None:
    data = part.data
    blanks = cls.candidates(base.model, data.covariates)
    if not blanks:
        return None
    if cls.screened == "spectral":
        place = len(base.model)
        points = [m.effects[-1] for b in blanks for m in grid_models(base.model + b, place, data)]
        ends = [
            polish(
                model, [p for p in free_places(model) if p[0] == place], found, part, roughly=True
            )
            for found, model in worth_polishing(added(base.model, points, base.best, part))
        ]
        model, found = simplest(ends, place)
        model = with_coefficients(model, found.theta)
        return solve(data, model, start=found, rounds=3, polish=False)
    if cls.screened == "slow":
        best: tuple[float, Deterministic] | None = None
        noise = base.noise(data)
        for blank in blanks:
            assert isinstance(blank, Deterministic)
            slow = grid_points(blank, data)
            gains, _ = matched_gains(slow, base.ordinates, noise, data)
            top = int(np.argmax(gains))
            if best is None or gains[top] > best[0]:
                best = float(gains[top]), slow[top]
        return None if best is None else solve(data, base.model + best[1], rounds=3)
    return None


def _nearer(new: Fit, old: Fit) -> bool:
    """Whether the Allan curve is clearly nearer to the measured one."""
    a, b = new.curve.rms_percent, old.curve.rms_percent
    return (
        a is not None and b is not None and bool(np.log1p(a / 100.0) < NEARER * np.log1p(b / 100.0))
    )


def swapped(
    fit: Fit, places: set[int], tried: set[tuple[str, str]]
) -> tuple[Fit, str, Effect] | None:
    """The fit in which another kind stands clearly better where an effect stands, the kind that left, and the new effect.

    One that explains the record as well takes the place if its Allan curve is nearer to the measured one.

    `places` are looked at; `tried` remembers (kind, kind that took its place): no swap is taken back.
    """
    best: tuple[float, Alternative, str] | None = None
    for place, effect in enumerate(fit.model.effects):
        if place not in places or effect.screened not in {"spectral", "slow"}:
            continue
        if not _may_leave(effect) or not _shown(fit, place):
            continue
        for found in alternatives(fit, place):
            pair = (effect.kind, found.effect.kind)
            if pair[::-1] in tried or found.evidence < 0.0 or not _may_come(found.effect):
                continue
            if best is not None and found.evidence <= best[0]:
                continue
            if found.evidence >= CLEARLY or _nearer(_of(fit, found.solution), fit):
                best = found.evidence, found, effect.kind
    if best is None:
        return None
    _, found, kind = best
    tried.add((kind, found.effect.kind))
    return refitted(fit, found.solution.model), kind, found.effect
