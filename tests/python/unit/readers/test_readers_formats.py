"""HDF5, netCDF, Parquet, Arrow and clock files: written by each format's own library where there is one."""

import numpy as np
import pytest

import allanite as al
from allanite.readers import FORMATS

RNG = np.random.default_rng(12)
N, RATE = 400, 50.0
X = RNG.standard_normal((N, 3))
T = np.arange(N) / RATE
DATES = np.datetime64("2026-01-31T00:00:00", "ns") + np.arange(N) * np.timedelta64(20, "ms")


@pytest.mark.slow
def test_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["imu/gyro"] = X
        file["imu/gyro"].attrs["units"] = "deg/s"
        file["imu/temperature"] = 20 + X[:, 0]
        file["imu/time"] = T
        file["note"] = "static"
    r = al.read(path)
    assert (r.columns, r.units) == (("gyro_x", "gyro_y", "gyro_z"), ("deg/s",) * 3)
    assert (r.rate, list(r.covariates)) == (pytest.approx(RATE), ["temperature"])
    with h5py.File(path, "w") as file:
        file.attrs["rate_hz"] = RATE
        file["gx"] = X[:, 0]
    assert al.read(path).rate == RATE
    with h5py.File(path, "w") as file:  # a table, as pandas' fixed and PyTables' logs are
        rows = np.zeros(N, dtype=[("t", "f8"), ("gx", "f4")])
        rows["t"], rows["gx"] = T, X[:, 0]
        file["log"] = rows
    assert al.read(path).columns == ("gx",)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["NETCDF4", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET"])
def test_netcdf(tmp_path, kind):
    netcdf = pytest.importorskip("netCDF4")
    path = tmp_path / "log.nc"
    with netcdf.Dataset(path, "w", format=kind) as file:
        file.createDimension("time", N)
        time = file.createVariable("time", "f8", ("time",))
        time.units = "milliseconds since 2026-01-31 00:00:00"
        time[:] = 1e3 * T
        gyro = file.createVariable("gyro_x", "f4", ("time",))
        gyro.units = "deg/s"
        gyro[:] = X[:, 0]
    r = al.read(path)
    assert (r.columns, r.unit, r.rate) == (("gyro_x",), "deg/s", pytest.approx(RATE))
    np.testing.assert_allclose(r.samples, X[:, 0], rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["parquet", "feather"])
def test_parquet_and_arrow(tmp_path, suffix):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    path = tmp_path / f"log.{suffix}"
    frame = pandas.DataFrame({"when": DATES, "gx [deg/s]": X[:, 0], "note": ["a"] * N})
    getattr(frame, f"to_{suffix}")(path)
    r = al.read(path)
    assert (r.columns, r.unit, r.rate) == (("gx",), "deg/s", pytest.approx(RATE))
    indexed = pandas.DataFrame({"gx": X[:, 0]}, index=pandas.DatetimeIndex(DATES, name="when"))
    indexed.to_parquet(tmp_path / "indexed.parquet")
    assert al.read(tmp_path / "indexed.parquet").rate == pytest.approx(RATE)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["parquet", "feather"])
def test_a_time_of_text_in_parquet_and_arrow(tmp_path, suffix):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import feather, parquet

    write = {"parquet": parquet.write_table, "feather": feather.write_feather}[suffix]
    stamps = [f"2026-01-31T00:{k // 60:02d}:{k % 60:02d}Z" for k in range(N)]
    for times, said in (
        (stamps, None),
        (["noon"] * N, "holds 'noon' at row 0: neither a number nor an ISO 8601 date-time"),
        ([*stamps[:-1], None], f"holds NaT at row {N - 1} .1 such in all"),
    ):
        path = tmp_path / f"log.{suffix}"
        time = pyarrow.array(times, pyarrow.string())
        write(pyarrow.table({"time": time, "gx": X[:, 0]}), path)
        if said is None:
            assert al.read(path).rate == pytest.approx(1.0)
        else:
            with pytest.raises(al.InputError, match=said):
                al.read(path)


def rinex(path, rows):
    head = "     3.00           C                                       RINEX VERSION / TYPE\n"
    head += " " * 60 + "END OF HEADER\n"
    path.write_text(head + "".join(rows))
    return path


