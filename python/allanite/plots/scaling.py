"""Conversion of figures to the units in which they are shown."""

from __future__ import annotations

from dataclasses import replace

from allanite.common.units import FREQUENCY, conversion
from allanite.effects.sheet_units import figure_unit
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.spec import Axis, Band, Figure, Line, Mark, Panel, Points, Quantity, Rule
from allanite.plots.words import allan_label, density_unit, label_in_unit, with_bracketed_unit


def deviation_axis(unit: str, axis: Axis, words: str = "Allan deviation") -> Axis:
    """Copy of a logarithmic axis for deviations in `unit`, with a label of the noun `words` and its quantity."""
    label = allan_label(unit) if words == "Allan deviation" else label_in_unit(words, unit)
    return replace(axis, label=label, quantity=Quantity(words, unit))


def density_axis(unit: str, axis: Axis) -> Axis:
    """Copy of a logarithmic axis for power spectral densities of samples in `unit`, with its label and quantity."""
    label = with_bracketed_unit("density", density_unit(unit))
    return replace(axis, label=label, quantity=Quantity("density", unit, power=2))


def sample_axis(unit: str, axis: Axis, words: str) -> Axis:
    """Copy of a linear axis for samples in `unit`, with a label of the noun `words`; unit ``1`` is fractional frequency."""
    label = f"{words} as {FREQUENCY}" if unit == "1" else label_in_unit(words, unit)
    return replace(axis, label=label, quantity=Quantity(words, unit, samples=True))


def in_figure_units(figure: Figure) -> Figure:
    """Copy of a figure whose deviations, densities and samples have the requested units, or else those of data sheets."""
    return replace(figure, panels=tuple(map(_in_figure_unit, figure.panels)))


def _in_figure_unit(panel: Panel) -> Panel:
    """Copy of a panel whose y values and marks are in the unit of figures (`figure_unit`)."""
    axis, quantity = panel.y, panel.y.quantity
    if quantity is None:
        return panel
    unit = figure_unit(quantity.unit, samples=quantity.samples)
    factor = conversion(quantity.unit, unit) ** quantity.power
    if unit == quantity.unit:
        return panel
    low, high = factor * axis.low, factor * axis.high
    scaled = log_axis("", [low, high], margin=1.0) if axis.log else linear_axis("", low, high)
    if quantity.power == 2:
        scaled = density_axis(unit, scaled)
    elif quantity.samples:
        scaled = sample_axis(unit, scaled, quantity.words)
    else:
        scaled = deviation_axis(unit, scaled, quantity.words)
    return replace(panel, y=scaled, marks=tuple(_scaled_mark(mark, factor) for mark in panel.marks))


def _scaled_mark(mark: Mark, factor: float) -> Mark:
    """Copy of a mark with its y values multiplied by a factor: line, points, band or horizontal rule; others unchanged."""
    match mark:
        case Line():
            return replace(mark, y=factor * mark.y)
        case Points():
            ends = [None if v is None else factor * v for v in (mark.low, mark.high)]
            return replace(mark, y=factor * mark.y, low=ends[0], high=ends[1])
        case Band():
            return replace(mark, low=factor * mark.low, high=factor * mark.high)
        case Rule(axis="y"):
            return replace(mark, value=factor * mark.value)
    return mark
