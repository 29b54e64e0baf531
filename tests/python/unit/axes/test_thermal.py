"""Thermal calibration: one law from several logs, its parameter files as their consumers evaluate them, and bad input."""

import csv
import io
import json
import re
import shutil
import subprocess

import numpy as np
import pytest

import allanite as al
import thermal_sensors as ts
from allanite.effects import Covariate, lagged
from documents import valid

pytestmark = pytest.mark.slow


def recording(columns, temperature, unit="deg/s", rate=1.0):
    names = list(columns)
    return al.Recording(
        np.column_stack([columns[n] for n in names]),
        rate=rate,
        unit=unit,
        columns=names,
        covariates={"temperature": temperature},
    )


def three_axes(seed, turn_on=0.0, letters="xyz", stem="gyro_", unit="deg/s"):
    """A warm-up and cooling, with a cubic on x and a line on the others."""
    rng = np.random.default_rng(seed)
    t = np.arange(1000.0)
    temp = 30.0 + 20.0 * np.sin(t / 200.0) + rng.normal(0.0, 0.01, t.size)
    u = temp - 30.0
    laws = {"x": 0.002 * u + 4e-6 * u**3, "y": 0.003 * u, "z": -0.001 * u}
    x = {f"{stem}{a}": laws[a] + turn_on + rng.normal(0.0, 0.01, t.size) for a in letters}
    return recording(x, temp, unit)


@pytest.fixture(scope="module")
def found():
    """Both sensors of an IMU, in the units of its log."""
    rng = np.random.default_rng(3)
    t = np.arange(1500.0)
    temp = 30.0 + 20.0 * np.sin(t / 300.0)
    u = temp - 30.0
    columns = {
        "gyro_x": 0.02 * u + 4e-5 * u**3,
        "gyro_z": 1e-3 * u**2,
        "acc_z": 9.8 + 2e-5 * u**3,
    }
    samples = np.column_stack([v + rng.normal(0.0, 0.05, t.size) for v in columns.values()])
    units = ["deg/s", "deg/s", "m/s^2"]
    log = al.Recording(
        samples, rate=1, unit=units, columns=list(columns), covariates={"temperature": temp}
    )
    return al.thermal(log)


def at(axis):
    """Temperatures within and beyond the covered range."""
    low, high = axis.range
    return np.linspace(low - 15.0, high + 15.0, 41)


def parameters(text, separator):
    rows = (line.removeprefix("param set ").split(separator) for line in text.splitlines())
    return {row[0]: float(row[1]) for row in rows if row[0] and not row[0].startswith("#")}


# TemperatureCompensation::calc_thermal_offsets_3D of PX4, in its single precision.
def px4_offset(p, key, axis, temperature):
    f = np.float32
    low, high, reference = (f(p[f"{key}_{n}"]) for n in ("TMIN", "TMAX", "TREF"))
    d = np.clip(np.asarray(temperature, dtype=f), low, high) - reference
    x = [f(p[f"{key}_X{k}_{axis}"]) for k in range(4)]
    return x[0] + x[1] * d + x[2] * d * d + x[3] * d * d * d


# AP_InertialSensor::TCal::correct_sensor of ArduPilot, in its single precision.
def ardupilot_corrected(p, key, name, axis, temperature, calibrated, value):
    f = np.float32
    low, high = (f(p[f"{key}_{n}"]) for n in ("TMIN", "TMAX"))
    c = [f(p[f"{key}_{name}{k}_{axis}"]) for k in (1, 2, 3)]

    def polynomial(t):
        d = np.clip(np.asarray(t, dtype=f), low, high) - f(35.0)
        return (c[0] + (c[1] + c[2] * d) * d) * d * f(1e-6)

    return value - polynomial(temperature) + polynomial(calibrated)


def si(axis):
    return np.pi / 180.0 if axis.unit == "deg/s" else 1.0


