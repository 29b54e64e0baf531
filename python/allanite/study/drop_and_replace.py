"""Moves of the search after an addition: drop what is no longer needed, replace what stands for something else."""

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
    "added_to",
    "mostly_within",
    "one_thing",
    "pruned",
    "swapped",
    "with_samples_out",
]


def _of(fit: Fit, solution: Solution) -> Fit:
    return Fit(fit.recording, solution.model, fit.method, fit.data, solution)


def pruned(
    fit: Fit, before: Fit, asked: int, gone: set[str], stand_in: set[str]
) -> tuple[Fit, list[str], int]:
    """The fit without what is no longer needed, the kinds taken out, and how many of the start's effects are left.

    Parameters
    ----------
    fit, before : Fit
        After and before the addition, which is the last effect of the model.
    asked : int
        How many effects, from the first, are the start's.
    gone : set of str
        Kinds that were taken out on an earlier rung and came back: needed.
    stand_in : set of str
        Kinds that took the place of one of the start's: kept as long as that would have been.
    """
    removed: list[str] = []
    # The interval of a function of time counts on the slow noise that the start asked for.
    first = asked if isinstance(fit.model.effects[-1], Deterministic) else 0
    place = len(fit.model.effects) - 2
    while place >= first:
        effect = fit.model.effects[place]
        own = place < asked
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
                asked -= own
        place -= 1
    return fit, removed[::-1], asked


def _may_come(effect: Effect, place: Effect) -> bool:
    """True if a swap may put an effect in another's place; one-off events and X are only suggested, filters elsewhere."""
    once = isinstance(effect, Deterministic) and effect.happens_once
    filtering = isinstance(effect, Modifier) and not isinstance(place, Modifier)
    return not (once or effect.last_resort or filtering)


def _without(fit: Fit, place: int, least: float) -> Fit | None:
    """The fit without an effect, if that costs less than `least` of logL."""
    effects = fit.model.effects
    less = Model(effects[:place] + effects[place + 1 :])
    if effects[place].screened not in {"spectral", "slow", "line"}:
        return None  # the evidence of what happens in time is not in the mean spectrum
    # With the shapes as they are the loss is an upper bound: far above what matters, it need not be known better.
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


def added_to(
    fit: Fit, addition: Effect | Suggestion, asked: int, lines: Sequence[Effect] = ()
) -> tuple[Fit, tuple[str, ...], tuple[Effect, ...]] | None:
    """The fit with an effect more, or a suggestion's, the kind that gave way to it, and what came with it.

    Of lines and a band at one frequency one stays: several of the `lines` that are known may be one band.

    None where the one that is there explains as much, or is one of the first `asked`, which the start has.
    """
    effect = addition if isinstance(addition, Effect) else addition.effect
    if not isinstance(addition, Effect) and addition.before is fit and addition.gives_way:
        first = [e.kind for e in fit.model.effects[:asked]]
        if any(kind in first for kind in addition.gives_way):
            return None
        return fit.add(addition), addition.gives_way, ()
    place = next((i for i, e in enumerate(fit.model) if one_thing(e, effect, fit)), None)
    if place is None:
        return (*with_samples_out(fit, addition, asked), ())
    if place < asked:
        return None
    effects = fit.model.effects
    rest = (*effects[:place], *effects[place + 1 :])
    better = refitted(fit, Model((*rest, effect)))
    came: tuple[Effect, ...] = ()
    for line in _apart([effect, *(e for e in lines if one_thing(effects[place], e, fit))], fit):
        more = refitted(fit, Model((*rest, effect, *came, line)))
        if evidence(more.solution) > evidence(better.solution) + MAX_RIVAL_LOG_EVIDENCE:
            better, came = more, (*came, line)
    clearly = evidence(better.solution) > evidence(fit.solution) + MAX_RIVAL_LOG_EVIDENCE
    return (better, (effects[place].kind,), came) if clearly else None


