"""What one browser tab works on: a log, a ladder of fits with undo and redo, one job at a time."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from allanite.common.errors import AllaniteError, InputError
from allanite.effects import Model
from allanite.fit import fit_model
from allanite.page.edits import effect as effect_at
from allanite.page.edits import freed, frozen, parse_model_string, with_value
from allanite.page.jobs import Job
from allanite.page.words import WORDS
from allanite.study import LIMIT, Rung, next_rung
from allanite.suggestion import Check, check_fit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from allanite.comparison.datasheet import DataSheet
    from allanite.fit import Error, Fit
    from allanite.page.source import Reading, Source
    from allanite.recording import Recording

__all__ = ["START", "Ladder", "Step", "Tab"]

START = "N+B+K"


@dataclass(eq=False)
class Step:
    """A rung as the page shows it: what was done, the fit, and its errors and its check once they are made."""

    label: str
    rung: Rung
    error: Error | None = None
    check: Check | None = None

    @property
    def fit(self) -> Fit:
        """The fit of the rung."""
        return self.rung.fit


@dataclass(frozen=True, eq=False)
class Ladder:
    """Steps, and the one that is looked at."""

    steps: tuple[Step, ...] = ()
    at: int = -1


class Tab:
    """State of one tab; every change is a new `Ladder`, so that undo is a step back in a list."""

    def __init__(self, sources: Sequence[Source], number: int) -> None:
        self.sources = list(sources)
        self.number = number
        self.place_of_source: int | None = None
        self.recording: Recording | None = None
        self.column = 0
        self._log: Recording | None = None
        self.problem: str | None = None
        self.history: list[Ladder] = [Ladder()]
        self.place = 0
        self.preview: Fit | None = None
        #: Unit in which the chips are shown; None for the log's own.
        self.unit: str | None = None
        #: Recordings of other logs and a data sheet, only compared with.
        self.others: list[tuple[str, Recording]] = []
        self.sheet: DataSheet | None = None
        self.job: Job | None = None
        self.version = 0
        self.lock = threading.RLock()

    # -- what it is --------------------------------------------------------------------------------

    @property
    def source(self) -> Source | None:
        """The log that is open, or that cannot be opened yet."""
        return None if self.place_of_source is None else self.sources[self.place_of_source]

    @property
    def ladder(self) -> Ladder:
        """The ladder now."""
        return self.history[self.place]

    @property
    def step(self) -> Step:
        """The step that is looked at."""
        if not self.ladder.steps:
            raise InputError("nothing is fitted yet: open a log first")
        return self.ladder.steps[self.ladder.at]

    @property
    def busy(self) -> bool:
        """Whether a job is at work."""
        return self.job is not None and self.job.busy

    @property
    def log(self) -> Recording:
        """The column that is looked at."""
        if self._log is None:
            raise InputError("no log is open: drop a file or choose one")
        return self._log

    # -- work ----------------------------------------------------------------------------------------

    def run(self, name: str, work: Callable[[Job], None]) -> None:
        """Start a job; one at a time."""
        with self.lock:
            if self.job is not None and self.job.busy:
                if not self.job.gives_way:
                    raise InputError(f"still at work ({self.job.name}): wait, or cancel it")
                self.job.cancel()

            def guarded(job: Job) -> None:
                try:
                    work(job)
                finally:
                    self.changed()

            self.job = Job(name, guarded)
            self.job.start()

    def changed(self) -> None:
        """Have the browser look again."""
        with self.lock:
            self.version += 1

    @contextmanager
    def change(self, job: Job) -> Iterator[None]:
        """Change the state as the result of a job, unless it was cancelled."""
        with self.lock:
            job.progress(1, 1)
            yield
            self.version += 1

    def push(self, ladder: Ladder) -> None:
        """Go on to a ladder; what was undone is forgotten."""
        with self.lock:
            self.history = [*self.history[: self.place + 1], ladder]
            self.place = len(self.history) - 1
            self.preview = None
            self.version += 1

    def _climb(self, job: Job, step: Step) -> None:
        _look(step.fit)
        with self.change(job):
            steps = self.ladder.steps[: self.ladder.at + 1]
            self.push(Ladder((*steps, step), len(steps)))

    def finish(self, job: Job, step: Step) -> Check:
        """The errors of a step, then what it lacks: shown as they come."""
        job.say("looking for what is missing")
        if step.error is None:
            found = step.fit.error
            with self.change(job):
                step.error = found
        if step.check is None:
            check = check_fit(step.fit, job.progress)
            with self.change(job):
                step.check = check
        assert step.check is not None
        return step.check

    def _rest(self, job: Job, step: Step) -> None:
        job.gives_way = True
        self.finish(job, step)

    def _refit(self, label: str, name: str, make: Callable[[], Rung]) -> None:
        def work(job: Job) -> None:
            step = Step(label, make())
            self._climb(job, step)
            self._rest(job, step)

        self.run(name, work)

    # -- actions -------------------------------------------------------------------------------------

    def open(self, place: int, reading: Reading | None = None) -> None:
        """Read a log and fit the first model to its first column."""
        if not 0 <= place < len(self.sources):
            raise InputError(f"there is no log {place}")
        source = self.sources[place]
        if reading is not None:
            source = self.sources[place] = source.with_reading(reading)

        def work(job: Job) -> None:
            with self.change(job):
                self.place_of_source, self.recording, self._log = place, None, None
                self.problem, self.unit, self.preview = None, None, None
                self.history, self.place, self.column = [Ladder()], 0, 0
            try:
                recording = source.read(source.reading)
            except AllaniteError as error:
                with self.change(job):
                    self.problem = " ".join(error.worded(WORDS).split())
                return
            self._start(job, recording, 0)

        if self.busy:
            self.cancel()
        self.run(f"reading {source.name}", work)

    def choose(self, column: int) -> None:
        """Go to another column: a ladder of its own."""
        if self.recording is None or not 0 <= column < len(self.recording.columns):
            raise InputError(f"there is no column {column}")
        recording = self.recording
        self.run("changing the column", lambda job: self._start(job, recording, column))

    def _start(self, job: Job, recording: Recording, column: int) -> None:
        log = recording.column(column)
        _ = log.audit  # kept by the recording, at hand for every request
        with self.change(job):
            # The measured curve is shown while the model is fitted.
            self.recording, self.column, self._log, self.preview = recording, column, log, None
            self.history, self.place = [Ladder()], 0
        job.say(f"fitting {START}")
        step = Step("start", Rung(fit_model(log, parse_model_string(START))))
        _look(step.fit)
        with self.change(job):
            # The empty ladder before the first fit is nothing to go back to.
            self.history, self.place = [Ladder((step,), 0)], 0
        self._rest(job, step)

    def fit(self, text: str) -> None:
        """Fit a model string."""
        model = parse_model_string(text)
        log = self.log
        self._refit(
            f"model {model.name}", f"fitting {model.name}", lambda: Rung(fit_model(log, model))
        )

    def add(self, number: int) -> None:
        """Add a suggestion by its place in the list."""
        step = self.step
        if step.check is None or not 0 <= number < len(step.check.suggestions):
            raise InputError("this suggestion is gone: look at the list again")
        suggestion = step.check.suggestions[number]
        name = step.fit.display_name(suggestion.effect)
        self._refit(
            f"+ {name}",
            f"adding {name}",
            lambda: Rung(step.fit.add(suggestion), suggestion.effect),
        )

    def remove(self, place: int) -> None:
        """Take an effect out."""
        fit = self.step.fit
        effect = effect_at(fit, place)
        if len(fit.model) == 1:
            raise InputError("a model needs at least one effect")
        name = fit.display_name(effect)
        self._refit(
            f"− {name}", f"removing {name}", lambda: Rung(fit.remove(place), None, (effect.kind,))
        )

    def hold(self, place: int, name: str, value: float | None) -> None:
        """Hold a parameter at a value, or let it free (None)."""
        fit = self.step.fit
        model = with_value(fit.model, place, name, value, held=value is not None)
        what = f"{name} of {fit.display_name(model.effects[place])}"
        verb = "free" if value is None else "hold"
        self._refit(
            f"{verb} {what}",
            f"fitting with {what} {verb}",
            lambda: Rung(fit_model(fit.recording, model)),
        )

    def what_if(self, place: int, name: str, value: float) -> None:
        """Show a model with one value changed, nothing fitted; further changes add up."""
        base = (self.preview or self.step.fit).model
        model = with_value(base, place, name, value, held=False)
        still = Model(tuple(frozen(e) for e in model))
        log = self.log

        def work(job: Job) -> None:
            found = fit_model(log, still)
            effects = (freed(e, o) for e, o in zip(found.model, model, strict=True))
            tried = replace(found, model=Model(tuple(effects)))
            _look(tried)
            with self.change(job):
                self.preview = tried

        self.run("trying the value", work)

    def drop_what_if(self) -> None:
        """Forget the values tried."""
        self.preview = None
        self.changed()
        self.recheck()

    def fit_what_if(self) -> None:
        """Fit from the values tried."""
        if self.preview is None:
            raise InputError("no value was tried")
        model, log = self.preview.model, self.log
        self._refit(
            "from tried values",
            "fitting from the tried values",
            lambda: Rung(fit_model(log, model)),
        )

    def improve(self) -> None:
        """Add the best missing effect until nothing helps, each rung shown as it comes."""
        _ = self.step

        def work(job: Job) -> None:
            for count in range(LIMIT):
                check = self.finish(job, self.step)
                if check.adequate:
                    return
                job.say(f"improving: rung {count + 1}")
                rungs = [s.rung for s in self.ladder.steps[: self.ladder.at + 1]]
                rung = next_rung(rungs, check)
                if rung is None:
                    raise InputError(
                        "nothing of the catalogue helps without raising an error or predicting worse"
                    )
                self._climb(job, Step(" ".join(rung.changes), rung))
            self.finish(job, self.step)

        self.run("improving", work)

    def go(self, rung: int) -> None:
        """Look at another rung; the next addition starts from there."""
        if not 0 <= rung < len(self.ladder.steps):
            raise InputError(f"there is no rung {rung}")
        if self.busy:
            self.cancel()
        self.push(Ladder(self.ladder.steps, rung))
        self.recheck()

    def undo(self) -> None:
        """One change back."""
        self._move(-1, "nothing to undo")

    def redo(self) -> None:
        """One change forward."""
        self._move(+1, "nothing to redo")

    def _move(self, by: int, otherwise: str) -> None:
        with self.lock:
            if self.busy:
                self.cancel()
            if not 0 <= self.place + by < len(self.history):
                raise InputError(otherwise)
            self.place += by
            self.preview = None
            self.version += 1
        self.recheck()

    def recheck(self) -> None:
        """Make a check that was cancelled before it was done."""
        if self.ladder.steps and self.step.check is None and not self.busy:
            step = self.step
            self.run("looking for what is missing", lambda job: self._rest(job, step))

    def cancel(self) -> None:
        """End the job."""
        if self.job is not None:
            self.job.cancel()
            self.changed()


def _look(fit: Fit) -> None:
    """Make what the page shows of a fit at once: found here, it is at hand for every request."""
    _ = fit.estimates, fit.misfit, fit.band
