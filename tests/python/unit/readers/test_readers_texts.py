"""Text logs with a format of their own: terminals, time servers, clocks, stations and message dumps."""

import json
from decimal import Decimal

import numpy as np
import pytest

import allanite as al

N = 300
X = np.random.default_rng(46).standard_normal((N, 6)) * ([0.01] * 3 + [0.05] * 3)


@pytest.fixture
def log(tmp_path):
    def write(lines, name="log.txt"):
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
        return path

    return write


def said(recording):
    return " ".join(f.message for f in recording.audit)


def agree(path, **options):
    """The recording, after `inspect` used the same columns, units and rate."""
    r, seen = al.read(path, **options), al.inspect(path, **options)
    used = [c.name for c in seen.columns if c.used and c.role == "sensor"]
    assert (tuple(used), seen.rate, seen.problem) == (r.columns, r.rate, None)
    return r


# -- what a serial terminal shows ----------------------------------------------------------------------------------------


def clock(k, rate=50.0, start=12 * 3600.0):
    ms = round((start + k / rate) * 1000)
    return f"{ms // 3600000 % 24:02d}:{ms // 60000 % 60:02d}:{ms // 1000 % 60:02d}.{ms % 1000:03d}"


@pytest.mark.parametrize("separator", [",", "\t", " ", ", ", ";"])
def test_a_serial_monitor_with_time_stamps(log, separator):
    rows = [f"{clock(k)} -> " + separator.join(f"{v:.5f}" for v in X[k, :3]) for k in range(N)]
    r = agree(log(rows), unit="deg/s")
    assert (len(r.columns), r.n) == (3, N)
    assert r.rate == pytest.approx(50, rel=1e-6)
    np.testing.assert_allclose(r.samples, X[:, :3], atol=1e-5)
    assert "the terminal received" in said(r)


def test_a_serial_monitor_over_midnight_with_a_greeting_and_names(log):
    start = 86_400 - 2.0
    rows = [f"{clock(0, start=start)} -> MPU6050 found!", f"{clock(0, start=start)} -> gx,gy,gz"]
    rows += [
        f"{clock(k, start=start)} -> " + ",".join(f"{v:.5f}" for v in X[k, :3]) for k in range(N)
    ]
    r = agree(log(rows), unit="deg/s")
    assert (r.columns, r.gaps) == (("gx", "gy", "gz"), 0)
    assert r.rate == pytest.approx(50, rel=1e-6)


def test_a_clock_of_the_board_is_better_than_that_of_the_terminal(log):
    rows = [f"{clock(0)} -> millis,gx"]
    rows += [f"{clock(k)} -> {1000 + 20 * k},{X[k, 0]:.5f}" for k in range(N)]
    r = agree(log(rows), unit="deg/s")
    assert (r.columns, r.rate) == (("gx",), 50.0)
    assert "the terminal received" not in said(r)


@pytest.mark.parametrize("separator", ["\t", ",", ", ", " "])
@pytest.mark.parametrize("stamped", [True, False])
def test_a_serial_plotter(log, separator, stamped):
    names = ("gx", "gy", "gz")
    rows = [
        (f"{clock(k)} -> " if stamped else "")
        + separator.join(f"{n}:{v:.5f}" for n, v in zip(names, X[k, :3], strict=True))
        for k in range(N)
    ]
    r = agree(log(rows), unit="deg/s", rate=None if stamped else 50)
    assert r.columns == names
    assert r.rate == pytest.approx(50, rel=1e-6)
    np.testing.assert_allclose(r.samples, X[:, :3], atol=1e-5)


def test_a_plotter_whose_labels_change(log):
    rows = [f"gx:{v:.5f}\tgy:{v:.5f}" for v in X[:, 0]]
    rows[200] = "gx:0.1\tgz:0.2"
    with pytest.raises(
        al.InputError, match=r"row 201 has the labels gx, gz, the rows before gx, gy"
    ):
        al.read(log(rows), rate=50)


