"""Work on a log: the steps of each column, and all earlier states for undo."""

from __future__ import annotations

import hashlib
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from allanite.deviation import Deviation
    from allanite.effects import Effect, Model
    from allanite.fit import Error, Fit
    from allanite.page.source import Part
    from allanite.recording import Recording
    from allanite.study import Rung, Study
    from allanite.suggestion import Check

#: The digest of a log uses at least this number of rows, or all rows of a shorter log.
ROWS = 1_000_000


@dataclass(eq=False)
class Step:
    """A step as shown by the page: its label, fit, errors, and the study with its check once it is available."""

    label: str
    rung: Rung
    error: Error | None = None
    study: Study | None = None

    @property
    def fit(self) -> Fit:
        """`Fit` of the step."""
        return self.rung.fit

    @property
    def check(self) -> Check | None:
        """`Check` of the fit; None until the check is finished."""
        return None if self.study is None else self.study.check


@dataclass(frozen=True, eq=False)
class ColumnSteps:
    """The steps of one column, and the index of the current one."""

    steps: tuple[Step, ...] = ()
    at: int = -1

    @property
    def step(self) -> Step | None:
        """Current `Step`; None without steps."""
        return self.steps[self.at] if self.steps else None


@dataclass(frozen=True, eq=False)
class Board:
    """The steps of all columns, and the index of the current column."""

    columns: tuple[ColumnSteps, ...]
    column: int = 0

    def with_steps(self, column: int, column_steps: ColumnSteps) -> Board:
        """Copy of the board in which the steps of the column with index `column` are replaced by `column_steps`."""
        return replace(
            self, columns=(*self.columns[:column], column_steps, *self.columns[column + 1 :])
        )


class Work:
    """All work on one log, with undo and redo over all its columns.

    `recording` is analyzed; it may be a part of `whole`, which was read. `part` is ((start, end) in s or None for all,
    excluded segments in s).
    """

    def __init__(
        self, recording: Recording, whole: Recording | None = None, part: Part = (None, ())
    ) -> None:
        self.recording = recording
        self.whole = recording if whole is None else whole
        self.part = part
        #: Work on the previously and on the subsequently analyzed part, for undo and redo.
        self.before: Work | None = None
        self.after: Work | None = None
        #: Models of the previous part with which the columns start; None for the default model.
        self.models: list[Model | None] = [None] * len(recording.columns)
        self.history = [Board((ColumnSteps(),) * len(recording.columns))]
        self.state_index = 0
        self.digest = _digest(recording)
        #: Digest of the whole log, independent of the analyzed part.
        self.whole_digest = self.digest if self.whole is recording else _digest(self.whole)
        self.audited = False
        #: Removed effects of each column, which can be restored with their values.
        self.removed: list[list[Effect]] = [[] for _ in recording.columns]
        #: Color role of each effect, which it keeps once assigned.
        self.colors: dict[tuple[str, int], int] = {}
        #: Computed deviations of columns and of simulated sensors.
        self.deviations: dict[Any, Deviation] = {}
        #: Paths of the small curves of the columns, once computed.
        self.paths: list[str | None] | None = None
        self._columns: dict[int, Recording] = {}

    def copied(self) -> Work:
        """Independent copy of the work on a log, in which earlier selections of a part cannot be undone."""
        other = copy(self)
        other.before = other.after = None
        other.models, other.history = list(self.models), list(self.history)
        other.removed = [list(effects) for effects in self.removed]
        other.colors, other.deviations = dict(self.colors), dict(self.deviations)
        other._columns = dict(self._columns)
        return other

    @property
    def board(self) -> Board:
        """Current `Board`: the steps of all columns, and the index of the current column."""
        return self.history[self.state_index]

    def log(self, column: int) -> Recording:
        """`Recording` of the column at an index, cached."""
        if column not in self._columns:
            self._columns[column] = self.recording.column(column)
        return self._columns[column]

    def select_column(self, column: int) -> None:
        """Make the column with index `column` the current one; this change cannot be undone."""
        self.history[self.state_index] = replace(self.board, column=column)

    def set_steps(self, column: int, column_steps: ColumnSteps) -> None:
        """Store new steps of a column as a new state of the work, to which `undo_or_redo` can return.

        States that were undone before are dropped. The first fit of a column cannot be undone: it is written into all
        states.
        """
        self.after = None
        if not self.board.columns[column].steps:
            # The first fit of a column cannot be undone.
            self.history = [
                b if b.columns[column].steps else b.with_steps(column, column_steps)
                for b in self.history
            ]
            return
        self.history = [
            *self.history[: self.state_index + 1],
            self.board.with_steps(column, column_steps),
        ]
        self.state_index += 1

    def undo_or_redo(self, by: int) -> bool:
        """Undo (`by` = −1) or redo (+1) one change, and make the changed column current. False if there is none."""
        if not 0 <= self.state_index + by < len(self.history):
            return False
        old, new = self.board, self.history[self.state_index + by]
        changed = [i for i, one in enumerate(new.columns) if one is not old.columns[i]]
        self.state_index += by
        self.select_column(changed[0] if changed else old.column)
        return True


def _digest(recording: Recording) -> str:
    """Hexadecimal digest, 24 characters, of rate, units, quantity and at most two million rows of samples."""
    step = max(1, recording.n // ROWS)
    part = np.ascontiguousarray(recording.samples[::step])
    said = f"{recording.samples.shape} {recording.rate!r} {recording.units} {recording.quantity}"
    return hashlib.blake2b(part.tobytes() + said.encode(), digest_size=12).hexdigest()
