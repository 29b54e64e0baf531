"""Models without a log: data sheets, files of other tools, tables of deviations, strings with units."""

import json
import math

import numpy as np
import pytest
import yaml

import allanite as al
from allanite.cli import main
from allanite.effects.strings import parse_with_units
from allanite.exports import TARGETS, axes_of
from allanite.sources import documents_of

DEGREE = math.pi / 180
#: Figures typed from the public data sheets of the makers (typical values at 25 degC).
SHEETS = {
    # Analog Devices ADIS16448 Rev. G, table 1: 0.66 deg/sqrt(h), 14.5 deg/h; 0.11 m/s/sqrt(h), 0.25 mg.
    "ADIS16448": (
        ("0.66 deg/sqrt(h)", "14.5 deg/h"),
        ("0.11 m/s/sqrt(h)", "0.25 mg"),
    ),
    # TDK InvenSense ICM-20649 DS-000192, tables 1 and 2: 0.0175 dps/sqrt(Hz), 285 ug/sqrt(Hz); no bias stability.
    "ICM-20649": (("0.0175 dps/sqrt(Hz)", None), ("285 ug/sqrt(Hz)", None)),
    # Bosch BMI088 BST-BMI088-DS001: 0.014 deg/s/sqrt(Hz), bias stability below 2 deg/h; 175 ug/sqrt(Hz).
    "BMI088": (("0.014 deg/s/sqrt(Hz)", "2 deg/h"), ("175 ug/sqrt(Hz)", None)),
    # Sensonor STIM300 TS1524, tables 6-3 and 6-4 (10 g): 0.15 deg/sqrt(h), 0.3 deg/h; 0.07 m/s/sqrt(h), 0.05 mg.
    "STIM300": (("0.15 deg/sqrt(h)", "0.3 deg/h"), ("0.07 m/s/sqrt(h)", "0.05 mg")),
    # SBG Systems Ellipse series leaflet: 0.15 deg/sqrt(h), 7 deg/h; 57 ug/sqrt(Hz), 14 ug.
    "Ellipse": (("0.15 deg/sqrt(h)", "7 deg/h"), ("57 ug/sqrt(Hz)", "14 ug")),
}


def sheet_file(folder, name):
    lines = [f'name = "{name}"']
    for table, (noise, stability) in zip(("gyroscope", "accelerometer"), SHEETS[name], strict=True):
        is_density = "Hz" in noise
        walk = "angle_random_walk" if table == "gyroscope" else "velocity_random_walk"
        lines += [f"[{table}]", f'{"noise_density" if is_density else walk} = "{noise}"']
        if stability:
            lines.append(f'in_run_bias_stability = "{stability}"')
    path = folder / f"{name}.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    return ended.value.code or 0, out, err


@pytest.mark.slow
@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.parametrize("target", TARGETS)
def test_a_data_sheet_is_written_for_every_target(name, target, tmp_path):
    path = sheet_file(tmp_path, name)
    axes = axes_of(documents_of(path), None, str(path))
    text = al.export(axes, target, 200.0)
    assert text
    if target in ("json", "statespace"):
        listed = [one["assumptions"] for one in json.loads(text)["axes"]]
        assert listed == [document["assumptions"] for document in documents_of(path)]
    else:
        assert "assumed" in text
        assert "temperature" in text
        if "Hz" in SHEETS[name][0][0]:
            assert "one-sided" in text


def test_values_of_a_data_sheet(tmp_path):
    gyro, acc = documents_of(sheet_file(tmp_path, "ADIS16448"))
    values = {e["kind"]: next(iter(e["parameters"].values()))["value"] for e in gyro["effects"]}
    assert values["angle_random_walk"] == pytest.approx(0.66 * DEGREE / 60)
    assert values["bias_instability"] == pytest.approx(14.5 * DEGREE / 3600 / 0.6642824703)
    assert acc["recording"]["unit"] == "m/s^2"
    # A one-sided density is sqrt(2) N.
    (gyro, _) = documents_of(sheet_file(tmp_path, "ICM-20649"))
    value = gyro["effects"][0]["parameters"]["N"]["value"]
    assert value == pytest.approx(0.0175 * DEGREE / math.sqrt(2))
    assert any("guess" in line for line in gyro["assumptions"])


def test_random_walk_that_a_floor_allows(tmp_path):
    """N and the largest K that the sheet allows have the floor of the sheet as their lowest Allan deviation."""
    (gyro, _) = documents_of(sheet_file(tmp_path, "STIM300"))
    said = next(line for line in gyro["assumptions"] if "any K from 0" in line)
    K = float(said.split("0 to ")[1].split()[0])
    N = 0.15 * DEGREE / 60
    tau = np.geomspace(1, 1e6, 4000)
    lowest = np.sqrt((N**2 / tau + K**2 * tau / 3).min())
    assert lowest == pytest.approx(0.3 * DEGREE / 3600, rel=0.02)