def test_px4_takes_the_law_out(found):
    p = parameters(found.export("px4"), " ")
    assert p["TC_G_ENABLE"] == p["TC_A_ENABLE"] == 1
    for name, key, place in (
        ("gyro_x", "TC_G0", 0),
        ("gyro_z", "TC_G0", 2),
        ("acc_z", "TC_A0", 2),
    ):
        axis = found[name]
        t = at(axis)
        offset = px4_offset(p, key, place, t)
        law = si(axis) * axis.bias(t)
        if key == "TC_A0":
            # The bias at the reference temperature is gravity's and stays.
            law = law - si(axis) * axis.bias(p["TC_A0_TREF"])
        assert np.abs(offset - law).max() < 1e-5 * np.ptp(law)
    # There is no acc_y: nothing is taken out.
    assert not px4_offset(p, "TC_A0", 1, at(found["acc_z"])).any()


def test_ardupilot_takes_the_law_out(found):
    p = parameters(found.export("ardupilot"), ",")
    assert p["INS_TCAL1_ENABLE"] == 1
    for name, sensor, letter in (
        ("gyro_x", "GYR", "X"),
        ("gyro_z", "GYR", "Z"),
        ("acc_z", "ACC", "Z"),
    ):
        axis = found[name]
        t, calibrated = at(axis), 41.0
        raw = si(axis) * axis.bias(t)
        left = ardupilot_corrected(p, "INS_TCAL1", sensor, letter, t, calibrated, raw)
        assert np.abs(left - si(axis) * axis.bias(calibrated)).max() < 2e-5 * np.ptp(raw)


def test_csv_and_json_hold_the_law(found):
    rows = list(csv.DictReader(io.StringIO(found.export("csv"))))
    document = valid(json.loads(found.export("json")))
    for axis, row, own in zip(found, rows, document["axes"], strict=True):
        assert row["axis"] == own["column"] == axis.name
        low, high = float(row["low_celsius"]), float(row["high_celsius"])
        u = np.clip(at(axis), low, high) - float(row["reference_celsius"])
        value = sum(float(row[f"x{k}"]) * u**k for k in range(4))
        assert value == pytest.approx(axis.bias(at(axis)), rel=1e-12, abs=1e-12)
        assert own["polynomial"] == pytest.approx([float(row[f"x{k}"]) for k in range(4)])


