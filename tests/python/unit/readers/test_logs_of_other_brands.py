"""Logs of more tools, as people have them: read as a person reads them, or refused with a remedy."""

import json

import numpy as np
import pytest

import allanite as al
from allanite.readers import read_sensors

N = 200
RNG = np.random.default_rng(8)
GYRO = RNG.standard_normal((N, 3)) * 0.05
ACC = RNG.standard_normal((N, 3)) * 0.02 + [0.1, -0.2, 9.8]
#: s
PHASE = np.cumsum(RNG.standard_normal(N)) * 1e-9
K = range(N)


def written(tmp_path, name, text, encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def used(recording):
    return {
        c.name: c.unit for c in recording.log_columns if c.used and c.role in ("sensor", "time")
    }


# -- Windows and Excel ---------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
def test_unicode_text_of_a_spreadsheet(tmp_path, encoding):
    rows = "".join(f"{k / 100:.2f}\t{GYRO[k, 0]:.5f}\r\n".replace(".", ",") for k in K)
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    r = al.read(
        written(tmp_path, "log.txt", f"{mark}Zeit [s]\tDrehrate X [°/s]\r\n{rows}", encoding)
    )
    assert (used(r), r.rate) == ({"Zeit": "s", "Drehrate X": "°/s"}, pytest.approx(100.0))
    np.testing.assert_allclose(r.samples, GYRO[:, 0], atol=5e-6)


def test_an_error_in_unicode_text_names_the_file_and_the_row(tmp_path):
    path = written(tmp_path, "log.txt", "t [s],gx [deg/s]\n0,1\n0.1,x\n" + "0.2,1\n" * 9, "utf-16")
    with pytest.raises(al.InputError, match=r"log\.txt: row 3"):
        al.read(path)


# -- LabVIEW ------------------------------------------------------------------------------------------


def lvm(x_columns="One", comma=False, multi="No"):
    mark = "," if comma else "."
    x = "" if x_columns == "No" else "X_Value\t"
    head = (
        f"LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t{mark}\n"
        f"Multi_Headings\t{multi}\nX_Columns\t{x_columns}\nDate\t2024/05/03\nTime\t12:00:00.12\n"
        "***End_of_Header***\t\n\t\nChannels\t2\t\nSamples\t200\t200\nY_Unit_Label\tdeg/s\tVolts\n"
        "X_Dimension\tTime\tTime\nX0\t0.0\t0.0\nDelta_X\t0.01\t0.01\n***End_of_Header***\t\t\n"
        f"{x}Gyro\tSupply\tComment\n"
    ).replace("0.01", f"0{mark}01")
    rows = (
        ("" if x_columns == "No" else f"{k / 100:.6f}\t") + f"{GYRO[k, 0]:.6f}\t{GYRO[k, 1]:.6f}\n"
        for k in K
    )
    return head + "".join(rows).replace(".", mark)


@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("x_columns", ["One", "No"])
def test_labview(tmp_path, x_columns, comma):
    r = al.read(written(tmp_path, "log.lvm", lvm(x_columns, comma)), column="Gyro")
    assert (r.rate, r.units) == (pytest.approx(100.0), ("deg/s",))
    np.testing.assert_allclose(r.samples, GYRO[:, 0], atol=1e-6)


def test_labview_with_a_head_for_each_segment_is_refused(tmp_path):
    with pytest.raises(al.InputError, match="one header only"):
        al.read(written(tmp_path, "log.lvm", lvm(multi="Yes")))


# -- rows and lines of several sensors ------------------------------------------------------------------


def tagged(first=("ACCE", "GYRO"), header=""):
    rows = "".join(
        f"{first[0]};{k / 100:.3f};{ACC[k, 0]:.5f};{ACC[k, 1]:.5f};{ACC[k, 2]:.5f}\n"
        f"{first[1]};{k / 100 + 0.001:.3f};{GYRO[k, 0]:.5f};{GYRO[k, 1]:.5f};{GYRO[k, 2]:.5f}\n"
        for k in K
    )
    return "% made by an app\n" + header + rows


@pytest.mark.parametrize(
    "tags", [("ACCE", "GYRO"), ("gyro", "acc"), ("ACCELEROMETER", "GYROSCOPE")]
)
def test_rows_of_two_sensors_are_two_recordings(tmp_path, tags):
    found = read_sensors(written(tmp_path, "log.txt", tagged(tags)))
    assert len(found) == 2
    order = sorted(tags, key=lambda tag: "acc" in tag.lower())
    values = dict(zip(tags, (ACC, GYRO), strict=True))
    for recording, tag in zip(found, order, strict=True):
        assert recording.rate == pytest.approx(100.0)
        np.testing.assert_allclose(recording.samples, values[tag], atol=1e-5)


def test_rows_of_two_sensors_with_names(tmp_path):
    path = written(tmp_path, "log.csv", tagged(header="sensor;time [s];x;y;z\n"))
    r = al.read(path, topic="ACCE", unit="m/s^2")
    assert (r.columns, r.rate) == (("x", "y", "z"), pytest.approx(100.0))
    np.testing.assert_allclose(r.samples, ACC, atol=1e-5)
    with pytest.raises(al.InputError, match="no rows of MAGN, only of ACCE, GYRO"):
        al.read(path, topic="MAGN")


SKETCH = "Adafruit MPU6050 test!\nMPU6050 Found!\nAccelerometer range set to: +-8G\n\n"


def sketch(stamp):
    return SKETCH + "".join(
        "".join(
            f"{stamp(k)}{line}\n"
            for line in (
                f"Acceleration X: {ACC[k, 0]:.2f}, Y: {ACC[k, 1]:.2f}, Z: {ACC[k, 2]:.2f} m/s^2",
                f"Rotation X: {GYRO[k, 0]:.2f}, Y: {GYRO[k, 1]:.2f}, Z: {GYRO[k, 2]:.2f} rad/s",
                f"Temperature: 25.{k % 9} degC",
            )
        )
        + "\n"
        for k in K
    )


def test_a_sketch_with_a_line_for_each_sensor(tmp_path):
    path = written(tmp_path, "log.txt", sketch(lambda _: ""))
    r = al.read(path, rate=50.0)
    assert r.columns == ("acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z")
    assert r.units == ("m/s^2",) * 3 + ("rad/s",) * 3
    assert list(r.covariates) == ["temperature"]
    np.testing.assert_allclose(r.samples, np.column_stack([ACC, GYRO]), atol=0.0051)


def test_a_sketch_with_stamps_of_the_terminal(tmp_path):
    path = written(tmp_path, "log.txt", sketch(lambda k: f"12:00:{k / 10:06.3f} -> "))
    assert al.read(path).rate == pytest.approx(10.0)
    lines = path.read_text().splitlines(keepends=True)
    for lost in (40, 41):
        path.write_text("".join(lines[:lost] + lines[lost + 1 :]))
        with pytest.raises(al.InputError, match="the sample that begins in row"):
            al.read(path)


def test_what_rostopic_echo_prints_is_refused(tmp_path):
    text = "".join(
        f"header: \n  seq: {k}\n  stamp: \n    secs: {k}\n    nsecs: 0\nangular_velocity: \n  x: 0.1\n---\n"
        for k in K
    )
    with pytest.raises(al.InputError, match="record a bag"):
        al.read(written(tmp_path, "imu.txt", text))


# -- units and roles --------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["deg.C", "deg C", "°C", "DegC", "degrees C", "Celsius"])
def test_a_temperature_that_rises_is_no_time(tmp_path, unit):
    rows = "".join(f"{k},{GYRO[k, 0]:.5f},{ACC[k, 0]:.3f},{25 + k / 1000}\n" for k in K)
    text = f"#Log Start,2024/05/03\nSample No.,Gx[dps],Ax[mG],Ts[{unit}]\n{rows}"
    r = al.read(written(tmp_path, "log.csv", text), rate=125.0)
    assert (r.columns, r.units) == (("Gx", "Ax"), ("deg/s", "mg"))
    assert list(r.covariates) == ["Ts"]


def test_a_magnetometer_in_mg_is_no_accelerometer(tmp_path):
    rows = "".join(f"{k / 50},{GYRO[k, 0]:.5f},{GYRO[k, 1]:.5f}\n" for k in K)
    r = al.read(written(tmp_path, "log.csv", f"t [s],gx [dps],mag_x [mG]\n{rows}"))
    assert r.columns == ("gx",)


def test_a_column_without_values_is_no_sensor(tmp_path):
    rows = "".join(f"{k / 50},,{GYRO[k, 0]:.5f}\n" for k in K)
    r = al.read(written(tmp_path, "log.csv", f"time,result,_value\n{rows}"))
    assert r.columns == ("_value",)
    reasons = {c.name: c.reason for c in r.log_columns}
    assert reasons["result"] == "no values"


# -- deviations of other tools ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "header",
    [
        "Stable32 Sigma Run\n\n   AF     Tau      #    Alpha  Min Sigma     Sigma      Max Sigma\n",
        "# Tau  N  Overlapping Allan deviation  Min  Max\n",
    ],
)
def test_a_table_of_deviations_whose_header_has_more_words_than_columns(tmp_path, header):
    rows = "".join(
        f"{2**i:6d} {2.0**i:.4e} {1000 // 2**i} 0 {9e-12 / 2 ** (i / 2):.4e}\n" for i in range(9)
    )
    with pytest.raises(al.InputError, match="a table of deviations"):
        al.read(written(tmp_path, "sigma.txt", header + rows), rate=1.0)