def test_units_of_another_sensor_in_a_table_of_a_sheet(tmp_path, capsys):
    path = tmp_path / "wrong.toml"
    path.write_text('[accelerometer]\nnoise_density = "0.01 deg/s/sqrt(Hz)"', encoding="utf-8")
    code, out, err = run(capsys, "export", path, "--format", "kalibr", "--rate", "100")
    assert (code, out) == (2, "")
    assert "angular rate" in err
    assert err.count("\n") == 1


def test_kalibr_to_kalibr_is_the_identity(tmp_path, capsys):
    given = {
        "accelerometer_noise_density": 0.0010382453726199955,
        "accelerometer_random_walk": 4.132785219723178e-05,
        "gyroscope_noise_density": 0.00010272083263292572,
        "gyroscope_random_walk": 1.1106223553679963e-06,
        "update_rate": 200.0,
    }
    for node in (given, {"imu0": given}):
        path = tmp_path / "imu.yaml"
        path.write_text("%YAML:1.0\n" + yaml.safe_dump(node), encoding="utf-8")
        code, out, _ = run(capsys, "export", path, "--format", "kalibr")
        assert code == 0
        back = yaml.safe_load(out.replace("%YAML:1.0", ""))
        back = back.get("imu0", back)
        for name, value in given.items():
            assert back[name] == pytest.approx(value, rel=1e-6), name


def test_imu_utils_writes_samples_and_floors(tmp_path, capsys):
    path = tmp_path / "imu_param.yaml"
    axis = {"gyr_n": 0.02, "gyr_w": 3e-5}
    path.write_text(
        "%YAML:1.0\n---\n" + yaml.safe_dump({"type": "IMU", "Gyr": {"avg-axis": axis}}),
        encoding="utf-8",
    )
    code, _, err = run(capsys, "export", path, "--format", "kalibr")
    assert code == 2
    assert "--rate" in err
    (document,) = documents_of(path, rate=400.0)
    noise, floor = (next(iter(e["parameters"].values()))["value"] for e in document["effects"])
    assert noise == pytest.approx(0.02 / 20)
    assert floor == pytest.approx(3e-5 / 0.6642824703)


def test_matlab_parameters_as_script_and_as_json(tmp_path):
    script = tmp_path / "imu.m"
    script.write_text(
        "imu = imuSensor('accel-gyro', 'SampleRate', 100);\n"
        "imu.Gyroscope = gyroparams( ... % comment\n"
        "    'NoiseType', 'double-sided', 'NoiseDensity', [1e-4 2e-4 3e-4], 'RandomWalk', 1e-6);\n"
        "imu.Accelerometer.NoiseDensity = 2e-3;\n",
        encoding="utf-8",
    )
    documents = documents_of(script)
    assert [d["recording"]["column"] for d in documents] == [
        "gyroscope x",
        "gyroscope y",
        "gyroscope z",
        "accelerometer",
    ]
    assert documents[1]["effects"][0]["parameters"]["N"]["value"] == 2e-4
    assert documents[3]["effects"][0]["parameters"]["N"]["value"] == 2e-3 / math.sqrt(2)
    file = tmp_path / "part.json"
    part = {"Part": {"Gyroscope": {"NoiseDensity": [0.01, 0.01, 0.01], "RandomWalk": 0}}}
    file.write_text(json.dumps(part), encoding="utf-8")
    assert len(documents_of(file)) == 3


def test_what_is_written_for_matlab_is_read_back(tmp_path):
    model, unit = parse_with_units("N(N=0.3 deg/sqrt(h))+K(K=2 deg/h/sqrt(h))")
    path = tmp_path / "own.m"
    documents = [{**documents_of(str(model))[0], "recording": {"unit": unit, "column": "gyro_x"}}]
    path.write_text(al.export(axes_of(documents), "matlab", 100.0), encoding="utf-8")
    back = documents_of(path)[0]
    found = {k: v["value"] for e in back["effects"] for k, v in e["parameters"].items()}
    assert found["N"] == pytest.approx(0.3 * DEGREE / 60, rel=1e-5)


def table_of_deviations(path, seed, N=0.01, K=2e-4, fs=10.0, n=20_000):
    rng = np.random.default_rng(seed)
    x = N * math.sqrt(fs) * rng.standard_normal(n)
    x += np.cumsum(K / math.sqrt(fs) * rng.standard_normal(n))
    curve = al.oadev(x, rate=fs)
    np.savetxt(path, np.c_[curve.tau, curve.deviation], delimiter=",", header="tau,adev")


