"""Units of figures: those of data sheets, or those that the user requested."""

import numpy as np
import pytest

import allanite as al
from allanite.plots import plot_fit, plot_recording
from allanite.plots.spec import Line, Points
from allanite.plots.units import figure_unit, in_sheet_unit, requested_units


@pytest.fixture(scope="module")
def fit():
    model = al.parse_model("N(N=0.005)+K(K=1e-5)")
    return al.fit_model(model.simulate(duration=600.0, rate=20.0, seed=1, unit="deg/s"), "N+K")


def test_curve_and_density_of_a_fit_are_in_units_of_data_sheets(fit):
    allan, _, density, _ = plot_fit(fit).panels
    assert allan.y.label == "Allan deviation (°/h)"
    assert density.y.label == "density [(°/h)²/Hz]"
    (points,) = allan.find(Points)
    assert points.y == pytest.approx(3600.0 * fit.curve.measured)
    assert allan.y.low < points.y.min()
    assert points.y.max() < allan.y.high
    # The line of white noise is N² at all frequencies.
    white = next(line for line in density.find(Line) if line.label.startswith("angle random walk"))
    assert white.y == pytest.approx((3600.0 * fit["N"].to("deg/s/sqrt(Hz)").value) ** 2, rel=1e-6)


def test_figures_have_the_unit_that_the_user_requested(fit):
    with requested_units({"angular rate": "mrad/s"}):
        figure = plot_fit(fit)
    assert figure.panels[0].y.label == "Allan deviation (mrad/s)"
    assert figure.panels[0].find(Points)[0].y == pytest.approx(
        1000.0 * np.deg2rad(fit.curve.measured)
    )


@pytest.mark.parametrize(
    ("unit", "deviation", "samples"),
    [("rad/s", "deg/h", "deg/s"), ("m/s^2", "ug", "mg"), ("1", "1", "1"), ("uT", "uT", "uT")],
)
def test_each_kind_of_sensor_has_its_units(unit, deviation, samples):
    assert figure_unit(unit) == deviation
    assert figure_unit(unit, samples=True) == samples


def test_samples_are_in_units_of_data_sheets(fit):
    (panel,) = plot_recording(fit.recording.to("rad/s")).panels
    assert panel.y.label == "samples (°/s)"


@pytest.mark.parametrize("column", ["°C", "Temp"])
def test_a_change_with_a_column_is_in_the_unit_of_samples(column):
    parameter = al.effects.Covariate.parameter("coefficient")
    value = al.Estimate(1.0, 0.1, (0.8, 1.2), f"mrad/s/{column}", True)
    shown = in_sheet_unit(value, parameter)
    assert shown.unit == f"deg/s/{column}"
    assert shown.value == pytest.approx(np.rad2deg(1e-3))
    assert shown.interval == pytest.approx((np.rad2deg(0.8e-3), np.rad2deg(1.2e-3)))