# -- JSON ------------------------------------------------------------------------------------------------------------------


def test_json_lines(log):
    rows = [
        json.dumps({"t": k / 50, "gyro": list(X[k, :3]), "imu": {"temp": 25.0}, "state": "ok"})
        for k in range(N)
    ]
    r = agree(log(rows, "log.jsonl"), unit="deg/s")
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z")
    assert list(r.covariates) == ["imu_temp"]
    assert r.rate == pytest.approx(50)
    np.testing.assert_array_equal(r.samples, X[:, :3])
    assert "text, not read: state" in said(r)


def test_json_lines_with_dates_and_missing_values(log):
    rows = [
        {"timestamp": f"2026-01-31T12:00:{k / 10:09.6f}Z", "gx [deg/s]": X[k, 0]} for k in range(N)
    ]
    rows[7].pop("gx [deg/s]")
    r = agree(log(map(json.dumps, rows)))
    assert (r.columns, r.units) == (("gx",), ("deg/s",))
    assert r.rate == pytest.approx(10, rel=1e-6)
    assert np.flatnonzero(np.isnan(r.samples)).tolist() == [7]


def test_json_lines_that_cannot_be_read(log):
    rows = [json.dumps({"t": k / 50, "gx": 0.1}) for k in range(N)]
    with pytest.raises(al.InputError, match="row 5 is no JSON object"):
        al.read(log([*rows[:4], '{"t": 0.08, "gx"', *rows[5:]]))
    mixed = [json.dumps({"t": k / 50, "ag"[k % 2] + "x": 0.1}) for k in range(N)]
    with pytest.raises(al.InputError, match="different kinds of objects"):
        al.read(log(mixed))


# -- time servers ----------------------------------------------------------------------------------------------------------

OFFSETS = np.rint(X[:, 0] * 1e5).astype(int)


def ptp_lines(prefix="ptp4l[{t:.3f}]: ", clock="master", path=" path delay {d:9d}"):
    yield prefix.format(t=99.0) + "port 1: LISTENING to UNCALIBRATED on RS_SLAVE"
    for k in range(N):
        state = "s0" if k == 0 else "s1" if k == 1 else "s2"
        line = f"{clock} offset {OFFSETS[k]:10d} {state} freq {1000 + k:+7d}{path.format(d=900)}"
        yield prefix.format(t=100.0 + k) + line.strip()


@pytest.mark.parametrize(
    ("prefix", "clock", "path"),
    [
        ("ptp4l[{t:.3f}]: ", "master", " path delay {d:9d}"),
        ("ptp4l[{t:.3f}]: [ptp4l.0.config] ", "", " path delay {d:9d}"),
        ("Nov 27 12:00:00 host ptp4l[1956]: [{t:.3f}] ", "master", " path delay {d:9d}"),
        ("phc2sys[{t:.3f}]: ", "CLOCK_REALTIME phc", " delay {d:6d}"),
        ("ts2phc[{t:.3f}]: [ts2phc.0.config] ", "ens7f1 master", ""),
    ],
)
def test_linuxptp(log, prefix, clock, path):
    r = agree(log(ptp_lines(prefix, clock, path)))
    assert (r.columns, r.quantity, r.n) == (("offset",), "angle", N - 2)
    assert r.rate == pytest.approx(1.0)
    np.testing.assert_allclose(r.samples, OFFSETS[2:] * 1e-9, rtol=1e-12)
    assert "2 samples before the servo locked" in said(r)


def test_linuxptp_of_several_clocks_and_summaries(log):
    both = [*ptp_lines(), *ptp_lines("phc2sys[{t:.3f}]: ", "CLOCK_REALTIME phc", " delay {d}")][:-9]
    r = al.read(log(both))
    assert "clocks not read: phc2sys CLOCK_REALTIME phc" in said(r)
    other = al.read(log(both), topic="phc2sys CLOCK_REALTIME phc")
    assert "clocks not read: ptp4l" in said(other)
    assert other.n < r.n
    rows = [
        f"ptp4l[{k}.123]: rms    6 max   14 freq -11576 +/-   8 delay   272 +/-   0"
        for k in range(N)
    ]
    with pytest.raises(al.InputError, match=r"summaries .* no offsets: set summary_interval to 0"):
        al.read(log(rows))


