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

    from allanite.common.arrays import Array
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
    tau: Array
    deviation: Array
    low: Array | None = None
    high: Array | None = None

    __repr__ = brief

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
    """Index of each reference curve → list of the indices of the curves that are compared with it.

    Curves of one kind of sensor form a group if their names end in the same word, the column. A curve whose column
    occurs only once joins the first group of its kind of sensor. The reference is the first curve of its group.
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
    tau = curves[first].tau
    logs = [_log_values(curve, tau) for curve in curves]

    def cells(i: int) -> list[tuple[str, ...]]:
        """Cells of curve number `i` in a comparison table: a header, then one tuple per averaging time of curve `first`.

        A tuple is (deviation, ratio to curve `first`), or only (deviation,) if `i` is `first`.
        """
        head = f"[{i + 1}] {printed(curves[i].unit)}"
        values = ["–" if np.isnan(v) else number(float(np.exp(v))) for v in logs[i][0]]
        if i == first:
            return [(text,) for text in (head, *values)]
        ratios = map(_ratio_text, logs[i].T, logs[first].T)
        return [(head, f"[{i + 1}]/[{first + 1}]"), *zip(values, ratios, strict=True)]

    left = [
        (t, *c)
        for t, c in zip(("tau (s)", *(number(t, 6) for t in tau)), cells(first), strict=True)
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
    """Copy of a curve, converted to the unit in which figures show this kind of sensor."""
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


def _log_values(curve: Drawn, tau: Array) -> Array:
    """Logarithms of the deviation and of both ends of its interval at k averaging times (s), shape (3, k).

    They are interpolated linearly over ln τ. Without an interval, its ends are the deviation. NaN where τ is more than
    0.1 % outside of the curve.
    """
    ends = (curve.deviation if v is None else v for v in (curve.low, curve.high))
    logs = [
        np.interp(np.log(tau), np.log(curve.tau), np.log(np.maximum(v, 1e-300)))
        for v in (curve.deviation, *ends)
    ]
    inside = (tau >= 0.999 * curve.tau[0]) & (tau <= 1.001 * curve.tau[-1])
    return np.where(inside, logs, np.nan)


def _ratio_text(one: Array, other: Array) -> str:
    """Text ``1.23 (1.1 … 1.4)``: ratio of two deviations with its 95 % interval, from their logarithms (`_log_values`).

    The two deviations are taken as independent, with errors that add in the logarithm.
    """
    middle = one[0] - other[0]
    if np.isnan(middle):
        return "–"
    below = np.hypot(one[0] - one[1], other[2] - other[0])
    above = np.hypot(one[2] - one[0], other[0] - other[1])
    ratio, low, high = (number(float(np.exp(v))) for v in (middle, middle - below, middle + above))
    return f"{ratio} ({low} … {high})" if 0.0 < below + above < np.inf else ratio


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
        log. Without a log, these are 1, 2, 4, … samples.

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
    tau: Array = measured[0].tau if logs else np.exp2(np.arange(18, dtype=np.float64)) / rate
    curves = []
    curve_of_log = iter(measured)
    for name, item, own in items:
        if isinstance(item, Drawn):
            curves.append(item)
        elif isinstance(item, Recording):
            curves.append(_measured_curve(name, next(curve_of_log)))
        else:
            variance = as_model(item).allan_variance(tau, rate=rate)
            curves.append(
                Drawn(name, "model", parse_unit(own or unit).name, tau, np.sqrt(variance))
            )
    return Curves(tuple(curves))


def curves_of_deviations(found: Mapping[str, Deviation]) -> Curves:
    """`Curves` with one curve per entry of `found` (name → deviation), with its interval if known."""
    return Curves(tuple(_measured_curve(name, deviation) for name, deviation in found.items()))


def _measured_curve(name: str, deviation: Deviation) -> Drawn:
    """`Drawn` of a measured deviation, with its interval if known."""
    d = deviation
    ends = (d.low, d.high) if d.has_interval else ()
    return Drawn(name, "recording", d.unit, d.tau, d.deviation, *ends)


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
