"""State of a search: a fitted model in which each effect keeps its number, whatever is added, dropped or replaced."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit
    from allanite.study.ladder import Rung


@dataclass(frozen=True, eq=False)
class State:
    """A fitted model of a search and the numbers of its effects, of which the user's are the first.

    `given` are the kinds of the user's effects. One that can be in a model only once keeps its number if it comes back.
    `used` is the number of effects that any model of the search had.
    """

    fit: Fit
    numbers: tuple[int, ...]
    given: tuple[str, ...]
    used: int

    @classmethod
    def of(cls, fit: Fit, given: int | None = None) -> State:
        """`State` of a fit, in which the first `given` effects, by default all, count as the user's."""
        kinds = tuple(effect.kind for effect in fit.model)
        return cls(fit, tuple(range(len(kinds))), kinds[:given], len(kinds))

    def after(self, fit: Fit, removed: Collection[int] = ()) -> State:
        """`State` of a later fit of the same search.

        Its model keeps the effects in order, without those at the indices `removed`, followed by new effects. If a new
        effect may occur only once and the user's model had this kind, it counts as the user's.
        """
        numbers = [n for place, n in enumerate(self.numbers) if place not in removed]
        used = self.used
        for effect in fit.model.effects[len(numbers) :]:
            back = (
                self.given.index(effect.kind)
                if effect.single and effect.kind in self.given
                else used
            )
            numbers.append(back)
            used += back == used
        return State(fit, tuple(numbers), self.given, used)

    def is_given(self, place: int) -> bool:
        """True if the effect at index `place` is one of the user's model."""
        return self.numbers[place] < len(self.given)

    @property
    def added(self) -> tuple[int, ...]:
        """Tuple of the indices of the effects that the search added."""
        return tuple(p for p in range(len(self.numbers)) if not self.is_given(p))

    def new_since(self, before: State) -> tuple[int, ...]:
        """Tuple of the indices, in this model, of the effects that the state `before` did not have."""
        return tuple(p for p, n in enumerate(self.numbers) if n not in before.numbers)

    def lost_since(self, before: State) -> tuple[int, ...]:
        """Tuple of the indices, in the model of `before`, of the effects that have left."""
        return tuple(p for p, n in enumerate(before.numbers) if n not in self.numbers)


def state_of(ladder: Sequence[Rung]) -> State:
    """`State` after the last of the steps `ladder`.

    In steps made by hand, effects are matched by kind and nearest frequency.
    """
    state = State.of(ladder[0].fit)
    for rung in ladder[1:]:
        if rung.numbers:
            used = max(state.used, 1 + max(rung.numbers))
            state = State(rung.fit, rung.numbers, state.given, used)
        else:
            state = state.after(rung.fit, places_lost(state.fit.model, rung.fit.model))
    return state


def places_lost(before: Model, after: Model) -> tuple[int, ...]:
    """Sorted tuple of the indices of effects of the model `before` that the model `after` lacks.

    If a model has several effects of one kind, effects with the nearest frequencies count as the same.
    """
    lost: list[int] = []
    for kind in dict.fromkeys(e.kind for e in before):
        had = [p for p, e in enumerate(before) if e.kind == kind]
        has = [e for e in after if e.kind == kind]
        if len(has) < len(had):
            kept = min(
                combinations(had, len(has)),
                key=lambda places: sum(
                    _log_frequency_distance(before.effects[p], e)
                    for p, e in zip(places, has, strict=True)
                ),
            )
            lost += [p for p in had if p not in kept]
    return tuple(sorted(lost))


def _log_frequency_distance(one: Effect, other: Effect) -> float:
    """Absolute difference of ln(center frequency) of two effects; 0 if one has no frequency."""
    a, b = one.occupies, other.occupies
    if a is None or b is None:
        return 0.0
    return float(abs(np.log(max(sum(a), 1e-300) / max(sum(b), 1e-300))))
