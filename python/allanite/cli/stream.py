"""The Allan deviation of a text log that arrives on standard input, in constant memory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.cli.pipe import NAME, PIPE
from allanite.errors import InputError, TooShortError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.accumulator import Accumulator
    from allanite.cli.options import LogOptions
    from allanite.deviation import Deviation
    from allanite.readers._choice import Choice, Request

__all__ = ["Stream", "deviations"]

ROWS = 1 << 16  # taken at a time


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


def deviations(options: LogOptions, taus: str) -> list[tuple[Stream, Deviation]]:
    """Read standard input to its end and return the deviation of each column.

    Parameters
    ----------
    options : LogOptions
        Without --trim and --decimate, which need the log itself.
    taus : str
        ``octave``, or a number of points per decade.

    Raises
    ------
    InputError
        No rate, a bad cell, an unknown column.
    TooShortError
        Too few rows.
    """
    from allanite._kernels import TextReader
    from allanite.readers._choice import Request, choose
    from allanite.readers.text import split_header

    request = Request(
        options.rate,
        options.unit,
        options.quantity,
        options.column,
        options.covariate,
        options.time_column,
    )
    reader = TextReader(PIPE)
    first = reader.next(ROWS)
    if first is None or len(first) < 3:
        raise TooShortError(f"{NAME}: too few rows of numbers")
    if reader.header is None:
        k = first.shape[1]
        names: tuple[str, ...] = ("x",) if k == 1 else tuple(f"x{i}" for i in range(k))
        units: tuple[str | None, ...] = (None,) * k
    else:
        names, units = split_header(reader.header)
    choice = choose(names, units, request, NAME)
    rate = _rate(first, choice, names, units, request)
    columns = [
        _Column(names[i], units[i], i, rate, request, taus, options.output_unit)
        for i in choice.samples
    ]
    chunk: NDArray[np.float64] | None = first
    while chunk is not None:
        for column in columns:
            column.take(chunk)
        chunk = reader.next(ROWS)
    return [column.result() for column in columns]


def _rate(
    first: NDArray[np.float64],
    choice: Choice,
    names: tuple[str, ...],
    units: tuple[str | None, ...],
    request: Request,
) -> float:
    """Sampling rate as given, or of the first rows' time stamps; later gaps are not seen."""
    from allanite.readers._table import time_unit_of
    from allanite.timebase import read_stamps

    if request.rate is not None:
        if not (math.isfinite(request.rate) and request.rate > 0):
            raise InputError(f"{NAME}: the rate must be a positive number of Hz")
        return request.rate
    if choice.time is None:
        raise InputError(f"{NAME}: no sampling rate: give --rate HZ or a time column")
    at = choice.time
    return read_stamps(first[:, at], time_unit_of(names[at], units[at])).rate


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
    ) -> None:
        from allanite.accumulator import Accumulator
        from allanite.readers._choice import unit_of
        from allanite.units import conversion, parse_unit, rate_unit

        quantity = request.quantity or ("angle" if own == "s" else "rate")
        said = unit_of(name, own, request.unit, quantity, NAME)
        self.name, self.at, self.rate, self.quantity = name, at, rate, quantity
        self.unit = rate_unit(said, quantity).name
        self.factor = 1.0
        if output_unit is not None:
            target = parse_unit(output_unit).name
            self.factor, self.unit = conversion(self.unit, target), target
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
        x = chunk[:, self.at]
        if self.quantity == "angle":
            joined = np.concatenate((self.last, x))
            self.last = joined[-1:]
            x = np.diff(joined) * self.rate
        self.sums.update(x if self.factor == 1.0 else x * self.factor)

    def result(self) -> tuple[Stream, Deviation]:
        """Description and deviation."""
        sums = self.sums
        stream = Stream(NAME, (self.name,), sums.n, self.rate, self.unit, sums.gaps)
        return stream, sums.oadev()
