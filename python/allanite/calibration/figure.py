"""Figure of a thermal calibration: the law with the data, and the Allan deviation before and after correction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.curves import TAU
from allanite.plots.scaling import deviation_axis, in_figure_units, sample_axis
from allanite.plots.spec import Band, Figure, Line, Mark, Panel, Points

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.calibration.law import AxisLaw
    from allanite.calibration.thermal import ThermalCalibration


def plot_thermal(
    found: ThermalCalibration, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """`Figure` with two panels per axis: the law b(T) with its band and the data, and the Allan deviation.

    Parameters
    ----------
    found : ThermalCalibration
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}

    Raises
    ------
    InputError
        The extension is not one of these, the folder does not exist, or matplotlib is not installed.
    """
    panels = tuple(
        p
        for row, axis in enumerate(found.axes)
        for p in (_law_panel(axis, row), _deviation_panel(axis, row))
    )
    logs = len(found.paths)
    figure = Figure(
        "Thermal calibration",
        f"{logs} log{'s' * (logs > 1)}, each band contains the whole law with 95 % confidence",
        panels,
        heights=(1.0,) * len(found.axes),
        widths=(1.0, 1.0),
        kind="thermal",
    )
    return in_figure_units(figure).saved(path, theme)


def _law_panel(axis: AxisLaw, row: int) -> Panel:
    """`Panel` of a figure (left column, given row): law b(T), its band, and mean samples while warming and while cooling.

    A direction of the temperature without samples has no points.
    """
    document = axis.to_dict()
    measured, curve = document["measured"], axis.curve
    t, bias, direction = (
        np.array(measured[k]) for k in ("temperature_celsius", "bias", "direction")
    )
    marks: list[Mark] = [Band(curve.temperature, curve.low, curve.high, "model", "95 % band")]
    for sign, color, label in ((1.0, "fail", "warming"), (-1.0, "c1", "cooling")):
        own = direction == sign
        if own.any():
            marks.append(Points(t[own], bias[own], color, label, size=3.0))
    marks.append(Line(curve.temperature, curve.bias, "model", "law"))
    shown = np.concatenate([bias, curve.low, curve.high])
    margin = 0.05 * float(np.ptp(shown)) or 1.0
    y = linear_axis("", float(shown.min()) - margin, float(shown.max()) + margin)
    return Panel(
        linear_axis("temperature (°C)", *axis.range),
        sample_axis(axis.unit, y, "bias"),
        tuple(marks),
        row=row,
        column=0,
        title=f"{axis.name}: {axis.form.name}",
    )


def _deviation_panel(axis: AxisLaw, row: int) -> Panel:
    """`Panel` of a figure (right column, given row): Allan deviation of one axis before and after correction."""
    r = axis.remainder
    marks = (
        Line(r.tau, r.before, "before", "before correction", dash="dash"),
        Line(r.tau, r.after, "measured", "after correction"),
    )
    y = deviation_axis(axis.unit, log_axis("", r.before, r.after))
    return Panel(log_axis(TAU, r.tau), y, marks, row=row, column=1, title="")