BANNER = "=" * 115


def test_chrony_tracking(log):
    head = "   Date (UTC) Time     IP Address   St   Freq ppm   Skew ppm     Offset L Co  Offset sd Rem. corr."
    rows = []
    for k in range(N):
        if k % 32 == 0:
            rows += [BANNER, head, BANNER]
        t = np.datetime64("2021-11-20T23:59:00") + 16 * k
        rows.append(
            f"{str(t).replace('T', ' ')} 81.94.123.17     3   -764.399      0.056 {X[k, 0] * 1e-4: .3e} N  1"
            "  6.800e-05 -6.329e-07"
        )
    r = agree(log(rows, "tracking.log"))
    assert (r.columns, r.quantity, r.n, r.rate) == (("offset",), "angle", N, 1 / 16)
    np.testing.assert_allclose(r.samples, X[:, 0] * 1e-4, rtol=1e-3, atol=1e-12)


def test_a_source_of_chrony_is_selected_by_name(log):
    head = "   Date (UTC) Time     IP Address    Std dev'n Est offset  Offset sd  Diff freq   Est skew  Stress"
    rows = [
        f"2021-11-20 {16 * k // 3600:02d}:{16 * k // 60 % 60:02d}:{16 * k % 60:02d} {ip}  1e-6 {sign * X[k, 0]: .3e} 1e-6"
        for k in range(N)
        for ip, sign in (("192.0.2.7", 1), ("198.51.100.7", -1))
    ]
    path = log([BANNER, head, BANNER, *rows], "statistics.log")
    assert "sources not read: 198.51.100.7" in said(al.read(path))
    other = al.read(path, topic="198.51.100.7")
    np.testing.assert_allclose(other.samples, -X[:, 0], rtol=1e-3, atol=1e-12)
    with pytest.raises(
        al.InputError, match=r"no source 192\.0\.2\.8 in this log, which holds 192\.0\.2\.7 "
    ):
        al.read(path, topic="192.0.2.8")


def test_ntpd(log):
    rows = [
        f"5093{5 + k // 200} {(75440.031 + 64 * k) % 86400:.3f} {X[k, 0] * 1e-4:.9f} 13.778 0.0003 0.0133 6"
        for k in range(N)
    ]
    rows = [
        f"{50935 + int((75440 + 64 * k) // 86400)} {(75440 + 64 * k) % 86400:.3f} {X[k, 0] * 1e-4:.9f}"
        " 13.778190 0.000351733 0.013380 6"
        for k in range(N)
    ]
    r = agree(log(rows, "loopstats"))
    assert (r.columns, r.quantity, r.gaps) == (("offset",), "angle", 0)
    assert r.rate == pytest.approx(1 / 64)
    peers = [
        f"{row.rsplit(' ', 5)[0]} {peer} 9714 {row.split()[2]} 0.000000000 0.0014 0.0009"
        for row in rows
        for peer in ("127.127.4.1", "2001:db8::1")
    ][:-1]
    r = agree(log(peers, "peerstats"))
    assert r.n == N
    assert "peers not read: 2001:db8::1" in said(r)
    assert al.read(log(peers, "peerstats"), topic="2001:db8::1").n == N - 1
    for topic in ("192.0.2.1", ["127.127.4.1", "2001:db8::1"]):
        with pytest.raises(
            al.InputError,
            match=r"holds 127\.127\.4\.1 \(\d+ rows\), 2001:db8::1 \(\d+ rows\): name one",
        ):
            al.read(log(peers, "peerstats"), topic=topic)


# -- clocks ----------------------------------------------------------------------------------------------------------------

