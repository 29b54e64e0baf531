"""Model of an axis for the comparison of units: one step for each kind of effect, such as all lines of a comb."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.effects import as_model
from allanite.fit import excludes_samples, fit_model
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
    """`Study` of one column as of `improve`, except that later checks add no effect of a kind that the model has.

    Units are compared by their coefficients and by the kinds of their effects. All lines of one check are added. Weaker
    lines of later checks would change neither, but each costs a fit of the whole model. Excluded samples and events are
    added as in `improve`, because they change the coefficients. Errors are those of `fit_model`.
    """
    fit = fit_model(column, with_given_designs(as_model(model)))
    seconds = DEFAULT_SECONDS + DEFAULT_SECONDS_PER_SAMPLE * column.n
    search = SearchOfKinds([Rung(fit)], MAX_ADDED_EFFECTS, None, time.process_time() + seconds)
    return search.study(search.run())


class SearchOfKinds(Search):
    """Search that adds effects of the same kind only from one check, and keeps its steps in the order of the search."""

    def _check_of_last_fit(self) -> Check:
        """`Check` of the last fit without suggestions of kinds that the model has; `check` keeps all suggestions."""
        check = super()._check_of_last_fit()
        kinds = {effect.kind for effect in check.fit.model}
        new = (
            s
            for s in check.suggestions
            if s.kind not in kinds or s.effect_happens_once or excludes_samples(s.effect)
        )
        return replace(check, suggestions=tuple(new))

    def _stop_reason(self, check: Check) -> str | None:
        """Reason (text) to end the search after the last check, judged by all suggestions; None to continue."""
        assert self.check is not None
        return super()._stop_reason(self.check)

    def _steps(self, _: str) -> tuple[Rung, ...]:
        """Tuple of the checked steps, oldest first; a table shows no steps, so that none is fitted for readers."""
        return tuple(self.ladder[: self.checked])
