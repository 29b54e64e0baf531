"""Logs in every dialect: what is found by itself, and what is refused by name."""

import numpy as np
import pytest

import allanite as al
from allanite.readers._table import split_unit
from allanite.recording.sensor_names import role_of, sensor_kind


def write(tmp_path, text, name="log.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return path


ROWS = [(0.00, 1.5, -2.25), (0.01, 1.0, 3.5), (0.02, -4e-3, 0.0)]


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "   ", ", ", "|"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("bom", ["", "\ufeff"])
@pytest.mark.parametrize("comment", ["", "# made by hand\n", "% one\n% two\n"])
def test_dialects(tmp_path, delimiter, newline, bom, comment):
    lines = [delimiter.join(["time", "gyro_x", "gyro_y"])]
    lines += [delimiter.join(map(repr, row)) for row in ROWS]
    text = bom + comment.replace("\n", newline) + newline.join(lines) + newline
    r = al.read(write(tmp_path, text), unit="deg/s")
    assert r.columns == ("gyro_x", "gyro_y")
    assert r.rate == pytest.approx(100)
    assert r.unit == "deg/s"
    np.testing.assert_allclose(r.samples, np.array(ROWS)[:, 1:])


@pytest.mark.parametrize("delimiter", [";", "\t", " "])
def test_decimal_comma(tmp_path, delimiter):
    lines = [delimiter.join(repr(v).replace(".", ",") for v in row) for row in ROWS]
    r = al.read(write(tmp_path, "\n".join(["t;x;y".replace(";", delimiter), *lines])))
    np.testing.assert_allclose(r.samples, np.array(ROWS)[:, 1:])


def test_no_header(tmp_path):
    r = al.read(write(tmp_path, "1.5\n2.5\n3.5\n"), rate=10)
    assert r.columns == ("x",)
    np.testing.assert_array_equal(r.samples, [1.5, 2.5, 3.5])
    text = "\n".join(f"{k / 50},{np.sin(k)},{np.cos(k)}" for k in range(200))
    r = al.read(write(tmp_path, text))
    assert (r.columns, r.rate) == (("x1", "x2"), pytest.approx(50))


def test_units_in_the_header(tmp_path):
    text = "Time [ms],Gyro X (deg/s),Acc X [m/s²],Temp (°C)\n" + "".join(
        f"{10 * k},{k % 7},{k % 5},{20 + k}\n" for k in range(50)
    )
    r = al.read(write(tmp_path, text))
    assert r.columns == ("Gyro X", "Acc X")
    assert r.units == ("deg/s", "m/s^2")
    assert r.rate == pytest.approx(100)
    assert list(r.covariates) == ["Temp"]
    assert r.column("Acc X").unit == "m/s^2"


def test_empty_cells_and_nan_are_gaps(tmp_path):
    r = al.read(write(tmp_path, "x,y\n1,2\n,3\nnan,4\n5,6\n"), rate=1)
    assert np.isnan(r.samples[1:3, 0]).all()
    assert r.gaps == 1


def test_a_short_tail_is_a_gap_and_a_long_one_another_rate(tmp_path):
    rows = [f"{k % 5},{k % 7}" for k in range(300)]
    for tail in (1, 3):
        text = "\n".join(["x,y", *rows[:-tail], *(row.split(",")[0] + "," for row in rows[-tail:])])
        r = al.read(write(tmp_path, text), rate=1)
        assert (r.n, r.column("y").missing, r.column("x").missing) == (300, tail, 0)
    data = np.random.default_rng(0).standard_normal((300, 2))
    data[150:, 1] = np.nan
    with pytest.raises(
        al.InputError, match="x1 ends after 150 rows, others have 300: it has another rate"
    ):
        al.read(npz(tmp_path, data=data, rate_hz=50.0))
    # A time that goes on beyond the samples: no column of samples is longer than the others.
    assert al.read(write(tmp_path, "t,x,y\n0,1,2\n1,3,4\n2,,\n3,,\n"), rate=1).missing == 2


def test_a_dead_axis_leaves_the_others(tmp_path):
    data = np.random.default_rng(0).standard_normal((2000, 3))
    data[:, 1], data[10:, 2] = np.nan, np.nan
    path = npz(tmp_path, data=data, rate_hz=50.0, channels=["gx", "gy", "gz"], unit="deg/s")
    r = al.read(path)
    assert [column.missing for column in r] == [0, 2000, 1990]
    assert (al.inspect(path).rate, al.inspect(path).duration) == (50.0, 40.0)
    # What is refused still has the rate that the log states.
    data[1000:, 0] = np.nan
    data[:, 2] = 1.0
    seen = al.inspect(npz(tmp_path, data=data, rate_hz=50.0))
    assert "ends after 1000 rows" in seen.problem
    assert (seen.rate, seen.duration) == (50.0, 40.0)


def test_a_column_without_values_explains_nothing(tmp_path):
    rows = [f"{k % 7}," for k in range(200)]
    r = al.read(write(tmp_path, "\n".join(["gx,temperature", *rows])), rate=1)
    assert not r.covariates
    assert [f.found for f in r.added_findings if f.kind == "no_values"] == [
        "column temperature is not used: only 0 values in 200 rows"
    ]


def test_names_that_repeat_one_are_told_apart(tmp_path):
    rows = "".join(f"{k / 10},{k % 7},{k % 5},{k / 10}\n" for k in range(50))
    path = write(tmp_path, "time [s],gx [rad/s],gx [rad/s],time\n" + rows)
    assert al.read(path).columns == ("gx", "gx [2]")
    assert al.read(path, column="gx [2]").samples[:6].tolist() == [0, 1, 2, 3, 4, 0]
    data = np.zeros((5, 3))
    assert al.Recording(data, rate=1, columns=["g", "g [2]", "g"]).columns == (
        "g",
        "g [2]",
        "g [3]",
    )
    named = npz(tmp_path, data=data, rate_hz=1.0, channels=["gx", "gx", "gx"])
    assert al.read(named, unit="deg/s,g").columns == ("gx", "gx [2]", "gx [3]")
    assert sensor_kind("gx [2]") == "angular rate"


def test_columns_by_name_and_index(tmp_path):
    path = write(
        tmp_path, "time_s,wx,wy,temp,mag_x\n" + "".join(f"{k},{k},2,3,4\n" for k in range(9))
    )
    assert al.read(path).columns == ("wx", "wy")
    assert al.read(path, column="wy").columns == ("wy",)
    assert al.read(path, column=["2", "1"]).columns == ("wy", "wx")
    assert al.read(path, column="mag_x", unit="1").columns == ("mag_x",)
    r = al.read(path, covariate=["mag_x", "wy"], column="wx")
    assert list(r.covariates) == ["temp", "mag_x", "wy"]
    assert al.read(path, rate="7!", time_column="time_s").rate == 7


def test_a_unit_of_one_kind_chooses_its_sensors(tmp_path):
    path = write(tmp_path, "gx,gy,ax,ay\n" + "1,2,3,4\n5,6,7,8\n" * 5)
    assert al.read(path, rate=1, unit="deg/s").columns == ("gx", "gy")
    assert al.read(path, rate=1, unit="mg").columns == ("ax", "ay")
    assert al.read(path, rate=1).columns == ("gx", "gy", "ax", "ay")


@pytest.mark.parametrize(
    ("name", "unit", "role"),
    [
        ("t", None, "time"),
        ("Time", "s", "time"),
        ("timestamp_us", None, "time"),
        ("time_ms", None, "time"),
        ("Unix Time", None, "time"),
        ("temp", None, "temperature"),
        ("imu_temperature", None, "temperature"),
        ("T1", "degC", "temperature"),
        ("attempt", None, "sensor"),
        ("gyro_x", None, "sensor"),
        ("x0", None, "sensor"),
        ("wx", None, "sensor"),
        ("rate", None, "sensor"),
        ("mag_x", None, "other"),
        ("pressure", None, "other"),
        ("seq", None, "other"),
        ("b", "uT", "other"),
        ("phase", "s", "sensor"),
        ("angle", "deg", "sensor"),
        ("p", "hPa", "other"),
        ("f", "mg", "sensor"),
        ("index", None, "other"),
    ],
)
def test_roles(name, unit, role):
    assert role_of(name, unit) == role


def test_names():
    assert split_unit("gyro x [deg/s]") == ("gyro x", "deg/s")
    assert split_unit("a(1)") == ("a", "1")
    assert split_unit("plain") == ("plain", None)
    assert sensor_kind("Gyr_X") == "angular rate"
    assert sensor_kind("acc_z") == "acceleration"
    assert sensor_kind("x0") is None


# -- NPY, NPZ ------------------------------------------------------------------------------------


def npz(tmp_path, **keys):
    path = tmp_path / "log.npz"
    np.savez(path, **keys)
    return path


def test_npz(tmp_path):
    rng = np.random.default_rng(0)
    data = rng.standard_normal((100, 3)).astype(np.float32)
    path = npz(
        tmp_path,
        data=data,
        rate_hz=50.0,
        channels=["g", "a", "temperature"],
        unit=["deg/s", "g", "degC"],
    )
    r = al.read(path)
    assert (r.columns, r.units, r.rate) == (("g", "a"), ("deg/s", "g"), 50.0)
    np.testing.assert_array_equal(r.samples, data[:, :2])
    assert r.samples.dtype == np.float32
    assert r.covariate_units["temperature"] == "degC"
    assert al.read(path, output := None, "deg/s", column="g").unit == "deg/s"
    assert output is None


def test_npz_with_time_keeps_the_stated_rate_and_reports(tmp_path):
    t = np.arange(500) / 9.862
    r = al.read(
        npz(tmp_path, data=np.random.default_rng(0).standard_normal(500), rate_hz=10.0, t=t)
    )
    assert r.rate == 10
    assert "9.862" in r.audit[0].message


def test_a_phase_in_seconds_is_an_angle(tmp_path):
    path = npz(tmp_path, data=np.arange(50.0), rate_hz=1.0, channels=["phase"], unit=["s"])
    r = al.read(path)
    assert (r.quantity, r.unit) == ("angle", "1")
    assert al.read(path, unit="1", quantity="angle").unit == "1"
    with pytest.raises(al.InputError, match="quantity=angle"):
        al.read(path, quantity="rate")


def test_npy(tmp_path):
    path = tmp_path / "x.npy"
    np.save(path, np.arange(10, dtype=np.int16))
    r = al.read(path, rate=5, unit="deg/s")
    assert (r.n, r.columns, r.samples.dtype) == (10, ("x",), np.int16)
    np.save(path, np.zeros((4, 2)))
    assert al.read(path, rate=5).columns == ("x0", "x1")


class Evil:
    def __reduce__(self):
        return (pytest.fail, ("a pickle was loaded",))


def test_pickles_are_never_loaded(tmp_path):
    evil = np.array([Evil()], dtype=object)
    np.save(tmp_path / "x.npy", evil, allow_pickle=True)
    with pytest.raises(al.InputError, match="never loaded"):
        al.read(tmp_path / "x.npy", rate=1)
    with pytest.raises(al.InputError, match=r"key 'data' .* holds pickled objects"):
        al.read(npz(tmp_path, data=evil, rate_hz=1.0))
    # A foreign key is not even looked at.
    assert al.read(npz(tmp_path, data=np.arange(5.0), rate_hz=1.0, notes=evil)).n == 5
    import pickle

    with pytest.raises(al.InputError, match="never loaded"):
        al.read(write(tmp_path, pickle.dumps([1, 2]), "p.npy"), rate=1)


def test_decimal_commas_of_a_single_column(tmp_path):
    recording = al.read(write(tmp_path, "gyro [deg/s]\n0,1257\n-0,1321\n#N/A\n0,5\n"), rate=1)
    assert (recording.columns, recording.unit, recording.missing) == (("gyro",), "deg/s", 1)
    np.testing.assert_array_equal(recording.samples, [0.1257, -0.1321, np.nan, 0.5])


# -- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "options", "error", "words"),
    [
        ("", {}, al.InputError, "empty"),
        ("# only a comment\n", {}, al.InputError, "no rows of numbers"),
        ("x,y\n", {}, al.InputError, "no rows of numbers"),
        ("x,y\n1,2\n3,abc\n", {}, al.InputError, r'row 3, column 2 \(y\): "abc"'),
        ("# c\n\nx,y\n1,2\n3,4\noops,6\n", {}, al.InputError, r'row 6, column 1 \(x\): "oops"'),
        ("x,y\n1,2\n3\n", {}, al.InputError, "row 3"),
        ("x,y\n1,2\n3,4,5\n", {}, al.InputError, "row 3"),
        ("x,y\n1,2\n3,\n4,\n", {}, al.InputError, "column y ends after 1 rows, others have 3"),
        ("x\n1\n2\n", {"rate": None}, al.InputError, "no sampling rate"),
        ("x\n1\n2\n", {"rate": 0}, al.InputError, "positive"),
        ("x\n1\n2\n", {"rate": -3}, al.InputError, "positive"),
        ("x\n1\ninf\n", {}, al.InputError, r'row 3, column 1 \(x\): "inf" is infinite: write nan'),
        ("x\nnan\nnan\n", {}, al.TooShortError, "every sample is NaN"),
        ("x\n1\n2\n", {"unit": "furlong"}, al.InputError, "furlong"),
        ("x\n1\n2\n", {"column": "y"}, al.InputError, "unknown column 'y': the columns are x"),
        ("x\n1\n2\n", {"covariate": "temp"}, al.InputError, "unknown column 'temp'"),
        ("x\n1\n2\n", {"time_column": "t"}, al.InputError, "unknown column 't'"),
        ("time\n1\n2\n", {}, al.InputError, "no sensor column"),
        (
            "x [deg/s]\n1\n2\n",
            {"unit": "rad/s"},
            al.InputError,
            "column x is in deg/s, but unit='rad/s' is given",
        ),
        (
            "x [deg/s]\n1\n2\n",
            {"unit": "mg"},
            al.InputError,
            "column x is in deg/s, but unit='mg' is given",
        ),
    ],
)
def test_refusals_name_the_file_and_the_thing(tmp_path, text, options, error, words):
    path = write(tmp_path, text)
    with pytest.raises(error, match=words) as caught:
        al.read(path, **{"rate": 1, **options})
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda d: d / "absent.csv", "no such file"),
        (lambda d: d, "a directory without a known log"),
        (lambda d: write(d, b"\x00\x01\x02" * 100), r"binary data.*known: .*\.npy .*\.tim"),
        (lambda d: write(d, b"PK\x03\x04 broken", "x.npz"), "damaged or truncated|never loaded"),
        (lambda d: npz(d, samples=np.arange(3.0)), "no key 'data' among samples"),
        (lambda d: npz(d, data=np.arange(3.0), t=np.arange(4.0)), "'t' has shape"),
        (
            lambda d: npz(d, data=np.zeros((3, 2)), unit=["g"] * 3),
            "3 entries in 'unit' for 2 channels",
        ),
        (lambda d: npz(d, data=np.array(["a", "b"])), "must be numbers"),
    ],
)
def test_files_that_are_no_logs(tmp_path, make, words):
    with pytest.raises(al.AllaniteError, match=words) as caught:
        al.read(make(tmp_path), rate=1)
    assert "\n" not in str(caught.value)


