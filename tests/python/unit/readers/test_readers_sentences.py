"""Logs of VectorNav, NovAtel, SBG and TimeLab, made by code as their manuals say; damaged ones say so in one line."""

import zlib
from functools import reduce
from operator import xor

import numpy as np
import pytest

import allanite as al
from allanite.cli import main

N = 400
X = np.random.default_rng(4).standard_normal((N, 6)) * ([0.01] * 3 + [0.05] * 3)


def vectornav(body):
    return f"${body}*{reduce(xor, body.encode(), 0):02X}\r\n"


def novatel(body, sign="%"):
    return f"{sign}{body}*{zlib.crc32(body.encode(), 0xFFFFFFFF) ^ 0xFFFFFFFF:08x}\r\n"


def imu_sentences():
    """Mag, accelerometers, gyroscopes, temperature, pressure, as a VN-100 sends them."""
    for x in X:
        acc, gyr = (",".join(f"{v:+07.3f}" for v in x[3:]), ",".join(f"{v:+010.6f}" for v in x[:3]))
        yield vectornav(f"VNIMU,-02.0841,+00.6045,+02.8911,{acc},{gyr},+21.6,+00099.761")


def test_the_checksums_are_those_of_the_manuals(tmp_path):
    told = (
        "%RAWIMUSA,2209,491612.254;2209,491612.253588,ea5afe00,"
        "329303960,-2512321,4410363,309705,607017,-1009773*1fb76c28\r\n"
    )
    path, lines = tmp_path / "span.asc", list(counts("RAWIMUSA", None, 1e-6, 1e-6))
    # The sentence of the manual takes the place of the one nearest in time.
    lines[51] = told
    path.write_text("".join(lines), newline="")
    read = al.read(path)
    assert read.samples[51].tolist() == [-1009773, -607017, 309705, 4410363, 2512321, 329303960]
    assert read.stamps.gaps == ()
    lines[51] = told.replace("607017", "607018")
    path.write_text("".join(lines), newline="")
    assert al.read(path).stamps.gaps == ((50, 1),)
    path = tmp_path / "vn.log"
    path.write_text("".join(f"$VNGYR,{x[0]:.6f},{x[1]:.6f},{x[2]:.6f}*XX\r\n" for x in X))
    np.testing.assert_allclose(al.read(path, rate=40).samples, X[:, :3], atol=5e-7)


def test_vectornav(tmp_path):
    path = tmp_path / "vn100.txt"
    lines = list(imu_sentences())
    path.write_text("".join(lines), newline="")
    r = al.read(path, rate=40)
    assert r.columns == ("AccelX", "AccelY", "AccelZ", "GyroX", "GyroY", "GyroZ")
    assert r.units == ("m/s^2",) * 3 + ("rad/s",) * 3
    assert list(r.covariates) == ["Temp"]
    np.testing.assert_allclose(r.samples[:, 3:], X[:, :3], atol=5e-7)
    # Other sentences between them are passed over; one damaged on the way is a missing sample.
    lines[100] = lines[100].replace("+21.6", "+21.7")
    path.write_text("$VNRRG,1,VN-100S*5B\r\n" + "".join(lines), newline="")
    r = al.read(path, rate=40)
    assert (r.n, np.flatnonzero(np.isnan(r.samples[:, 0])).tolist()) == (N, [100])
    assert any("first in line 102" in f.message for f in r.audit)


def test_vectornav_of_other_kinds(tmp_path):
    path = tmp_path / "vn.log"
    rows = (",".join(f"{v:+.6f}" for v in x) for x in X)
    path.write_text("".join(vectornav(f"VNMAR,+1.0,+0.1,+0.2,{row}") for row in rows))
    assert al.read(path, rate=40).columns[0] == "AccelX"
    path.write_text("".join(vectornav(f"VNGYR,{x[0]:.6f},{x[1]:.6f},{x[2]:.6f}") for x in X))
    assert al.read(path, rate=40).columns == ("GyroX", "GyroY", "GyroZ")


def counts(kind, number, gyro, acc):
    """RAWIMUS or RAWIMUSX message: 200 Hz, with counts in the order Z, −Y, X."""
    for k, x in enumerate(X):
        g, a = np.rint(x[:3] / gyro).astype(int), np.rint(x[3:] / acc).astype(int)
        when = f"{491612.0 + k / 200:.6f}"
        about = "" if number is None else f"04,{number},"
        body = f"{about}2209,{when},ea5afe00,{a[2]},{-a[1]},{a[0]},{g[2]},{-g[1]},{g[0]}"
        yield novatel(f"{kind},2209,{float(when):.3f};{body}")