@pytest.mark.slow
def test_intervals_of_a_table_of_deviations_cover(tmp_path):
    path = tmp_path / "adev.csv"
    inside = {"N": 0, "K": 0}
    for seed in range(12):
        table_of_deviations(path, seed)
        (document,) = documents_of(path, unit="rad/s", record_length=2000.0)
        found = {k: v for e in document["effects"] for k, v in e["parameters"].items()}
        for name, truth in (("N", 0.01), ("K", 2e-4)):
            low, high = found[name]["interval"]
            inside[name] += low < truth < high
    # Of 12 intervals of 95 %, fewer than 9 contain the truth with a probability of 0.0002.
    assert min(inside.values()) >= 9


def test_a_table_of_deviations_needs_the_length_of_its_record(tmp_path, capsys):
    path = tmp_path / "adev.csv"
    table_of_deviations(path, 1)
    asked = ("export", path, "--unit", "rad/s", "--format", "kalibr")
    code, _, err = run(capsys, *asked)
    assert code == 2
    assert "--record-length" in err
    code, _, err = run(capsys, *asked, "--record-length", "100")
    assert code == 2
    assert "twice as long" in err
    code, out, _ = run(capsys, *asked, "--record-length", "2000")
    assert code == 0
    assert "table of Allan deviations" in out


def test_a_log_in_the_place_of_a_table(tmp_path, capsys):
    path = tmp_path / "log.csv"
    rng = np.random.default_rng(1)
    np.savetxt(path, np.c_[np.arange(1, 900) / 100, rng.standard_normal(899)], delimiter=",")
    code, _, err = run(capsys, "export", path, "--unit", "rad/s", "--record-length", "100")
    assert code == 2
    assert "characterize" in err


@pytest.mark.parametrize(
    ("text", "unit", "name", "value"),
    [
        ("N(N=0.3 deg/sqrt(h))", "rad/s", "N", 0.3 * DEGREE / 60),
        ("N(N=0.0135 deg/s/√Hz one-sided)", "rad/s", "N", 0.0135 * DEGREE / math.sqrt(2)),
        ("N(N=100 µg/√Hz)", "m/s^2", "N", 100e-6 * 9.80665),
        ("GM(T=10 min, q_c=1 mg/sqrt(s))", "m/s^2", "correlation_time", 600.0),
        ("N(N=0.5)", None, "N", 0.5),
        ("N(N=1 deg/sqrt(h)[0.5, 2])", "rad/s", "N", DEGREE / 60),
    ],
)
def test_values_with_units(text, unit, name, value):
    model, own = parse_with_units(text)
    assert own == unit
    assert getattr(model.effects[0], name) == pytest.approx(value)


def test_limits_have_the_unit_of_the_value():
    model, _ = parse_with_units("N(N=1 deg/sqrt(h)[0.5, 2])")
    assert model.effects[0].limits["N"] == pytest.approx((0.5 * DEGREE / 60, 2 * DEGREE / 60))
    model, _ = parse_with_units("B(B=[0.1,3] deg/h)")
    assert model.effects[0].limits["B"] == pytest.approx((0.1 * DEGREE / 3600, DEGREE / 1200))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("N(N=1 deg/sqrt(h))+K(K=1 m/s^2/s^0.5)", "different quantities"),
        ("N(N=1 deg/sqrt(h))+K(K=1)", "give each value a unit"),
        ("N(N=1 foo)", "unknown unit"),
        ("N(N=1 deg/h)", "different quantities"),
        ("GM(T=3 m)", "different quantities"),
    ],
)
def test_units_that_do_not_fit(text, words):
    with pytest.raises(al.InputError, match=words):
        parse_with_units(text)


def test_units_need_the_unit_of_the_samples_where_none_is_known():
    with pytest.raises(al.InputError, match="give unit="):
        al.parse_model("N(N=1 deg/sqrt(h))")


def test_a_string_with_units_starts_a_fit_in_the_unit_of_the_log(tmp_path, capsys):
    path = tmp_path / "log.npz"
    log = al.parse_model("N(N=0.5)").simulate(duration=200, rate=50, seed=1)
    np.savez(path, data=log.samples[:, None], rate_hz=50.0, unit="deg/s", channels=["gx"])
    code, out, err = run(capsys, "fit", path, "--model", "N(N=30 deg/sqrt(h)!)", "--json")
    assert code == 0, err
    found = json.loads(out)["effects"][0]["parameters"]["N"]
    # 30 deg/sqrt(h) is 0.5 deg/s/sqrt(Hz): held, and in the unit of the log.
    assert found["value"] == pytest.approx(0.5)
