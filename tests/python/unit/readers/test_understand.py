"""Sensor, clock, index, counter or temperature: by name and by numbers, shown before anything is computed."""

import gzip
import json

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from allanite.cli.words import WORDS
from allanite.readers.column_numbers import kind_of_numbers
from allanite.readers.unit_names import unit_in_name

RNG = np.random.default_rng(5)
N = 400
X = RNG.standard_normal((N, 3))


def csv(tmp_path, header, *columns, name="log.csv"):
    path = tmp_path / name
    np.savetxt(path, np.column_stack(columns), "%.12g", ",", header=header, comments="")
    return path


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (np.arange(N), "index"),
        (np.arange(N) + 1.0, "index"),
        (np.arange(N) % 256, "counter"),
        (np.arange(N) / 50, "clock"),
        ((np.arange(N) + 0.2 * X[:, 0]) / 50, "clock"),
        (np.arange(N) // 5, "clock"),
        (1.76e18 + np.arange(N) * 1e7, "clock"),
        (X[:, 0], None),
        (np.cumsum(X[:, 0]), None),
        (np.round(X[:, 0]), None),
        (20 + 3 * (1 - np.exp(-np.arange(N) / 100)) + 0.02 * X[:, 1], None),
        (np.ones(N), None),
        (np.where(np.arange(N) == 7, np.nan, np.arange(N)), None),
        (np.sin(np.arange(N) / 30), None),
        (np.repeat(np.sort(X[:20, 0]), 20), None),
    ],
)
def test_kinds_by_numbers(values, kind):
    assert kind_of_numbers(values) == kind


def said(recording):
    return " ".join(str(f) for f in recording.audit)


def test_the_index_of_pandas_is_no_sensor(tmp_path):
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "log.csv"
    pandas.DataFrame(X, columns=["gx", "gy", "gz"]).to_csv(path)
    assert al.read(path, rate=100).columns == ("gx", "gy", "gz")
    assert [c.role for c in al.inspect(path).columns] == ["other", "sensor", "sensor", "sensor"]
    with pytest.raises(al.InputError, match="no sampling rate"):
        al.read(path)


@pytest.mark.parametrize("name", ["seconds_elapsed", "Zeit", "TOW", "Zeitachse"])
def test_a_ramp_is_the_time_whatever_its_name(tmp_path, name):
    r = al.read(csv(tmp_path, f"{name},a,b", np.arange(N) / 50, X[:, 0], X[:, 1]))
    assert (r.columns, r.rate) == (("a", "b"), pytest.approx(50))
    if name == "Zeitachse":  # which no name gave away
        assert "Zeitachse rises steadily and is used as the time" in said(r)


def test_the_time_row_of_a_matlab_matrix(tmp_path):
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "log.mat"
    io.savemat(path, {"data": np.vstack([np.arange(N) / 50, X.T])})
    r = al.read(path)
    assert (len(r.columns), r.rate) == (3, pytest.approx(50))


def test_counters_are_left_out_and_can_be_asked_for(tmp_path):
    path = csv(tmp_path, "packet,gx", np.arange(N) % 256, X[:, 0])
    r = al.read(path, rate=100)
    assert r.columns == ("gx",)
    assert "packet (a counter)" in said(r)
    assert al.read(path, rate=100, column="packet").columns == ("packet",)


def test_a_phase_that_rises_is_a_clock_s_sample(tmp_path):
    phase = 1e-8 * np.arange(N) + 1e-10 * X[:, 0]
    path = csv(tmp_path, "time [s],phase", np.arange(N), phase)
    r = al.read(path, quantity="angle", unit="1")
    assert r.columns == ("phase",)
    assert al.read(csv(tmp_path, "phase", phase), rate=1).columns == ("phase",)


