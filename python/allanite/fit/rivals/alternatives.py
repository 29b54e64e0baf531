"""What else might stand where an effect of a model stands, and explains the record as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Deterministic, Effect, Model, Modifier, Stochastic
from allanite.fit.engine import solve, with_coefficients
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.rivals.columns import consistent
from allanite.fit.rivals.evidence import RIVAL, gained
from allanite.fit.shapes.matched import grid_points, matched_gains, slow_families
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.scan import added, simplest, worth_polishing
from allanite.fit.shapes.shape import free_places, grid_models

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from allanite.fit.engine import Solution
    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit

__all__ = [
    "POLISH",
    "Alternative",
    "alternatives",
    "best_slow",
    "instead",
    "may_leave",
    "shown",
    "slow_scans",
]

#: What a polish of shapes may add to the best point of a scan.
POLISH = 25.0


@dataclass(frozen=True, eq=False)
class Alternative:
    """A model in which another kind stands where an effect stood.

    Attributes
    ----------
    effect : Effect
        What stands there now, with values.
    solution : Solution
    evidence : float
        ln of its evidence over that of the model it was made from.
    """

    effect: Effect
    solution: Solution
    evidence: float


def may_leave(effect: Effect) -> bool:
    """Whether a search may take an effect out: not the white one, what takes samples out, what the user holds or limits."""
    white = isinstance(effect, Stochastic) and effect.white
    removes = isinstance(effect, Modifier) and effect.removes
    # Not a shape that is only at the end of its own range.
    asked = effect.held & {*effect.hold, *effect.limits}
    return not (white or removes or asked)


def alternatives(fit: Fit, place: int) -> Iterator[Alternative]:
    """What else might stand where an effect stands: every kind that is its declared rival, fitted anew.

    Nothing for the white effect, for what happens at one time and for what is held.
    """
    effects = fit.model.effects
    out = effects[place]
    if not may_leave(out) or out.screened not in {"spectral", "slow"}:
        return
    less = Model(effects[:place] + effects[place + 1 :])
    if not len(less):
        return
    # Shapes of the others stay as they are: what takes the place is fitted wholly before it is believed.
    base = solve(fit.data, less, like=fit.solution, polish=False)
    part = RandomPart(fit.data, base.power, base.count)
    for cls in CATALOGUE:
        if cls.kind == out.kind or not cls.may_be(out):
            continue
        solution = instead(cls, base, part, fit.solution.log_likelihood - RIVAL - POLISH)
        if solution is None:
            continue
        effect = solution.model.effects[-1]
        if not consistent((effect,), solution, fit.data):
            continue
        yield Alternative(effect, solution, gained(solution, fit.solution, fit.data))


def instead(cls: type[Effect], base: Solution, part: RandomPart, least: float) -> Solution | None:
    """The base, of which `part` is the random part, with an effect of this kind.

    None where the best point of its grid stays below `least` in logL.
    """
    data = part.data
    if cls.screened == "spectral":
        blanks = cls.candidates(base.model, data.covariates)
        if not blanks:
            return None
        place = len(base.model)
        points = [m.effects[-1] for b in blanks for m in grid_models(base.model + b, place, data)]
        # Power and count are those without known functions of time: as much is lost beside the whole record.
        scanned = added(base.model, points, base.best, part)
        below = base.log_likelihood - part.judged(base.best)
        if scanned[0][0].log_likelihood + below < least:
            return None
        ends = [
            polish(
                model, [p for p in free_places(model) if p[0] == place], found, part, roughly=True
            )
            for found, model in worth_polishing(scanned)
        ]
        model, found = simplest(ends, place)
        model = with_coefficients(model, found.theta)
        return solve(data, model, start=found, like=base, rounds=3, polish=False)
    if cls.screened == "slow":
        best = best_slow(base, data, lambda blank: isinstance(blank, cls)).get(cls.kind)
        if best is None or base.log_likelihood + best[0] < least:
            return None
        return solve(data, base.model + best[1], like=base, rounds=3, polish=False)
    return None


def slow_scans(
    base: Solution, data: Data, wanted: Callable[[Deterministic], bool]
) -> Iterator[tuple[list[Deterministic], NDArray[np.float64], NDArray[np.float64]]]:
    """Slow functions that may be missing: the points of the grid of each, their gains and directions beside a model."""
    noise = base.noise(data)
    for blanks in slow_families(base.model, data.covariates).values():
        for blank in filter(wanted, blanks):
            points = grid_points(blank, data)
            gains, directions = matched_gains(
                points, base.ordinates, noise, data, base.model.deterministic
            )
            yield points, gains, directions


def best_slow(
    base: Solution, data: Data, wanted: Callable[[Deterministic], bool]
) -> dict[str, tuple[float, Deterministic]]:
    """The best point of every kind of slow function beside a model, with its gain."""
    best: dict[str, tuple[float, Deterministic]] = {}
    for points, gains, _ in slow_scans(base, data, wanted):
        top = int(np.argmax(gains))
        kind = points[top].kind
        if gains[top] > best.get(kind, (0.0, None))[0]:
            best[kind] = float(gains[top]), points[top]
    return best


def shown(fit: Fit, place: int) -> bool:
    """Whether the record distinguished the coefficient of an effect from 0."""
    effect = fit.model.effects[place]
    values = fit.estimates[place]
    return all(
        getattr(values[p.name], "detected", True)
        for p in effect.parameters
        if p.role == "coefficient"
    )
