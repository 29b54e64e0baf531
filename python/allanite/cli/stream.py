"""The Allan deviation of a log that is not kept: standard input, or a file too large for the memory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.cli.pipe import NAME, PIPE
from allanite.errors import InputError, TooShortError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from allanite.accumulator import Accumulator
    from allanite.cli.options import LogOptions
    from allanite.deviation import Deviation
    from allanite.readers._choice import Choice, Request

    _Header = tuple[tuple[str, ...], tuple[str | None, ...]]

__all__ = ["Stream", "deviations", "too_large"]

ROWS = 1 << 16  # taken at a time
SHARE = 0.5  # of the free memory that a log may take before it is read in chunks


def too_large(path: str) -> bool:
    """Tell whether a text log or NPY file is better read in chunks than kept."""
    file = Path(path)
    if not file.is_file() or file.stat().st_size <= SHARE * free_memory():
        return False
    with file.open("rb") as stream:
        head = stream.read(4096)
    return head.startswith(NPY) or b"\0" not in head


def free_memory() -> float:
    """Bytes that can be had without pushing others out; infinite where nothing tells."""
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        return next(1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvail"))
    except (OSError, StopIteration, ValueError, IndexError):
        return math.inf


NPY = b"\x93NUMPY"


@dataclass(frozen=True, slots=True)
class Stream:
    """What is known of a log that was not kept, in the words of a recording."""

    path: str
    columns: tuple[str, ...]
    n: int
    rate: float
    unit: str
    missing: int

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.n / self.rate

    @property
    def audit(self) -> tuple[()]:
        """Nothing: samples that are gone cannot be audited."""
        return ()

    def describe(self) -> dict[str, Any]:
        """JSON form of the contract."""
        return {
            "path": self.path,
            "column": self.columns[0],
            "n": self.n,
            "rate_hz": self.rate,
            "duration_s": self.duration,
            "unit": self.unit,
            "gaps": self.missing,
            "audit": [],
        }


def deviations(options: LogOptions, taus: str, log: str = PIPE) -> list[tuple[Stream, Deviation]]:
    """Read a log to its end, once, and return the deviation of each column.

    Parameters
    ----------
    options : LogOptions
        Without --trim and --decimate, which need the log itself.
    taus : str
        ``octave``, or a number of points per decade.
    log : str
        Text or NPY file, or ``-``.

    Raises
    ------
    InputError
        No rate, a bad cell, an unknown column.
    TooShortError
        Too few rows.
    """
    from allanite.readers._choice import Request, choose

    request = Request(
        options.rate,
        options.unit,
        options.quantity,
        options.column,
        options.covariate,
        options.time_column,
    )
    name = NAME if log == PIPE else log
    (names, units), rows = _opened(log)
    choice = choose(names, units, request, name)
    stamps = () if choice.time is None or request.rate is not None else (choice.time,)
    # Columns that nobody asked for may hold any text, and infinities.
    wanted = sorted({*choice.samples, *stamps})
    chunks = rows(wanted)
    first = next(chunks, None)
    if first is None or len(first) < 3:
        raise TooShortError(f"{name}: too few rows of numbers")
    time = first[:, wanted.index(stamps[0])] if stamps else None
    rate = _rate(time, choice, names, units, request, name)
    columns = [
        _Column(names[i], units[i], wanted.index(i), rate, request, taus, options.output_unit, name)
        for i in choice.samples
    ]
    chunk: NDArray[np.float64] | None = first
    while chunk is not None:
        for column in columns:
            column.take(chunk)
        chunk = next(chunks, None)
    return [column.result() for column in columns]


def _nameless(k: int) -> _Header:
    return ("x",) if k == 1 else tuple(f"x{i}" for i in range(k)), (None,) * k


def _opened(log: str) -> tuple[_Header, Callable[[list[int]], Iterator[NDArray[np.float64]]]]:
    """Names and units, and what gives the rows of some columns a chunk at a time."""
    from allanite._kernels import TextReader
    from allanite.readers.text import split_header

    if log != PIPE:
        with Path(log).open("rb") as stream:
            if stream.read(len(NPY)) == NPY:
                return _mapped(log)
    reader = TextReader(log, finite=True)
    header = _nameless(reader.width) if reader.header is None else split_header(reader.header)

    def rows(wanted: list[int]) -> Iterator[NDArray[np.float64]]:
        reader.select(wanted)
        while (chunk := reader.next(ROWS)) is not None:
            yield chunk

    return header, rows


def _mapped(log: str) -> tuple[_Header, Callable[[list[int]], Iterator[NDArray[np.float64]]]]:
    """Rows of an array that stays in its file."""
    data = np.load(log, mmap_mode="r", allow_pickle=False)
    if data.ndim not in (1, 2) or data.dtype.kind not in "iufb":
        raise InputError(
            f"{log}: samples must be numbers of shape (n,) or (n, columns), found {data.dtype} of"
            f" shape {data.shape}"
        )
    table = data if data.ndim == 2 else data[:, np.newaxis]

    def rows(wanted: list[int]) -> Iterator[NDArray[np.float64]]:
        for at in range(0, len(table), ROWS):
            yield np.asarray(table[at : at + ROWS], np.float64)[:, wanted]

    return _nameless(table.shape[1]), rows


def _rate(
    time: NDArray[np.float64] | None,
    choice: Choice,
    names: tuple[str, ...],
    units: tuple[str | None, ...],
    request: Request,
    log: str,
) -> float:
    """Sampling rate as given, or of the first rows' time stamps; later gaps are not seen."""
    from allanite.readers._table import time_unit_of
    from allanite.timebase import read_stamps

    if request.rate is not None:
        if not (math.isfinite(request.rate) and request.rate > 0):
            raise InputError(f"{log}: the rate must be a positive number of Hz")
        return request.rate
    if time is None or choice.time is None:
        raise InputError(f"{log}: no sampling rate: give --rate HZ or a time column")
    at = choice.time
    return read_stamps(time, time_unit_of(names[at], units[at])).rate