# -- what was read rightly before, by other kinds of tools ------------------------------------------------------


def ros2_lines():
    stamp = ({"sec": 1_700_000_000 + k // 100, "nanosec": k % 100 * 10**7} for k in K)
    return "".join(
        json.dumps({
            "header": {"stamp": s}, "angular_velocity": dict(zip("xyz", GYRO[k].round(6), strict=True)),
            "angular_velocity_covariance": [0.0] * 9,
        }) + "\n" for k, s in zip(K, stamp, strict=True)
    )  # fmt: skip


LOGS = {
    "u-blox, NAV-CLOCK": (
        "iTOW [ms],clkB [ns],tAcc [ns]\n" + "".join(f"{417600000 + 1000 * k},{1e9 * PHASE[k]:.1f},20\n" for k in K),
        {"iTOW": "ms", "clkB": "ns"}, 1.0, {"column": "clkB"},
    ),
    "GPS week and seconds, decimal commas": (
        "GPSWeek;TOW_s;DrehrateX [°/s]\r\n"
        + "".join(f"2300;{604700 + k / 50:.3f};{GYRO[k, 0]:.6f}\r\n".replace(".", ",") for k in K),
        {"GPSWeek": None, "TOW_s": None, "DrehrateX": "°/s"}, 50.0, {},
    ),
    "ROS 2 messages, an object a line": (
        ros2_lines(),
        {"header_stamp_sec": None, "header_stamp_nanosec": None, **{f"angular_velocity_{a}": None for a in "xyz"}},
        100.0, {},
    ),
    "ppstest": (
        "ok, found 1 source(s), now start fetching data...\n"
        + "".join(
            f"source 0 - assert {1516102326 + k}.{500123 + int(3e9 * PHASE[k]):09d}, sequence: {k} - clear  0.0,"
            " sequence: 0\n"
            for k in K
        ),
        {"phase": "s"}, 1.0, {},
    ),
    "TAPR TICC, time stamps": (
        "# TAPR TICC Timestamping Counter\n# timestamp (seconds)\n"
        + "".join(f"{1000 + k}.{int(123456789012 + 1e12 * PHASE[k]):012d} chA\n" for k in K),
        {"phase_chA": "s"}, 1.0, {"column": "phase_chA"},
    ),
    "chrony, measurements": (
        "   Date (UTC) Time     IP Address   L St 123 567 ABCD  LP RP Score    Offset  Peer del. Peer disp.  Root del."
        " Root disp. Refid     MTxRx\n"
        + "".join(
            f"2024-03-02 {64 * k // 3600:02d}:{64 * k // 60 % 60:02d}:{64 * k % 60:02d} 192.0.2.7       N  1 111 111 1111"
            f"  6  6 0.00 {1e3 * PHASE[k]: .3e}  1.230e-03  1.100e-06  0.000e+00  1.526e-05 47505300 4B K K\n"
            for k in K
        ),
        {"(time)": None, "offset": "s"}, 1 / 64, {},
    ),
    "chrony, refclocks with a row of medians": (
        "".join(
            ("   Date (UTC) Time         Refid  DP L P  Raw offset   Cooked offset      Disp.\n" if k % 32 == 0 else "")
            + f"2024-03-02 00:{k // 60:02d}:{k % 60:02d}.595742 PPS0   {k % 16:2d} N 1 {PHASE[k]: .6e} {PHASE[k]: .6e}"
            "  5.500e-08\n"
            + (f"2024-03-02 00:{k // 60:02d}:{k % 60:02d}.595742 PPS0    - N -       -        1.000000e-09  5.500e-08\n"
               if k % 16 == 15 else "")
            for k in K
        ),
        {"(time)": None, "offset": "s"}, 1.0, {},
    ),
    "linuxptp in a journal": (
        "".join(
            f"Mar 02 10:{k // 60:02d}:{k % 60:02d} edge1 ptp4l[812]: [{9000 + k}.532] master offset"
            f" {int(5e9 * PHASE[k]):10d} s2 freq {-1234 + k % 9:+7d} path delay      {700 + k % 4}\n" for k in K
        ),
        {"(time)": None, "offset": "s"}, 1.0, {},
    ),
    "MJD and seconds of day across midnight": (
        "# MJD  SOD[s]  TI[s]\n"
        + "".join(f"{60432 + (86300 + k) // 86400} {(86300 + k) % 86400}.0 {1.23e-6 + PHASE[k]:.12e}\n" for k in K),
        {"MJD": None, "SOD": "s", "TI": "s"}, 1.0, {},
    ),
    "French, Windows code page": (
        "Horodatage;Vitesse angulaire X (°/s);Température (°C)\n"
        + "".join(f"03/05/2024 12:00:{k / 10:06.3f};{GYRO[k, 0]:.5f};{25 + k / 1000:.3f}\n".replace(".", ",") for k in K),
        {"Horodatage": "s", "Vitesse angulaire X": "°/s"}, 10.0, {},
    ),
    "pandas with its index": (
        ",time,gx,gy\n" + "".join(f"{k},{k / 200},{GYRO[k, 0]:.5f},{GYRO[k, 1]:.5f}\n" for k in K),
        {"time": None, "gx": None, "gy": None}, 200.0, {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LOGS)
def test_read_as_a_person_reads_it(tmp_path, name):
    text, columns, rate, options = LOGS[name]
    r = al.read(written(tmp_path, "log.csv", text, "cp1252"), **options)
    assert set(used(r)) - {"(time)"} == set(columns) - {"(time)"}
    assert {c: u for c, u in used(r).items() if columns.get(c)} == {
        c: u for c, u in columns.items() if u
    }
    assert r.rate == pytest.approx(rate, rel=1e-3)


def test_summaries_of_a_time_server_are_refused(tmp_path):
    text = "".join(
        f"phc2sys[{100 + k}.345]: CLOCK_REALTIME rms {20 + k % 5:4d} max {60 + k % 7:4d} freq  +1234 +/-  12 delay  900\n"
        for k in K
    )
    with pytest.raises(al.InputError, match=r"summaries \(rms, max\), but no offsets"):
        al.read(written(tmp_path, "phc2sys.log", text))
