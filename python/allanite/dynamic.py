"""Dynamic Allan deviation: how the curve changes along the record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.averaging import averaging, source
from allanite.errors import InputError, TooShortError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from allanite.deviation import Taus

__all__ = ["DynamicDeviation", "dynamic_oadev"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DynamicDeviation:
    """Overlapping Allan deviation of windows along a record.

    Attributes
    ----------
    time : ndarray of shape (w,)
        Centres of the windows, s from the start.
    tau : ndarray of shape (k,)
        Averaging times, s.
    factors : ndarray of shape (k,)
        Averaging factors.
    n : ndarray of shape (w, k)
        Number of terms.
    deviation : ndarray of shape (w, k)
        Deviations, in `unit`; NaN where gaps leave no term.
    window : float
        Length of the windows, s.
    rate : float
        Sampling rate, Hz.
    unit : str
        Unit of the deviation.
    diagnostics : tuple of str
        What to know before trusting it.
    """

    time: NDArray[np.float64]
    tau: NDArray[np.float64]
    factors: NDArray[np.int64]
    n: NDArray[np.int64]
    deviation: NDArray[np.float64]
    window: float
    rate: float
    unit: str = "1"
    diagnostics: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("time", "tau", "factors", "n", "deviation"):
            getattr(self, name).flags.writeable = False

    def to_dict(self) -> dict[str, Any]:
        """JSON form: times, averaging times, a row of deviations per window; null for NaN."""
        rows = [[float(v) if np.isfinite(v) else None for v in row] for row in self.deviation]
        return {
            "kind": "dynamic_oadev",
            "window_s": self.window,
            "time_s": self.time.tolist(),
            "tau_s": self.tau.tolist(),
            "deviation": rows,
            "diagnostics": list(self.diagnostics),
        }

    def __repr__(self) -> str:
        windows, times = self.deviation.shape
        return (
            f"DynamicDeviation({windows} windows of {self.window:g} s, {times} averaging times"
            f" from {self.tau[0]:g} s to {self.tau[-1]:g} s in {self.unit})"
        )


def dynamic_oadev(
    x: object,
    rate: float = 1.0,
    *,
    window: float,
    step: float | None = None,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> DynamicDeviation:
    """Overlapping Allan deviation of windows along the record: Galleani & Tavella 2009.

    Parameters
    ----------
    x : array_like of shape (n,) or Recording
        Samples; a recording brings its own rate, unit and quantity.
    rate : float
        Sampling rate, Hz.
    window : float
        Length of a window, s.
    step : float, optional
        From one window to the next, s; a quarter of the window if left out.
    taus, factors, quantity
        As of `allanite.oadev`; averaging times up to half of the window.

    Returns
    -------
    DynamicDeviation

    Raises
    ------
    InputError
        Samples, rate, window, step, taus or quantity that cannot be used.
    TooShortError
        A window longer than the record or shorter than 3 samples.
    """
    src = source(x, rate, quantity)
    if not (np.isfinite(window) and window > 0 and (step is None or step > 0)):
        raise InputError(f"window and step must be positive seconds, found {window!r}, {step!r}")
    size = round(window * src.rate)
    total = src.samples.size
    if not 3 <= size <= total:
        raise TooShortError(
            f"a window of {window:g} s is {size} samples: it must hold 3 to {total}, the record"
        )
    every = max(1, round((window / 4 if step is None else step) * src.rate))
    m, notes = averaging(src, taus, factors, (size - src.angle) // 2)
    starts = np.arange(0, total - size + 1, every)
    deviation = np.full((starts.size, m.size), np.nan)
    n = np.zeros((starts.size, m.size), np.int64)
    floating = src.samples.dtype.kind == "f"
    for row, start in enumerate(starts):
        part = src.samples[start : start + size]
        if floating and np.isnan(part).all():
            continue
        variance, n[row], _, _ = _kernels.overlapping_allan(part, m, src.angle)
        deviation[row] = np.sqrt(variance / m**2 if src.angle else variance) * src.scale
    time = np.asarray((starts + size / 2) / src.rate, np.float64)
    return DynamicDeviation(
        time, m / src.rate, m, n, deviation, size / src.rate, src.rate, src.unit, notes
    )
