"""Logs of the page, given at the start or uploaded, and parts of logs."""

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
from allanite.common.isolation import POLL_S
from allanite.common.read_options import ReadOptions
from allanite.effects import Model
from allanite.page.child import inspect_in_child, read_in_child
from allanite.readers import FORMATS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from allanite.recording import Recording

#: Maximum size of an upload in bytes, enough for about 100 million samples as text.
MAX_UPLOAD_BYTES = 2_000_000_000
_FORBIDDEN = re.compile(r"[\x00-\x1f/\\:]")


@dataclass(frozen=True, slots=True)
class Reading:
    """Settings for reading a log; by default, the reader decides."""

    options: ReadOptions = field(default_factory=ReadOptions)
    output_unit: str | None = None
    #: Units of single columns, by name.
    units: Mapping[str, str] = field(default_factory=dict)
    #: What to do with a log that is mostly motion: "" refuses it, "quiet" takes its longest quiet segment, "anyway" all.
    motion: str = ""


#: Called repeatedly while waiting; an exception that it raises ends the wait.
Watch: TypeAlias = "Callable[[], None] | None"


class SharedRecording:
    """Recording of a log shared by all tabs: read once and freed with the last tab."""

    def __init__(self) -> None:
        self._gate = threading.Lock()
        self._found: Callable[[], Recording | None] = lambda: None
        self._state: tuple[int, int] | None = None

    def get(self, path: Path, read: Callable[[], Recording], watch: Watch) -> Recording:
        """`Recording` of the log at `path`: the one that another tab uses, or ``read()`` if none or the file changed.

        Only a weak reference is kept. `watch` is called repeatedly while another tab reads the same log.
        """
        with self.exclusive(watch):
            state = _file_stamp(path)
            found = self._found() if state == self._state else None
            if found is None:
                found = read()
                self._found, self._state = weakref.ref(found), state
            return found

    @contextmanager
    def exclusive(self, watch: Watch) -> Iterator[None]:
        """Context manager that only one tab enters at a time; `watch` is called every 20 ms while this tab waits."""
        while not self._gate.acquire(timeout=POLL_S):
            if watch is not None:
                watch()
        try:
            yield
        finally:
            self._gate.release()


def _file_stamp(path: Path) -> tuple[int, int] | None:
    """Pair (modification time in ns, size in bytes) of a file; None if it cannot be accessed, which the reader reports."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A log with its name; the browser never learns its path."""

    name: str
    path: Path | None = None
    recording: Recording | None = None
    reading: Reading = Reading()
    shared: SharedRecording = field(default_factory=SharedRecording)

    def read(self, reading: Reading, watch: Watch = None) -> Recording:
        """`Recording` of the log, read in a child process with the settings `reading`; one of Python is only converted.

        `watch` is called repeatedly during the reading; an exception that it raises ends the reading. The message of an
        `InputError` contains only the name of the log, not its path.
        """
        recording = self.recording
        if recording is None:
            assert self.path is not None

            def read() -> Recording:
                """`Recording` of the file, read in a child process and named like the source."""
                assert self.path is not None
                with about(self.name, instead=self.path):
                    return read_in_child(
                        self.path, reading.options, reading.units, watch
                    ).with_path(self.name)

            same = reading == self.reading
            recording = self.shared.get(self.path, read, watch) if same else read()
        if reading.motion == "quiet":
            recording = recording.quiet()
        return recording if reading.output_unit is None else recording.to(reading.output_unit)

    def inspect(self, reading: Reading) -> dict[str, Any]:
        """Dict of `inspect_in_child` for this log, with its name instead of its path.

        Raises `InputError` for a recording without a file.
        """
        if self.path is None:
            raise InputError(f"{self.name} was passed as a recording: there is no file to inspect")
        with about(self.name, instead=self.path):
            found = inspect_in_child(self.path, reading.options)
        text = str(self.path)
        problem = found["problem"]
        return {**found, "path": self.name, "problem": problem and problem.replace(text, self.name)}

    def with_reading(self, reading: Reading) -> Source:
        """Copy of the source with other settings for reading; its recording is not shared with earlier ones."""
        return replace(self, reading=reading, shared=SharedRecording())