def test_rinex_clk(tmp_path):
    rows = []
    for k in range(N):
        minute, second = divmod(30 * k, 60)
        stamp = (
            f"2026 01 {1 + minute // 1440:02} {minute // 60 % 24:02} {minute % 60:02} {second:9.6f}"
        )
        rows.append(f"AR BRUX {stamp}  2   {X[k, 0] * 1e-9:19.12E} {1e-12:19.12E}\n")
        if k != 7:
            rows.append(f"AS G01  {stamp}  1   {X[k, 1] * 1e-9:19.12E}\n".replace("E-", "D-"))
    r = al.read(rinex(tmp_path / "igs.clk", rows))
    assert (r.columns, r.quantity, r.rate) == (("BRUX", "G01"), "angle", pytest.approx(1 / 30))
    assert np.isnan(r.samples[7]).tolist() == [False, True]
    np.testing.assert_allclose(r.samples[:, 0], X[:, 0] * 1e-9, rtol=1e-11, atol=1e-21)
    with pytest.raises(al.InputError, match=r"igs\.clk: line 4: not a clock record"):
        al.read(rinex(tmp_path / "igs.clk", [*rows[:1], "AR BRUX 2026 01 oops\n"]))
    with pytest.raises(al.InputError, match="no clock record"):
        al.read(rinex(tmp_path / "igs.clk", []))


def test_stable32(tmp_path):
    phase = np.cumsum(X[:, 0]) * 1e-12
    path = tmp_path / "cs.phd"
    path.write_text("# Phase data\n# Tau: 1.000e+01\n" + "".join(f"{v:.15e}\n" for v in phase))
    r = al.read(path)
    assert (r.quantity, r.unit, r.rate) == ("angle", "1", 0.1)
    np.testing.assert_allclose(r.samples, phase, rtol=1e-12, atol=1e-24)
    rows = "".join(f"{60000 + k / 86400:.9f} {v:.15e}\n" for k, v in enumerate(phase))
    path.write_text(rows)
    assert al.read(path).rate == pytest.approx(1, rel=1e-4)
    path = tmp_path / "cs.frd"
    path.write_text("".join(f"{v:.15e}\n" for v in X[:, 0] * 1e-12))
    assert (al.read(path, rate=1).quantity, al.read(path, rate=1).unit) == ("rate", "1")


def test_a_euroc_folder(tmp_path):
    folder = tmp_path / "V1_01" / "mav0" / "imu0"
    folder.mkdir(parents=True)
    head = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],a_RS_S_z [m s^-2]\n"
    rows = "".join(
        f"{1403715273262142976 + 5_000_000 * k},{X[k, 0]},{X[k, 1]},{X[k, 2]}\n" for k in range(N)
    )
    (folder / "data.csv").write_text(head + rows)
    for path in (tmp_path / "V1_01", folder, folder.parent):
        r = al.read(path)
        assert (r.rate, r.units) == (pytest.approx(200), ("rad/s", "rad/s", "m/s^2"))
    with pytest.raises(al.InputError, match="this log has no topics"):
        al.read(folder, topic="imu")


def test_a_folder_is_a_bag_if_it_also_holds_a_table(tmp_path):
    assert FORMATS.of_folder(tmp_path) is None
    table = tmp_path / "data.csv"
    table.touch()
    assert FORMATS.of_folder(tmp_path)[1] == table
    (tmp_path / "metadata.yaml").touch()
    log_format, log = FORMATS.of_folder(tmp_path)
    assert (log_format.title, log) == ("ROS bag and MCAP", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "suffix", ["h5", "nc", "parquet", "feather", "clk", "phd", "mat", "npz", "ulg", "bag"]
)
@pytest.mark.parametrize(
    "content",
    [b"x", b"\x89HDF\r\n\x1a\n" + b"\0" * 90, b"CDF\x01" + b"\0" * 40, b"PAR1" + b"\xff" * 50],
)
def test_files_that_are_none(tmp_path, suffix, content):
    path = tmp_path / f"log.{suffix}"
    path.write_bytes(content)
    with pytest.raises(al.AllaniteError, match=rf"log\.{suffix}") as caught:
        al.read(path, rate=1)
    assert "\n" not in str(caught.value)


@pytest.mark.long
@pytest.mark.parametrize("suffix", ["h5", "nc", "parquet"])
def test_truncated_files(tmp_path, suffix):
    path = tmp_path / f"log.{suffix}"
    if suffix == "parquet":
        pandas = pytest.importorskip("pandas")
        pytest.importorskip("pyarrow")
        pandas.DataFrame(X, columns=["gx", "gy", "gz"]).to_parquet(path)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            file["gyro"] = X
    whole = path.read_bytes()
    for length in np.linspace(1, len(whole) - 1, 25).astype(int):
        path.write_bytes(whole[:length])
        with pytest.raises(al.AllaniteError, match=rf"log\.{suffix}") as caught:
            al.read(path, rate=1)
        assert "\n" not in str(caught.value)


# -- ArduPilot, telephones, vendors' text --------------------------------------------------------


