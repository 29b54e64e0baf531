"""Search: check, take the best step, and repeat until nothing helps; it owns the steps, the limits and the last check."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from allanite.common.threads import with_deadline
from allanite.fit.kept import forget
from allanite.fit.likelihood.remembered import trim_memory
from allanite.study.ladder import Rung, Study
from allanite.study.steps import best_replacement, further_steps, step_and_suggestions
from allanite.study.story import story, tried_and_dropped, without_rises
from allanite.suggestion.check import last_check
from allanite.suggestion.constants import MAX_ADDED_EFFECTS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.fit.result import Fit
    from allanite.suggestion import Check


@dataclass
class Search:
    """State of one search: its steps, limits and last check.

    `limit` is the number of steps from which on no effect is added. The search ends below the model discrepancy
    `tolerance`, %, and at the time `deadline` of the `clock`. `on_progress` is called with (steps done, maximum number of
    steps). `first_check` is that of the first fit. `checked` is the number of steps that the last check covers.
    """

    ladder: list[Rung]
    limit: int
    tolerance: float | None
    deadline: float
    clock: Callable[[], float] = time.process_time
    on_progress: Callable[[int, int], None] | None = None
    check: Check | None = None
    first_check: Check | None = None
    checked: int = 0

    def run(self) -> str:
        """Add steps to `ladder` until the search ends; return the reason as text, as in `Study.stopped_because`."""
        while True:
            try:
                # The first check has no limit, because a study needs one.
                with with_deadline(self.deadline if self.check else None, self.clock):
                    check = self._check_of_last_fit()
            except TimeoutError:
                return "time"
            stop = self._stop_reason(check)
            found = None
            try:
                with with_deadline(self.deadline, self.clock):
                    if stop is None:
                        found, stop = step_and_suggestions(self.ladder, check), "nothing helps"
                    elif stop != "within tolerance":
                        last = best_replacement(self.ladder)
                        found = None if last is None else (last, ())
            except TimeoutError:
                stop = stop or "time"
            if found is None:
                return stop or "nothing helps"
            rung, added = found
            self.ladder.append(rung)
            with suppress(TimeoutError), with_deadline(self.deadline, self.clock):
                for further in further_steps(self.ladder, check, added):
                    if has_reached_limit(self.ladder, self.limit) or self._is_within_tolerance(
                        further.fit
                    ):
                        break
                    self.ladder.append(further)

    def _check_of_last_fit(self) -> Check:
        """`Check` of the last fit; stores it as `check`, reports progress, and frees memory of earlier fits."""
        fit = self.ladder[-1].fit
        for rung in self.ladder[:-1]:
            forget(rung.fit, last_check)
            if rung.fit.data is not fit.data:
                rung.fit.data.clear_caches()
        trim_memory(fit.data.n)
        self.check, self.checked = last_check(fit), len(self.ladder)
        if self.first_check is None:
            self.first_check = self.check
        if self.on_progress is not None:
            self.on_progress(self.checked, max(self.limit + 1, self.checked))
        return self.check

    def _stop_reason(self, check: Check) -> str | None:
        """Reason to add no further effect after a check: "adequate", "within tolerance" or "limit"; None to continue.

        After "adequate" or "limit" the search ends only if `best_replacement` finds no step.
        """
        if check.adequate:
            return "adequate"
        if self._is_within_tolerance(check.fit):
            return "within tolerance"
        return "limit" if has_reached_limit(self.ladder, self.limit) else None

    def _is_within_tolerance(self, fit: Fit) -> bool:
        """True if there is a tolerance and the model discrepancy is below it."""
        return self.tolerance is not None and fit.discrepancy.percent < self.tolerance

    def study(self, stop: str) -> Study:
        """`Study` of the checked steps. `stop`, the reason why the search ended, becomes its `stopped_because`.

        If the study has doubts, "nothing helps" replaces "adequate".
        """
        assert self.check is not None
        forget(self.check.fit, last_check)
        study = Study(
            self.check.fit.recording,
            ladder=self._steps(stop),
            check=self.check,
            stopped_because=stop,
            tolerance=self.tolerance,
            tried=tried_and_dropped(self.ladder[: self.checked]),
            first_check=self.first_check,
        )
        if stop == "adequate" and study.doubts:
            return replace(study, stopped_because="nothing helps")
        return study

    def _steps(self, stop: str) -> tuple[Rung, ...]:
        """Tuple of the checked steps as users see them, rearranged by `story` and joined by `without_rises`.

        Not rearranged if `stop` is "time" or "interrupted", or if the deadline passes before `story` is done.
        """
        ladder = tuple(self.ladder[: self.checked])
        if stop not in {"time", "interrupted"}:
            with suppress(TimeoutError), with_deadline(self.deadline, self.clock):
                return without_rises(story(ladder))
        return ladder


def has_reached_limit(ladder: Sequence[Rung], limit: int = MAX_ADDED_EFFECTS) -> bool:
    """True if the search has made `limit` steps or more after the first model."""
    return len(ladder) > limit