def with_samples_out(
    fit: Fit, addition: Effect | Suggestion, asked: int
) -> tuple[Fit, tuple[str, ...]]:
    """The fit with an effect more, and the kinds of what went with the samples it takes out."""
    effect = addition if isinstance(addition, Effect) else addition.effect
    if not isinstance(effect, Modifier) or not effect.removes or effect.when is None:
        return fit.add(addition), ()
    gone = [e for e in fit.model.effects[asked:] if mostly_within(e, effect.when, fit)]
    if not gone:
        return fit.add(addition), ()
    rest = tuple(e for e in fit.model.effects if e not in gone)
    return refitted(fit, Model((*rest, effect))), tuple(e.kind for e in gone)


def mostly_within(effect: Effect, when: tuple[float, float], fit: Fit) -> bool:
    """Whether it is of a while, or of moments, by half or more between two times.

    A function of time is there if it hardly changes elsewhere.
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


def _apart(lines: Sequence[Effect], fit: Fit) -> tuple[Effect, ...]:
    """Those lines behind the first that are too far apart to be one that wanders; none if the first is no line."""
    kept: list[Effect] = []
    for line in lines:
        alone = line.screened == "line" and line.occupies is not None
        if alone and all(
            between(line, other) > MAX_LINE_BAND_DISTANCE / fit.data.duration for other in kept
        ):
            kept.append(line)
    return tuple(kept[1:]) if kept and kept[0] is lines[0] else ()


def between(one: Effect, other: Effect) -> float:
    """Hz from one line to another."""
    a, b = one.occupies, other.occupies
    return abs(a[0] - b[0]) if a is not None and b is not None else np.inf


def one_thing(one: Effect, other: Effect, fit: Fit) -> bool:
    """Whether two effects are one hump or gap of the spectrum.

    A line in a band, or too near to be told from it: one that wanders is a narrow band with single ordinates that stand out
    in its flanks. Two bands about as wide of which one has its middle in the other: the hump is no pure resonance. What is
    on the course of a band that moves. A band and a filter that takes out what is there: each would grow against the other.
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


def _nearer(new: Fit, old: Fit, place: int) -> bool:
    """Whether the Allan curve is clearly nearer to a measured one that is farther away than chance leads.

    What stands at `place` gives way within chance too, where the record does not show it.
    """
    a, b = new.curve.rms_percent, old.curve.rms_percent
    if a is None or b is None or np.log1p(a / 100.0) > MAX_ALLAN_ERROR_RATIO * np.log1p(b / 100.0):
        return False
    chance = old.curve.chance_percent or 0.0
    return b > MAX_ALLAN_ERROR_SCATTERS * chance or (b > chance and not is_detected(old, place))


def swapped(
    fit: Fit, places: set[int], tried: set[tuple[str, str]], barred: set[str]
) -> tuple[Fit, str, Effect] | None:
    """The fit in which another kind stands clearly better where an effect stands, the kind that left, and the new effect.

    One that is little better takes the place if its Allan curve is clearly nearer to a measured one that chance does not
    explain, or if the record does not show what stands there.

    `places` are looked at; `tried` remembers (kind, kind that took its place): no swap is taken back. Kinds that are
    `barred` take no place.
    """
    best: tuple[float, Alternative, str] | None = None
    for place, effect in enumerate(fit.model.effects):
        if place not in places or _absent(effect):
            continue
        for found in fit.alternatives(place):
            new = found.effect.kind
            if (new, effect.kind) in tried or new in barred or not _may_come(found.effect, effect):
                continue
            if best is not None and found.evidence <= best[0]:
                continue
            risen = found.solution.log_likelihood - fit.solution.log_likelihood
            enough = risen >= MIN_GAIN_PER_RIVAL_PARAMETER * max(
                1, found.effect.numbers - effect.numbers
            )
            if found.evidence >= MAX_RIVAL_LOG_EVIDENCE or (
                enough and _nearer(_of(fit, found.solution), fit, place)
            ):
                best = found.evidence, found, effect.kind
    if best is None:
        return None
    _, found, kind = best
    tried.add((kind, found.effect.kind))
    better = refitted(fit, found.solution.model)
    came = max(i for i, e in enumerate(better.model) if e.kind == found.effect.kind)
    # What shares its part with another may be ahead, and be nothing by itself.
    return (better, kind, found.effect) if is_detected(better, came) else None
