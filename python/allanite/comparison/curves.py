"""Comparison of logs and models: their Allan deviations at common averaging times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.documents import rows_of
from allanite.common.errors import InputError
from allanite.common.numbers import number
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines, brief
from allanite.common.units import conversion, parse_unit
from allanite.common.validation import positive_rate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from allanite.deviation import Deviation
    from allanite.effects import Model
    from allanite.plots.spec import Figure
    from allanite.recording import Recording
    from allanite.study import Study


#: Maximum width of a printed table, characters.
MAX_TABLE_WIDTH = 100


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Allan deviation of one log or model.

    Attributes
    ----------
    name : str
        Name of the log or model.
    kind : str
        ``"recording"`` or ``"model"``.
    unit : str
        Unit of the deviation.
    tau, deviation : ndarray of shape (points,)
        Averaging times in s, and the deviation.
    low, high : ndarray of shape (points,) or None
        95 % interval; None for a model.
    """

    name: str
    kind: str
    unit: str
    tau: NDArray[np.float64]
    deviation: NDArray[np.float64]
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None

    __repr__ = brief

    def at(self, tau: float) -> float | None:
        """Deviation at the point nearest to the averaging time τ, s; None if that point is 1 % or more away."""
        i = int(np.argmin(np.abs(self.tau - tau)))
        return float(self.deviation[i]) if abs(self.tau[i] / tau - 1) < 0.01 else None

    def near(self, tau: float) -> Drawn | None:
        """Copy of the curve with one point, at the averaging time τ (s), interpolated linearly in logarithms.

        None if τ is more than 0.1 % outside of the curve. Logs with different rates have different averaging times.
        """
        if not self.tau[0] * 0.999 <= tau <= self.tau[-1] * 1.001:
            return None

        def value(values: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
            """Array of shape (1,): `values` at τ, interpolated linearly in ln(value) over ln(τ); None if `values` is None.

            For a τ before the first or after the last point, the value of that point.
            """
            if values is None:
                return None
            logs = np.interp(np.log(tau), np.log(self.tau), np.log(np.maximum(values, 1e-300)))
            return np.array([np.exp(logs)])

        return replace(
            self,
            tau=np.array([tau]),
            deviation=np.asarray(value(self.deviation)),
            low=value(self.low),
            high=value(self.high),
        )

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: name, kind, unit, and points, a list of dicts (tau_s, deviation, and low and high if known)."""
        columns = {"tau_s": self.tau, "deviation": self.deviation}
        if self.low is not None and self.high is not None:
            columns |= {"low": self.low, "high": self.high}
        points = rows_of(**columns)
        return {"name": self.name, "kind": self.kind, "unit": self.unit, "points": points}


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Allan deviations of several logs and models. As text: tables with ratios to the first curve of the same column.

    Without a common column, the ratios are to the first curve of the same kind of sensor. Tables show each curve in the
    unit of figures: °/h for gyroscopes, µg for accelerometers.

    Examples
    --------
    >>> model = al.parse_model("N(N=0.1)")
    >>> log = model.simulate(duration=100, rate=10, seed=1)
    >>> found = al.compare([("log", log, None), ("model", model, None)])
    >>> [item["kind"] for item in found.to_dict()["items"]]
    ['recording', 'model']
    >>> figure = found.plot("curves.svg")
    """

    curves: tuple[Drawn, ...]

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/compare/1``."""
        return {
            "schema": "allanite/compare/1",
            "version": _kernels.version(),
            "items": [curve.to_dict() for curve in self.curves],
        }

    def __str__(self) -> str:
        curves = [_in_figure_unit(curve) for curve in self.curves]
        names = [f"[{i}] {c.kind} {c.name}" for i, c in enumerate(curves, start=1)]
        tables = [
            table
            for first, others in _comparison_groups(curves).items()
            for table in _comparison_tables(curves, first, others)
        ]
        return "\n".join([*names, *("\n" + table for table in tables)])

    def plot(self, path: str | Path | None = None) -> Figure:
        """Figure of all curves with logarithmic axes; written to `path` (SVG, PNG, PDF) if given."""
        from allanite.plots import plot_compare

        return plot_compare(self, path)


def _comparison_groups(curves: Sequence[Drawn]) -> dict[int, list[int]]:
    """Dict from the index of the first curve of each group to the indices of the others, which are compared with it.

    If several curves have one column (the last word of their names), those of each column are a group. Otherwise, and
    for columns that only one curve has, those of one kind of sensor are a group.
    """
    columns = [curve.name.rpartition(" ")[2] for curve in curves]
    kinds = [parse_unit(curve.unit).kind for curve in curves]
    groups: dict[int, list[int]] = {}
    for i, (column, kind) in enumerate(zip(columns, kinds, strict=True)):
        same = [g for g in groups if kinds[g] == kind]
        alone = columns.count(column) == 1
        first = next((g for g in same if alone or columns[g] == column), None)
        if first is None:
            groups[i] = []
        else:
            groups[first].append(i)
    return groups


def _comparison_tables(curves: Sequence[Drawn], first: int, others: Sequence[int]) -> list[str]:
    """List of text tables of curve `first` and `others` with their ratios to it, each at most 100 characters wide."""
    base = curves[first]
    points = [base.near(tau) for tau in base.tau]

    def cells(i: int) -> list[tuple[str, ...]]:
        """List of tuples of texts, one per row of the table: deviation of curve `i`, and its ratio unless `i` is `first`.

        The first tuple is the head; the others follow the averaging times of curve `first`.
        """
        head = f"[{i + 1}] {printed(curves[i].unit)}"
        near = [curves[i].near(tau) for tau in base.tau]
        values = ["–" if p is None else number(float(p.deviation[0])) for p in near]
        if i == first:
            return [(text,) for text in (head, *values)]
        ratios = [_ratio_text(p, q) for p, q in zip(near, points, strict=True)]
        return [(head, f"[{i + 1}]/[{first + 1}]"), *zip(values, ratios, strict=True)]

    left = [
        (t, *c)
        for t, c in zip(("tau (s)", *(number(t, 6) for t in base.tau)), cells(first), strict=True)
    ]
    tables, rows = [], left
    for i in others:
        wider = [(*row, *own) for row, own in zip(rows, cells(i), strict=True)]
        if rows is not left and len(aligned_lines(wider, right=True)[0]) > MAX_TABLE_WIDTH:
            tables.append(rows)
            wider = [(*row, *own) for row, own in zip(left, cells(i), strict=True)]
        rows = wider
    return ["\n".join(aligned_lines(rows, right=True)) for rows in (*tables, rows)]


def _in_figure_unit(curve: Drawn) -> Drawn:
    """Copy of a curve (`Drawn`), converted to the unit in which figures show this kind of sensor.

    The same object if it has this unit already.
    """
    from allanite.effects.sheet_units import figure_unit

    unit = figure_unit(curve.unit)
    if unit == curve.unit:
        return curve
    factor = conversion(curve.unit, unit)
    return replace(
        curve,
        unit=unit,
        deviation=curve.deviation * factor,
        low=None if curve.low is None else curve.low * factor,
        high=None if curve.high is None else curve.high * factor,
    )


def _ratio_text(one: Drawn | None, other: Drawn | None) -> str:
    """Text ``1.23 (1.1 … 1.4)``: ratio of the first deviations of two curves, with its 95 % interval.

    Without the interval if neither curve has one, or if it is infinite. A dash if a curve is None or the deviation of
    `other` is 0. The two deviations are taken as independent, with errors that add in the logarithm.
    """
    if one is None or other is None or not other.deviation[0] > 0.0:
        return "–"
    ratio = float(one.deviation[0] / other.deviation[0])
    sides = []
    for name, opposite in (("low", "high"), ("high", "low")):
        far = _log_half_interval(one, name) ** 2 + _log_half_interval(other, opposite) ** 2
        sides.append(np.sqrt(far))
    if not any(sides) or not np.isfinite(sides).all():
        return number(ratio)
    low, high = ratio * np.exp(-sides[0]), ratio * np.exp(sides[1])
    return f"{number(ratio)} ({number(low)} … {number(high)})"


def _log_half_interval(point: Drawn, end: str) -> float:
    """Distance from the first deviation of a curve to one end of its interval, as the absolute difference of logarithms.

    `end` is ``"low"`` or ``"high"``. 0 if the curve has no interval.
    """
    values = getattr(point, end)
    return 0.0 if values is None else abs(float(np.log(values[0] / point.deviation[0])))


def compare(
    items: Sequence[tuple[str, Recording | Model | str | Drawn, str | None]],
    rate: float | None = None,
    unit: str | None = None,
) -> Curves:
    """`Curves`: one Allan deviation curve for each item, of a measured log or of a model.

    Parameters
    ----------
    items : sequence of (name, Recording of one column, Model, str or Drawn, unit or None)
        For a model, the unit is that of its samples. A `Drawn` is a finished curve, such as a table of deviations.
    rate : float, optional
        Sampling rate of the models, Hz; by default that of the first log.
    unit : str, optional
        Unit of models that have none; by default that of the first log.

    Returns
    -------
    Curves
        One curve for each item, in its own unit and in the given order. Models have the averaging times of the first
        log, or octaves of one sample without a log.

    Raises
    ------
    InputError
        There are models only and no rate, or `items` is not a list of such items.

    Examples
    --------
    >>> old, new = al.parse_model("N(N=2)"), al.parse_model("N(N=1)")
    >>> found = al.compare([("old", old, "deg/s"), ("new", new, "deg/s")], rate=10)
    >>> print((found.curves[0].deviation / found.curves[1].deviation)[:2])
    [2. 2.]
    """
    from collections.abc import Sequence

    from allanite.deviation import oadev
    from allanite.effects import as_model
    from allanite.recording import Recording

    if not isinstance(items, Sequence) or any(
        not isinstance(item, (tuple, list)) or len(item) != 3 for item in items
    ):
        raise InputError(
            "compare takes a list of (name, recording or model, unit or None):"
            " give [('log', recording, None), ('model', model, None)]"
        )
    logs = [item for _, item, _ in items if isinstance(item, Recording)]
    # Logs of different folders may have one name.
    measured = [oadev(log) for log in logs]
    rate = (logs[0].rate if logs else None) if rate is None else positive_rate(rate)
    if rate is None:
        raise InputError(
            "without a log, the models need a sampling rate",
            missing="rate",
            remedy=": give {rate}",
        )
    unit = unit or (logs[0].unit if logs else "1")
    tau: NDArray[np.float64] = (
        measured[0].tau if logs else np.exp2(np.arange(18, dtype=np.float64)) / rate
    )
    curves = []
    curve_of_log = iter(measured)
    for name, item, own in items:
        if isinstance(item, Drawn):
            curves.append(item)
        elif isinstance(item, Recording):
            found = next(curve_of_log)
            curves.append(
                Drawn(
                    name, "recording", item.unit, found.tau, found.deviation, found.low, found.high
                )
            )
        else:
            variance = as_model(item).allan_variance(tau, rate=rate)
            deviation: NDArray[np.float64] = np.sqrt(variance).astype(np.float64)
            curves.append(Drawn(name, "model", parse_unit(own or unit).name, tau, deviation))
    return Curves(tuple(curves))


def curves_of_deviations(found: Mapping[str, Deviation]) -> Curves:
    """`Curves` with one curve per entry of `found` (name → deviation), with its interval if known."""
    return Curves(
        tuple(
            Drawn(
                name,
                "recording",
                d.unit,
                d.tau,
                d.deviation,
                *((d.low, d.high) if d.has_interval else ()),
            )
            for name, d in found.items()
        )
    )


def curves_of_studies(studies: Mapping[str, Study]) -> Curves:
    """`Curves` with two curves per column (name → study): the measured Allan deviation and that of the last model."""
    from allanite.plots.curves import interval

    curves = []
    for name, study in studies.items():
        curve, unit = study.fit.curve, study.recording.unit
        bounds = interval(curve.measured, curve.edf)
        curves += [
            Drawn(name, "recording", unit, curve.tau, curve.measured, *bounds),
            Drawn(name, "model", unit, curve.tau, curve.model),
        ]
    return Curves(tuple(curves))
