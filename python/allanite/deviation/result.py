"""Result of every estimator: a deviation over averaging times."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import finite_or_none, rows_of
from allanite.common.errors import InputError
from allanite.common.numbers import number
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines
from allanite.common.units import conversion
from allanite.deviation.confidence import interval

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from allanite.plots import Figure


#: Default confidence of an interval.
DEFAULT_CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Deviation:
    """A deviation over averaging times.

    Attributes
    ----------
    kind : str
        Name of the estimator, e.g. ``oadev``.
    tau : ndarray of shape (k,)
        Averaging times, s.
    factors : ndarray of shape (k,)
        Averaging factors m; τ = m / rate.
    n : ndarray of shape (k,)
        Number of squared differences that were averaged.
    deviation : ndarray of shape (k,)
        The estimates, in `deviation_unit`.
    alpha : ndarray of shape (k,)
        Exponent of the noise S_y ∝ f^α identified at each τ; it sets `edf`.
    rate : float
        Sampling rate, Hz.
    unit : str
        Unit of the samples as a rate; the unit of the estimates is `deviation_unit`.
    diagnostics : tuple of str
        Remarks on the reliability.
    lost : ndarray of shape (k,)
        Number of differences omitted because they contain missing samples.
    level : float
        Confidence of the interval.

    Examples
    --------
    >>> curve = al.AngleRandomWalk(N=0.1).simulate(duration=100, rate=10, seed=1).oadev()
    >>> curve.tau[:3]
    array([0.1, 0.2, 0.4])
    >>> bool(curve.low[0] < 0.1 / 0.1**0.5 < curve.high[0])
    True
    >>> curve.to_dict()["points"][0]["m"]
    1
    >>> curve.to("ppb").unit
    'ppb'
    >>> bool(curve.at_confidence(0.683).high[0] < curve.high[0])
    True
    >>> curve.to(curve.unit) is curve
    True
    >>> figure = curve.plot("curve.svg")
    """

    kind: str
    tau: NDArray[np.float64]
    factors: NDArray[np.int64]
    n: NDArray[np.int64]
    deviation: NDArray[np.float64]
    alpha: NDArray[np.float64]
    rate: float
    unit: str = "1"
    diagnostics: tuple[str, ...] = ()
    _freedom: Callable[[], NDArray[np.float64]] | None = None
    _bands: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    lost: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    _of_phase: bool = False
    level: float = DEFAULT_CONFIDENCE

    def __post_init__(self) -> None:
        if self.lost.size != self.n.size:
            object.__setattr__(self, "lost", np.zeros_like(self.n))
        for array in (self.tau, self.factors, self.n, self.deviation, self.alpha, self.lost):
            array.setflags(write=False)

    @property
    def deviation_unit(self) -> str:
        """Unit of `deviation`, `low` and `high`: `unit`, or `unit` times s for time deviations and interval errors."""
        return _unit_times_second(self.unit) if self._of_phase else self.unit

    @property
    def has_interval(self) -> bool:
        """True if an interval is known at any τ; `tierms` and `mtie` have none."""
        return bool(np.isfinite(self.low).any())

    @property
    def edf(self) -> NDArray[np.float64]:
        """Equivalent degrees of freedom, shape (k,); NaN without an estimate or a formula (`tierms`, `mtie`)."""
        return self._interval_array("edf")

    @property
    def low(self) -> NDArray[np.float64]:
        """Lower ends of the interval, in `deviation_unit`, shape (k,); NaN if unknown."""
        return self._interval_array("low")

    @property
    def high(self) -> NDArray[np.float64]:
        """Upper ends of the interval, in `deviation_unit`, shape (k,); NaN if unknown."""
        return self._interval_array("high")

    @property
    def percent(self) -> str:
        """Text of the confidence: ``95 %``."""
        return f"{number(100.0 * self.level)} %"

    def at_confidence(self, level: float) -> Deviation:
        """`Deviation` with the same estimates, and with intervals of another confidence.

        Parameters
        ----------
        level : float
            Between 0 and 1: 0.683 for one standard deviation of a normal law.

        Raises
        ------
        InputError
            A level that does not lie between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise InputError(f"a confidence lies between 0 and 1, found {level:g}: give 0.95")
        return replace(self, level=float(level), _bands={})

    def to(self, unit: str) -> Deviation:
        """`Deviation` of samples in another unit of the same kind of sensor; the same object if `unit` is unchanged.

        Parameters
        ----------
        unit : str
            Unit of samples, e.g. ``"deg/h"``.

        Raises
        ------
        InputError
            The unit is that of another kind of sensor.

        Examples
        --------
        >>> curve = al.AngleRandomWalk(N=1.0).simulate(n=1000, rate=10, seed=1, unit="deg/s").oadev()
        >>> bool(np.isclose(curve.to("deg/h").deviation[0], 3600.0 * curve.deviation[0]))
        True
        """
        if unit == self.unit:
            return self
        factor = conversion(self.unit, unit)
        bands = {k: v if k == "edf" else factor * v for k, v in self._bands.items()}
        return replace(self, unit=unit, deviation=factor * self.deviation, _bands=bands)

    def _interval_array(self, name: str) -> NDArray[np.float64]:
        """Array ``low``, ``high`` or ``edf``, shape (k,); NaN without a formula for the degrees of freedom."""
        # Computed on first use, since it takes longer than the deviation of a short record.
        if not self._bands:
            edf = np.full(self.tau.shape, np.nan) if self._freedom is None else self._freedom()
            low, high = interval(self.deviation, edf, self.level)
            for key, values in (("low", low), ("high", high), ("edf", edf)):
                values.flags.writeable = False
                self._bands[key] = values
        return self._bands[name]

    def __len__(self) -> int:
        return self.tau.size

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the deviation over averaging time, with its interval if one is known.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        return al.plots.plot_deviation(self, path, theme)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: kind, unit of the deviations, points (a dict per averaging time), diagnostics.

        None for unknown values; ``confidence`` only if it is not 0.95.
        """
        known = {k: finite_or_none(getattr(self, k)) for k in ("deviation", "low", "high", "edf")}
        return {
            "kind": self.kind,
            "unit": self.deviation_unit,
            "points": rows_of(tau_s=self.tau, m=self.factors, n=self.n, **known),
            **({} if self.level == DEFAULT_CONFIDENCE else {"confidence": self.level}),
            "diagnostics": list(self.diagnostics),
        }

    def __str__(self) -> str:
        table = [("tau (s)", self.kind, "low", "high", "edf", "n"), *self._rows()]
        known = f"{self.percent} interval" if self.has_interval else "no interval is known"
        title = f"{self._title_with_unit}, {known}"
        return "\n".join([title, *aligned_lines(table, right=True), *self.diagnostics])

    @property
    def _title_with_unit(self) -> str:
        """Name of the estimator with the unit of the deviation, if any, in parentheses: ``oadev (deg/s)``."""
        unit = self.deviation_unit
        return self.kind if unit == "1" else f"{self.kind} ({printed(unit)})"

    def __repr__(self) -> str:
        if not len(self):
            return f"Deviation({self.kind}: empty)"
        return (
            f"Deviation({self.kind}: {len(self)} averaging times from {self.tau[0]:g} s to "
            f"{self.tau[-1]:g} s in {self.deviation_unit})"
        )

    def _repr_html_(self) -> str:
        """HTML table for notebooks, one row per averaging time."""
        own = self._title_with_unit
        head = "".join(f"<th>{name}</th>" for name in ("τ (s)", own, "low", "high", "edf", "n"))
        rows = "".join(
            "<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in self._rows()
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"

    def _rows(self) -> list[tuple[str, ...]]:
        """List of the rows of the table, one per averaging time: texts of τ, deviation, low, high, edf and n."""
        columns = (self.tau, self.deviation, self.low, self.high, self.edf, self.n)
        return [
            (number(tau, 6), *map(cell_text, values), str(n))
            for tau, *values, n in zip(*columns, strict=True)
        ]


def cell_text(value: float) -> str:
    """Text of a value in a table with three digits; a dash if the value is not finite."""
    return number(value) if np.isfinite(value) else "–"


def _unit_times_second(unit: str) -> str:
    """Text of the unit U·s: deg/s → deg, m/s^2 → m/s, 1 → s, any other unit with ``·s``, as deg/h → deg/h·s."""
    if unit in ("", "1"):
        return "s"
    if unit.endswith("/s^2"):
        return unit.removesuffix("^2")
    return unit.removesuffix("/s") if unit.endswith("/s") else f"{unit}·s"
