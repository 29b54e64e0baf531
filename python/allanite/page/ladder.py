"""What was done to a log: a ladder for each of its columns, and every state before for undo."""

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

__all__ = ["Board", "Ladder", "Step", "Work"]

#: Rows of which the content of a log is known again.
ROWS = 1_000_000


@dataclass(eq=False)
class Step:
    """A step as the page shows it: what was done, the fit, its errors, and what a study says of the fit once it is made."""

    label: str
    rung: Rung
    error: Error | None = None
    study: Study | None = None

    @property
    def fit(self) -> Fit:
        """The fit of the step."""
        return self.rung.fit

    @property
    def check(self) -> Check | None:
        """The check of the fit; None until it is made."""
        return None if self.study is None else self.study.check


@dataclass(frozen=True, eq=False)
class Ladder:
    """Steps, and the one that is looked at."""

    steps: tuple[Step, ...] = ()
    at: int = -1

    @property
    def step(self) -> Step | None:
        """The step that is looked at."""
        return self.steps[self.at] if self.steps else None


@dataclass(frozen=True, eq=False)
class Board:
    """A ladder for each column, and the column that is looked at."""

    ladders: tuple[Ladder, ...]
    column: int = 0

    def put(self, column: int, ladder: Ladder) -> Board:
        """The board with another ladder."""
        return replace(self, ladders=(*self.ladders[:column], ladder, *self.ladders[column + 1 :]))


class Work:
    """All that was done to one log, with undo and redo over all its columns.

    Parameters
    ----------
    recording : Recording
        What is analysed.
    whole : Recording
        What was read, of which it may be a part.
    part : (span, stretches)
        That part, s: from … to or None for all, and what is left out of it.
    """

    def __init__(
        self,
        recording: Recording,
        whole: Recording | None = None,
        part: Part = (None, ()),
    ) -> None:
        self.recording = recording
        self.whole = recording if whole is None else whole
        self.part = part
        #: What was done to the part that was analysed before, and after: undo and redo go there.
        self.before: Work | None = None
        self.after: Work | None = None
        #: Models that the columns begin with, of the part before; None for the first model of any column.
        self.models: list[Model | None] = [None] * len(recording.columns)
        self.history = [Board((Ladder(),) * len(recording.columns))]
        self.place = 0
        self.digest = _digest(recording)
        #: By what the whole log is known again, whichever part of it is analysed.
        self.home = self.digest if self.whole is recording else _digest(self.whole)
        self.audited = False
        #: Effects that were taken out, by column: they can be brought back with the values they had.
        self.tray: list[list[Effect]] = [[] for _ in recording.columns]
        #: Colour role of each effect once it was seen: it keeps it.
        self.colors: dict[tuple[str, int], int] = {}
        #: Deviations of its columns and of twins that were looked at.
        self.deviations: dict[Any, Deviation] = {}
        #: The small curves of its columns, once they were drawn.
        self.paths: list[str | None] | None = None
        self._columns: dict[int, Recording] = {}

    def copied(self) -> Work:
        """The same, to be gone on with by itself: what is done to one from now on does not change the other."""
        other = copy(self)
        other.before = other.after = None
        other.models, other.history = list(self.models), list(self.history)
        other.tray = [list(effects) for effects in self.tray]
        other.colors, other.deviations = dict(self.colors), dict(self.deviations)
        other._columns = dict(self._columns)
        return other

    @property
    def board(self) -> Board:
        """The state now."""
        return self.history[self.place]

    def log(self, column: int) -> Recording:
        """One column, kept."""
        if column not in self._columns:
            self._columns[column] = self.recording.column(column)
        return self._columns[column]

    def look(self, column: int) -> None:
        """Look at another column: nothing to undo."""
        self.history[self.place] = replace(self.board, column=column)

    def push(self, column: int, ladder: Ladder) -> None:
        """Go on to another ladder of a column; what was undone is forgotten."""
        self.after = None
        if not self.board.ladders[column].steps:
            # A column without a first fit is nothing to go back to.
            self.history = [
                b if b.ladders[column].steps else b.put(column, ladder) for b in self.history
            ]
            return
        self.history = [*self.history[: self.place + 1], self.board.put(column, ladder)]
        self.place += 1

    def move(self, by: int) -> bool:
        """One change back or forward; the column that it was of is looked at."""
        if not 0 <= self.place + by < len(self.history):
            return False
        old, new = self.board, self.history[self.place + by]
        changed = [i for i, one in enumerate(new.ladders) if one is not old.ladders[i]]
        self.place += by
        self.look(changed[0] if changed else old.column)
        return True


def _digest(recording: Recording) -> str:
    """By what the same log is known again: its samples, rate and units."""
    step = max(1, recording.n // ROWS)
    part = np.ascontiguousarray(recording.samples[::step])
    said = f"{recording.samples.shape} {recording.rate!r} {recording.units} {recording.quantity}"
    return hashlib.blake2b(part.tobytes() + said.encode(), digest_size=12).hexdigest()
