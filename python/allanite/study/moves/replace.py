"""Replace: another effect takes the place of one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Deterministic, Modifier
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.together import is_broad
from allanite.suggestion.ranking import prior

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit


def replacements(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Models with one effect replaced by a declared alternative: promised gain, places that leave, model.

    The new effect is the last of the model.
    """
    for place, out in enumerate(fit.model.effects):
        if is_detected(fit, place):
            for other in fit.alternatives(place):
                if may_take_the_place(other.effect, out):
                    promised = other.evidence + prior(other.effect) - prior(out)
                    yield promised, (place,), other.solution.model


def may_take_the_place(effect: Effect, out: Effect) -> bool:
    """True if the score alone may put an effect here: an event only for an event, a filter for a filter or a broad hump."""
    event = _is_event(effect) and not _is_event(out)
    filtering = isinstance(effect, Modifier) and not (isinstance(out, Modifier) or is_broad(out))
    return not (event or filtering or effect.nameless)


def _is_event(effect: Effect) -> bool:
    """True for an effect that happens once: its evidence does not pay for the many times that were tried."""
    return isinstance(effect, Deterministic) and effect.happens_once