def dataflash(path, instances=2, temperature=True):
    """A DataFlash log after the format's description: FMT messages, then IMU messages."""
    import struct

    def described(kind, size, name, codes, fields):
        head = struct.pack("<BB4s16s64s", kind, size, name, codes, fields)
        return b"\xa3\x95\x80" + head

    out = described(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    fields = b"TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T"
    layout = struct.Struct("<QB7f")
    out += described(129, 3 + layout.size, b"IMU", b"QBfffffff", fields)
    for k in range(N):
        for at in range(instances):
            values = (*(X[k] * 0.01 + at), *(X[k] * 0.1), 30 + k / 100)
            out += b"\xa3\x95\x81" + layout.pack(10**6 + 20_000 * k + at, at, *values)
    path.write_bytes(out)
    return path


@pytest.mark.slow
def test_ardupilot(tmp_path):
    pytest.importorskip("pymavlink")
    path = dataflash(tmp_path / "log.bin")
    r = al.read(path)
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
    assert (r.rate, r.units[0], r.units[3]) == (pytest.approx(RATE), "rad/s", "m/s^2")
    np.testing.assert_allclose(r.samples[:, 0], X[:, 0] * 0.01, rtol=1e-6)
    assert r.covariates["temperature"][-1] == pytest.approx(30 + (N - 1) / 100)
    assert "IMU.1" in " ".join(f.message for f in r.added_findings)
    second = al.read(path, topic="IMU.1", column="gyro_x")
    np.testing.assert_allclose(second.samples, X[:, 0] * 0.01 + 1, rtol=1e-6)
    with pytest.raises(al.InputError, match="no message GPS among IMU"):
        al.read(path, topic="GPS")
    path.write_bytes(b"no DataFlash at all")
    with pytest.raises(al.InputError, match=r"log\.bin: not an ArduPilot log"):
        al.read(path)


def archive(path, **logs):
    import zipfile

    with zipfile.ZipFile(path, "w") as file:
        for name, text in logs.items():
            file.writestr(name.replace("__", "/") + ".csv", text)
    return path


def test_archives_of_telephones(tmp_path):
    gyro = "time,seconds_elapsed,z,y,x\n" + "".join(
        f"{1769860800000000000 + 20_000_000 * k},{k / 50},{X[k, 0]},{X[k, 1]},{X[k, 2]}\n"
        for k in range(N)
    )
    path = archive(
        tmp_path / "sensorlogger.zip", Gyroscope=gyro, Accelerometer=gyro, Metadata="a,b\n1,2\n"
    )
    r = al.read(path)
    assert (r.columns, r.rate) == (("z", "y", "x"), pytest.approx(50))
    assert al.read(path, topic="Accelerometer").n == N
    with pytest.raises(
        al.InputError,
        match=r"no log Barometer in the archive, only Accelerometer, Gyroscope; choose one with topic=",
    ):
        al.read(path, topic="Barometer")
    raw = '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)"\n' + "".join(
        f"{k / 50:.9E},{X[k, 0]:.9E},{X[k, 1]:.9E}\n" for k in range(N)
    )
    r = al.read(
        archive(tmp_path / "phyphox.zip", Raw_Data=raw, meta__device="property,value\nversion,1\n")
    )
    assert (r.columns, r.unit) == (("Gyroscope x", "Gyroscope y"), "rad/s")
    assert r.rate == pytest.approx(50)
    whole = path.read_bytes()
    for length in (5, 200, len(whole) - 10):
        path.write_bytes(whole[:length])
        with pytest.raises(al.InputError, match=r"sensorlogger\.zip: damaged"):
            al.read(path)


def test_text_of_xsens(tmp_path):
    path = tmp_path / "MT_07700001-000.txt"
    head = "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: general\n"
    names = "PacketCounter\tSampleTimeFine\tAcc_X\tGyr_X\tTemperature\n"
    rows = "".join(
        f"{k % 65536:05}\t{100 * k:010}\t{X[k, 0]:.6f}\t{X[k, 1]:.6f}\t31.{k % 10}\n"
        for k in range(N)
    )
    path.write_text(head + names + rows)
    r = al.read(path)
    assert (r.columns, list(r.covariates)) == (("Acc_X", "Gyr_X"), ["Temperature"])
    assert (r.rate, r.stamps.rate) == (100.0, pytest.approx(100))
    path.write_text(head + names.replace("SampleTimeFine\t", "") + rows.replace("\t", " ", 0))
    path.write_text(head + "Acc_X\tGyr_X\n" + "".join(f"{a:.6f}\t{b:.6f}\n" for a, b in X[:, :2]))
    assert al.read(path).rate == 100.0


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Fs,100", 100), ("# Sample rate: 50 Hz", 50), ("% sampling frequency = 0.2 kHz", 200), ("ODR: 400", 400),
        ("# rate of change 5", None), ("# fs of what", None), ("Sampling Rate [Hz], 125", 125),
    ],
)  # fmt: skip
def test_a_rate_that_a_comment_states(tmp_path, line, rate):
    from allanite.readers.text import stated_rate

    path = tmp_path / "log.csv"
    path.write_text(line + "\nx,y\n1,2\n")
    assert stated_rate(path) == rate
