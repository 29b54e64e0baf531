"""Candidates that change the spectrum: every random process and filter of the catalogue, at every shape of its grid.

Screen by projected score (no refit), then refit the best few of each kind.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Effect, Model, Modifier, Stochastic
from allanite.effects.model import ONCE
from allanite.fit.data import column
from allanite.fit.engine import Solution, solve
from allanite.fit.shape import shape_grid
from allanite.showing import brief
from allanite.suggestion.evidence import arc_length

if TYPE_CHECKING:
    from allanite.fit.data import Data

__all__ = ["Candidate", "Screen", "screen_spectral"]

#: A candidate whose score promises less is not refitted.
LEAST = 2.0


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

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class Screen:
    """Candidates of a family and the angle that each kind's grid spans."""

    candidates: tuple[Candidate, ...]
    arcs: tuple[float, ...]
    #: Family of each of the arcs where a screen serves several.
    families: tuple[str, ...] = ()

    __repr__ = brief


def _points(cls: type[Effect], data: Data) -> list[Effect]:
    blank = cls()
    names = [p.name for p in cls.parameters if p.role == "shape"]
    variants = getattr(blank, "variants", None)
    out = []
    for variant in (blank,) if variants is None else variants():
        grids = [shape_grid(variant, name, data) for name in names]
        out += [
            variant.with_values(**dict(zip(names, map(float, point), strict=True)))
            for point in product(*grids)
        ]
    return out


def _tangent(effect: Effect, solution: Solution, data: Data) -> NDArray[np.float64]:
    """Change of bin power for a small amount of the effect, shape (bins,)."""
    model = solution.model
    if isinstance(effect, Modifier):
        changed = Model((*model.effects, effect))
        return column(data.terms(changed), data) - solution.spectrum
    assert isinstance(effect, Stochastic)
    return column(data.unit_terms(model, effect), data)


def screen_spectral(solution: Solution, data: Data) -> Screen:
    """Refitted best candidate of every kind whose score promises something."""
    root = np.sqrt(0.5 * solution.count)
    residual = root * (solution.power / solution.spectrum - 1.0)
    # Directions that the model can already move in, and into which it will after the refit.
    own = solution.columns[:, solution.theta > 0.0]
    basis, _ = np.linalg.qr((own / solution.spectrum[:, None]) * root[:, None])
    present = {e.kind for e in solution.model.effects}
    found: list[Candidate] = []
    arcs: list[float] = []
    families: list[str] = []
    for cls in CATALOGUE:
        if not issubclass(cls, (Stochastic, Modifier)) or not getattr(cls, "suggested", True):
            continue
        if cls.kind in present and cls.kind in ONCE:
            continue
        if issubclass(cls, Modifier) and "angle_random_walk" not in present:
            continue
        points = _points(cls, data)
        tangents = np.stack([_tangent(p, solution, data) for p in points])
        directions = tangents / solution.spectrum * root
        size = np.linalg.norm(directions, axis=1)
        projected = directions - (directions @ basis) @ basis.T
        norm = np.linalg.norm(projected, axis=1)
        usable = norm > 1e-3 * np.maximum(size, 1e-300)
        if not usable.any():
            continue
        unit = projected[usable] / norm[usable, None]
        score = unit @ residual
        arcs.append(arc_length(unit))
        families.append(cls.family)
        # A filter changes the spectrum by orders of magnitude where the score, a slope, says little:
        # all its designs and cutoffs are refitted.
        tried = score.size if issubclass(cls, Modifier) else 3
        order = np.argsort(score)[::-1][:tried]
        if 0.5 * max(score[order[0]], 0.0) ** 2 < LEAST:
            continue
        kept = [p for p, keep in zip(points, usable, strict=True) if keep]
        best = _refit([kept[i] for i in order], solution, data)
        if best is not None:
            found.append(best)
    return Screen(tuple(found), tuple(arcs), tuple(families))


def _refit(points: list[Effect], base: Solution, data: Data) -> Candidate | None:
    """The best of a few starting points, shapes polished."""
    coarse = []
    for effect in points:
        solution = solve(data, base.model + effect, polish=False, rounds=2)
        coarse.append((solution.log_likelihood, effect))
    _, effect = max(coarse, key=lambda pair: pair[0])
    solution = solve(data, base.model + effect, rounds=3)
    fitted = solution.model.effects[-1]
    gain = solution.log_likelihood - base.log_likelihood
    if gain <= 0.0:
        return None
    count = sum(p.role != "derived" for p in fitted.parameters)
    return Candidate(fitted, gain, fitted.family, solution, count)