#: Times of the edges of a pulse per second from a clock that is off by 20e-6, ps since 1970: doubles could not hold them.
EDGES = [
    1_516_102_326 * 10**12 + k * (10**12 + 20 * 10**6) + round(X[k, 0] * 1e6) for k in range(N)
]


def edge(k, digits=9):
    return f"{Decimal(EDGES[k]) / 10**12:.{digits}f}"


@pytest.mark.parametrize(
    "rows",
    [
        [
            f"source 0 - assert {edge(k)}, sequence: {k} - clear  0.000000000, sequence: 0"
            for k in range(N)
        ],
        [f"{edge(k)}#{k}" for k in range(N)],
        ["# timestamp (seconds)", *(f"{edge(k, 12)} chA" for k in range(N))],
        [edge(k) for k in range(N)],
        ["timestamp", *(edge(k) for k in range(N))],
    ],
    ids=["ppstest", "sysfs", "TICC", "bare", "named"],
)
def test_edges_become_a_phase(log, rows):
    r = agree(log(rows))
    assert (r.columns[0][:5], r.units, r.quantity, r.rate) == ("phase", ("1",), "angle", 1.0)
    phase = (np.array(EDGES) - EDGES[0]).astype(float) * 1e-12 - np.arange(N)
    np.testing.assert_allclose(r.samples - r.samples[0], phase, atol=1.1e-9)


def test_edges_that_are_missing_or_doubled(log):
    rows = [edge(k) for k in range(N)]
    r = al.read(log(rows[:100] + rows[103:]))
    assert np.flatnonzero(np.isnan(r.samples)).tolist() == [100, 101, 102]
    with pytest.raises(al.InputError, match="row 101: a second edge within one period"):
        al.read(log([*rows[:100], rows[99][:-3] + "999", *rows[100:]]))
    # One damaged time once filled the memory.
    with pytest.raises(
        al.InputError, match=r"row 101: 8[0-9]{9} periods without an edge before it"
    ):
        al.read(log([*rows[:100], "9999999999.500000000"]))


@pytest.mark.parametrize("sign", ["# ", ""])
@pytest.mark.parametrize(("kind", "unit"), [("Phase", "s"), ("Frequency", "1")])
def test_stable32_by_its_header(log, sign, kind, unit):
    head = ["File: test.dat", "Date: 12/06/99  17:43:27", f"Type: {kind}", "Tau: 1.000000e+01"]
    rows = [*(sign + line for line in head), "# Header End", *(f"{v:.8e}" for v in X[:, 0] * 1e-9)]
    r = agree(log(rows, "test.dat"))
    assert r.rate == pytest.approx(0.1)
    assert (r.columns, r.quantity) == (
        (("phase",), "angle") if unit == "s" else (("frequency",), "rate")
    )
    np.testing.assert_allclose(r.samples, X[:, 0] * 1e-9, rtol=1e-8)


def test_a_stated_tau_is_the_interval(log):
    r = al.read(log(["# Tau: 0.5", *(f"{v:.8e}" for v in X[:, 0])]), unit="1")
    assert r.rate == 2.0


# -- stations, messages ----------------------------------------------------------------------------------------------------


def station_rows(kind):
    if kind == "tenv3":
        yield (
            "site YYMMMDD yyyy.yyyy __MJD week d reflon _e0(m) __east(m) ____n0(m) _north(m) u0(m) ____up(m) _ant(m)"
            " sig_e(m) sig_n(m) sig_u(m) __corr_en __corr_eu __corr_nu _latitude(deg) _longitude(deg) __height(m)"
        )
    for k in range(N):
        if k in (50, 51):
            continue
        date = np.datetime64("2002-08-09") + k
        year, month, day = str(date).split("-")
        name = ["JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC"][
            int(month) - 1
        ]
        first = f"MPRA {year[2:]}{name}{day} {2002.6037 + k / 365.25:.4f} {52495 + k} {1178 + (k + 5) // 7} {(k + 5) % 7}"
        e, n, u = X[k, :3]
        tail = "0.0083 0.000573 0.000705 0.002338 -0.113796  0.146139 -0.157282"
        if kind == "tenv":
            yield f"{first}  {e: .6f}  {n: .6f}  {u: .6f}  {tail}"
        else:
            parts = f"{-3552} {e:.6f} {4417023} {n:.6f} {976} {u:.6f}"
            yield f"{first}  32.8  {parts}  {tail}  39.8875 32.7585 976.0"


