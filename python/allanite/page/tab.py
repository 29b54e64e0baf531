"""What one browser tab works on: a log, a ladder of fits with undo and redo, one job at a time."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from allanite.effects import Model
from allanite.effects.files import model_from_dict
from allanite.errors import InputError
from allanite.fit import fit_model
from allanite.page.edits import effect as effect_at
from allanite.page.edits import freed, frozen, parse_model_string, with_value
from allanite.page.jobs import Job
from allanite.study import LIMIT, Rung, next_rung
from allanite.suggestion import Check, check_fit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.fit import Fit
    from allanite.page.source import Reading, Source
    from allanite.recording import Recording

__all__ = ["START", "Step", "Tab"]

START = "N+B+K"


@dataclass(eq=False)
class Step:
    """A rung as the page shows it: what was done, the fit, and its check once it is made."""

    label: str
    fit: Fit
    rung: Rung
    check: Check | None = None


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
        self.source: Source | None = None
        self.recording: Recording | None = None
        self.column = 0
        self.problem: str | None = None
        self.history: list[Ladder] = [Ladder()]
        self.place = 0
        self.preview: Fit | None = None
        #: Recordings of other logs, only compared with.
        self.others: list[tuple[str, Recording]] = []
        self.job: Job | None = None
        self.version = 0
        self.lock = threading.RLock()

    # -- what it is --------------------------------------------------------------------------------

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
        if self.recording is None:
            raise InputError("no log is open: drop a file or choose one")
        return self.recording.column(self.column)

    # -- work ----------------------------------------------------------------------------------------

    def run(self, name: str, work: Callable[[Job], None]) -> None:
        """Start a job; one at a time."""
        with self.lock:
            if self.busy:
                assert self.job is not None
                raise InputError(f"still at work ({self.job.name}): wait, or cancel it")

            def guarded(job: Job) -> None:
                try:
                    work(job)
                finally:
                    self.version += 1

            self.job = Job(name, guarded)
            self.job.start()

    def _push(self, ladder: Ladder) -> None:
        with self.lock:
            self.history = [*self.history[: self.place + 1], ladder]
            self.place = len(self.history) - 1
            self.preview = None
            self.version += 1

    def _climb(self, step: Step) -> None:
        steps = self.ladder.steps[: self.ladder.at + 1]
        self._push(Ladder((*steps, step), len(steps)))

    def _check(self, job: Job, step: Step) -> Check:
        if step.check is None:
            job.say("looking for what is missing")
            found = check_fit(step.fit, job.progress)
            job.progress(1, 1)
            step.check = found
            self.version += 1
        return step.check

    def _refit(self, label: str, name: str, make: Callable[[], Rung]) -> None:
        def work(job: Job) -> None:
            rung = make()
            job.progress(1, 1)
            step = Step(label, rung.fit, rung)
            self._climb(step)
            self._check(job, step)

        self.run(name, work)

    # -- actions -------------------------------------------------------------------------------------

    def open(self, source: Source, reading: Reading | None = None, model: str = START) -> None:
        """Read a log and fit the first model to its first column."""
        reading = source.reading if reading is None else reading

        def work(job: Job) -> None:
            with self.lock:
                self.source, self.recording, self.problem = source.with_reading(reading), None, None
                self.history, self.place, self.column = [Ladder()], 0, 0
                self.version += 1
            try:
                self.recording = source.read(reading)
            except (InputError, ValueError) as error:
                self.problem = " ".join(str(error).split())
                return
            job.progress(1, 1)
            self.version += 1
            self._start(job, model)

        self.run(f"reading {source.name}", work)

    def choose(self, column: int, model: str = START) -> None:
        """Go to another column: a ladder of its own."""
        if self.recording is None or not 0 <= column < len(self.recording.columns):
            raise InputError(f"there is no column {column}")

        def work(job: Job) -> None:
            with self.lock:
                self.column = column
                self.history, self.place = [Ladder()], 0
                self.version += 1
            self._start(job, model)

        self.run("changing the column", work)

    def _start(self, job: Job, model: str) -> None:
        job.say(f"fitting {model}")
        fit = fit_model(self.log, parse_model_string(model))
        job.progress(1, 1)
        step = Step("start", fit, Rung(fit))
        with self.lock:
            # The empty ladder before the first fit is nothing to go back to.
            self.history, self.place = [Ladder((step,), 0)], 0
            self.version += 1
        self._check(job, step)

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
            job.progress(1, 1)
            self.preview = replace(
                found,
                model=Model(tuple(freed(e, o) for e, o in zip(found.model, model, strict=True))),
            )
            self.version += 1

        self.run("trying the value", work)

    def drop_what_if(self) -> None:
        """Forget the values tried."""
        self.preview = None
        self.version += 1

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
                check = self._check(job, self.step)
                if check.adequate:
                    return
                job.say(f"improving: rung {count + 1}")
                rungs = [s.rung for s in self.ladder.steps[: self.ladder.at + 1]]
                rung = next_rung(rungs, check)
                job.progress(1, 1)
                if rung is None:
                    return
                assert rung.added is not None
                gone = "".join(f" − {k.replace('_', ' ')}" for k in rung.removed)
                self._climb(Step(f"+ {rung.fit.display_name(rung.added)}{gone}", rung.fit, rung))

        self.run("improving", work)

    def go(self, rung: int) -> None:
        """Look at another rung; the next addition starts from there."""
        if not 0 <= rung < len(self.ladder.steps):
            raise InputError(f"there is no rung {rung}")
        self._push(Ladder(self.ladder.steps, rung))
        self._recheck()

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
        self._recheck()

    def _recheck(self) -> None:
        """Make a check that was cancelled before it was done."""
        step = self.step
        if step.check is None and not self.busy:
            self.run("looking for what is missing", lambda job: _none(self._check(job, step)))

    def cancel(self) -> None:
        """Ask the job to end."""
        if self.job is not None:
            self.job.cancel()
            self.version += 1

    # -- studies ---------------------------------------------------------------------------------------

    def study(self) -> dict[str, Any]:
        """The ladder as one JSON document: models with values, not the samples."""
        source = self.source
        assert source is not None
        return {
            "schema": "allanite/page-study/1",
            "log": source.name,
            "column": self.log.columns[0],
            "recording": self.log.describe(),
            "at": self.ladder.at,
            "ladder": [{"label": s.label, **s.rung.to_dict()} for s in self.ladder.steps],
        }

    def open_study(self, document: Any) -> None:
        """Fit the models of a saved study to the open log, rung by rung."""
        if not isinstance(document, dict) or document.get("schema") != "allanite/page-study/1":
            raise InputError("not a study: a JSON file saved from this page is needed")
        log = self.log
        rungs = document.get("ladder")
        if not isinstance(rungs, list) or not 0 < len(rungs) <= 100:
            raise InputError("the study holds no ladder")
        try:
            models = [model_from_dict({**r, "schema": "allanite/fit/1"}, "study") for r in rungs]
        except (AttributeError, TypeError, KeyError) as error:
            raise InputError(f"the study is damaged ({error})") from None

        def work(job: Job) -> None:
            steps = []
            for i, (model, rung) in enumerate(zip(models, rungs, strict=True)):
                job.progress(i, len(models))
                fit = fit_model(log, model)
                steps.append(Step(str(rung.get("label", ""))[:80], fit, Rung(fit)))
            job.progress(len(models), len(models))
            at = document.get("at")
            last = len(steps) - 1
            self._push(
                Ladder(tuple(steps), at if isinstance(at, int) and 0 <= at <= last else last)
            )
            self._check(job, self.step)

        self.run("opening the study", work)


def _none(_: object) -> None:
    return None
