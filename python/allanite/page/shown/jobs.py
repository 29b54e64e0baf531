"""Figures of jobs on whole recordings: the temperature law of an axis, and the average of several units."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from allanite.calibration.thermal import thermal
from allanite.combination.combine import combine
from allanite.common.errors import InputError
from allanite.common.units import parse_unit
from allanite.effects.sheet_units import figure_unit
from allanite.plots.words import unit_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.calibration import ThermalCalibration
    from allanite.page.tab import Tab
    from allanite.plots.spec import Figure
    from allanite.recording import Recording

#: Files with the temperature law of all axes, and their formats.
LAWS = {
    "temperature-law.params": "px4",
    "temperature-law.parm": "ardupilot",
    "temperature-law.h": "c",
    "temperature-law.csv": "csv",
    "temperature-law.json": "json",
}


_combination_of_units = lru_cache(maxsize=4)(combine)


@lru_cache(maxsize=4)
def thermal_calibration(recording: Recording, unit: str | None = None) -> ThermalCalibration:
    """`ThermalCalibration` (temperature laws of all axes) of a recording, converted to a unit if it is given; cached."""
    return thermal(recording if unit in (None, recording.unit) else recording.to(unit))


def thermal_figure(tab: Tab, _: Mapping[str, str]) -> Figure:
    """`Figure` of the temperature law of the current axis, and of its Allan deviation before and after the correction.

    Raises `InputError` if the log has no temperature.
    """
    found = thermal_calibration(tab.log, figure_unit(tab.log.unit, samples=True))
    (axis,) = found.axes
    figure = found.plot()
    return replace(
        figure, subtitle=f"{axis.headline.removeprefix(f'{axis.name}: ')}\n{figure.subtitle}"
    )


def average_figure(tab: Tab, _: Mapping[str, str]) -> Figure:
    """`Figure` of the Allan deviation of the average of the current axis and the compared logs, and of the weights.

    Compared columns with the name of the axis are averaged; without any, all columns of the same kind of sensor. Raises
    `InputError` without such a column.
    """
    if not tab.others:
        raise InputError("Averaging needs another log: add one with Compare")
    own = tab.log
    alike = [log for _, log in tab.others if parse_unit(log.unit).kind == parse_unit(own.unit).kind]
    # The same axis of other logs, or, if no axis has this name, all columns of the same kind of sensor.
    units = [log for log in alike if log.columns == own.columns] or alike
    if not units:
        raise InputError(f"Averaging needs another log with samples in {unit_text(own.unit)}")
    found = _combination_of_units(
        (own, *(log.in_units({log.columns[0]: own.unit}) for log in units))
    )
    figure = found.plot()
    return replace(figure, subtitle=f"{found.headline}\n{figure.subtitle}")
