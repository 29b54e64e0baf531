"""Split: two effects replace one that stood for both, or one effect and the filter that it distorts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.effects import Modifier
from allanite.fit.rivals.alternatives import is_detected, is_removable
from allanite.fit.rivals.pairs import alternative_pairs
from allanite.fit.rivals.score import is_broad, prior
from allanite.study.moves.replace import may_take_the_place

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects import Model
    from allanite.fit.result import Fit


def models_with_split(fit: Fit) -> Iterator[tuple[float, tuple[int, ...], Model]]:
    """Iterator over (expected gain, indices, model): models in which two effects replace one.

    The gain is that of the score, nats; the indices are those of the replaced effects. Only detected effects are
    replaced. A filter may be replaced together with the effect. The new effects are the last of the model.
    """
    for place, out in enumerate(fit.model.effects):
        if not is_detected(fit, place):
            continue
        for pair in fit.alternative_pairs(place):
            if all(may_take_the_place(effect, out) for effect in pair.model.effects[-2:]):
                yield pair.evidence - prior(out), (place,), pair.model
        for other in _filters_beside(fit, place):
            for pair in alternative_pairs(fit, place, also=other):
                if fit.model.effects[other].kind in pair.kinds:
                    yield pair.evidence - prior(out), (place, other), pair.model


def _filters_beside(fit: Fit, place: int) -> Iterator[int]:
    """Iterator over the indices of removable filters that may be confused with the broad hump at index `place`.

    A hump may compensate a filter of the wrong type. Nothing if the effect at `place` is no broad hump.
    """
    out = fit.model.effects[place]
    if is_broad(out):
        for other, effect in enumerate(fit.model.effects):
            if isinstance(effect, Modifier) and is_removable(effect) and effect.may_be(out):
                yield other
