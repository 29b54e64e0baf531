"""Logs as people have them: a row of the table states what a person would read in each file."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import allanite as al
from allanite.axes.averaging import averaged
from allanite.cli import main


@dataclass(frozen=True)
class Row:
    """A file and the expected result: used columns with units, rate in Hz, options, words that must be printed."""

    file: str
    columns: dict[str, str | None]
    rate: float
    options: tuple[str, ...] = ()
    says: tuple[str, ...] = ()
    time: str | None = None


GYRO, ACC = "rad/s", "m/s²"
ANDRO = {f"ACCELEROMETER {a}": ACC for a in "XYZ"} | {f"GYROSCOPE {a}": GYRO for a in "XYZ"}

ROWS = [
    Row("bracket.csv", dict.fromkeys(["gyro[0]", "gyro[1]", "gyro[2]"]), 200.0),
    Row(
        "bracket.csv",
        dict.fromkeys(["gyro[0]", "gyro[1]", "gyro[2]"], "deg/s"),
        200.0,
        ("--unit", "deg/s"),
    ),
    Row(
        "kalibr.csv",
        {f"omega_{a}": "rad/s" for a in "xyz"} | {f"alpha_{a}": "m/s^2" for a in "xyz"},
        345.0,
    ),
    Row("mjd.csv", {"clock_bias_s": "s"}, 1 / 300, time="MJD"),
    Row("phase_ns.csv", {"offset": "ns"}, 1.0),
    Row("andro_nodate.csv", ANDRO, 50.0, time="Time since start in ms"),
    Row(
        "andro_nodate.csv",
        {"GYROSCOPE X": GYRO},
        50.0,
        ("--column", "GYROSCOPE X"),
        time="Time since start in ms",
    ),
    Row(
        "sensorconnect.csv",
        dict.fromkeys([f"scaledAccel{a}" for a in "XYZ"], "g")
        | dict.fromkeys([f"scaledGyro{a}" for a in "XYZ"], "rad/s"),
        100.0,
        time="Time",
    ),
    Row(
        "serial_monitor.txt",
        dict.fromkeys(["x0", "x1", "x2"]),
        50.0,
        says=("the time is that at which the terminal received each line",),
    ),
    Row(
        "serial_plotter.txt",
        dict.fromkeys(["gx", "gy", "gz"]),
        50.0,
        ("--rate", "50"),
        says=("add --unit deg/s",),
    ),
    Row("lines.jsonl", dict.fromkeys(["gx", "gy", "gz"]), 50.0, time="t"),
    Row(
        "ptp4l.txt",
        {"offset": "s"},
        1.0,
        says=("2 samples before the servo locked", "delay (a duration)"),
    ),
    Row(
        "chrony_tracking.log",
        {"offset": "s"},
        0.06202,
        says=("the offset is the phase", "irregular sampling: 26 of 53 steps"),
    ),
    Row(
        "station_tenv.txt",
        dict.fromkeys(["east", "north", "up"]),
        1 / 86_400,
        says=("are in m", "gaps in the time column"),
    ),
    Row(
        "phyphox_rest.csv",
        {f"Gyroscope {a}": GYRO for a in "xyz"},
        100.0,
        says=("not used: Absolute (a magnitude)",),
    ),
]


@pytest.mark.data
@pytest.mark.parametrize("row", ROWS, ids=lambda row: " ".join((row.file, *row.options)))
def test_what_a_person_would_read(data, capsys, row):
    path = str(data(f"field/{row.file}"))
    with pytest.raises(SystemExit) as stop:
        main(["inspect", path, "--json", *row.options])
    assert stop.value.code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["problem"] is None
    used = {
        c["name"]: c["unit"] for c in document["columns"] if c["used"] and c["role"] == "sensor"
    }
    assert used == row.columns
    assert document["rate_hz"] == pytest.approx(row.rate, rel=1e-3)
    if row.time is not None:
        assert [c["name"] for c in document["columns"] if c["used"] and c["role"] == "time"] == [
            row.time
        ]
    with pytest.raises(SystemExit):
        main(["inspect", path, *row.options])
    said = capsys.readouterr()
    assert all(words in said.out for words in row.says)
    # The deviation is of the same columns at the same rate.
    with pytest.raises(SystemExit) as stop:
        main(["adev", path, "--json", *row.options])
    assert stop.value.code == 0
    found = json.loads(capsys.readouterr().out)
    found = found.get("columns", [found])
    assert [one["recording"]["column"] for one in found] == list(row.columns)
    assert [one["recording"]["rate_hz"] for one in found] == pytest.approx(
        [row.rate] * len(found), rel=1e-3
    )


@pytest.mark.data
def test_days_and_years_of_a_station_are_the_time(data, tmp_path):
    # The same table in no format of its own.
    path = tmp_path / "station.csv"
    rows = data("field/station_tenv.txt").read_text().splitlines()
    path.write_text("".join(",".join(row.split()) + "\n" for row in rows))
    r = al.read(path)
    assert 1 / r.rate == pytest.approx(86_400, rel=1e-3)
    assert r.gaps > 0
    columns = {c.name: c for c in r.log_columns}
    assert (columns["x3"].role, columns["x3"].unit, columns["x3"].used) == ("time", "d", True)
    assert columns["x2"].role == "time"
    assert columns["x0"].reason.startswith("text")
    assert not {"x4", "x5"} & set(r.columns)


@pytest.mark.data
def test_a_table_of_deviations_is_refused_with_a_remedy(data, capsys):
    path = data("field/allan_table.csv")
    for command in ("inspect", "adev", "fit", "characterize"):
        with pytest.raises(SystemExit) as stop:
            main([command, str(path)])
        assert stop.value.code == 2
        said = capsys.readouterr()
        assert "a table of deviations (τ from 0.1 to 300 s), not a log of samples" in said.err
        assert "allanite export, --unit UNIT and --record-length SECONDS" in said.err
        assert said.out == ""
        assert said.err.count("\n") == 1


def test_a_phase_in_ns_is_read_in_s(tmp_path):
    path = tmp_path / "phase.csv"
    x = np.random.default_rng(1).standard_normal(200)
    np.savetxt(
        path,
        np.column_stack([np.arange(200), x]),
        "%.9f",
        ",",
        header="time [s],offset [ns]",
        comments="",
    )
    r = al.read(path)
    assert (r.quantity, r.units) == ("angle", ("1",))
    np.testing.assert_allclose(r.samples, x * 1e-9, atol=1e-18)
    (column,) = [c for c in r.log_columns if c.role == "sensor"]
    assert (column.unit, column.scale, column.sources["scale"]) == ("ns", 1e-9, "header")


def log_of(tmp_path, header, rows):
    path = tmp_path / "log.csv"
    path.write_text(header + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return path


NOISE = np.random.default_rng(7).standard_normal((600, 6)).round(6)


@pytest.mark.parametrize("column", [None, "gx", "gz"])
def test_columns_that_are_no_axis(tmp_path, column):
    rows = [
        (
            k,
            12345,
            k % 2 + 1,
            k / 50,
            *NOISE[k, :3],
            float(np.linalg.norm(NOISE[k, :3]).round(6)),
            0.1,
            k % 7,
        )
        for k in range(600)
    ]
    header = "row,serial,board,t [s],gx [deg/s],gy [deg/s],gz [deg/s],|g| [deg/s],gx_covariance [deg/s],dev id"
    r = al.read(log_of(tmp_path, header, rows), column=column)
    assert r.columns == (("gx", "gy", "gz") if column is None else (column,))
    assert r.rate == pytest.approx(50)
    reasons = {c.name: c.reason for c in r.log_columns if not c.used and c.role == "other"}
    assert reasons == {
        "row": "a counter",
        "serial": "an identifier",
        "board": "an identifier",
        "|g|": "a magnitude",
        "gx_covariance": "a covariance",
        "dev id": "an identifier",
    }


def test_a_norm_is_no_axis_whatever_its_name(tmp_path):
    rows = [(k / 50, *NOISE[k, :3], np.linalg.norm(NOISE[k, :3]).round(4)) for k in range(600)]
    r = al.read(log_of(tmp_path, "t,gx,gy,gz,gw", rows))
    assert r.columns == ("gx", "gy", "gz")


def test_what_is_not_used_is_one_line_on_stderr(tmp_path, capsys):
    rows = [(k / 50, *NOISE[k, :3], k % 256) for k in range(600)]
    path = log_of(tmp_path, "t,gx [deg/s],ax [m/s^2],mag [uT],packet", rows)
    with pytest.raises(SystemExit):
        main(["fit", str(path), "--model", "N", "--unit", "deg/s"])
    said = [line for line in capsys.readouterr().err.splitlines() if "not used" in line]
    assert len(said) == 1
    assert "ax (an accelerometer, but deg/s is no unit of an accelerometer)" in said[0]
    assert "mag (a magnetometer)" in said[0]
    assert "packet (a counter)" in said[0]
    with pytest.raises(SystemExit):
        main(["fit", str(path), "--model", "N", "--unit", "deg/s", "--quiet"])
    assert "not used" not in capsys.readouterr().err


# -- time ----------------------------------------------------------------------------------------


def stamps(header, of_row):
    return pytest.param(header, of_row, id=header)


@pytest.mark.parametrize(
    ("header", "of_row"),
    [
        stamps("MJD", lambda k: f"{60000 + k * 30 / 86400:.9f}"),
        stamps("day of year", lambda k: f"{12 + k * 30 / 86400:.9f}"),
        stamps("decimal_year", lambda k: f"{2024 + k * 30 / 31557600:.12f}"),
        stamps("time [days]", lambda k: f"{k * 30 / 86400:.9f}"),
        stamps("time [yr]", lambda k: f"{2024 + k * 30 / 31557600:.12f}"),
        stamps("GPS week,TOW", lambda k: f"{2300 + (604000 + k * 30) // 604800},{(604000 + k * 30) % 604800}"),
        stamps("week,iTOW", lambda k: f"2300,{(4000 + k * 30) * 1000}"),
        stamps("mjd,sod", lambda k: f"{60000 + (80000 + k * 30) // 86400},{(80000 + k * 30) % 86400}"),
        stamps("year,doy,sod", lambda k: f"2023,{365 - 364 * ((80000 + k * 30) // 86400)},{(80000 + k * 30) % 86400}"
               if k * 30 < 6400 else f"2024,1,{(80000 + k * 30) % 86400}"),
        stamps("time_s", lambda k: str(30 * k)),
        stamps("seconds", lambda k: str(30 * k)),
        stamps("date,time", lambda k: f"2024-02-{28 + (80000 + k * 30) // 86400},{clock((80000 + k * 30) % 86400)}"),
        stamps("time", lambda k: f"02/{28 + (80000 + k * 30) // 86400}/2024 {clock((80000 + k * 30) % 86400)}.000000000"),
        stamps("when", lambda k: f"{3 + (80000 + k * 30) // 86400:02}/05/2024 {clock((80000 + k * 30) % 86400)}"),
    ],
)  # fmt: skip
def test_time_in_many_forms(tmp_path, header, of_row):
    path = tmp_path / "log.csv"
    rows = "".join(f"{of_row(k)},{NOISE[k, 0]}\n" for k in range(300))
    path.write_text(f"{header},frequency\n{rows}")
    r = al.read(path)
    assert r.columns == ("frequency",)
    assert 1 / r.rate == pytest.approx(30, rel=2e-4)
    assert r.gaps == 0


def clock(seconds):
    return f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}"


def test_a_rate_that_contradicts_the_stamps_is_refused(tmp_path, capsys):
    path = log_of(tmp_path, "time [s],gx [deg/s]", [(k / 99.7, NOISE[k, 0]) for k in range(600)])
    with pytest.raises(SystemExit) as stop:
        main(["adev", str(path), "--rate", "100"])
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert "the time column says 99.7 Hz, not 100 Hz" in said
    assert "--rate 100!" in said
    assert al.read(path, rate="100!").rate == 100.0
    assert al.read(path, rate=99.7).rate == 99.7
    with pytest.raises(al.InputError, match=r"rate='100!'"):
        al.read(path, rate=100)
    with pytest.raises(al.InputError, match="is not a number in Hz"):
        al.read(path, rate="fast")


@pytest.mark.data
def test_every_row_of_the_table_is_a_test(data):
    rows = re.findall(r"^\| ([^|]+) \|", data("field/README.md").read_text("utf-8"), re.MULTILINE)
    files = {name for row in rows for name in re.findall(r"[\w.]+\.\w+", row)}
    tests = "\n".join(
        (Path(__file__).parents[1] / name).read_text("utf-8")
        for name in ("readers/test_field_logs.py", "recording/test_plausibility.py")
    )
    assert len(files) > 20
    assert {
        name for name in files if f'"{name}"' not in tests and f"field/{name}" not in tests
    } == set()


# -- rows of the table that are made, or no logs --------------------------------------------------


@pytest.mark.data
@pytest.mark.parametrize("file", ["adis16448.toml", "kalibr_d455.yaml", "imu_utils.yaml"])
def test_results_of_others_are_exported_and_compared(data, capsys, file):
    path = str(data(f"field/{file}"))
    with pytest.raises(SystemExit) as stop:
        main(["export", path, "--format", "kalibr", "--rate", "200"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    assert "  assumed: " in said
    assert "gyroscope_noise_density: " in said
    with pytest.raises(SystemExit) as stop:
        main(["compare", path, str(data("field/kalibr_d455.yaml")), "--rate", "200"])
    assert stop.value.code == 0


@pytest.mark.data
def test_a_filter_file_of_a_short_record_says_so(data, capsys, tmp_path):
    model = str(tmp_path / "model.json")
    with pytest.raises(SystemExit) as stop:
        main(["fit", str(data("field/kalibr.csv")), "--save", model])
    assert stop.value.code == 0
    capsys.readouterr()
    with pytest.raises(SystemExit) as stop:
        main(["export", model, "--format", "kalibr"])
    assert stop.value.code == 0
    first = capsys.readouterr().out.partition("# Written by")[0].replace("\n#    ", "")
    assert "Record too short for B, K of omega_x, omega_y, omega_z, alpha_x" in first
    assert "2.41 s shows tau up to 0.241 s" in first


@pytest.mark.data
@pytest.mark.long
@pytest.mark.parametrize(
    ("file", "truth"),
    [
        ("temperature_whole_degrees.csv", {"coefficient": 0.02}),
        ("temperature_hundredths.csv", {"coefficient": 0.02}),
        ("temperature_cubic.csv", {"cubic": 1.2e-5}),
    ],
)
def test_the_logged_temperature_is_the_cause(field, file, truth):
    study = al.improve(al.read(field(file)))
    (law,) = [e for e in study.fit.model if e.kind == "covariate"]
    assert {e.short for e in study.fit.model} == {"N", "B", "K", "COV"}
    assert law.lag == 0.0
    for name, value in truth.items():
        low, high = study.fit[f"COV.{name}"].interval
        assert low < value < high
    low, high = study.fit["N"].interval
    assert low < 0.005 < high
    # K is 2e-6 √50 °/s/√s: not inflated by the steps of the thermometer.
    assert study.fit["K"].interval[0] <= 2e-6 * 50**0.5 < study.fit["K"].interval[1] < 1e-4
    if "cubic" in truth:
        # b(T) = 0.02 d − 4e-4 d² + 1.2e-5 d³, d = T − 25 °C, rises over the whole range.
        u = np.linspace(-10, 51, 100) - study.recording.covariates["temp"].mean()
        slope = law.coefficient + 2 * law.quadratic * u + 3 * law.cubic * u**2
        d = u + study.recording.covariates["temp"].mean() - 25
        np.testing.assert_allclose(slope, 0.02 - 8e-4 * d + 3.6e-5 * d**2, atol=1e-3)


@pytest.mark.data
def test_three_gyroscopes_on_a_board(field):
    log = al.read(field("three_boards.csv"))
    fitted = {name: SimpleNamespace(fit=al.fit_model(log[name], "N+K")) for name in log.columns}
    (one,) = averaged([log], fitted)
    expected = np.array([1.0, 1.4, 1.8]) ** -2.0
    np.testing.assert_allclose(one.weights, expected / expected.sum(), atol=0.02)
    gains = dict(zip(np.round(one.tau, 6), one.gain, strict=True))
    # White noise falls by 1/√(1 + 1/1.96 + 1/3.24).
    assert gains[0.25] == pytest.approx(1.349, rel=0.05)
    assert min(one.gain) > 1.0
