"""Allan deviation of a log that is read in chunks: standard input, or a file too large for the memory."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.cli.options import is_points_per_decade
from allanite.cli.pipe import INPUT_NAME, STANDARD_INPUT
from allanite.common.errors import InputError, TooShortError, about
from allanite.common.memory import budget
from allanite.common.plain import plain
from allanite.recording.record import Record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from allanite.cli.options import LogOptions
    from allanite.deviation import Deviation
    from allanite.deviation.accumulator import Accumulator
    from allanite.readers._table import Table
    from allanite.readers.columns import Layout
    from allanite.readers.time_parts import TimeParts
    from allanite.recording.findings import Finding

    _Rows = Callable[[list[int]], Iterator[NDArray[Any]]]

#: First bytes of an NPY file.
NPY = b"\x93NUMPY"
#: Number of rows per chunk.
CHUNK_ROWS = 1 << 16
#: Maximum number of averaging times per octave (limit of `Accumulator`).
MAX_TAUS_PER_OCTAVE = 16


def is_too_large(path: str) -> bool:
    """True if a text log or NPY file is larger than the memory budget; False for other files or no file.

    A file is text if its first 4096 bytes have no null byte.
    """
    file = Path(path)
    if not file.is_file() or file.stat().st_size <= budget():
        return False
    with file.open("rb") as stream:
        head = stream.read(4096)
    return head.startswith(NPY) or b"\0" not in head


@dataclass(frozen=True, slots=True)
class Stream(Record):
    """Description of a log that was read in chunks, without its samples; only its time stamps are audited."""

    path: str
    columns: tuple[str, ...]
    rate: float
    units: tuple[str, ...]
    n: int = field()
    gaps: int = field()
    audit: tuple[Finding, ...] = field()
    whole: bool = False


def deviations_in_chunks(
    options: LogOptions, taus: str, log: str = STANDARD_INPUT
) -> list[tuple[Stream, Deviation]]:
    """List of (`Stream`, overlapping Allan deviation), one pair per column; the log is read once, in chunks.

    Parameters
    ----------
    options : LogOptions
        Shared options; --trim and --decimate must not be given, as they need all samples.
    taus : str
        ``octave``, or a number of points per decade.
    log : str
        Text or NPY file, or ``-``.

    Raises
    ------
    InputError
        There is no rate, a cell is invalid, or a column is unknown.
    TooShortError
        There are too few rows.
    """
    from allanite.readers.text import core_errors_with_remedy

    name = INPUT_NAME if log == STANDARD_INPUT else log
    with about(name), core_errors_with_remedy(name):
        return _read_deviations(options, taus, log)


def _read_deviations(options: LogOptions, taus: str, log: str) -> list[tuple[Stream, Deviation]]:
    """List of (`Stream`, `Deviation`), one pair per column.

    The caller adds the name of the log to errors. Raises `TooShortError` below 3 rows, and `InputError` without a rate.
    """
    from allanite.cli.clock import Clock
    from allanite.common.validation import positive_rate
    from allanite.readers import refuse_contradicting_rate, request_of
    from allanite.readers.columns import layout_of
    from allanite.readers.unit_names import no_unit_findings
    from allanite.recording.findings import stamp_findings
    from allanite.recording.samples import factors_to

    request = request_of(**{**options.read_arguments(), "piece": None, "topic": None})
    name = INPUT_NAME if log == STANDARD_INPUT else log
    table, rows = _open_log(log)
    layout = layout_of(table, request)
    names, units = table.names, table.units
    # Columns that are not used may hold text and infinities.
    wanted = sorted({*layout.samples, *layout.time_columns})
    chunks = rows(wanted)
    first = next(chunks, None)
    if first is None or len(first) < 3:
        raise TooShortError("fewer than 3 rows of numbers")
    clock = None
    all_rows: Iterable[NDArray[Any]] = itertools.chain((first,), chunks)
    if layout.time is not None:
        unit = layout.time_unit
        if layout.parts is not None:
            all_rows, unit = (
                _with_joined_time(
                    all_rows, [wanted.index(i) for i in layout.time_columns], layout.parts
                ),
                "s",
            )
        clock = Clock(wanted.index(layout.time), unit, request.rate)
    if request.rate is not None:
        positive_rate(request.rate)
    elif clock is None:
        raise InputError("no sampling rate", missing="rate", remedy=": add {rate} or a time column")
    columns = [
        _Column(names[i], unit, layout, i, wanted.index(i), taus, options.output_units, name)
        for i, unit in zip(layout.samples, layout.units, strict=True)
    ]
    if options.output_units:
        # Only columns of the unit's kind of sensor are converted. This call raises an error if there is none.
        factors_to(",".join(options.output_units.values()), tuple(c.unit for c in columns))
    for chunk in all_rows if clock is None else clock.fill(all_rows):
        for column in columns:
            column.add(chunk)
    stamps = None if clock is None else clock.stamps()
    rate = request.rate or (stamps.rate if stamps else 0.0)
    refuse_contradicting_rate(request, None, stamps)
    audit = (*layout.findings, *(stamp_findings(stamps, rate) if stamps else ()))
    if request.unit is None and layout.quantity == "rate":
        audit += tuple(no_unit_findings([names[i] for i in layout.samples if units[i] is None]))
    return [column.result(rate, audit) for column in columns]


def _with_joined_time(
    chunks: Iterable[NDArray[np.float64]], places: Sequence[int], parts: TimeParts
) -> Iterator[NDArray[np.float64]]:
    """Yield chunks, shape (rows, columns), whose first time column holds the seconds since the first row.

    `places` are the columns whose parts (date, seconds, nanoseconds, …) make up the time.
    """
    origin: list[float] | None = None
    for chunk in chunks:
        arrays = [chunk[:, place] for place in places]
        origin = [float(x[0]) for x in arrays] if origin is None else origin
        out = chunk.copy()
        out[:, places[0]] = parts.joined(arrays, origin)
        yield out


def _open_log(log: str) -> tuple[Table, _Rows]:
    """Tuple (table of the first rows, function that yields all rows of given columns in chunks)."""
    from allanite._kernels import TextReader
    from allanite.readers._table import split_header
    from allanite.readers.text import first_rows

    if log != STANDARD_INPUT:
        with Path(log).open("rb") as stream:
            if stream.read(len(NPY)) == NPY:
                return _open_npy(log)
    reader = TextReader(log, finite=True)
    names, units = ((), ()) if reader.header is None else split_header(reader.header)
    table, _ = first_rows(reader, names, units)

    def rows(wanted: list[int]) -> Iterator[NDArray[Any]]:
        """Yield the given columns of all rows in chunks, shape (rows, columns)."""
        reader.select(wanted)
        while (chunk := reader.next(CHUNK_ROWS)) is not None:
            yield chunk

    return table, rows


def _open_npy(log: str) -> tuple[Table, _Rows]:
    """Tuple (table of the first rows, function that yields all rows of given columns in chunks) of an NPY file.

    The file is mapped into memory.
    """
    from allanite.readers._table import Table
    from allanite.readers.arrays.npy import load

    array = load(Path(log), largest_read=0)

    def rows(wanted: list[int]) -> Iterator[NDArray[Any]]:
        """Yield the given columns of all rows in chunks, shape (rows, columns)."""
        for at in range(0, len(array), CHUNK_ROWS):
            part = np.asarray(array[at : at + CHUNK_ROWS])
            # Integers keep their type, as doubles do not hold all 64-bit integers.
            yield (part if part.dtype.kind in "iu" else part.astype(np.float64))[:, wanted]

    k = array.shape[1]
    names = ("x",) if k == 1 else tuple(f"x{i}" for i in range(k))
    return Table(names, tuple(np.asarray(array[:CHUNK_ROWS]).T), (None,) * k, named=False), rows


class _Column:
    """Allan variance of one column, accumulated chunk by chunk; angles are differenced, also across chunks."""

    def __init__(
        self,
        name: str,
        unit: str,
        layout: Layout,
        column: int,
        at: int,
        taus: str,
        output_units: Mapping[str, str],
        log: str,
    ) -> None:
        from allanite.common.units import conversion, parse_unit, rate_unit
        from allanite.deviation.accumulator import Accumulator

        self.log = plain(log)
        self.name, self.at, self.quantity = name, at, layout.quantity
        quantity = layout.quantity
        self.unit = rate_unit(unit, quantity).name
        self.factor = layout.columns[column].scale
        target = output_units.get(parse_unit(self.unit).kind)
        if target is not None:
            self.factor, self.unit = self.factor * conversion(self.unit, target), target
        self.rows = self.gaps = 0
        self.last: NDArray[Any] = np.empty(0)
        self.hole = False
        grid: str | int = taus
        if is_points_per_decade(taus):
            # A decade has log2(10) octaves.
            grid = math.ceil(int(taus) / math.log2(10))
            if not 1 <= grid <= MAX_TAUS_PER_OCTAVE:
                raise InputError(
                    f"--taus {taus}: a log that is read in chunks can have 1 to"
                    f" {int(MAX_TAUS_PER_OCTAVE * math.log2(10))} averaging times per decade"
                )
        # 1 Hz stands for the rate, which is only known at the end of the log.
        self.sums: Accumulator = Accumulator(
            1.0,
            grid,
            quantity="increment" if quantity == "increment" else "rate",
            unit=self.unit,
        )

    def add(self, chunk: NDArray[Any]) -> None:
        """Add the samples of this column in a chunk to the sums, and count rows and gaps.

        Raises `InputError` for an infinite sample.
        """
        x = samples = chunk[:, self.at]
        if self.quantity == "angle":
            # Differences of narrow or unsigned integers would wrap. Differences of 64-bit integers are exact modulo 2^64.
            x = x.astype(np.int64) if x.dtype.kind in "iu" else x
            joined = np.concatenate((self.last, x)) if self.last.size else x
            self.last = joined[-1:]
            x = np.diff(joined)
        try:
            self.sums.update(x)
        except InputError:
            # The text reader refuses an infinite sample by its line number. This one comes from an NPY file.
            bad = np.flatnonzero(np.isinf(samples))
            if bad.size == 0:
                raise
            raise InputError(
                f"column {self.name}: sample {self.rows + int(bad[0]) + 1}, counted"
                f" from 1, is {samples[bad[0]]}: mark missing samples with NaN"
            ) from None
        holes = np.concatenate(([self.hole], np.isnan(samples)))
        self.gaps += int(np.count_nonzero(holes[1:] & ~holes[:-1]))
        self.hole = bool(holes[-1])
        self.rows += len(samples)

    def result(self, rate: float, audit: tuple[Finding, ...]) -> tuple[Stream, Deviation]:
        """Tuple (`Stream`, `Deviation`) of all samples so far, in the requested unit; `rate` is the sampling rate in Hz.

        A log from a file gets a note that it was read in chunks.
        """
        self.sums.rate = rate
        stream = Stream(self.log, (self.name,), rate, (self.unit,), self.rows, self.gaps, audit)
        found = self.sums.oadev()
        factor = self.factor * (rate if self.quantity == "angle" else 1.0)
        notes = found.diagnostics
        if self.log != INPUT_NAME:
            notes = ("log read in chunks, as it is larger than half of the free memory", *notes)
        return stream, replace(found, deviation=found.deviation * factor, diagnostics=notes)
