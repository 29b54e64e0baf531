"""Where the level of the white noise changes several times, one effect says so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOGUE, Level, Model
from allanite.fit import refitted
from allanite.fit.likelihood.whitened import expected_level, whiten
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.suggestion.constants import MAX_SEPARATE_LEVEL_INTERVALS
from allanite.suggestion.screens.level_changes import level_series, screen_levels

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.fit.result import Fit
    from allanite.suggestion.screens.spectral import Candidate

__all__ = ["one_level", "several_levels"]


def several_levels(fit: Fit, asked: int) -> list[Level]:
    """The effects after the first `asked` by which the level changes, where they are more than one or two intervals."""
    changes = [e for e in fit.model.effects[asked:] if isinstance(e, Level) and e.switches[0]]
    intervals = all(len(e.switches[0]) == 2 and e.switches[1][-1] == 1.0 for e in changes)
    return changes if len(changes) > (MAX_SEPARATE_LEVEL_INTERVALS if intervals else 1) else []


def one_level(fit: Fit, changes: list[Level]) -> Fit | None:
    """The fit with one effect in the place of several `changes` of level, with what is still missing beside it.

    It is what a search finds beside the rest of the model, or the changes together: what explains the power of the white
    noise over time better, less half the logarithm of its values for each number. None where neither explains more than the
    changes without the last.
    """
    base = refitted(fit, Model(tuple(e for e in fit.model if e not in changes)))
    whitened = whiten(base.solution, base.data)
    series = level_series(base.solution, base.data, whitened)
    if series is None:
        return None
    price = 0.5 * np.log(max(series.freedom * series.judged.size, 2.0))

    def explained(level: Level) -> float:
        expected = expected_level(base.model + level, base.data, series.judged.size)
        model = 1.0 + series.share * (expected - 1.0)
        fits = np.log(model).sum() + model.size * np.log(np.mean(series.judged / model))
        return float(-0.5 * series.freedom * fits)

    def worth(level: Level) -> float:
        return explained(level) - price * level.numbers

    before = max((explained(level) for level in _together(changes[:-1])), default=0.0)
    found = [
        *_switching(screen_levels(base.solution, base.data, whitened)),
        *_together(changes),
    ]
    # A set that explains more each time does not come back to where it was.
    found = [level for level in found if explained(level) > before + MAX_RIVAL_LOG_EVIDENCE]
    if not found:
        return None
    best = max(found, key=worth)
    while True:
        last = refitted(base, base.model + best)
        again = screen_levels(last.solution, last.data, whiten(last.solution, last.data))
        more = [e for one in _switching(again) for e in _together([best, one])]
        if not more or worth(further := max(more, key=worth)) <= worth(best):
            return last
        best = further


def _switching(candidates: Iterable[Candidate]) -> list[Level]:
    return [c.effect for c in candidates if isinstance(c.effect, Level) and c.effect.switches[0]]


def _together(changes: list[Level]) -> list[Level]:
    """The effects of the catalogue that have the product of the levels of several."""
    times = np.array(sorted({t for change in changes for t in change.switches[0]}))
    gains = np.prod([change.gain(times) for change in changes], axis=0)
    kept = np.flatnonzero(np.diff([1.0, *gains]))
    many = tuple(times[kept].tolist()), tuple(gains[kept].tolist())
    kinds = [cls for cls in CATALOGUE if issubclass(cls, Level)]
    return [effect for cls in kinds if (effect := cls.switched(*many)) is not None]
