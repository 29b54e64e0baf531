"""Operations on a tab: changing, trying and improving models, undo and redo."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.effects import Model
from allanite.fit import fit_model
from allanite.page.edits import (
    effect_at,
    parse_model_string,
    with_holds_of,
    with_limits,
    with_value,
    with_values_held,
)
from allanite.page.tab_state import TabState, cache_results
from allanite.page.work import ColumnSteps, Step
from allanite.study import Rung, best_replacement, has_reached_limit, next_step

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects import Effect
    from allanite.page.jobs import Job


class Tab(TabState):
    """A browser tab: its state and the operations on it. Results are shown as soon as they are available."""

    def _refit(self, label: str, name: str, make: Callable[[], Rung]) -> None:
        """Start the job `name`, which calls `make`, adds the result as a step called `label`, and checks it.

        Raises `InputError` if another job of the user runs.
        """
        column = self.column

        def work(job: Job) -> None:
            """Call `make` for the new step, add it to the steps of the column, and search for effects missing from it."""
            step = Step(label, make())
            self.append_step(job, step, column)
            self.check_until_interrupted(job, step)

        self.start_job(name, work)

    # -- the model ---------------------------------------------------------------------------------------

    def fit(self, text: str) -> None:
        """Start a job that fits a model string and adds the result as a step."""
        model = parse_model_string(text)
        log = self.log
        self._refit(
            f"model {model.name}", f"Fitting {model.name}", lambda: Rung(fit_model(log, model))
        )

    def add(self, number: int) -> None:
        """Start a job that adds the suggestion at index `number` of the check to the model, and fits the model.

        Raises `InputError` if there is no such suggestion, or for a second effect of a kind that a model can have only
        once.
        """
        step = self.step
        if step.check is None or not 0 <= number < len(step.check.suggestions):
            raise InputError("This suggestion no longer exists: see the updated list")
        self._fit_with(step.check.suggestions[number].effect)

    def add_by_name(self, text: str) -> None:
        """Start a job that adds one effect, given by its name or as a model string with values, and fits the model.

        Raises `InputError` if the text is invalid or names several effects.
        """
        model = parse_model_string(text)
        if len(model) != 1:
            raise InputError("Add one effect at a time, or enter a whole model")
        self._fit_with(model.effects[0])

    def restore(self, place: int) -> None:
        """Start a job that adds the removed effect ``work.removed[column][place]`` again, and fits the model."""
        tray = self.work.removed[self.column]
        if not 0 <= place < len(tray):
            raise InputError("This effect is already in the model")
        self._fit_with(tray[place])

    def _fit_with(self, effect: Effect) -> None:
        """Start a job that fits the current model with one more effect.

        Raises `InputError` for a second effect of a kind that a model can have only once.
        """
        fit = self.step.fit
        name = fit.display_name(effect)
        if type(effect).single and any(e.kind == effect.kind for e in fit.model):
            raise InputError(f"The model already has {'an' if name[0] in 'aeiou' else 'a'} {name}")
        self._refit(f"+ {name}", f"Adding {name}", lambda: Rung(fit.add(effect), effect))

    def remove(self, place: int) -> None:
        """Start a job that removes the effect at index `place` from the model and fits the rest.

        `restore` can add the effect again, unless another effect of its kind is left. Raises `InputError` if there is
        no effect at this index, or if it is the only effect of the model.
        """
        fit = self.step.fit
        effect = effect_at(fit.model, place)
        if len(fit.model) == 1:
            raise InputError("A model needs at least one effect")
        name = fit.display_name(effect)
        self._refit(
            f"− {name}", f"Removing {name}", lambda: Rung(fit.remove(place), None, (effect.kind,))
        )

    def hold(self, place: int, name: str, value: float | None) -> None:
        """Start a job that fits with the parameter `name` of the effect at `place` held at `value`, or free for None."""
        fit = self.step.fit
        model = with_value(fit.model, place, name, value, held=value is not None)
        what = f"{name} of {fit.display_name(model.effects[place])}"
        verb = "free" if value is None else "hold"
        self._refit(
            f"{verb} {what}",
            f"Fitting with {what} {'free' if value is None else 'held'}",
            lambda: Rung(fit_model(fit.recording, model)),
        )

    def limit(self, place: int, name: str, low: float | None, high: float | None) -> None:
        """Start a job that fits with limits of the parameter `name` of the effect at index `place`; None is no limit."""
        fit = self.step.fit
        model = with_limits(fit.model, place, name, low, high)
        effect = model.effects[place]
        what = f"{name} of {fit.display_name(effect)}"
        self._refit(
            f"{'limit' if name in effect.limits else 'no limits on'} {what}",
            f"Fitting with {what} {'within its' if name in effect.limits else 'without'} limits",
            lambda: Rung(fit_model(fit.recording, model)),
        )

    def try_value(self, place: int, name: str, value: float) -> None:
        """Start a job that stores in `preview` the model with one parameter changed to a trial `value`, for display.

        All values are held, so nothing is fitted to the log. Trial values add up: the next one changes the preview.
        """
        base = (self.preview or self.step.fit).model
        model = with_value(base, place, name, value, held=False)
        still = Model(tuple(with_values_held(e) for e in model))
        log = self.log

        def work(job: Job) -> None:
            """Evaluate the model with the trial value, and set it as the preview; the steps stay unchanged."""
            found = fit_model(log, still)
            effects = (with_holds_of(e, o) for e, o in zip(found.model, model, strict=True))
            tried = replace(found, model=Model(tuple(effects)))
            cache_results(tried)
            with self.changing(job):
                self.preview = tried

        self.start_job("Trying the value", work)

    def discard_trial(self) -> None:
        """Discard the trial values, and check the current step if its check was canceled."""
        self.preview = None
        self.announce_change()
        self.recheck()

    def fit_from_trial(self) -> None:
        """Start a job that fits the model, starting from the trial values. Raises `InputError` without trial values."""
        if self.preview is None:
            raise InputError("There is no trial value")
        model, log = self.preview.model, self.log
        self._refit(
            "from trial values",
            "Fitting from the trial values",
            lambda: Rung(fit_model(log, model)),
        )

    def improve(self, columns: Sequence[int] | None = None) -> None:
        """Start a job that improves the models of `columns`, or of the current one; then it fails if no change helps.

        Raises `InputError` if another job than a check is running, or without `columns` if nothing is fitted yet.
        """
        work_on = [self.column] if columns is None else list(columns)
        if columns is None:
            _ = self.step
        names = self.work.recording.columns

        def work(job: Job) -> None:
            """Improve the models of the columns one after the other; a column without a fit gets its first model before.

            If `columns` is None (only the current column), raises `InputError` if no effect helps.
            """
            for i, column in enumerate(work_on):
                job.columns, job.column = tuple(work_on[i:]), column
                before = "" if columns is None else f"{names[column]} ({i + 1} of {len(work_on)}): "
                job.take_turn()
                self.fitted_step(job, column)
                helped = self._improve_column(job, column, before)
                if columns is None and not helped:
                    raise InputError(
                        "No effect lowers the error without worse predictions of unseen data"
                    )

        # The check with which the improvement starts may still be running.
        self.start_job("Improving", work, follows=True)

    def _improve_column(self, job: Job, column: int, before: str) -> bool:
        """Add steps to the model of a column until no step helps; the current model is checked before each step.

        True if the last model is adequate, within the tolerance of the user, or if 32 steps were made. For an adequate
        model, and after 32 steps, only replacements of effects are tried. The progress text of the job begins with
        `before`.
        """
        begun = self.board.columns[column].at
        while True:
            column_steps = self.board.columns[column]
            step = column_steps.step
            assert step is not None
            check = self.finished_check(job, step)
            rungs = [s.rung for s in column_steps.steps[: column_steps.at + 1]]
            if self.is_within_tolerance(step) and not check.adequate:
                return True
            good = check.adequate or has_reached_limit(rungs[begun:])
            best = check.significant[0].effect if check.significant else None
            tried = "" if best is None else f", trying {step.fit.display_name(best)}"
            job.begin_stage(f"{before}step {len(rungs) - begun}{tried}")
            rung = best_replacement(rungs) if good else next_step(rungs, check)
            if rung is None:
                return good
            self.append_step(job, Step(" ".join(rung.changes), rung), column)

    def set_tolerance(self, tolerance: float | None) -> None:
        """Set the model discrepancy in % below which a model is accepted; None to require an adequate model.

        Raises `InputError` unless it lies in (0, 100].
        """
        if tolerance is not None and not 0.0 < tolerance <= 100.0:
            raise InputError("The accepted model discrepancy must lie between 0 and 100 %")
        self.tolerance = tolerance
        self.announce_change()

    # -- steps ---------------------------------------------------------------------------------------------

    def go_to_step(self, number: int) -> None:
        """Make the step at index `number` the current one, from which the next change starts; a running job is canceled.

        If that step was compared with the current one, the two change roles.
        """
        if not 0 <= number < len(self.column_steps.steps):
            raise InputError(f"There is no step {number}")
        if self.busy:
            self.cancel()
        if self.column_steps.steps[number] is self._compared:
            # Swap the two compared steps.
            self._compared = self.column_steps.step
        self.set_steps(ColumnSteps(self.column_steps.steps, number))
        self.recheck()

    def compare_steps(self, number: int | None) -> None:
        """Compare the current step of the model building with the step at index `number`; None ends the comparison."""
        if number is not None and not 0 <= number < len(self.column_steps.steps):
            raise InputError(f"There is no step {number}")
        self._compared = None if number is None else self.column_steps.steps[number]
        self.announce_change()

    def undo(self) -> None:
        """Undo the last change, in any column; raises InputError if there is none."""
        self._undo_or_redo(-1, "Nothing to undo")

    def redo(self) -> None:
        """Redo the last undone change; raises InputError if there is none."""
        self._undo_or_redo(+1, "Nothing to redo")

    def _undo_or_redo_part(self, by: int) -> bool:
        """Undo (`by` = −1) or redo (+1) the selection of a part of the log. Returns False if there is no such selection."""
        now, place = self.work, self.source_index
        other = now.before if by < 0 else now.after
        if other is None or place is None:
            return False
        if by < 0:
            other.after, now.before = now, None
        else:
            other.before, now.after = now, None
        other.select_column(now.board.column)
        self.works[place] = other
        return True

    def _undo_or_redo(self, by: int, otherwise: str) -> None:
        """Undo (`by` = −1) or redo (+1) a change of the model, or else a selection of a part of the log.

        A running job is canceled, trial values are discarded, and a missing check is started. Raises `InputError` with
        the message `otherwise` if there is nothing to undo or redo.
        """
        with self.lock:
            if self.busy:
                self.cancel()
            if self.open_work is None or not (
                self.work.undo_or_redo(by) or self._undo_or_redo_part(by)
            ):
                raise InputError(otherwise)
            self.preview = None
            self.version += 1
        self.recheck()