class _Column:
    """One column on its way into an accumulator; angles are differenced across chunks."""

    def __init__(
        self,
        name: str,
        own: str | None,
        at: int,
        rate: float,
        request: Request,
        taus: str,
        output_unit: str | None,
        log: str,
    ) -> None:
        from allanite.accumulator import Accumulator
        from allanite.readers._choice import unit_of
        from allanite.units import conversion, parse_unit, rate_unit

        quantity = request.quantity or ("angle" if own == "s" else "rate")
        said = unit_of(name, own, request.unit, quantity, log)
        self.log = log
        self.name, self.at, self.rate, self.quantity = name, at, rate, quantity
        self.unit = rate_unit(said, quantity).name
        self.factor = 1.0
        if output_unit is not None:
            target = parse_unit(output_unit).name
            self.factor, self.unit = conversion(self.unit, target), target
        self.rows = 0
        self.last: NDArray[np.float64] = np.empty(0)
        # A decade has log2(10) octaves.
        grid: str | int = math.ceil(int(taus) / math.log2(10)) if taus.isdigit() else taus
        self.sums: Accumulator = Accumulator(
            rate,
            grid,
            quantity="increment" if quantity == "increment" else "rate",
            unit=self.unit,
        )

    def take(self, chunk: NDArray[np.float64]) -> None:
        x = samples = chunk[:, self.at]
        if self.quantity == "angle":
            joined = np.concatenate((self.last, x))
            self.last = joined[-1:]
            x = np.diff(joined) * self.rate
        try:
            self.sums.update(x if self.factor == 1.0 else x * self.factor)
        except InputError:
            # Of a text log the reader has refused it by its line: this is an array's.
            bad = np.flatnonzero(np.isinf(samples))
            if bad.size == 0:
                raise
            raise InputError(
                f"{self.log}: column {self.name}: sample {self.rows + int(bad[0]) + 1}, counted"
                f" from 1, is {samples[bad[0]]}: mark missing samples with NaN"
            ) from None
        self.rows += len(samples)

    def result(self) -> tuple[Stream, Deviation]:
        """Description and deviation."""
        sums = self.sums
        stream = Stream(self.log, (self.name,), sums.n, self.rate, self.unit, sums.gaps)
        found = sums.oadev()
        if self.log != NAME:
            note = "log read in chunks: it would take more than half of the free memory"
            found = replace(found, diagnostics=(note, *found.diagnostics))
        return stream, found