def test_the_c_header_compiles_and_gives_the_law(found, tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    (tmp_path / "law.h").write_text(found.export("c"), encoding="utf-8")
    axis = found["gyro_x"]
    calls = "\n".join(f'    printf("%.17g\\n", gyro_x_bias({t!r}));' for t in at(axis).tolist())
    (tmp_path / "law.c").write_text(
        f'#include <stdio.h>\n#include "law.h"\nint main(void) {{\n{calls}\n    return 0;\n}}\n'
    )
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-o", "law", "law.c"]
    subprocess.run([compiler, *options], cwd=tmp_path, check=True)
    out = subprocess.run(["./law"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert np.array(out.split(), dtype=float) == pytest.approx(axis.bias(at(axis)), rel=1e-12)


def test_each_axis_has_a_c_function_of_its_own():
    """The names "x 2", "x" and "x-" must not give the same C identifier twice."""
    temperature = 20.0 + 5.0 * np.sin(np.linspace(0.0, 6.0, 2000))
    noise = 0.01 * np.random.default_rng(5).standard_normal((2000, 4))
    log = al.Recording(
        noise + 0.1 * temperature[:, None],
        rate=1.0,
        unit="deg/s",
        columns=["x 2", "x", "x-", "2"],
        covariates={"temperature": temperature},
    )
    functions = re.findall(r"^static .*?(\w+)_bias\(", al.thermal(log).export("c"), re.MULTILINE)
    assert functions == ["x_2", "x", "x_1", "axis_2"]


def test_several_logs_have_one_law_and_an_offset_each():
    logs = [three_axes(seed, turn_on, "xy") for seed, turn_on in ((1, 0.1), (2, -0.2), (3, 0.4))]
    found = al.thermal(logs)
    assert [axis.form.name for axis in found] == ["cubic", "linear"]
    y = found["gyro_y"]
    shift = 0.003 * (y.curve.reference - 30.0)
    assert np.array(y.offsets) - shift == pytest.approx((0.1, -0.2, 0.4), abs=0.005)
    low, high = y.fit["COV.coefficient"].interval
    assert low < 0.003 < high
    assert y.loop is not None
    assert not y.loop.detected
    document = valid(found.to_dict())
    assert document["axes"][0]["runs"] == 3
    assert "cubic" in str(found)


def test_a_sensor_that_ignores_the_temperature_gets_no_law():
    rng = np.random.default_rng(5)
    temp = 20.0 + 20.0 * np.linspace(0.0, 1.0, 1500)
    found = al.thermal(recording({"gyro_x": rng.normal(0.0, 0.01, 1500)}, temp))
    axis = found.axes[0]
    assert axis.form.name == "constant"
    assert "no dependence on temperature detected" in axis.headline
    assert axis.curve.low[0] < 0.0 < axis.curve.high[0]
    assert valid(found.to_dict())["axes"][0]["law"]["detected"] is False


def test_noise_that_grows_with_the_temperature_is_said():
    rng = np.random.default_rng(6)
    temp = 20.0 + 20.0 * np.sin(np.arange(8000) / 1200.0)
    x = 0.002 * temp + 0.01 * np.exp(0.02 * (temp - 20.0)) * rng.normal(size=temp.size)
    noise = al.thermal(recording({"gyro_x": x}, temp)).axes[0].noise
    assert noise.detected
    assert noise.interval[0] < 2.0 < noise.interval[1]


def test_kelvin_becomes_celsius():
    log = three_axes(1, letters="y")
    kelvin = al.Recording(
        log.samples,
        rate=1,
        unit="deg/s",
        columns=["gyro_y"],
        covariates={"temperature": log.covariates["temperature"] + 273.15},
        covariate_units={"temperature": "K"},
    )
    celsius = log.covariates["temperature"]
    assert al.thermal(kelvin).axes[0].range == pytest.approx((celsius.min(), celsius.max()))


def test_a_lag_begins_anew_in_each_run():
    """Without this the second run would begin with the memory of the end of the first one."""
    temp = np.concatenate([np.full(50, 10.0), np.full(50, 40.0)])
    effect = Covariate(column="t", coefficient=1.0, lag=20.0, starts=(50,))
    signal = effect.regressors(np.arange(100.0), {"t": temp})[:, 0]
    assert np.ptp(signal[50:]) == 0.0
    assert np.ptp(lagged(temp, 20.0)[50:]) > 1.0


@pytest.mark.parametrize(
    ("logs", "error", "said"),
    [
        (list, al.InputError, "no recordings"),
        (
            lambda: [al.Recording(np.random.default_rng(1).normal(size=500), rate=1, unit="deg/s")],
            al.InputError,
            "no temperature column was found in every log",
        ),
        (lambda: [three_axes(1), three_axes(1).decimate(2)], al.InputError, "0.5 Hz, but"),
        (
            lambda: [
                recording({"gyro_x": np.random.default_rng(1).normal(size=500)}, np.full(500, 20.0))
            ],
            al.TooShortError,
            "record a log while the temperature changes",
        ),
    ],
)
def test_bad_input_is_one_line(logs, error, said):
    with pytest.raises(error, match=said):
        al.thermal(logs())


def test_a_clock_has_no_parameters_for_px4():
    log = three_axes(1, letters="y", stem="clock_", unit="1")
    with pytest.raises(al.InputError, match="the logs contain neither"):
        al.thermal(log).export("px4")


@pytest.mark.statistical
def test_the_band_holds_the_law_and_the_form_is_found():
    """Five sensors: at 95 % each, fewer than four bands or walks have a probability of 2 %, fewer than three 0.1 %."""
    band, walk, right = [], [], []
    for k, law in enumerate(ts.LAWS):
        sensor = ts.sensor(law, ts.THERMOMETERS[k % 2], "warm-up and cooling", 10 + k)
        (samples, shown), *_ = sensor.runs
        axis = al.thermal(recording({"gyro_x": samples}, shown, rate=ts.RATE)).axes[0]
        t, curve = axis.curve.temperature, axis.curve
        true = sensor.bias(t) - sensor.bias(curve.reference)
        band.append(np.mean((curve.low <= true + 1e-12) & (true <= curve.high + 1e-12)) >= 0.95)
        low, high = axis.random["K"].interval
        walk.append(low <= ts.K <= high)
        memory = axis.form.memory
        right.append(memory == law if law in ("lag", "hysteresis") else axis.form.name == law)
    assert sum(band) >= 3
    assert sum(walk) >= 3
    assert sum(right) >= 4
