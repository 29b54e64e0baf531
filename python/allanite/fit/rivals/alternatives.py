"""Fits in which another kind of effect replaces an effect of the model, and the kinds that a record cannot exclude."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array
from allanite.effects import CATALOG, Deterministic, Effect, Modifier, Stochastic
from allanite.fit.engine import solve, with_coefficients
from allanite.fit.estimates import Laws, is_detected_in, min_detected_delta_logl
from allanite.fit.kept import kept_with_fit
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.marginal import slow_amplitudes
from allanite.fit.models import without_effect
from allanite.fit.rivals.columns import follow_columns_consistently
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.shapes.matched import grid_points, matched_gains, slow_families
from allanite.fit.shapes.scan import polished_designs, scan_added_effect, simplest_design

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.fit.solution import Solution

#: Assumed maximum ΔlogL that the optimization of shapes adds to the best grid point. Candidates that would need more are
#: dropped. Chosen by judgment; not measured.
MAX_POLISH_DELTA_LOGL = 25.0

#: Grid points of a slow function of time, their ΔlogL, and their directions.
Scan = tuple[list[Deterministic], Array, Array]


@dataclass(frozen=True, eq=False)
class Alternative:
    """A fitted model in which one effect was replaced by the last one, `effect`, of another kind.

    `evidence` is the ln evidence of this model minus that of the original model.
    """

    effect: Effect
    solution: Solution
    evidence: float


def is_removable(effect: Effect) -> bool:
    """True if a search may remove an effect from the model.

    False for white noise and for effects that exclude samples. False also for effects with a parameter that the user held,
    or that is at a limit given by the user.
    """
    white = isinstance(effect, Stochastic) and effect.white
    removes = isinstance(effect, Modifier) and effect.removes
    # Held by the user, not by the fit because a shape is at the end of its range.
    fixed = effect.held & {*effect.hold, *effect.limits}
    return not (white or removes or fixed)


@kept_with_fit
def solution_without(fit: Fit, *places: int) -> Solution:
    """`Solution` of the model without the effects at the indices `places`; kept with the fit.

    The coefficients of the other effects are fitted again, but their shapes are kept.
    """
    model = fit.model
    for place in sorted(places, reverse=True):
        model = without_effect(model, place)
    return solve(fit.data, model, like=fit.solution, polish=False)


@kept_with_fit
def alternatives(fit: Fit, place: int) -> tuple[Alternative, ...]:
    """Tuple of `Alternative` fits in which another kind of effect replaces the effect at index `place`; kept with the fit.

    The other kinds are its declared alternatives (`Effect.may_be`). The tuple is empty for an effect that may not be
    removed, that is neither spectral nor a slow function, or that is the only effect. A replacement is omitted if it is 28
    nats below the fit before shapes are optimized, if it is not detected, or if it follows a logged column with different
    signs at slow and fast time scales (`follow_columns_consistently`).
    """
    out = fit.model.effects[place]
    is_slow = isinstance(out, Deterministic) and out.low
    if not (is_slow or out.is_tried_in_spectrum()) or not is_removable(out) or len(fit.model) == 1:
        return ()
    # The shapes of the other effects stay, unless the replacement competes with the fit.
    base, found = solution_without(fit, place), []
    min_log_likelihood = (
        fit.solution.log_likelihood - MAX_RIVAL_LOG_EVIDENCE - MAX_POLISH_DELTA_LOGL
    )
    for cls in CATALOG:
        if cls.kind == out.kind or not cls.may_be(out):
            continue
        if out.happens_once and _has_two_ends(cls):
            continue  # the screen of slow functions has compared the forms of an event
        solution = fit_replacement(cls, base, fit.data, min_log_likelihood)
        if solution is None:
            continue
        effect = solution.model.effects[-1]
        risen = solution.log_likelihood - base.log_likelihood
        detected = risen > min_detected_delta_logl(effect)
        if not detected or not follow_columns_consistently((effect,), solution, fit.data):
            continue
        evidence = evidence_gain(solution, fit.solution, fit.data)
        if evidence > -MAX_RIVAL_LOG_EVIDENCE:
            solution = solve(fit.data, solution.model, like=fit.solution)
            effect = solution.model.effects[-1]
            evidence = evidence_gain(solution, fit.solution, fit.data)
        found.append(Alternative(effect, solution, evidence))
    return tuple(found)


def _has_two_ends(cls: type[Effect]) -> bool:
    """True for the class of a slow function with a begin and an end, such as a transition."""
    return issubclass(cls, Deterministic) and cls.low and len({*cls.interval}) == 2


def fit_replacement(
    cls: type[Effect], base: Solution, data: Data, min_log_likelihood: float = -np.inf
) -> Solution | None:
    """`Solution` of the base model plus an effect of kind `cls`; None if no shapes of a grid reach `min_log_likelihood`.

    None as well for kinds that are neither spectral nor slow functions, or that cannot be added to the base model. A
    spectral effect must also show the feature that distinguishes it from its alternatives (`Effect.shows`). A slow function
    with a begin and an end is fitted with all its times, not only with those of a grid.
    `min_log_likelihood` is that of the whole model: an absolute value, not a difference.
    """
    if cls.is_tried_in_spectrum():
        part = RandomPart(data, base.power, base.count)
        blanks = cls.candidates(base.model, data.covariates)
        if not blanks:
            return None
        place = len(base.model)
        points = [point for blank in blanks for point in grid_points(blank, data.n, data.rate)]
        # logL of `part` differs from that of the base by a constant, since known functions are removed from the power.
        scanned = scan_added_effect(base.model, points, base.best, part)
        below = base.log_likelihood - part.log_likelihood_of(base.best)
        if scanned[0][0].log_likelihood + below < min_log_likelihood:
            return None
        model, found = simplest_design(polished_designs(scanned, place, part), place)
        model = with_coefficients(model, found.theta)
        solution = solve(data, model, start=found, like=base, rounds=3, polish=False)
        own = solution.model
        return solution if own.effects[-1].shows(own, data.rate, data.duration) else None
    if _has_two_ends(cls):
        # A high-pass leaves no slow functions.
        if not slow_families(base.model, data.covariates):
            return None
        solution = solve(data, base.model + cls(), like=base, settled=len(base.model), rounds=4)
        return solution if solution.log_likelihood > min_log_likelihood else None
    if issubclass(cls, Deterministic) and cls.low:
        best = best_of_kinds(slow_scans(base, data, lambda b: isinstance(b, cls))).get(cls.kind)
        if best is None or base.log_likelihood + best[0] < min_log_likelihood:
            return None
        return solve(data, base.model + best[1], like=base, settled=len(base.model), rounds=4)
    return None


def slow_scans(
    base: Solution, data: Data, wanted: Callable[[Deterministic], bool]
) -> Iterator[Scan]:
    """Iterator over a matched-filter scan of each slow function of time that `wanted` accepts, added to the fitted model.

    A scan is a tuple (grid points, their ΔlogL, their directions). A grid point is the function with shape values.
    Directions are normalized whitened ordinates, shape (points, ordinates).
    """
    noise = base.noise(data)
    for blanks in slow_families(base.model, data.covariates).values():
        for blank in filter(wanted, blanks):
            points = grid_points(blank, data.n, data.rate)
            gains, directions = matched_gains(
                points, base.ordinates, noise, data, base.model.deterministic
            )
            yield points, gains, directions


def best_of_kinds(scans: Iterable[Scan]) -> dict[str, tuple[float, Deterministic]]:
    """Dict from kind to (ΔlogL, effect): best grid point of each kind of slow function with a positive ΔlogL."""
    best: dict[str, tuple[float, Deterministic]] = {}
    for points, gains, _ in scans:
        top = int(np.argmax(gains))
        kind = points[top].kind
        if gains[top] > best.get(kind, (0.0, None))[0]:
            best[kind] = float(gains[top]), points[top]
    return best


@kept_with_fit
def _slow_laws(fit: Fit) -> Laws:
    """Dict of the distributions of the amplitudes of slow functions of time (`slow_amplitudes`); kept with the fit."""
    return slow_amplitudes(fit.solution, fit.data)


@kept_with_fit
def is_detected(fit: Fit, place: int) -> bool:
    """True if all coefficients of the effect at index `place` are significantly different from 0, or held."""
    if fit.given is None:
        return is_detected_in(fit.solution, place, fit.data, lambda: _slow_laws(fit))
    coefficients = (p.name for p in fit.model.effects[place].parameters if p.role == "coefficient")
    return all(getattr(fit.given[place][name], "detected", True) for name in coefficients)


@dataclass(frozen=True, slots=True)
class Rivals:
    """Alternative explanations of one effect: kinds that explain the record equally well if they replace it.

    `alone` are single kinds, `pairs` are pairs of kinds, best first.
    """

    alone: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with ``rivals``, each kind once, and ``rival_pairs``, a list of pairs [kind, kind]."""
        every = (*self.alone, *(kind for pair in self.pairs for kind in pair))
        return {
            "rivals": list(dict.fromkeys(every)),
            "rival_pairs": [list(pair) for pair in self.pairs],
        }


def rivals(fit: Fit, place: int) -> Rivals:
    """`Rivals`: kinds of effects that explain the record nearly as well as the effect at index `place` of the model.

    `Rivals.alone` can replace this effect with a loss of ln evidence below 3 nats, `Rivals.pairs` together
    (`Fit.alternative_pairs`). Both are empty if the effect is not detected.
    """
    if not is_detected(fit, place):
        return Rivals()
    alone = [a.effect.kind for a in fit.alternatives(place) if a.evidence > -MAX_RIVAL_LOG_EVIDENCE]
    return Rivals(tuple(alone), tuple(pair.kinds for pair in fit.alternative_pairs(place)))
