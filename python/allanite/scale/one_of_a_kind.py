"""Model of an axis for the comparison of units: one step for each kind of effect, such as all lines of a comb."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.effects import as_model
from allanite.fit import fit_model
from allanite.study.improvement import with_given_designs
from allanite.study.ladder import Rung
from allanite.study.search import Search
from allanite.suggestion.constants import (
    DEFAULT_SECONDS,
    DEFAULT_SECONDS_PER_SAMPLE,
    MAX_ADDED_EFFECTS,
)

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.recording import Recording
    from allanite.study import Study
    from allanite.suggestion import Check


def study_of_kinds(column: Recording, model: str | Model) -> Study:
    """`Study` of one column as by `improve`, but no check adds an effect of a kind that the model already has.

    This saves fits of weak further lines, which change neither coefficients nor kinds of effects. All lines that one check
    suggests are added together. Excluded samples and single events are added as by `improve`, because they change the
    coefficients.
    """
    fit = fit_model(column, with_given_designs(as_model(model)))
    seconds = DEFAULT_SECONDS + DEFAULT_SECONDS_PER_SAMPLE * column.n
    search = SearchOfKinds([Rung(fit)], MAX_ADDED_EFFECTS, None, time.process_time() + seconds)
    return search.study(search.run())


class SearchOfKinds(Search):
    """Search that adds effects of the same kind only from one check, and keeps its steps in the order of the search."""

    def _check_of_last_fit(self) -> Check:
        """`Check` of the last fit, without suggested effects of kinds in the model; `self.check` keeps all suggestions.

        Excluded samples and single events may be suggested again.
        """
        check = super()._check_of_last_fit()
        kinds = {effect.kind for effect in check.fit.model}
        new = (
            s
            for s in check.suggestions
            if s.kind not in kinds or s.effect_happens_once or s.effect.removes
        )
        return replace(check, suggestions=tuple(new))

    def _stop_reason(self, check: Check) -> str | None:
        """Reason to end the search, or None; judges `self.check`, which has all suggestions, not the argument."""
        assert self.check is not None
        return super()._stop_reason(self.check)

    def _steps(self, _stop: str) -> tuple[Rung, ...]:
        """Tuple of the checked steps of the search (models with their fits), oldest first. The argument is not used."""
        return tuple(self.ladder[: self.checked])
