"""Dynamic Allan deviation: the curve in windows along the record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import finite_or_none
from allanite.common.errors import TooShortError
from allanite.common.printing import printed
from allanite.common.showing import html_list, html_table
from allanite.common.validation import positive
from allanite.deviation.averaging import Samples, Taus, averaging_factors, samples_of
from allanite.deviation.estimation import kernel_results
from allanite.deviation.estimators import OADEV
from allanite.deviation.gaps import gap_notes
from allanite.deviation.result import cell_text

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from allanite.plots import Figure


#: Most windows and averaging times of a printed table.
MAX_ROWS, MAX_COLUMNS = 24, 6


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DynamicDeviation:
    """Overlapping Allan deviation of windows along a record.

    Attributes
    ----------
    time : ndarray of shape (w,)
        Centers of the windows, s from the start.
    tau : ndarray of shape (k,)
        Averaging times, s.
    factors : ndarray of shape (k,)
        Averaging factors.
    n : ndarray of shape (w, k)
        Number of averaged squared differences.
    deviation : ndarray of shape (w, k)
        Deviations, in `unit`; NaN if gaps leave no difference.
    window : float
        Length of the windows, s.
    rate : float
        Sampling rate, Hz.
    unit : str
        Unit of the deviation.
    diagnostics : tuple of str
        Remarks on the reliability.

    Examples
    --------
    >>> x = al.AngleRandomWalk(N=0.1).simulate(duration=1000, rate=10, seed=1)
    >>> found = al.dynamic_oadev(x, window=100.0)
    >>> found.deviation.shape == (found.time.size, found.tau.size)
    True
    >>> found.tau[found.shown(3)]
    array([ 0.1,  1.6, 25.6])
    >>> sorted(found.to_dict())
    ['deviation', 'diagnostics', 'kind', 'tau_s', 'time_s', 'window_s']
    >>> figure = found.plot("dynamic.svg")
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
        """Dict for JSON: kind, window_s, time_s, tau_s, deviation (a row per window, None for NaN), diagnostics."""
        return {
            "kind": "dynamic_oadev",
            "window_s": self.window,
            "time_s": self.time.tolist(),
            "tau_s": self.tau.tolist(),
            "deviation": finite_or_none(self.deviation).tolist(),
            "diagnostics": list(self.diagnostics),
        }

    def shown(self, most: int) -> NDArray[np.int64]:
        """Indices of at most `most` averaging times, evenly spread in index, with the first and the last."""
        return np.unique(np.round(np.linspace(0, self.tau.size - 1, most)).astype(np.int64))

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the deviations over the time of the window's center.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        return al.plots.plot_dynamic(self, path, theme)

    def _table(self) -> tuple[str, list[str], list[list[str]], list[str]]:
        """Tuple (title, head, rows, remarks) of a printed table, as texts; at most 24 windows and 6 averaging times."""
        columns = self.shown(MAX_COLUMNS)
        rows = np.unique(np.round(np.linspace(0, self.time.size - 1, MAX_ROWS)).astype(np.int64))
        remarks = list(self.diagnostics)
        if rows.size < self.time.size or columns.size < self.tau.size:
            remarks.append(
                f"{rows.size} of {self.time.size} windows and {columns.size} of {self.tau.size} averaging"
                " times are shown"
            )
        title = (
            f"overlapping Allan deviation ({printed(self.unit)}) of windows of {self.window:g} s"
        )
        head = ["time (s)", *(f"τ = {self.tau[k]:.4g} s" for k in columns)]
        body = [
            [f"{self.time[i]:.6g}", *(cell_text(self.deviation[i, k]) for k in columns)]
            for i in rows
        ]
        return title, head, body, remarks

    def __str__(self) -> str:
        title, head, body, remarks = self._table()
        lines = [" ".join(text.rjust(14) for text in row) for row in (head, *body)]
        return "\n".join([title, *lines, *remarks])

    def _repr_html_(self) -> str:
        """HTML table for notebooks, with the remarks as a list."""
        title, head, body, remarks = self._table()
        return html_table(title, head, body, range(len(head))) + html_list(remarks)

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
    """Overlapping Allan deviation of windows along the record (Galleani & Tavella 2009).

    Parameters
    ----------
    x : array_like of shape (n,) or Recording
        Samples; a recording has its own rate, unit and quantity.
    rate : float
        Sampling rate, Hz.
    window : float
        Length of a window, s.
    step : float, optional
        Time from one window to the next, s; by default a quarter of the window.
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

    Examples
    --------
    A noise that doubles in the middle of the record shows at every τ:

    >>> rng = np.random.default_rng(1)
    >>> x = rng.standard_normal(10_000) * np.repeat([1.0, 2.0], 5000)
    >>> found = al.dynamic_oadev(x, rate=10, window=200.0)
    >>> print((found.deviation[-1, 0] / found.deviation[0, 0]).round(1))
    2.0
    """
    src = samples_of(x, rate, quantity)
    window = positive(window, "window", "s", "a positive number of seconds")
    step = (
        window / 4 if step is None else positive(step, "step", "s", "a positive number of seconds")
    )
    size = round(window * src.rate)
    total = src.samples.size
    if not 3 <= size <= total:
        raise TooShortError(
            f"a window of {window:g} s is {size} samples: it must hold 3 to {total}, the record"
        )
    every = min(max(1, round(step * src.rate)), total)
    m, notes = averaging_factors(src, taus, factors, (size - src.angle) // 2)
    starts = np.arange(0, total - size + 1, every)
    deviation = np.full((starts.size, m.size), np.nan)
    n = np.zeros((starts.size, m.size), np.int64)
    floating = src.samples.dtype.kind == "f"
    for row, start in enumerate(starts):
        part = src.samples[start : start + size]
        if floating and np.isnan(part).all():
            continue
        variance, n[row], _, _, step = kernel_results(OADEV, part, m, src.angle)
        deviation[row] = np.sqrt(variance) * step * src.scale
    notes = (*notes, *_gap_remarks(src, n, m, size))
    time = np.asarray((starts + size / 2) / src.rate, np.float64)
    return DynamicDeviation(
        time, m / src.rate, m, n, deviation, size / src.rate, src.rate, src.unit, notes
    )


def _gap_remarks(
    src: Samples, n: NDArray[np.int64], m: NDArray[np.int64], size: int
) -> tuple[str, ...]:
    """Remarks on missing samples (as `gap_notes`), and on windows of `size` samples in which gaps leave no difference.

    `n`, shape (windows, k), counts the averaged differences at the averaging factors `m`.
    """
    missing = int(np.isnan(src.samples).sum()) if src.samples.dtype.kind == "f" else 0
    used = n.sum(axis=0)
    lost = n.shape[0] * OADEV.max_terms(m, size + (not src.angle)) - used
    notes = gap_notes(missing, src.samples.size, np.asarray(m / src.rate), used, lost)
    empty = np.count_nonzero(~n.any(axis=1))
    return (*notes, f"{empty} of {n.shape[0]} windows have too few samples") if empty else notes