def test_two_clocks(tmp_path):
    t = np.arange(N) / 50
    r = al.read(csv(tmp_path, "time,seconds_elapsed,gx", t * 1e9 + 1.7e18, t, X[:, 0]))
    (finding,) = [f for f in r.audit if f.kind == "two_clocks"]
    assert finding.severity == "info"
    r = al.read(csv(tmp_path, "time,seconds_elapsed,gx", t * 1.02, t, X[:, 0]))
    (finding,) = [f for f in r.audit if f.kind == "two_clocks"]
    assert finding.severity == "warning"
    assert "1.96 %" in finding.message
    assert al.read(
        csv(tmp_path, "time,seconds_elapsed,gx", t * 1.02, t, X[:, 0]),
        time_column="seconds_elapsed",
    ).rate == pytest.approx(50)


def test_inspect_in_python_and_in_the_shell(tmp_path, capsys):
    path = tmp_path / "log.csv"
    rows = "".join(f"{k / 50},{X[k, 0]},{20 + k % 3},idle,{k % 256}\n" for k in range(N))
    path.write_text("time [s],gx [deg/s],temp,state,nr\n" + rows)
    found = al.inspect(path)
    assert [c.role for c in found.columns] == ["time", "sensor", "temperature", "other", "other"]
    assert [c.used for c in found.columns] == [True, True, True, False, False]
    assert [c.reason for c in found.columns[3:]] == ['text, such as "idle"', "a counter"]
    assert found.columns[0].rate == found.rate == pytest.approx(50)
    assert found.columns[1].unit == "deg/s"
    with pytest.raises(SystemExit) as stop:
        main(["inspect", str(path), "--json"])
    assert stop.value.code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "allanite/inspect/1"
    assert document["columns"][1]["first"] == pytest.approx(X[:3, 0].tolist())
    with pytest.raises(SystemExit):
        main(["inspect", str(path)])
    text = capsys.readouterr().out
    assert "gx" in text
    assert "–state" in text


def test_inspect_tells_what_is_lacking(tmp_path):
    found = al.inspect(csv(tmp_path, "gx", X[:, 0]))
    assert (found.rate, found.problem is None) == (None, False)
    assert "rate=" in found.problem
    assert "unit" in found.columns[0].doubts[0]
    with pytest.raises(al.InputError, match="no such file"):
        al.inspect(tmp_path / "absent.csv")


def test_inspect_words_what_is_lacking_for_the_command_line(tmp_path, capsys):
    path = csv(tmp_path, "gx,gy,ax", *X.T)
    with pytest.raises(SystemExit):
        main(["inspect", str(path)])
    said = capsys.readouterr().out.splitlines()
    assert [
        line for line in said if "no unit in the log for gx, gy, ax: add --unit deg/s,m/s^2" in line
    ]
    assert "no sampling rate: give --rate HZ or a time column" in said[-1]


def test_inspect_says_that_it_does_not_trim(tmp_path, capsys):
    path = csv(tmp_path, "gx", X[:, 0])
    with pytest.raises(SystemExit) as stop:
        main(["inspect", str(path), "--rate", "50", "--unit", "deg/s", "--trim", "quiet"])
    assert stop.value.code == 0
    said = capsys.readouterr()
    assert f"{N} rows" in said.out
    assert "--trim ignored: inspect shows the whole log" in said.err


def test_one_unit_leaves_the_other_kind_out_and_says_so(tmp_path):
    path = csv(tmp_path, "gx,gy,ax", *X.T)
    r = al.read(path, rate=50, unit="deg/s")
    assert r.columns == ("gx", "gy")
    (told,) = [f for f in r.audit if f.kind == "not_used"]
    assert (
        "ax (an accelerometer, but deg/s is no unit of an accelerometer); two units" in told.message
    )
    seen = al.inspect(path, rate=50, unit="deg/s")
    assert [(c.unit, c.used) for c in seen.columns] == [("deg/s", True)] * 2 + [(None, False)]
    asked = al.read(path, rate=50, unit="deg/s", column="gx")
    assert not [f for f in asked.audit if f.kind == "not_used"]


