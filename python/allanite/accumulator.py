"""Allan deviation of a stream: constant memory, any chunks, mergeable."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.averaging import QUANTITIES, one_column, positive_rate
from allanite.deviation import Deviation
from allanite.errors import InputError, TooShortError
from allanite.identification import degrees_of_freedom

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Accumulator"]


class Accumulator:
    """Overlapping Allan deviation of samples that arrive in chunks.

    Terms are taken at every sample up to m = 31 and every 2^l samples, m/32 < 2^l ≤ m/16, above. That
    costs nothing in white, flicker and random-walk rate noise (edf ratio 0.996 to 1.03), but most of
    the terms' worth in quantization noise, which only full overlap (`oadev`) uses. The result is that
    of the whole record at the same strides, for any chunks and any order of merging; exactly so for
    integers.

    Parameters
    ----------
    rate : float
        Sampling rate, Hz.
    taus : "octave" or int
        Averaging times: doubling, or so many per octave (1 to 16).
    quantity : {"rate", "increment"}
        What the samples are.
    unit : str
        Unit of the deviation.
    start : int
        Number of the first sample in its stream, for stretches that are to be merged.

    Raises
    ------
    InputError
        A rate, grid or quantity that cannot be used.
    """

    __slots__ = ("_core", "_octaves", "quantity", "rate", "start", "unit")

    def __init__(
        self,
        rate: float = 1.0,
        taus: str | int = "octave",
        *,
        quantity: str = "rate",
        unit: str = "1",
        start: int = 0,
    ) -> None:
        self.rate = positive_rate(rate)
        if quantity not in QUANTITIES[:2]:
            raise InputError(f"unknown quantity {quantity!r} of a stream: rate or increment")
        if taus != "octave" and not isinstance(taus, (int, np.integer)):
            raise InputError(f"unknown taus {taus!r} of a stream: octave, or a number per octave")
        if start < 0:
            raise InputError(f"start is {start}: the number of the first sample, from 0")
        self._octaves = 1 if isinstance(taus, str) else int(taus)
        self.quantity = quantity
        self.unit = unit
        self.start = int(start)
        self._core = _kernels.Accumulator(max(self._octaves, 0), self.start)

    @property
    def n(self) -> int:
        """Number of samples taken so far."""
        return self._core.samples()

    @property
    def gaps(self) -> int:
        """Number of missing samples so far."""
        return self._core.gaps()

    def update(self, chunk: ArrayLike) -> None:
        """Take the next samples.

        Parameters
        ----------
        chunk : array_like of shape (n,)
            Of any length, also none; NaN marks a missing sample.

        Raises
        ------
        InputError
            Infinite samples, or not one column of real numbers; nothing of the chunk is taken then.
        """
        self._core.update(np.ascontiguousarray(one_column(chunk), np.float64))

    def merge(self, other: Accumulator) -> None:
        """Join the stretch that follows this one.

        Raises
        ------
        InputError
            Another grid, rate, quantity or unit, a stretch that does not begin where this one ends, or no
            other accumulator.
        """
        if not isinstance(other, Accumulator):
            raise InputError(f"cannot merge {other!r}: another Accumulator is needed")
        if other is self:
            raise InputError(
                "cannot merge an accumulator with itself: give the stretch that follows"
            )
        if self.unit != other.unit:
            raise InputError(
                f"cannot merge samples in {other.unit} into samples in {self.unit}: convert them first"
            )
        if (self.rate, self.quantity) != (other.rate, other.quantity):
            raise InputError(
                f"cannot merge {other.quantity} at {other.rate:g} Hz"
                f" into {self.quantity} at {self.rate:g} Hz"
            )
        self._core.merge(other._core)

    def oadev(self) -> Deviation:
        """Overlapping Allan deviation of what has been taken so far.

        Raises
        ------
        TooShortError
            Fewer than 3 samples.
        """
        reading = sorted(self._core.reading())
        if not reading:
            raise TooShortError(f"{self.n} samples so far: at least 3 are needed")
        m = np.array([row[0] for row in reading], np.int64)
        stride = np.array([row[1] for row in reading], np.int64)
        total = np.array([row[2] for row in reading])
        n = np.array([row[3] for row in reading], np.int64)
        variance = total / (2.0 * m.astype(np.float64) ** 2 * n)
        alpha = _slopes(m, variance)
        notes = ["stream: terms every 2^l samples, m/32 < 2^l ≤ m/16, for m ≥ 32"]
        if self.gaps:
            notes.append(f"{self.gaps} of {self.n} samples are missing")

        def freedom() -> NDArray[np.float64]:
            return np.array(
                [
                    degrees_of_freedom(a, int(f), int(c), stride=int(s))
                    for a, f, c, s in zip(alpha, m, n, stride, strict=True)
                ]
            )

        scale = 1.0 if self.quantity == "rate" else self.rate
        return Deviation(
            "oadev",
            m / self.rate,
            m,
            n,
            np.sqrt(variance) * scale,
            alpha,
            self.rate,
            self.unit,
            tuple(notes),
            freedom,
        )

    def __repr__(self) -> str:
        return f"Accumulator({self.n} samples at {self.rate:g} Hz from sample {self.start})"

    def __copy__(self) -> Accumulator:
        twin = Accumulator(
            self.rate, self._octaves, quantity=self.quantity, unit=self.unit, start=self.start
        )
        twin._core = self._core.copy()
        return twin

    def __deepcopy__(self, memo: dict[int, Any]) -> Accumulator:
        return self.__copy__()


def _slopes(m: NDArray[np.int64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power laws from the local slope µ of the variance, α = −1 − µ; flicker PM where µ = −2 says PM."""
    if m.size < 2 or not (variance > 0).all():
        return np.zeros(m.size)
    slope = np.gradient(np.log(variance), np.log(m))
    return np.clip(np.round(-1.0 - slope), -2.0, 1.0) + 0.0