def test_truncation_anywhere(tmp_path):
    path = npz(tmp_path, data=np.random.default_rng(0).standard_normal((300, 3)), rate_hz=1.0)
    whole = path.read_bytes()
    cut = tmp_path / "cut.npz"
    for length in np.linspace(1, len(whole) - 1, 40).astype(int):
        cut.write_bytes(whole[:length])
        with pytest.raises(al.InputError, match=r"truncated|never loaded|no key"):
            al.read(cut)
    np.save(tmp_path / "x.npy", np.arange(100.0))
    whole = (tmp_path / "x.npy").read_bytes()
    cut = tmp_path / "cut.npy"
    for length in (1, 5, 20, 100, len(whole) - 1):
        cut.write_bytes(whole[:length])
        with pytest.raises(al.InputError, match=r"truncated|never loaded"):
            al.read(cut, rate=1)


# -- real recordings -----------------------------------------------------------------------------


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "columns", "covariates", "units"),
    [
        ("adis16405_imu1", 6, [], {"deg/s", "g"}),
        ("mtig_gyrox_contaminated", 1, [], {"rad/s"}),
        ("hfi_10hz", 6, [], {"rad/s", "g"}),
        ("cats_thermal_a", 6, ["temperature"], {"mrad/s", "m/s^2"}),
        ("phone_gyro_b", 3, [], {"rad/s"}),
        ("mpu6050_raw_7min", 6, [], {"deg/s", "g"}),
        ("clock_cs5071a_phase", 1, [], {"1"}),
    ],
)
def test_real_recordings(data, name, columns, covariates, units):
    r = al.read(data(f"{name}.npz"))
    assert len(r.columns) == columns
    assert list(r.covariates) == covariates
    assert set(r.units) == units
    assert r.gaps == 0


def test_columns_that_are_not_asked_for_may_hold_text(tmp_path):
    text = "time_s,label,gyro\n" + "".join(f"{k},at rest,{k % 3}\n" for k in range(9))
    path = write(tmp_path, text)
    assert al.read(path, column="gyro").columns == ("gyro",)
    r = al.read(path)
    assert r.columns == ("gyro",)
    assert [f.found for f in r.added_findings if f.kind == "not_used"] == [
        'not used: label (text, such as "at rest")'
    ]


def test_whole_numbers_between_commas_are_not_decimal_commas(tmp_path):
    path = write(tmp_path, "a,b\n1,2\n3,4\n5,6\n")
    assert al.read(path, rate=1).samples.tolist() == [[1, 2], [3, 4], [5, 6]]
    with pytest.raises(al.InputError, match="row 4"):
        al.read(write(tmp_path, "a,b\n1,2\n3,4\n5\n6\n"), rate=1)
