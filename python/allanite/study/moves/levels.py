"""Merged changes of level: if the white-noise level changes several times, one effect describes all changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOG, Model, Modifier
from allanite.fit import refitted
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.suggestion.constants import MAX_SEPARATE_LEVEL_INTERVALS
from allanite.suggestion.screens.level_changes import level_series, screen_levels

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.study.state import State
    from allanite.suggestion.screens import Candidate


def with_merged_levels(before: State) -> State | None:
    """`State` in which one effect replaces all changes of the white-noise level that the search added; or None.

    The effect is the one with the largest ΔlogL minus BIC cost, for the white-noise power over time: one that a new search
    finds, or all added changes together. None if the power over time is not known. None as well if no effect has a ΔlogL
    more than 3 nats above that of the added changes without the last one.
    """
    fit = before.fit
    changes, places = _added_level_changes(before)
    base = refitted(fit, Model(tuple(e for e in fit.model if e not in changes)))
    whitened = whiten(base.solution, base.data)
    series = level_series(base.solution, base.data, whitened)
    if series is None:
        return None
    power = np.maximum(series.judged, 1e-12)
    price = 0.5 * np.log(max(series.freedom * power.size, 2.0))

    def explained(level: Modifier) -> float:
        """ΔlogL, nats, of a change of level compared with a constant level, from the white-noise power over time.

        Times with the same factor share one level: their mean power.
        """
        _, which = np.unique(level.gain(series.times), return_inverse=True)
        count = np.bincount(which)
        means = np.bincount(which, weights=power) / count
        return float(-0.5 * series.freedom * (count @ np.log(means / power.mean())))

    def worth(level: Modifier) -> float:
        """ΔlogL of a change of level less the BIC cost of its parameters, nats."""
        return explained(level) - price * level.numbers

    had = max((explained(level) for level in _product_levels(changes[:-1])), default=0.0)
    found = [
        *_switching_levels(screen_levels(base.solution, base.data, whitened)),
        *_product_levels(changes),
    ]
    # Requiring more each time prevents a loop between equal sets.
    found = [level for level in found if explained(level) > had + MAX_RIVAL_LOG_EVIDENCE]
    if not found:
        return None
    return before.after(refitted(base, base.model + max(found, key=worth)), places)


def must_merge_levels(state: State) -> bool:
    """True if the changes of the noise level that the search added must become one effect.

    At most two changes may stay separate, and two only if each is an interval after which the level returns to its first
    value.
    """
    changes, _ = _added_level_changes(state)
    intervals = all(len(e.switches[0]) == 2 and e.switches[1][-1] == 1.0 for e in changes)
    return len(changes) > (MAX_SEPARATE_LEVEL_INTERVALS if intervals else 1)


def _added_level_changes(state: State) -> tuple[list[Modifier], list[int]]:
    """Pair of lists: the added effects that switch the noise level, and their indices in the model."""
    effects = state.fit.model.effects
    found = [(e, p) for p in state.added if isinstance(e := effects[p], Modifier) and e.switches[0]]
    return [e for e, _ in found], [p for _, p in found]


def _switching_levels(candidates: Iterable[Candidate]) -> list[Modifier]:
    """List of the effects of the `candidates` that switch between noise levels."""
    return [c.effect for c in candidates if isinstance(c.effect, Modifier) and c.effect.switches[0]]


def _product_levels(changes: list[Modifier]) -> list[Modifier]:
    """List of effects, one for each suitable kind of the catalog, whose level is the product of the levels of `changes`."""
    times = np.array(sorted({t for change in changes for t in change.switches[0]}))
    gains = np.prod([change.gain(times) for change in changes], axis=0)
    kept = np.flatnonzero(np.diff([1.0, *gains]))
    many = {"times": tuple(times[kept].tolist()), "factors": tuple(gains[kept].tolist())}
    kinds = [cls for cls in CATALOG if issubclass(cls, Modifier)]
    return [effect for cls in kinds if (effect := cls.from_values(**many)) is not None]