@pytest.mark.parametrize("kind", ["tenv", "tenv3"])
def test_daily_positions_of_a_station(log, kind):
    r = agree(log(station_rows(kind), f"MPRA.{kind}"))
    assert r.columns == ("east", "north", "up")
    assert r.rate == pytest.approx(1 / 86400)
    assert (r.n, r.gaps) == (N, 1)
    whole = [-3552, 4417023, 976] if kind == "tenv3" else 0
    np.testing.assert_allclose(r.samples[60] - whole, X[60, :3], atol=1e-6)
    assert "are in m" in said(r)


@pytest.mark.parametrize("stamped", [True, False])
def test_rostopic(log, stamped):
    fields = [
        *("header.seq", "header.stamp", "header.frame_id"),
        *(f"orientation.{a}" for a in "xyzw"),
        *(f"orientation_covariance{i}" for i in range(9)),
        *(f"angular_velocity.{a}" for a in "xyz"),
        *(f"angular_velocity_covariance{i}" for i in range(9)),
        *(f"linear_acceleration.{a}" for a in "xyz"),
        *(f"linear_acceleration_covariance{i}" for i in range(9)),
    ]
    rows = ["%time," + ",".join(f"field.{f}" for f in fields)]
    jitter = np.random.default_rng(3).integers(0, 4_000_000, N)
    for k in range(N):
        stamp = 1_600_000_000_000_000_000 + 10_000_000 * k
        values = [k, stamp if stamped else 0, "imu_link", 0, 0, 0, 1, *([0.0] * 9)]
        values += [*X[k, :3], *([1e-6] * 9), *X[k, 3:], *([1e-4] * 9)]
        rows.append(",".join(map(str, [stamp + jitter[k], *values])))
    r = agree(log(rows, "imu.csv"))
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
    assert r.units == ("rad/s",) * 3 + ("m/s^2",) * 3
    assert r.rate == pytest.approx(100, rel=1e-6 if stamped else 1e-3)
    assert ("stamp in each header" in said(r)) == stamped
    np.testing.assert_allclose(r.samples, X, rtol=1e-12)


# -- tables of deviations --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "tau", [0.1 * np.arange(1, 200), 2.0 ** np.arange(12), np.geomspace(0.01, 1e3, 40)]
)
@pytest.mark.parametrize("header", [None, "tau,adev_x,adev_y", "Tau (s),n,Sigma"])
def test_a_table_of_deviations_is_no_log(log, tau, header):
    sigma = np.sqrt(1e-4 / tau + 1e-6 + 1e-7 * tau)
    rows = [f"{t:.6g},{a:.6g},{3 * a:.6g}" for t, a in zip(tau, sigma, strict=True)]
    with pytest.raises(al.InputError, match=r"a table of deviations .*, not a log of samples"):
        al.read(log([*([header] if header else []), *rows]))
    with pytest.raises(al.InputError, match="a table of deviations"):
        al.inspect(log(rows))


def test_a_log_that_decays_is_no_table_of_deviations(log):
    t = np.arange(1, 400) / 10
    warm = 1.0 + 0.5 * np.exp(-t / 5)
    rows = [f"{a:.6g},{b:.6g},{c:.6g}" for a, b, c in zip(t, warm, 2 * warm, strict=True)]
    assert al.read(log(rows), unit="deg/s").rate == pytest.approx(10)
    rng = np.random.default_rng(1)
    rows = [
        f"{a:.6g},{9.8 + b:.6g}" for a, b in zip(t, 0.1 * rng.standard_normal(t.size), strict=True)
    ]
    assert al.read(log(rows), unit="m/s^2").rate == pytest.approx(10)
