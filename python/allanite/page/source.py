"""Logs that the page may open, given at the start or uploaded into a folder of its own, and parts of them."""

from __future__ import annotations

import re
import threading
import weakref
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from allanite.common.errors import InputError, about
from allanite.common.files import OwnedFolder
from allanite.effects import Model
from allanite.page.child import POLL_S, inspect_in_child, read_in_child
from allanite.readers import FORMATS
from allanite.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from allanite.effects import Effect

__all__ = [
    "MOST_BYTES",
    "Part",
    "Reading",
    "Source",
    "Stretch",
    "Uploads",
    "check_name",
    "joined",
    "kept",
    "part_of",
]

#: Largest upload: two thousand million bytes, some 100 million samples of text.
MOST_BYTES = 2_000_000_000
_FORBIDDEN = re.compile(r"[\x00-\x1f/\\:]")


@dataclass(frozen=True, slots=True)
class Reading:
    """How a log is to be read; None where the reader guesses."""

    rate: float | None = None
    unit: str | None = None
    quantity: str | None = None
    time_column: str | None = None
    output_unit: str | None = None
    columns: tuple[str, ...] = ()
    #: Units of single columns, by name.
    units: Mapping[str, str] = field(default_factory=dict)
    piece: int | None = None
    #: What to do with a log that is mostly motion: "" refuses it, "quiet" takes its longest quiet segment, "anyway" all.
    motion: str = ""

    def options(self) -> dict[str, Any]:
        """What the reader is told."""
        return {
            "rate": self.rate,
            "unit": self.unit,
            "quantity": self.quantity,
            "time_column": self.time_column,
            "column": list(self.columns) or None,
            "piece": self.piece,
            "units": dict(self.units),
        }


#: Called again and again while something is waited for; what it raises ends the waiting.
Watch: TypeAlias = "Callable[[], None] | None"


class Shared:
    """What tabs have of one log: it is read once, and forgotten with the last of them."""

    def __init__(self) -> None:
        self._gate = threading.Lock()
        self._found: Callable[[], Recording | None] = lambda: None
        self._state: tuple[int, int] | None = None

    def get(self, path: Path, read: Callable[[], Recording], watch: Watch) -> Recording:
        """The recording that another tab has, or that is read now; a file that was changed since is read again."""
        with self.alone(watch):
            state = _state(path)
            found = self._found() if state == self._state else None
            if found is None:
                found = read()
                self._found, self._state = weakref.ref(found), state
            return found

    @contextmanager
    def alone(self, watch: Watch) -> Iterator[None]:
        """Do what another tab need not do again; `watch` is called until it is this one's turn."""
        while not self._gate.acquire(timeout=POLL_S):
            if watch is not None:
                watch()
        try:
            yield
        finally:
            self._gate.release()


def _state(path: Path) -> tuple[int, int] | None:
    """What changes with a file; None where there is none, which the reader says."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A log by its name; where it lies is never told to the browser."""

    name: str
    path: Path | None = None
    recording: Recording | None = None
    reading: Reading = Reading()
    shared: Shared = field(default_factory=Shared)

    def read(self, reading: Reading, watch: Watch = None) -> Recording:
        """All sensor columns; `watch` is called meanwhile, and what it raises ends the reading.

        Raises
        ------
        InputError
            The log cannot be used as asked; the message speaks of its name.
        """
        recording = self.recording
        if recording is None:
            assert self.path is not None

            def read() -> Recording:
                assert self.path is not None
                with about(self.name, instead=self.path):
                    return read_in_child(self.path, reading.options(), watch).called(self.name)

            same = reading == self.reading
            recording = self.shared.get(self.path, read, watch) if same else read()
        if reading.motion == "quiet":
            recording = recording.quiet()
        return recording if reading.output_unit is None else recording.to(reading.output_unit)

    def inspect(self, reading: Reading) -> dict[str, Any]:
        """What is understood of each column, as `allanite.readers.inspection` says it, with spark lines."""
        if self.path is None:
            raise InputError(f"{self.name} was passed as a recording: there is no file to inspect")
        with about(self.name, instead=self.path):
            found = inspect_in_child(self.path, reading.options())
        text = str(self.path)
        problem = found["problem"]
        return {
            **found,
            "path": self.name,
            "problem": problem and problem.replace(text, self.name),
        }

    def with_reading(self, reading: Reading) -> Source:
        """The same log, to be read otherwise."""
        return replace(self, reading=reading, shared=Shared())