def test_two_units_are_those_of_two_kinds_of_sensor(tmp_path):
    path = csv(tmp_path, "gx,gy,ax", *X.T)
    for unit in ("deg/s,m/s^2", "m/s^2, deg/s"):
        assert al.read(path, rate=50, unit=unit).units == ("deg/s", "deg/s", "m/s^2")
    stated = csv(tmp_path, "gx [rad/s],ax", *X[:, :2].T)
    with pytest.raises(al.InputError, match=r"column gx is in rad/s, but unit='deg/s' is given"):
        al.read(stated, rate=50, unit="deg/s,g")
    assert al.read(stated, rate=50, unit="rad/s,g").units == ("rad/s", "g")
    with pytest.raises(al.InputError, match="two units of one kind"):
        al.read(path, rate=50, unit="deg/s,rad/s")
    with pytest.raises(al.InputError, match="does not show which of deg/s,g is its unit"):
        al.read(csv(tmp_path, "one,two", *X[:, :2].T), rate=50, unit="deg/s,g")


def test_a_preamble_of_words_is_none_whichever_columns_are_read(tmp_path):
    """A manufacturer's log: a number beside a word, then names, then six columns."""
    path = tmp_path / "log.csv"
    rows = "".join(f"{a:.0f},{b:.0f},{c:.0f}\n" for a, b, c in 1000 * X)
    path.write_text("Fs,100\nWaiting time,-1\nax,gx,gy\n" + rows)
    for column in (["gy"], ["gx"], ["gx", "gy"], ["ax"]):
        r = al.read(path, unit="1", column=column)
        assert (r.rate, r.n, r.columns) == (100.0, N, tuple(column))


# -- objects and packed files --------------------------------------------------------------------


def test_frames():
    pandas = pytest.importorskip("pandas")
    dates = pandas.date_range("2026-01-31", periods=N, freq="20ms", tz="UTC")
    indexed = pandas.DataFrame({"gx": X[:, 0], "temp": 20.0 + X[:, 1]}, index=dates)
    r = al.read(indexed, unit="deg/s")
    assert (r.columns, list(r.covariates), r.rate) == (("gx",), ["temp"], pytest.approx(50))
    column = pandas.DataFrame({"when": dates, "gx [deg/s]": X[:, 0], "note": ["a"] * N})
    r = al.read(column)
    assert (r.columns, r.unit, r.rate) == (("gx",), "deg/s", pytest.approx(50))
    assert al.read(indexed["gx"]).rate == pytest.approx(50)
    assert al.inspect(column).rate == pytest.approx(50)
    with pytest.raises(al.InputError, match="no column of numbers"):
        al.read(pandas.DataFrame({"a": ["x", "y"]}))


def test_polars_xarray_and_arrow():
    dates = np.datetime64("2026-01-31T00:00:00") + np.arange(N) * np.timedelta64(20, "ms")
    polars = pytest.importorskip("polars")
    r = al.read(polars.DataFrame({"t": dates, "gx": X[:, 0], "gy": X[:, 1]}))
    assert (r.columns, r.rate) == (("gx", "gy"), pytest.approx(50))
    xarray = pytest.importorskip("xarray")
    variable = xarray.Variable(("time",), X[:, 0], {"units": "deg/s"})
    r = al.read(xarray.Dataset({"gx": variable}, coords={"time": dates}))
    assert (r.columns, r.unit, r.rate) == (("gx",), "deg/s", pytest.approx(50))
    r = al.read(xarray.DataArray(X, dims=("time", "axis"), coords={"time": dates}, name="g"))
    assert (r.columns, r.rate) == (("g0", "g1", "g2"), pytest.approx(50))
    arrow = pytest.importorskip("pyarrow")
    r = al.read(arrow.table({"t": dates, "gx": X[:, 0]}))
    assert (r.columns, r.rate) == (("gx",), pytest.approx(50))


