"""Moves of the search: add an effect, drop effects that are no longer needed, replace an effect by an alternative."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic, Effect, Model, Modifier, Moving, Periodic, Stochastic
from allanite.fit import refitted, removes
from allanite.fit.engine import solve
from allanite.fit.result import Fit
from allanite.fit.rivals.alternatives import MAX_POLISH_DELTA_LOGL, is_detected, is_removable
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, bic_cost, evidence
from allanite.suggestion.constants import (
    MAX_ALLAN_ERROR_RATIO,
    MAX_ALLAN_ERROR_SCATTERS,
    MAX_BAND_WIDTH_RATIO,
    MAX_LINE_BAND_DISTANCE,
    MIN_ENERGY_IN_SEGMENT,
    MIN_EXPLAINED_COST_FRACTION,
    MIN_GAIN_PER_RIVAL_PARAMETER,
    MIN_START_EFFECT_GAIN,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.rivals.alternatives import Alternative
    from allanite.fit.solution import Solution
    from allanite.suggestion.suggest import Suggestion

__all__ = [
    "is_same_feature",
    "lies_mostly_within",
    "with_addition",
    "with_best_alternative",
    "with_exclusion",
    "without_needless_effects",
]


def _fit_of(fit: Fit, solution: Solution) -> Fit:
    """Fit of a solution."""
    return Fit(fit.recording, solution.model, fit.method, fit.data, solution)


def without_needless_effects(
    fit: Fit, before: Fit, start_count: int, gone: set[str], stand_in: set[str]
) -> tuple[Fit, list[str], int]:
    """Fit without needless effects, the kinds dropped, and the number of initial effects that are left.

    Parameters
    ----------
    fit, before : Fit
        After and before the addition, which is the last effect of the model.
    start_count : int
        Number of effects, from the first, that the initial model has.
    gone : set of str
        Kinds that were dropped on an earlier step and added again: they are needed.
    stand_in : set of str
        Kinds that replaced an initial effect: they are dropped by the same rule as an initial effect.
    """
    removed: list[str] = []
    # The interval of a function of time depends on the slow noise of the initial model, which therefore stays.
    first = start_count if isinstance(fit.model.effects[-1], Deterministic) else 0
    place = len(fit.model.effects) - 2
    while place >= first:
        effect = fit.model.effects[place]
        own = place < start_count
        if (
            is_removable(effect)
            and effect.kind not in gone
            and not (own and not is_detected(before, place))
        ):
            least = (
                MIN_START_EFFECT_GAIN
                if own or effect.kind in stand_in
                else MIN_EXPLAINED_COST_FRACTION * effect.numbers * bic_cost(fit.solution)
            )
            without = _without(fit, place, least)
            if without is not None:
                removed.append(effect.kind)
                fit = without
                start_count -= own
        place -= 1
    return fit, removed[::-1], start_count


def _may_replace(effect: Effect, place: Effect) -> bool:
    """True if an alternative may replace an effect: no one-off event, no power law, and a filter only another filter."""
    once = isinstance(effect, Deterministic) and effect.happens_once
    filtering = isinstance(effect, Modifier) and not isinstance(place, Modifier)
    return not (once or effect.last_resort or filtering)


def _without(fit: Fit, place: int, least: float) -> Fit | None:
    """Fit without an effect, if that loses less than `least` of logL; else None."""
    effects = fit.model.effects
    less = Model(effects[:place] + effects[place + 1 :])
    if effects[place].screened not in {"spectral", "slow", "line"}:
        return None  # the evidence of events in time is not in the mean spectrum
    # With fixed shapes the loss is an upper bound. If it is far above the limit, the full fit is not needed.
    rough = (
        solve(fit.data, less, like=fit.solution, polish=False)
        if not removes(effects[place])
        else None
    )
    if (
        rough is not None
        and fit.solution.log_likelihood - rough.log_likelihood > least + MAX_POLISH_DELTA_LOGL
    ):
        return None
    found = refitted(fit, less)
    lost = fit.solution.log_likelihood - found.solution.log_likelihood
    return found if lost < least else None


def with_addition(
    fit: Fit, addition: Effect | Suggestion, start_count: int, lines: Sequence[Effect] = ()
) -> tuple[Fit, tuple[str, ...], tuple[Effect, ...]] | None:
    """Fit with one more effect, the kinds that left for it, and further effects added with it; None if it does not help.

    Of a line and a band at one frequency only one stays. Several of the suggested `lines` may together replace one band.
    The addition is refused if the present effect explains as much or is among the first `start_count`, which are the
    initial ones.
    """
    effect = addition if isinstance(addition, Effect) else addition.effect
    if not isinstance(addition, Effect) and addition.before is fit and addition.gives_way:
        first = [e.kind for e in fit.model.effects[:start_count]]
        if any(kind in first for kind in addition.gives_way):
            return None
        return fit.add(addition), addition.gives_way, ()
    place = next((i for i, e in enumerate(fit.model) if is_same_feature(e, effect, fit)), None)
    if place is None:
        return (*with_exclusion(fit, addition, start_count), ())
    if place < start_count:
        return None
    effects = fit.model.effects
    rest = (*effects[:place], *effects[place + 1 :])
    better = refitted(fit, Model((*rest, effect)))
    came: tuple[Effect, ...] = ()
    for line in _separate_lines(
        [effect, *(e for e in lines if is_same_feature(effects[place], e, fit))], fit
    ):
        more = refitted(fit, Model((*rest, effect, *came, line)))
        if evidence(more.solution) > evidence(better.solution) + MAX_RIVAL_LOG_EVIDENCE:
            better, came = more, (*came, line)
    clearly = evidence(better.solution) > evidence(fit.solution) + MAX_RIVAL_LOG_EVIDENCE
    return (better, (effects[place].kind,), came) if clearly else None


def with_exclusion(
    fit: Fit, addition: Effect | Suggestion, start_count: int
) -> tuple[Fit, tuple[str, ...]]:
    """Fit with one more effect, and the kinds that left because their samples are excluded."""
    effect = addition if isinstance(addition, Effect) else addition.effect
    if not isinstance(effect, Modifier) or not effect.removes or effect.when is None:
        return fit.add(addition), ()
    gone = [e for e in fit.model.effects[start_count:] if lies_mostly_within(e, effect.when, fit)]
    if not gone:
        return fit.add(addition), ()
    rest = tuple(e for e in fit.model.effects if e not in gone)
    return refitted(fit, Model((*rest, effect))), tuple(e.kind for e in gone)


def lies_mostly_within(effect: Effect, when: tuple[float, float], fit: Fit) -> bool:
    """True if at least half of an effect, or of its moments, lies between two times.

    For a function of time, nearly all of its changes must lie there.
    """
    first, last = when
    if isinstance(effect, Modifier) and effect.moments:
        inside = sum(first <= moment <= last for moment in effect.moments)
        return 2 * inside >= len(effect.moments)
    if isinstance(effect, Deterministic) and not isinstance(effect, Periodic):
        signal, time = fit.data.signal((effect,)), fit.data.time
        there = (first <= time) & (time <= last)
        signal = (signal - signal[~there].mean()) ** 2 if not there.all() else signal
        return bool(signal[there].sum() >= MIN_ENERGY_IN_SEGMENT * signal.sum())
    if not isinstance(effect, Modifier) or effect.when is None:
        return False
    begin, end = effect.when
    within = 2.0 * (min(end, last) - max(begin, first)) >= end - begin
    return (effect.passing or effect.removes) and within


def _separate_lines(lines: Sequence[Effect], fit: Fit) -> tuple[Effect, ...]:
    """Lines after the first that are too far apart to be one wandering line; empty if the first effect is no line."""
    kept: list[Effect] = []
    for line in lines:
        alone = line.screened == "line" and line.occupies is not None
        if alone and all(
            line_distance(line, other) > MAX_LINE_BAND_DISTANCE / fit.data.duration
            for other in kept
        ):
            kept.append(line)
    return tuple(kept[1:]) if kept and kept[0] is lines[0] else ()


def line_distance(one: Effect, other: Effect) -> float:
    """Distance of two lines, Hz."""
    a, b = one.occupies, other.occupies
    return abs(a[0] - b[0]) if a is not None and b is not None else np.inf


def is_same_feature(one: Effect, other: Effect, fit: Fit) -> bool:
    """True if two effects describe one hump or gap of the spectrum.

    This holds for a line in or near a band (a wandering line leaves single ordinates in the flanks of a band); for two
    bands of similar width, one with its middle in the other (the hump is no pure resonance); for an effect on the course of
    a moving band; and for a band and a filter that removes it, since each would grow against the other.
    """
    a, b = one.occupies, other.occupies
    if a is None or b is None:
        return False
    if isinstance(one, Modifier) and isinstance(other, Modifier):
        return False
    lines = (a[0] == a[1]) + (b[0] == b[1])
    if lines == 2:
        return False
    for moving, (low, high), (first, last) in ((one, a, b), (other, b, a)):
        if isinstance(moving, Moving) and low <= 0.5 * (first + last) <= high:
            return True
    if not (lines or isinstance(one, Modifier) or isinstance(other, Modifier)):
        widths = sorted((0.5 * (a[1] - a[0]), 0.5 * (b[1] - b[0])))
        return 0.5 * abs(sum(a) - sum(b)) < widths[1] < MAX_BAND_WIDTH_RATIO * widths[0]
    apart = max(a[0], b[0]) - min(a[1], b[1])
    return apart <= MAX_LINE_BAND_DISTANCE / fit.data.duration


def _absent(effect: Effect) -> bool:
    """True if the coefficient is zero: the fit found none of the effect."""
    return isinstance(effect, Stochastic) and not effect.values[effect.coefficient]


def _fits_curve_better(new: Fit, old: Fit, place: int) -> bool:
    """True if the Allan curve is clearly closer to the measured one, whose distance was beyond its scatter.

    An effect at `place` that the record does not show gives way within the scatter as well.
    """
    a, b = new.curve.rms_percent, old.curve.rms_percent
    if a is None or b is None or np.log1p(a / 100.0) > MAX_ALLAN_ERROR_RATIO * np.log1p(b / 100.0):
        return False
    chance = old.curve.chance_percent or 0.0
    return b > MAX_ALLAN_ERROR_SCATTERS * chance or (b > chance and not is_detected(old, place))


def with_best_alternative(
    fit: Fit, places: set[int], tried: set[tuple[str, str]], barred: set[str]
) -> tuple[Fit, str, Effect] | None:
    """Fit in which the best alternative replaces an effect, the kind that left, and the new effect; None if none is better.

    An alternative must have a score higher by `MAX_RIVAL_LOG_EVIDENCE`. With less, it must bring the Allan curve clearly
    closer to a measured one beyond its scatter, or replace an effect that the record does not show. Only effects at
    `places` are examined. `tried` remembers (kind, replacement), so that no replacement is reversed. Kinds in `barred`
    replace nothing.
    """
    best: tuple[float, Alternative, str] | None = None
    for place, effect in enumerate(fit.model.effects):
        if place not in places or _absent(effect):
            continue
        for found in fit.alternatives(place):
            new = found.effect.kind
            if (
                (new, effect.kind) in tried
                or new in barred
                or not _may_replace(found.effect, effect)
            ):
                continue
            if best is not None and found.evidence <= best[0]:
                continue
            risen = found.solution.log_likelihood - fit.solution.log_likelihood
            enough = risen >= MIN_GAIN_PER_RIVAL_PARAMETER * max(
                1, found.effect.numbers - effect.numbers
            )
            if found.evidence >= MAX_RIVAL_LOG_EVIDENCE or (
                enough and _fits_curve_better(_fit_of(fit, found.solution), fit, place)
            ):
                best = found.evidence, found, effect.kind
    if best is None:
        return None
    _, found, kind = best
    tried.add((kind, found.effect.kind))
    better = refitted(fit, found.solution.model)
    came = max(i for i, e in enumerate(better.model) if e.kind == found.effect.kind)
    # An alternative may score high together with another effect, although the record does not show it.
    return (better, kind, found.effect) if is_detected(better, came) else None
