"""Units of figures and tables: those of data sheets, or those that the user requested."""

import numpy as np
import pytest

import allanite as al
from allanite.effects.sheet_units import figure_unit, in_sheet_unit, requested_units
from allanite.plots import plot_fit, plot_recording
from allanite.plots.spec import Line, Points


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


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log of a gyroscope in °/s with a line and a resonance, and an accelerometer in m/s²."""
    path = tmp_path_factory.mktemp("units") / "imu.csv"
    model = al.parse_model("N(N=0.005)+SIN(f=2.5,A=0.004)+RES(f=7,damping=0.05,rms=0.01)")
    gyro = model.simulate(duration=300.0, rate=20.0, seed=1, unit="deg/s").samples
    accel = al.parse_model("N(N=1e-3)+SIN(f=2.5,A=2e-3)").simulate(
        duration=300.0, rate=20.0, seed=2, unit="m/s^2"
    )
    rows = zip(gyro.tolist(), accel.samples.tolist(), strict=True)
    lines = [f"{g!r},{a!r}" for g, a in rows]
    path.write_text("\n".join(["gyro_x [deg/s],accel_x [m/s^2]", *lines]), encoding="utf-8")
    return path


def rows_of(out):
    """Dict of the value with its unit by parameter, of a table of `fit`."""
    found = {}
    for line in out.splitlines():
        cells = [cell for cell in line.strip().split("  ") if cell]
        if line.startswith("  ") and len(cells) >= 3:
            name, value = cells[-3:-1]
            found[name.strip()] = value.strip()
    return found


@pytest.mark.parametrize("command", ["fit", "check"])
def test_tables_of_commands_are_in_units_of_data_sheets(log, command, capsys):
    from allanite.cli import main

    for column, model, units in (
        ("gyro_x", "N+SIN(f=2.5)+RES(f=7,damping=0.05)", ("°/√h", "°/h", "°/h")),
        ("accel_x", "N+SIN(f=2.5)", ("m/s/√h", "µg")),
    ):
        with pytest.raises(SystemExit):
            main([command, str(log), "--rate", "20", "--column", column, "--model", model])
        out = capsys.readouterr().out
        found = rows_of(out)
        for name, unit in zip(("N", "amplitude", "rms"), units, strict=False):
            assert found[name].endswith(f" {unit}"), (name, found)
        assert "e-0" not in out
    # 0.004 °/s are 14.4 °/h, and 2e-3 m/s² are 204 µg.
    assert float(found["amplitude"].split()[0]) == pytest.approx(204.0, rel=0.05)


def test_a_requested_unit_replaces_those_of_data_sheets(log, capsys):
    from allanite.cli import main

    options = ["--rate", "20", "--column", "gyro_x", "--output-unit", "rad/s"]
    with pytest.raises(SystemExit):
        main(["fit", str(log), "--model", "N+SIN(f=2.5)", *options])
    found = rows_of(capsys.readouterr().out)
    assert found["N"].endswith(" rad/s/√Hz")
    assert found["amplitude"].endswith(" rad/s")


def test_the_figure_and_the_table_of_adev_have_one_unit(log, tmp_path, capsys):
    from allanite.cli import main

    figure = tmp_path / "adev.svg"
    options = ["--rate", "20", "--column", "gyro_x", "--plot", str(figure)]
    with pytest.raises(SystemExit):
        main(["adev", str(log), *options])
    assert "oadev (°/h)" in capsys.readouterr().out
    assert "(°/h)" in figure.read_text(encoding="utf-8")