def test_gzip(tmp_path):
    path = csv(tmp_path, "time [s],gx", np.arange(N) / 50, X[:, 0])
    packed = tmp_path / "log.csv.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    r = al.read(packed)
    assert (r.n, r.rate, r.path) == (N, pytest.approx(50), str(packed))
    np.savez(tmp_path / "x.npz", data=X, rate_hz=50.0)
    (tmp_path / "x.npz.gz").write_bytes(gzip.compress((tmp_path / "x.npz").read_bytes()))
    assert al.read(tmp_path / "x.npz.gz").rate == 50
    whole = packed.read_bytes()
    for cut in (1, 12, len(whole) // 2, len(whole) - 4):
        packed.write_bytes(whole[:cut])
        with pytest.raises(al.InputError, match=r"log\.csv\.gz") as caught:
            al.read(packed)
        assert "\n" not in str(caught.value)


@pytest.mark.data
def test_real_logs(data):
    r = al.read(data("logs/static.csv"), rate=100, unit="deg/s")
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z")
    r = al.read(data("logs/Gyroscope.csv"))
    assert (r.columns, r.rate) == (("z", "y", "x"), pytest.approx(99.71, rel=1e-4))
    r = al.read(data("logs/data_v.csv"))
    assert (r.rate, set(r.units)) == (pytest.approx(200), {"rad/s", "m/s^2"})
    assert len(r.columns) == 6


# -- date-times and preambles in text ------------------------------------------------------------


@pytest.mark.parametrize(
    "stamp",
    [
        "2026-01-31T{:02}:{:02}:{:09.6f}Z",
        "2026-01-31 {:02}:{:02}:{:09.6f}",
        "2026/01/31 {:02}:{:02}:{:09.6f}",
        "{:02}:{:02}:{:09.6f}",
    ],
)
@pytest.mark.parametrize("delimiter", [",", ";"])
def test_date_times_in_text(tmp_path, stamp, delimiter):
    # From just before midnight on, where a time of the day begins anew.
    rows = []
    for k in range(N):
        seconds = 86_390 + k / 50
        day, rest = divmod(seconds, 86_400)
        hour, minute = int(rest // 3600), int(rest // 60 % 60)
        text = stamp.format(hour, minute, rest % 60).replace("-31", f"-{31 - 1 + int(day):02}")
        rows.append(
            delimiter.join([text.replace("/31", f"/{30 + int(day):02}"), *map(repr, X[k].tolist())])
        )
    path = tmp_path / "log.csv"
    path.write_text(delimiter.join(["time", "gx", "gy", "gz"]) + "\n" + "\n".join(rows) + "\n")
    r = al.read(path)
    assert (r.columns, r.rate, r.gaps) == (("gx", "gy", "gz"), pytest.approx(50, rel=1e-4), 0)
    np.testing.assert_allclose(r.samples, X)


def test_a_preamble_before_the_header(tmp_path):
    path = tmp_path / "log.csv"
    head = "Fs,100\nLogging Type,1\nInitialization time,-1\nWaiting time,-1\nax,ay,gx\n"
    path.write_text(head + "".join(",".join(map(repr, row)) + "\n" for row in X.tolist()))
    r = al.read(path)
    assert (r.columns, r.n, r.rate) == (("ax", "ay", "gx"), N, 100.0)
    found = al.inspect(path)
    assert (found.rate, len(found.columns)) == (100.0, 3)
    text = "Logger v2\nSerial: 5\n\ntime [s],gx [deg/s]\n"
    path.write_text(text + "".join(f"{k / 50},{X[k, 0]}\n" for k in range(N)))
    assert al.read(path).rate == pytest.approx(50)


@pytest.mark.data
def test_the_preamble_of_a_real_log(data):
    r = al.read(data("logs/imu_static_test.csv"))
    assert (r.columns, r.rate) == (("ax", "ay", "az", "gx", "gy", "gz"), 100.0)
    assert r.n == 9986


def test_steps_near_the_ends_of_doubles_are_told_without_a_warning():
    values = np.array([0.0, 1e-300, 2e-300, 3e-300, 1e300, 1.5e308, -1.5e308] * 40)
    assert kind_of_numbers(values) is None


def test_names_say_units(tmp_path):
    rows = "".join(f"{k % 7},{k % 5},{k % 3},{20 + k % 2}\n" for k in range(200))
    path = tmp_path / "log.csv"
    path.write_text("GyrX_dps,Acc Y mps2,AccZ_mg,TempC\n" + rows)
    seen = {c.name: (c.role, c.unit) for c in al.inspect(path, rate=100).columns}
    assert seen == {
        "GyrX_dps": ("sensor", "deg/s"),
        "Acc Y mps2": ("sensor", "m/s^2"),
        "AccZ_mg": ("sensor", "mg"),
        "TempC": ("temperature", None),
    }
    assert al.read(path, rate=100).units == ("deg/s", "m/s^2", "mg")


def test_a_suffix_is_a_unit_only_of_its_kind_of_sensor():
    assert unit_in_name("mag_x_g") is None
    assert unit_in_name("gyro_x_mg") is None
    assert unit_in_name("gyro_x") is None
    assert unit_in_name("omega_z_rad_s") == "rad/s"
    assert unit_in_name("gx_rad/s") == "rad/s"
    assert unit_in_name("Acc X m/s^2") == "m/s^2"
    assert unit_in_name("gx_m/s^2") is None
    assert unit_in_name("gx_a/b") is None


def test_a_unit_that_is_not_understood_is_said(tmp_path):
    rows = "".join(f"{k % 7},{k % 5},{k % 3}\n" for k in range(200))
    path = tmp_path / "log.csv"
    path.write_text("gx [deg/s],ax [m/sq],press [hPa]\n" + rows)
    seen = al.inspect(path, rate=100)
    assert (
        "! not used: ax (the unit m/sq is not understood); press (hPa is no unit of a sensor)"
        in str(seen)
    )
    told = [f for f in al.read(path, rate=100).audit if f.kind == "not_used"]
    assert [f.severity for f in told] == ["warning"]


def test_no_unit_is_said_with_what_to_give(tmp_path):
    rows = "".join(f"{k % 7},{k % 5},{k % 3}\n" for k in range(200))
    path = tmp_path / "log.csv"
    path.write_text("gyro x,acc x,acc y\n" + rows)
    (told,) = [f for f in al.read(path, rate=100).audit if f.kind == "no_unit"]
    assert told.severity == "warning"
    assert "unit='deg/s,m/s^2'" in told.message
    assert "add --unit deg/s,m/s^2" in al.inspect(path, rate=100).worded(WORDS)
    path.write_text("x,y,z\n" + rows)
    (told,) = [f for f in al.read(path, rate=100).audit if f.kind == "no_unit"]
    assert told.severity == "info"
    assert not [f for f in al.read(path, rate=100, unit="1").audit if f.kind == "no_unit"]


def test_the_time_of_a_file_without_names_beside_a_column_that_is_asked_for(tmp_path):
    path = tmp_path / "log.txt"
    day, second = 1_524_614_400, 36_013 + np.arange(N) // 5
    np.savetxt(path, np.column_stack([np.full(N, day), second, X]), fmt="%.6g")
    text = path.read_text().replace("1.52461e+09", "2018-04-25")
    path.write_text(text)
    r = al.read(path, column="x2", unit="rad/s")
    assert (r.columns, r.rate) == (("x2",), pytest.approx(5.0, rel=2e-2))
    columns = al.inspect(path).columns
    assert [c.role for c in columns[:2]] == ["other", "time"]
    assert columns[0].reason == "a date"


def test_a_clock_named_like_its_sensor(tmp_path):
    late = np.cumsum(np.random.default_rng(5).exponential(0.01, N))
    r = al.read(csv(tmp_path, "gyro_0,gyro_1,gyro_2", late, X[:, 0], X[:, 1]))
    assert r.columns == ("gyro_1", "gyro_2")
    # One that comes back is none.
    late[50] = late[48]
    with pytest.raises(al.InputError, match="no sampling rate"):
        al.read(csv(tmp_path, "gyro_0,gyro_1,gyro_2", late, X[:, 0], X[:, 1]))


def test_a_temperature_called_t_is_no_second_clock(tmp_path):
    warm = np.round(36.0 + 0.2 * np.sin(np.arange(N) / 50.0), 1)
    path = csv(tmp_path, "time,gx,T", np.arange(N) / 50, X[:, 0], warm)
    assert "two_clocks" not in {f.kind for f in al.read(path).audit}
    assert [c.role for c in al.inspect(path).columns] == ["time", "sensor", "other"]