def check_name(name: str) -> str:
    """The given name of an uploaded file, unchanged.

    Raises `InputError` for a path, for a hidden or empty name, and for over 200 characters.
    """
    if not name or len(name) > 200 or _FORBIDDEN.search(name) or name.startswith("."):
        shown = name[:80]
        raise InputError(
            f"file name {shown!r} refused: only a plain name is accepted, no path and no hidden file"
        )
    return name


class Uploads:
    """Private folder of uploaded logs, deleted with the server; the next server deletes that of a killed one."""

    KIND = "page"

    def __init__(self) -> None:
        self._folder: OwnedFolder | None = None
        self._count = 0
        OwnedFolder.remove_abandoned(self.KIND)

    def new_path(self, name: str) -> Path:
        """`Path` of a new upload with the suffix of `name` if a reader knows it (or ``.json``), otherwise ``.csv``."""
        if self._folder is None:
            self._folder = OwnedFolder(self.KIND)
        self._count += 1
        suffix = Path(name).suffix.lower()
        if suffix not in (*FORMATS.suffixes, ".json"):  # a data sheet is JSON
            suffix = ".csv"
        return self._folder.path / f"{self._count:04d}{suffix}"

    def files(self) -> Sequence[Path]:
        """List of the paths of the uploaded files, sorted; empty without uploads."""
        return [] if self._folder is None else sorted(self._folder.path.glob("[0-9]*"))

    def close(self) -> None:
        """Delete the folder with all uploads."""
        if self._folder is not None:
            self._folder.close()
            self._folder = None


#: Segment (start, end) in s from the start of the whole log.
Segment = tuple[float, float]
#: Analyzed part of a log: a segment or None for the whole log, and the excluded segments.
Part = tuple[Segment | None, tuple[Segment, ...]]
#: Minimum number of samples of an analyzed part. Chosen by judgment; not measured.
MIN_SAMPLES = 64


def merged_segments(stretches: Iterable[Segment]) -> tuple[Segment, ...]:
    """Tuple of segments (start, end) in s, in ascending order; overlapping or touching segments are merged."""
    out: list[Segment] = []
    for start, end in sorted(stretches):
        if out and start <= out[-1][1]:
            out[-1] = out[-1][0], max(end, out[-1][1])
        else:
            out.append((start, end))
    return tuple(out)


def part_of(whole: Recording, span: Segment | None, out: tuple[Segment, ...]) -> Recording:
    """`Recording` of the part `span` (s; None is all) of a log, in which the samples of the segments `out` are missing.

    Raises `InputError` if fewer than 64 samples remain.
    """
    part = whole if span is None else whole.trim(*span)
    begin = 0.0 if span is None else max(span[0], 0.0)
    if out:
        part = _with_excluded_segments(part, [(a - begin, b - begin) for a, b in out])
    left = part.n - (part.missing if out else 0)
    if left < MIN_SAMPLES:
        raise InputError(f"{left} samples are too few: select at least {MIN_SAMPLES}")
    return part


def _with_excluded_segments(part: Recording, out: list[Segment]) -> Recording:
    """Copy of the recording with NaN in the segments `out`, (start, end) in s from its start."""
    samples = np.array(part.samples, dtype=np.promote_types(part.samples.dtype, np.float32))
    for stretch in out:
        # A segment may end after the record or belong to another record.
        first, last = (round(min(max(t, 0.0), part.duration) * part.rate) for t in stretch)
        samples[first:last] = np.nan
    return part.with_samples(samples)


def model_for_part(model: Model, moved: bool) -> Model | None:
    """Model with which the fit of another part of the log starts; None if no effect remains.

    If the start time has `moved`, effects at a particular time, such as steps, are removed.
    """
    effects = [
        e
        for e in model
        if not moved or (e.when is None and all(p.role != "time" for p in e.parameters))
    ]
    return Model(tuple(effects)) if effects else None
