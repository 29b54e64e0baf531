"""Search of several weak excursions, none of which is significant alone.

While excursions are missing, the fitted noise is too high for each of them. They are therefore added one by one, with the
noise refitted, and judged together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOG, Deterministic
from allanite.fit.engine import solve
from allanite.fit.rivals.evidence import evidence
from allanite.fit.shapes.matched import best_spans
from allanite.suggestion.constants import MAX_EVENTS
from allanite.suggestion.p_values import log_chi2_tail

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution


def merged_excursions(events: Sequence[Deterministic]) -> Deterministic | None:
    """Effect of the catalog that contains all excursions of `events`, e.g. for a joint fit; None if no kind can."""
    kinds = (cls for cls in CATALOG if issubclass(cls, Deterministic))
    return next((one for cls in kinds if (one := cls.together(events)) is not None), None)


def excursions_overlap(one: Deterministic, event: Deterministic) -> bool:
    """True if the first excursion of `one` overlaps any excursion of `event` in time."""
    (start, end), *_ = _excursion_times(one)
    return any(start < last and end > first for first, last in _excursion_times(event))


def _excursion_times(event: Deterministic) -> list[tuple[float, float]]:
    """List of pairs (start, end), s, one for each single excursion that an effect contains."""
    return [e.when for e in event.singly if e.when is not None]


def several_excursions(
    kind: type[Deterministic], first: Deterministic, places: float, solution: Solution, data: Data
) -> tuple[Deterministic, float] | None:
    """Pair (effect, ln number): one effect that contains 2 to 32 excursions (short events); or None.

    Excursions are added one by one as long as the p-value falls, and the set with the highest evidence is taken. The number
    is that of possible sets of so many excursions, divided by that of single ones. `first` is the best single excursion,
    `places` the number of independent ones, and `solution` that of the model without any.
    """
    found, fitted = [_with_height_one(first)], _solution_with_excursions([first], solution, data)
    log_p, best, events = _log_p(1, places, fitted, solution), -np.inf, []
    while log_p < 0.0 and len(found) < MAX_EVENTS:
        further = _next_excursion(kind, fitted, data)
        if further is None or any(excursions_overlap(further, e) for e in found):
            break
        found = [*found, further]
        fitted = _solution_with_excursions(found, solution, data)
        risen = _log_p(len(found), places, fitted, solution)
        if risen >= log_p:
            break
        log_p = risen
        if evidence(fitted) > best:
            best, events = evidence(fitted), found
    if not events:
        return None
    for place in range(len(events)):
        # The first ones were found while the noise was too high.
        others = events[:place] + events[place + 1 :]
        moved = _next_excursion(kind, _solution_with_excursions(others, solution, data), data)
        if moved is not None and not any(excursions_overlap(moved, e) for e in others):
            events[place] = moved
    whole = merged_excursions(events)
    return None if whole is None else (whole, _log_choices(len(events), places))


def _next_excursion(
    kind: type[Deterministic], solution: Solution, data: Data
) -> Deterministic | None:
    """Excursion (short event) of the given kind, with height 1, that fits best as the next one; None if there is none."""
    spans = best_spans(
        kind, solution.ordinates, solution.noise(data), data, solution.model.deterministic
    )
    return next((_with_height_one(effect) for effect, _ in spans if effect.returns), None)


def _with_height_one(event: Deterministic) -> Deterministic:
    """Copy of an excursion with height 1, as a start value for a joint fit of several excursions."""
    return event.with_amplitudes(np.ones(1))


def _solution_with_excursions(
    events: Sequence[Deterministic], solution: Solution, data: Data
) -> Solution:
    """`Solution` of a trial fit of the model plus the excursions `events` as one effect; shapes keep their values."""
    effect = merged_excursions(events) if len(events) > 1 else events[0]
    assert effect is not None
    model = solution.model
    return solve(data, model + effect, like=solution, polish=False, settled=len(model), rounds=4)


def _log_p(count: int, places: float, fitted: Solution, solution: Solution) -> float:
    """Natural logarithm of the p-value, at most 0, of adding `count` excursions (short events) to the model together.

    The p-value is corrected for the choice of the times of the excursions; `places` is the number of independent times.
    """
    gain = fitted.log_likelihood - solution.log_likelihood
    return min(
        0.0, log_chi2_tail(gain, count) + _log_choices(count, places) + float(np.log(places))
    )


def _log_choices(count: int, places: float) -> float:
    """Ln of the number of sets of `count` excursions, relative to the number of single excursions (`places`)."""
    from scipy.special import gammaln

    return (count - 1) * float(np.log(places)) - float(gammaln(count + 1.0))
