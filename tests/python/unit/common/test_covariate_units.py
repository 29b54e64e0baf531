"""The unit of a column that explains: °C where the recording knows it, else the column's name."""

import numpy as np
import pytest

import allanite as al
from allanite.common.printing import column_unit
from allanite.plots import plot_fit
from allanite.plots.spec import label_of
from generators import white

MODEL = "N+COV(column={})"


@pytest.mark.parametrize(
    ("name", "stated", "unit"),
    [
        ("temperature", "degC", "°C"),
        ("temperature", "°C", "°C"),
        ("temperature", "C", "°C"),
        ("temperature", "K", "K"),
        ("temperature", None, "temperature"),
        ("temperature", "1", "temperature"),
        ("temp", "", "temp"),
        ("die_degC", None, "°C"),
        ("imu temp_c", None, "°C"),
        ("temperature_K", "1", "K"),
        ("board_fahrenheit_degF", None, "°F"),
        ("c", None, "c"),
        ("supply", "V", "V"),
        ("supply voltage", None, "(supply voltage)"),
        ("acc_y", "m/s^2", "(m/s^2)"),
    ],
)
def test_unit_of_a_column(name, stated, unit):
    assert column_unit(name, stated) == unit


@pytest.fixture(scope="module")
def samples():
    rng = np.random.default_rng(5)
    temperature = 25.0 + np.cumsum(rng.standard_normal(4000)) * 0.02
    return white(rng, 4000, 10.0, 0.01) + 0.05 * temperature, temperature


def written(folder, samples, header, unit="m/s^2"):
    path = folder / "log.csv"
    rows = "".join(f"{x:.9f},{t:.6f}\n" for x, t in zip(*samples, strict=True))
    path.write_text(f"acc_x [{unit}],{header}\n{rows}")
    return al.read(path, rate=10.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("header", "column", "unit"),
    [
        ("temperature [degC]", "temperature", "°C"),
        ("temperature", "temperature", "temperature"),
        ("temp_degC", "temp_degC", "°C"),
    ],
)
def test_every_face_of_a_fit_says_it(tmp_path, samples, header, column, unit):
    recording = written(tmp_path, samples, header)
    fit = al.fit_model(recording, MODEL.format(column))
    assert fit["coefficient"].unit == f"m/s^2/{unit}"
    # As a table prints the units of data sheets; documents keep those of the samples. A name is no unit.
    shown = f"mg per unit of {column}" if unit == column else f"mg/{unit}"
    assert shown in str(fit)
    told = fit.to_dict()["effects"][1]["parameters"]["coefficient"]
    assert told["unit"] == f"m/s^2/{unit}"
    assert any(f"mg/{unit}" in label_of(m) for m in plot_fit(fit).legend())


def test_the_quadratic_coefficient_is_per_square(tmp_path, samples):
    recording = written(tmp_path, samples, "temperature [degC]")
    fit = al.fit_model(recording, "N+COV(column=temperature,quadratic=0)")
    assert fit["quadratic"].unit == "m/s^2/°C²"


@pytest.mark.long
def test_report_and_suggestion_say_it(tmp_path, samples):
    pytest.importorskip("matplotlib")
    recording = written(tmp_path, samples, "temperature [degC]")
    text = al.make_report(recording, "N").to_markdown()
    assert "temperature (°C)" in text
    assert "m/s²/°C" in text
    assert "/unit" not in text


def test_one_unit_for_all_columns_is_not_that_of_the_temperature(tmp_path, samples):
    path = tmp_path / "log.npz"
    np.savez(
        path,
        data=np.column_stack(samples),
        rate_hz=10.0,
        channels=["acc_x", "temperature"],
        unit="m/s^2",
    )
    fit = al.fit_model(al.read(path), MODEL.format("temperature"))
    assert fit["coefficient"].unit == "m/s^2/temperature"


def test_noise_that_follows_a_column_is_per_its_unit(tmp_path, samples):
    recording = written(tmp_path, samples, "temperature [degC]")
    fit = al.fit_model(recording, "N+NCOL(column=temperature,coefficient=0.02,reference=20)")
    assert (fit["coefficient"].unit, fit["reference"].unit) == ("1/°C", "°C")
