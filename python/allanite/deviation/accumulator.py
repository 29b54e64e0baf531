"""Allan deviation of a stream in constant memory: chunks of any size, mergeable."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.choices import QUANTITIES
from allanite.common.errors import InputError, TooShortError
from allanite.common.former import Former
from allanite.common.validation import positive_rate
from allanite.deviation.averaging import one_column
from allanite.deviation.confidence import degrees_of_freedom
from allanite.deviation.gaps import gap_notes
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Minimum number of averages for an identification of the noise, as in rust/deviation/identify.rs.
MIN_POINTS = 90
#: Exponent α for longer averaging times if the last identified noise is white FM, as in rust/deviation/identify.rs.
ALPHA_BEYOND_WHITE_FM = -0.5


class Accumulator:
    """Overlapping Allan deviation of samples that arrive in chunks.

    Second differences are taken at every sample up to m = 31, and every 2^l samples, m/32 < 2^l ≤ m/16, above. In white,
    flicker and random-walk rate noise, this costs no precision (edf ratio 0.996 to 1.03). In quantization noise, full
    overlap (`oadev`) is more precise. The result is that of the whole record at the same strides, for any chunks and any
    order of merging; for integers exactly.

    Parameters
    ----------
    rate : float
        Sampling rate, Hz.
    taus : "octave" or int
        Averaging times: ``octave`` doubles them; a number is their count per octave (1 to 16).
    quantity : {"rate", "increment"}
        Quantity of the samples: the rate, or its integral over one sample.
    unit : str
        Unit of the deviation.
    start : int
        Index of the first sample in its stream, for segments that will be merged.

    Raises
    ------
    InputError
        A rate, grid or quantity that cannot be used.

    References
    ----------
    Riley, W. & Howe, D. (2008). Handbook of frequency stability analysis. NIST SP 1065, eq. 11.

    Examples
    --------
    The two halves of a record, each in a process of its own:

    >>> x = np.random.default_rng(1).standard_normal(10_000)
    >>> first, second = al.Accumulator(rate=10), al.Accumulator(rate=10, start=6000)
    >>> first.update(x[:6000])
    >>> second.update(x[6000:])
    >>> first.merge(second)
    >>> bool(np.allclose(first.oadev().deviation[:5], al.oadev(x, rate=10).deviation[:5]))
    True
    >>> al.Accumulator.restored(first.state()).n  # from plain numbers, in another process
    10000
    """

    __slots__ = ("_base", "_core", "_octaves", "quantity", "rate", "start", "unit")

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
        # Subtracted from integer samples, since doubles do not hold every 64-bit integer.
        self._base = 0

    @property
    def n(self) -> int:
        """Number of samples added so far, with the missing ones."""
        return self._core.samples()

    @property
    def missing(self) -> int:
        """Number of missing samples so far."""
        return self._core.gaps()

    gaps = Former("missing")

    def update(self, chunk: ArrayLike) -> None:
        """Add the next samples. Infinite samples leave the accumulator unchanged.

        Parameters
        ----------
        chunk : array_like of shape (n,)
            Of any length, also none; NaN marks a missing sample.

        Raises
        ------
        InputError
            Infinite samples, or not one column of real numbers; the accumulator is unchanged then.
        """
        x = one_column(chunk)
        if x.dtype.kind in "iu" and x.dtype.itemsize == 8 and x.size:
            if self.n == 0:
                self._base = int(x[0])
            x = _minus_base(x, self._base)
        elif self._base:
            x = x - float(self._base)
        self._core.update(np.require(x, np.float64, ["C", "A"]))

    def merge(self, other: Accumulator) -> None:
        """Add the samples of `other`, an accumulator of the segment that directly follows this segment.

        Raises
        ------
        InputError
            Another grid, rate, quantity or unit, a segment that does not begin where this one ends, or no
            accumulator.
        """
        if not isinstance(other, Accumulator):
            raise InputError(f"cannot merge {other!r}: another Accumulator is needed")
        if other is self:
            raise InputError(
                "cannot merge an accumulator with itself: give the segment that follows"
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
        if self.n == 0:
            self._base = other._base
        self._core.merge(other._core, float(other._base - self._base))

    def oadev(self) -> Deviation:
        """`Deviation`: overlapping Allan deviation of the samples so far; missing samples are noted in the diagnostics.

        Raises
        ------
        TooShortError
            Fewer than 3 samples.
        """
        reading = sorted(self._core.reading())
        if self.n < 3:
            raise TooShortError(f"{self.n} samples so far: at least 3 are needed")
        m, stride, n, lost = (np.array([row[i] for row in reading], np.int64) for i in (0, 1, 3, 4))
        total = np.array([row[2] for row in reading])
        with np.errstate(invalid="ignore"):
            variance = total / (2.0 * m.astype(np.float64) ** 2 * n)
        alpha = _noise_exponents(m, variance, self.n)
        notes = ["stream: terms every 2^l samples, m/32 < 2^l ≤ m/16, for m ≥ 32"]
        notes += gap_notes(self.missing, self.n, m / self.rate, n, lost)

        def freedom() -> NDArray[np.float64]:
            """Equivalent degrees of freedom at each averaging time, shape (k,)."""
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
            lost=lost,
        )

    def state(self) -> dict[str, Any]:
        """Dict of plain values from which `Accumulator.restored` makes the same accumulator."""
        return {
            "rate": self.rate,
            "octaves": self._octaves,
            "quantity": self.quantity,
            "unit": self.unit,
            "base": self._base,
            "core": self._core.__getstate__(),
        }

    @classmethod
    def restored(cls, state: dict[str, Any]) -> Accumulator:
        """`Accumulator` from the dict that `state()` of another accumulator returned."""
        out = cls(state["rate"], state["octaves"], quantity=state["quantity"], unit=state["unit"])
        start, samples, gaps, origin, levels = state["core"]
        out.start, out._base = start, state["base"]
        out._core.__setstate__((start, samples, gaps, origin, [tuple(one) for one in levels]))
        return out

    def __repr__(self) -> str:
        return f"Accumulator({self.n} samples at {self.rate:g} Hz from sample {self.start})"

    def __copy__(self) -> Accumulator:
        twin = Accumulator(
            self.rate, self._octaves, quantity=self.quantity, unit=self.unit, start=self.start
        )
        twin._core, twin._base = self._core.copy(), self._base
        return twin

    def __deepcopy__(self, memo: dict[int, Any]) -> Accumulator:
        return self.__copy__()


def _minus_base(x: NDArray[Any], base: int) -> NDArray[Any]:
    """64-bit integers `x` minus `base`, shape of `x`: int64 if all differences fit into it, else rounded doubles."""
    if int(x.min()) - base >= -(2**63) and int(x.max()) - base < 2**63:
        # Modulo 2^64, of which the signed difference is the right one.
        return (x.view(np.uint64) - np.uint64(base % 2**64)).view(np.int64)
    return x.astype(np.float64) - float(base)


def _noise_exponents(
    m: NDArray[np.int64], variance: NDArray[np.float64], samples: int
) -> NDArray[np.float64]:
    """Noise exponent α = −1 − µ at each averaging factor, shape (k,), rounded to −2 … 1.

    Here µ is the log-log slope of the variance from half to twice the factor. At factors with fewer than 90 averages,
    the slope is too uncertain: the last reliable exponent is used, or −0.5 (between white and flicker FM) if that is 0.
    """
    alpha = np.zeros(m.size)
    sure = (variance > 0) & (m * MIN_POINTS <= samples)
    if np.count_nonzero(sure) < 2:
        return alpha
    x, y = np.log(m[sure]), np.log(variance[sure])
    left, right = (np.clip(x + by, x[0], x[-1]) for by in (-np.log(2.0), np.log(2.0)))
    slope = (np.interp(right, x, y) - np.interp(left, x, y)) / (right - left)
    alpha[sure] = np.clip(np.round(-1.0 - slope), -2.0, 1.0) + 0.0
    last = alpha[sure][-1]
    alpha[m > m[sure][-1]] = ALPHA_BEYOND_WHITE_FM if last == 0.0 else last
    return alpha
