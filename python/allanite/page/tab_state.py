"""State of one browser tab: logs, the steps of each column, and one job at a time."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from allanite.common.errors import AllaniteError, InputError
from allanite.fit import fit_model
from allanite.page.edits import SHEET, parse_model_string
from allanite.page.jobs import Job
from allanite.page.source import model_for_part, part_of
from allanite.page.words import WORDS
from allanite.page.work import Board, ColumnSteps, Step, Work
from allanite.readers.starts import start_model
from allanite.recording.at_rest import motion_error
from allanite.study import Rung, Study
from allanite.suggestion import Check, check_fit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from allanite.fit import Fit
    from allanite.page.source import Part, Reading, Source
    from allanite.recording import Recording
    from allanite.sources.datasheet import DataSheet


class TabState:
    """State of one tab. Every change creates a new `Board`, so that undo moves back in a list of boards."""

    def __init__(self, sources: Sequence[Source]) -> None:
        self.sources = list(sources)
        self.source_index: int | None = None
        #: Work on each opened log, by its place in the list.
        self.works: dict[int, Work] = {}
        self.problem: str | None = None
        #: True if the problem is that the log is mostly motion.
        self.moving = False
        self.preview: Fit | None = None
        #: Model discrepancy in % below which a model is accepted; None to require an adequate model.
        self.tolerance: float | None = None
        #: Unit of the displayed values: that of data sheets, a chosen one, or None for that of the log.
        self.unit: str | None = SHEET
        #: Recordings of other logs and a data sheet for comparison.
        self.others: list[tuple[str, Recording]] = []
        self.sheet: DataSheet | None = None
        #: Step with which the current step is compared.
        self._compared: Step | None = None
        self.job: Job | None = None
        #: Thread of the audit of the log that was read last.
        self._audit: threading.Thread | None = None
        self.version = 0
        self.last_request = time.monotonic()
        self.has_left = False
        self.lock = threading.RLock()

    def copy_state_from(self, other: TabState) -> None:
        """Replace the state of this tab by a copy of that of another tab, without trial values, compared step and job."""
        with other.lock:
            self.sources = list(other.sources)
            self.works = {place: work.copied() for place, work in other.works.items()}
            self.source_index, self.problem = other.source_index, other.problem
            self.tolerance, self.unit = other.tolerance, other.unit
            self.others, self.sheet = list(other.others), other.sheet
        self.announce_change()

    # -- state -------------------------------------------------------------------------------------

    @property
    def source(self) -> Source | None:
        """`Source` of the selected log, opened or not; None if no log is selected."""
        return None if self.source_index is None else self.sources[self.source_index]

    @property
    def open_work(self) -> Work | None:
        """`Work`: the state of the analysis of the open log. None if no log is open or while the log is being read."""
        return None if self.source_index is None else self.works.get(self.source_index)

    @property
    def work(self) -> Work:
        """`Work`: the state of the open log; raises `InputError` if no log is open."""
        found = self.open_work
        if found is None:
            raise InputError("No log is open: drop a file or choose one")
        return found

    @property
    def board(self) -> Board:
        """Current `Board`: the steps of every column of the open log; without a log, one column without steps."""
        found = self.open_work
        return Board((ColumnSteps(),)) if found is None else found.board

    @property
    def column(self) -> int:
        """Index of the current column."""
        return self.board.column

    @property
    def column_steps(self) -> ColumnSteps:
        """`ColumnSteps`: the steps of the model building of the current column; without steps before the first fit."""
        return self.board.columns[self.column]

    @property
    def step(self) -> Step:
        """Current `Step` of the current column; raises `InputError` if nothing is fitted yet."""
        found = self.column_steps.step
        if found is None:
            raise InputError("Nothing is fitted yet: open a log first")
        return found

    @property
    def compared_step(self) -> Step | None:
        """Other `Step` of the current column that the user compares with the current step, or None."""
        column_steps = self.column_steps
        there = self._compared in column_steps.steps and self._compared is not column_steps.step
        return self._compared if there else None

    @property
    def busy(self) -> bool:
        """True while a job is running that was not canceled."""
        return self.job is not None and self.job.busy

    @property
    def log(self) -> Recording:
        """`Recording` of the current column of the open log; raises `InputError` if no log is open."""
        return self.work.log(self.column)

    # -- work ----------------------------------------------------------------------------------------

    def start_job(self, name: str, work: Callable[[Job], object], *, follows: bool = False) -> None:
        """Start a job called `name` that calls `work` in a thread; returns at once. A tab runs one job at a time.

        A running check is canceled; with `follows`, the new job waits for its end instead. Raises `InputError` if any
        other job is running.
        """
        with self.lock:
            before = self.job if self.busy else None
            if before is not None:
                if not before.gives_way:
                    raise InputError(f"Still working ({before.name}): wait, or cancel it")
                if not follows:
                    before.cancel()

            def guarded(job: Job) -> None:
                """Run `work`, with `follows` after the end of the job before. Then tell the browser of the change."""
                try:
                    if before is not None and follows:
                        job.await_end(before)
                    work(job)
                finally:
                    self.announce_change()

            self.job = Job(name, guarded)
            self.job.start()

    def announce_change(self) -> None:
        """Increase `version`, by which the browser learns of a change."""
        with self.lock:
            self.version += 1

    @contextmanager
    def changing(self, job: Job) -> Iterator[None]:
        """Context manager in which a job changes the state of the tab; holds the lock and then increases `version`.

        Raises `Ended` if the job was canceled.
        """
        with self.lock, job.uncancelable():
            yield
            self.version += 1

    def set_steps(self, column_steps: ColumnSteps, column: int | None = None) -> None:
        """Store new steps of a column (default: the current one), and discard undone changes and trial values."""
        with self.lock:
            self.work.set_steps(self.column if column is None else column, column_steps)
            self.preview = None
            self.version += 1

    def append_step(self, job: Job, step: Step, column: int) -> None:
        """Add `step` after the current step of a column, and make it the current one; later steps are dropped.

        Raises `Ended` if the job was canceled.
        """
        cache_results(step.fit)
        with self.changing(job):
            column_steps = self.board.columns[column]
            steps = column_steps.steps[: column_steps.at + 1]
            self._update_removed(column, column_steps.step, step)
            self.set_steps(ColumnSteps((*steps, step), len(steps)), column)

    def _update_removed(self, column: int, before: Step | None, after: Step) -> None:
        """Update ``work.removed[column]``, the effects of earlier models whose kind is missing in the model of `after`."""
        tray, there = self.work.removed[column], {e.kind for e in after.fit.model}
        gone = [] if before is None else [e for e in before.fit.model if e.kind not in there]
        kinds = there | {e.kind for e in gone}
        self.work.removed[column] = [*(e for e in tray if e.kind not in kinds), *gone]

    def is_within_tolerance(self, step: Step) -> bool:
        """True if the model discrepancy of a step (%) is below the user's tolerance; False if no tolerance is set."""
        return self.tolerance is not None and step.fit.discrepancy.percent < self.tolerance

    def finished_check(self, job: Job, step: Step) -> Check:
        """`Check` of the fit of a step; stores the step's error and study, each as soon as it is computed.

        Waits until the number of searches in other tabs permits one more. Raises `Ended` if the job was canceled.
        """
        job.take_turn()
        job.begin_stage(f"Searching for effects missing from {step.fit.model.name}")
        if step.error is None:
            found = step.fit.error
            with self.changing(job):
                step.error = found
        if step.study is None:
            check = check_fit(step.fit, job.progress)
            study = Study(step.fit.recording, (step.rung,), check, "nothing helps")
            if check.adequate:
                job.begin_stage("Comparing alternative explanations")
                _ = study.doubts  # cached by the study
            with self.changing(job):
                step.study = study
        return step.study.check

    def check_until_interrupted(self, job: Job, step: Step) -> None:
        """Check a step in a job that any action of the user cancels, and wait for the audit of the samples."""
        job.gives_way = True
        self.finished_check(job, step)
        if self._audit is not None:
            self._audit.join()

    # -- logs ------------------------------------------------------------------------------------------

    def open(
        self,
        place: int,
        reading: Reading | None = None,
        found: Recording | None = None,
        column: int | None = None,
    ) -> None:
        """Start a job that reads the log ``sources[place]`` and fits the first model to a column; cancels a running job.

        An open log is not read again unless `reading` has new options, which discard earlier results. `found` is its
        recording, if it was already read. `column` is the column to show; by default the last viewed one. Errors of
        reading are stored in `problem`. Raises `InputError` if there is no such log or column. `column` is only
        possible for an open log, without `reading` and `found`.
        """
        if not 0 <= place < len(self.sources):
            raise InputError(f"There is no log {place}")
        source = self.sources[place]
        if reading is not None:
            source = self.sources[place] = source.with_reading(reading)
        known = self.works.get(place) if reading is None and found is None else None
        if column is not None and (known is None or not 0 <= column < len(known.board.columns)):
            raise InputError(f"There is no column {column}")

        def work(job: Job) -> None:
            """Read the log unless it is already in memory, show its column, and fit and check the first model."""
            with self.changing(job):
                self.source_index, self.problem, self.preview = place, None, None
                self.moving = False
                self.unit = SHEET
                if known is None:
                    self.works.pop(place, None)
                elif column is not None:
                    known.select_column(column)
            try:
                if known is None:
                    watch = lambda: job.progress(0, 0)  # noqa: E731
                    recording = found or source.read(source.reading, watch)
                    if not source.reading.motion:
                        refusal = motion_error(recording.measured)
                        self.moving = refusal is not None
                        if refusal is not None:
                            raise refusal
                    self._store_new_work(job, place, Work(recording))
            except AllaniteError as error:
                with self.changing(job):
                    self.problem = " ".join(error.worded(WORDS).split())
                return
            self._check_first_step(job, self.column)

        if self.busy:
            self.cancel()
        with self.lock:
            # An earlier problem does not apply to the new reading.
            self.problem = None
            self.version += 1
        self.start_job(f"Reading {source.name}", work)

    def _store_new_work(self, job: Job, place: int, work: Work) -> None:
        """Set ``works[place]`` to the work on a newly read log, and start the audit of its samples in a thread.

        The audit runs beside the first fit, and to its end even if the job is canceled.
        """
        with self.changing(job):
            self.works[place] = work

        def audit() -> None:
            """Compute the audit of the recording, unless another tab has done it, and set ``work.audited``."""
            with self.sources[place].shared.exclusive(None):
                _ = work.recording.audit  # cached by the recording
            work.audited = True
            self.announce_change()

        self._audit = threading.Thread(target=audit, daemon=True)
        self._audit.start()

    def analyze_part(self, part: Part) -> None:
        """Start a job that analyzes a part of the log, starting from the current models; a running job is canceled.

        Raises `InputError` if fewer than 64 samples remain, or if no log is open.
        """
        found = part_of(self.work.whole, *part)

        def work(job: Job) -> None:
            """Make the part the analyzed recording, and fit and check the first model of the current column."""
            self.switch_to_part(job, part, found)
            self._check_first_step(job, self.column)

        if self.busy:
            self.cancel()
        self.start_job("Selecting a part of the log", work)

    def switch_to_part(self, job: Job, part: Part, found: Recording) -> None:
        """Analyze the part `found` of the log from now on, without steps, and start the audit of its samples.

        The first fits start from the models of the former part; if the start time changes, these models lose effects at
        a fixed time. Undo returns to the former part, but to no part before it.
        """
        before, place = self.work, self.source_index
        assert place is not None
        moved = (before.part[0] or (0.0,))[0] != (part[0] or (0.0,))[0]
        work = Work(found, before.whole, part)
        steps = [one.step for one in before.board.columns]
        work.models = [None if s is None else model_for_part(s.fit.model, moved) for s in steps]
        self._store_new_work(job, place, work)
        with self.changing(job):
            # Undo reaches back one part only, because each part keeps a copy of the log.
            work.before, before.before = before, None
            self.work.select_column(before.board.column)
            self.preview = None

    def open_column(self, column: int) -> None:
        """Show a column, discard trial values, and start a job that fits its first model or checks its current step.

        If a job of the user runs, no new job starts; a running check is canceled.
        """
        if not 0 <= column < len(self.board.columns) or self.open_work is None:
            raise InputError(f"There is no column {column}")
        with self.lock:
            self.work.select_column(column)
            self.preview = None
            self.version += 1
        if self.busy and self.job is not None and not self.job.gives_way:
            return  # a job started by the user continues
        self.start_job(
            f"Fitting {self.work.recording.columns[column]}",
            lambda job: self._check_first_step(job, column),
        )

    def _check_first_step(self, job: Job, column: int) -> None:
        """Check the current or first step of a column in a job that any action of the user cancels."""
        job.gives_way = True
        self.check_until_interrupted(job, self.fitted_step(job, column))

    def fitted_step(self, job: Job, column: int) -> Step:
        """Current `Step` of a column; fits and stores the first model if the column has no step.

        The first model is that of the former part of the log, or else N+B+K (Q+F+N+B+K for a clock).
        """
        known = self.board.columns[column].step
        if known is not None:
            return known
        log = self.work.log(column)
        model = self.work.models[column] or parse_model_string(start_model(log))
        job.begin_stage(f"Fitting {model.name} to {log.columns[0]}")
        step = Step("start", Rung(fit_model(log, model)))
        cache_results(step.fit)
        with self.changing(job):
            self.set_steps(ColumnSteps((step,), 0), column)
        return step

    def recheck(self) -> None:
        """Start a job that checks the current step, if its check was canceled and no job is running."""
        step = self.column_steps.step
        if step is not None and step.check is None and not self.busy:
            self.start_job(
                "Searching for missing effects", lambda job: self.check_until_interrupted(job, step)
            )

    def resume(self) -> None:
        """Start again the job that was canceled when the user left the page: reading, the first fit, or the check."""
        if self.open_work is None and self.source_index is not None and self.problem is None:
            self.open(self.source_index)
        elif self.open_work is None and self.source_index is None and self.sources:
            self.open(0)
        elif self.open_work is not None and self.column_steps.step is None:
            self.open_column(self.column)
        else:
            self.recheck()

    def cancel(self) -> None:
        """Cancel the job, if there is one."""
        if self.job is not None:
            self.job.cancel()
            self.announce_change()


def cache_results(fit: Fit) -> None:
    """Compute and cache the estimates, misfit, band and discrepancy of a fit; returns nothing."""
    _ = fit.estimates, fit.misfit, fit.band, fit.discrepancy