def check_name(name: str) -> str:
    """Return the name of an uploaded file.

    Raises
    ------
    InputError
        A path, a hidden or an empty name: only the name of a file is taken from a browser.
    """
    if not name or len(name) > 200 or _FORBIDDEN.search(name) or name.startswith("."):
        shown = name[:80]
        raise InputError(
            f"file name {shown!r} refused: only a plain name is accepted, no path and no hidden file"
        )
    return name


class Uploads:
    """A private folder of uploaded logs, gone with the server; those of a server that was killed go with the next."""

    KIND = "page"

    def __init__(self) -> None:
        self._folder: OwnedFolder | None = None
        self._count = 0
        OwnedFolder.remove_abandoned(self.KIND)

    def place(self, name: str) -> Path:
        """A new path; of the browser's name only a known suffix is kept."""
        if self._folder is None:
            self._folder = OwnedFolder(self.KIND)
        self._count += 1
        suffix = Path(name).suffix.lower()
        if suffix not in (*FORMATS.suffixes, ".json"):  # a data sheet is JSON
            suffix = ".csv"
        return self._folder.path / f"{self._count:04d}{suffix}"

    def files(self) -> Sequence[Path]:
        """The uploaded logs."""
        return [] if self._folder is None else sorted(self._folder.path.glob("[0-9]*"))

    def close(self) -> None:
        """Delete everything."""
        if self._folder is not None:
            self._folder.close()
            self._folder = None


#: From … to, s from the start of the whole log.
Stretch = tuple[float, float]
#: What is analysed of a log: a stretch or all of it, and what is left out.
Part = tuple[Stretch | None, tuple[Stretch, ...]]
#: Samples of the shortest part of a log that is analysed by itself.
FEWEST = 64


def joined(stretches: Iterable[Stretch]) -> tuple[Stretch, ...]:
    """Stretches in their order, those that touch made one."""
    out: list[Stretch] = []
    for start, end in sorted(stretches):
        if out and start <= out[-1][1]:
            out[-1] = out[-1][0], max(end, out[-1][1])
        else:
            out.append((start, end))
    return tuple(out)


def part_of(whole: Recording, span: Stretch | None, out: tuple[Stretch, ...]) -> Recording:
    """A part of a log; what is left out of it is missing, so that time goes on as it was.

    Raises
    ------
    InputError
        Hardly anything is left.
    """
    part = whole if span is None else whole.trim(*span)
    begin = 0.0 if span is None else max(span[0], 0.0)
    if out:
        part = _without(part, [(a - begin, b - begin) for a, b in out])
    left = part.n - (part.missing if out else 0)
    if left < FEWEST:
        raise InputError(f"{left} samples are too few: leave more of the log")
    return part


def _without(part: Recording, out: list[Stretch]) -> Recording:
    samples = np.array(part.samples, dtype=np.promote_types(part.samples.dtype, np.float32))
    for stretch in out:
        # A stretch may end long after the record, or be of another one.
        first, last = (round(min(max(t, 0.0), part.duration) * part.rate) for t in stretch)
        samples[first:last] = np.nan
    return Recording(
        samples,
        part.rate,
        unit=part.units,
        quantity=part.quantity,
        columns=part.columns,
        covariates=part.covariates,
        covariate_units=part.covariate_units,
        path=part.path,
    )


def kept(model: Model, moved: bool) -> Model | None:
    """A model to begin with on another part; events stay out where the start of time has `moved`."""
    effects = [e for e in model if not (moved and _is_of_time(e))]
    return Model(tuple(effects)) if effects else None


def _is_of_time(effect: Effect) -> bool:
    return effect.when is not None or any(p.role == "time" for p in effect.parameters)
