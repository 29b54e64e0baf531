"""HDF5, netCDF, Parquet, Arrow and clock files: written by each format's own library where there is one."""

import numpy as np
import pytest

import allanite as al
from allanite.common.errors import AllaniteError, InputError

RNG = np.random.default_rng(12)
N, RATE = 400, 50.0
X = RNG.standard_normal((N, 3))
T = np.arange(N) / RATE
DATES = np.datetime64("2026-01-31T00:00:00", "ns") + np.arange(N) * np.timedelta64(20, "ms")


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
    with pytest.raises(InputError, match=r"igs\.clk: line 4: not a clock record"):
        al.read(rinex(tmp_path / "igs.clk", [*rows[:1], "AR BRUX 2026 01 oops\n"]))
    with pytest.raises(InputError, match="no clock in it"):
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
    with pytest.raises(AllaniteError, match=rf"log\.{suffix}") as caught:
        al.read(path, rate=1)
    assert "\n" not in str(caught.value)


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
        with pytest.raises(AllaniteError, match=rf"log\.{suffix}") as caught:
            al.read(path, rate=1)
        assert "\n" not in str(caught.value)