@pytest.mark.parametrize(
    ("number", "gyro", "acc"),
    [
        # rad/s and m/s² of a count: an increment of 1/200 s times 200, and a rate.
        (58, 200 * 2.0**-33, 200 * 2.0**-29),
        (41, np.radians(0.008 / 65536), 0.2 / 65536 * 9.80665e-3),
    ],
    ids=["HG4930", "EG320N"],
)
def test_novatel_of_a_known_imu(tmp_path, number, gyro, acc):
    path = tmp_path / "span.asc"
    path.write_text("".join(counts("RAWIMUSXA", number, gyro, acc)), newline="")
    r = al.read(path)
    assert r.rate == pytest.approx(200)
    assert r.units == ("rad/s",) * 3 + ("m/s^2",) * 3
    np.testing.assert_allclose(r.samples[:, :3], X[:, :3], atol=gyro)
    np.testing.assert_allclose(r.samples[:, 3:], X[:, 3:], atol=acc)


def test_novatel_of_an_unknown_imu_and_a_damaged_line(tmp_path):
    path = tmp_path / "span.asc"
    lines = list(counts("RAWIMUSA", None, 1e-6, 1e-6))
    lines[7] = lines[7][:-6] + "\r\n"
    position = novatel("BESTPOSA,USB1,0,58.5,FINESTEERING,2209,491612.000,0,0,0;SOL", "#")
    path.write_text(position + "".join(lines), newline="")
    r = al.read(path)
    assert (r.units, r.stamps.gaps) == (("1",) * 6, ((6, 1),))
    assert any("counts" in f.message for f in r.audit)


def test_novatel_corrected(tmp_path):
    path = tmp_path / "corr.asc"
    path.write_text(
        "".join(
            novatel(
                f"CORRIMUDATASA,2209,{k / 100:.3f};2209,{k / 100:.6f},"
                + ",".join(f"{v / 100:.12f}" for v in x)
            )
            for k, x in enumerate(X)
        )
    )
    r = al.read(path)
    assert (r.rate, r.columns[0]) == (pytest.approx(100), "gyro_x")
    np.testing.assert_allclose(r.samples, X, atol=1e-9)


UNITS_BELOW = [
    (
        "timestamp\tstatus\taccelX\tgyroX\ttemp\n(us)\t(na)\t(m/s^2)\t(rad/s)\t(degC)\n",
        lambda k: f"{5000 * k}\t0x7F",
        ("m/s^2", "rad/s"),
    ),
    (
        "UTC Time\tstatus\tAccelerometer X\tGyroscope X\tTemperature\n[UTC]\t[na]\t[m/s²]\t[°/s]\t[°C]\n",
        lambda k: f"2024-01-31 12:00:{k // 200:02d}.{k % 200 * 5:03d}\t127",
        ("m/s^2", "deg/s"),
    ),
]


@pytest.mark.parametrize(("head", "first", "units"), UNITS_BELOW, ids=["logger", "center"])
def test_sbg(tmp_path, head, first, units):
    path = tmp_path / "imuData.txt"
    rows = (f"{first(k)}\t{x[3]:.6f}\t{x[0]:.6f}\t31.25\n" for k, x in enumerate(X))
    path.write_text(head + "".join(rows), encoding="utf-8")
    r = al.read(path)
    assert (r.rate, r.units) == (pytest.approx(200, rel=1e-6), units)
    assert len(r.covariates) == 1


def test_timelab(tmp_path):
    path = tmp_path / "tcxo.tim"
    phase = np.cumsum(X[:, :2], axis=0) * 1e-9
    head = 'TIM 1\n"Input Freq" 1.0000000E+07\nTIC 400 2\n'
    body = "".join(f"{a:.15e} {b:.15e}\n" for a, b in phase)
    path.write_text(head + body + "END\n")
    r = al.read(path, rate=1)
    assert (r.columns, r.quantity) == (("phase_1", "phase_2"), "angle")
    np.testing.assert_allclose(r.samples, phase, rtol=1e-12)
    path.write_text(head + body[: len(body) // 2])
    with pytest.raises(al.InputError, match=r"ends after \d+ of 400 × 2 numbers"):
        al.read(path, rate=1)


BAD = {
    "no block.tim": "1e-9\n2e-9\n",
    "text.tim": "TIC 2 1\n1e-9\nnoon\n",
    "all damaged.txt": "".join(line.replace("+21.6", "+21.7") for line in imu_sentences()),
    "cut.txt": next(imu_sentences())[:40],
    "short.txt": "".join(vectornav(f"VNIMU,1,2,{k}") for k in range(50)),
    "text.txt": "".join(vectornav(f"VNGYR,1,noon,{k}") for k in range(50)),
    "cut.asc": next(counts("RAWIMUSXA", 58, 1e-6, 1e-6))[:60],
    "short.asc": "".join(novatel(f"RAWIMUSA,1,2;2209,{k},ff,1,2") for k in range(50)),
    "text.asc": "".join(novatel(f"RAWIMUSA,1,2;2209,{k},ff,1,2,3,4,5,six") for k in range(50)),
    "still.asc": "".join(novatel("RAWIMUSA,1,2;2209,7.0,ff,1,2,3,4,5,6") for k in range(50)),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_and_cut_files(tmp_path, capsys, name):
    path = tmp_path / name
    path.write_text(BAD[name])
    with pytest.raises(SystemExit) as stop:
        main(["adev", str(path), "--rate", "10"])
    told = capsys.readouterr().err
    assert (stop.value.code, told.count("\n")) == (2, 1)
    assert str(path) in told
