"""Time stamps as logs have them: the rate, the gaps with their rows, or one line that says why not."""

import resource
import time

import numpy as np
import pytest

import allanite as al
from allanite.recording.timebase import read_stamps

N = 20_000


def noise(n=N, seed=0):
    return np.random.default_rng(seed).standard_normal(n)


def kinds(recording):
    return [finding.kind for finding in recording.audit]


def said(recording, kind):
    return next(f.message for f in recording.audit if f.kind == kind)


# -- the rate ------------------------------------------------------------------------------------


def test_thousands_of_holes_in_a_1_hz_log():
    rng = np.random.default_rng(0)
    t = np.flatnonzero(rng.random(3 * N) > 0.07) * 1.0
    t[5000:] += 7000
    s = read_stamps(t, "s")
    assert s.rate == pytest.approx(1, rel=1e-9)
    assert s.missing == t[-1] + 1 - t.size - t[0]
    assert (4999, 7000) in [
        (row, count - (count - 7000 if row == 4999 else 0)) for row, count in s.gaps
    ]


def test_one_hole_of_295_s_in_whole_seconds_of_a_5_hz_log():
    t = np.arange(40_000) // 5
    t[1581:] += 295
    r = al.Recording(noise(40_000), time=t, time_unit="s")
    assert r.rate == pytest.approx(5, rel=1e-3)
    assert r.stamps.gaps[0][0] == 1580
    # The stamps resolve 5 samples: so many may be counted too many or few.
    assert r.missing == pytest.approx(295 * 5, abs=6)


@pytest.mark.data
def test_the_hole_of_a_telephone(data):
    r = al.read(data("phone_acc.npz"))
    assert r.stamps.rate == pytest.approx(5, rel=1e-3)
    assert r.stamps.gaps == ((1581, pytest.approx(294 * 5, abs=6)),)
    assert "rate" not in kinds(r)
    assert "after row 1581" in said(r, "gaps")


def test_two_logs_joined():
    t = np.concatenate((np.arange(N) / 100, np.arange(N // 2) / 100))
    r = al.Recording(noise(t.size), time=t)
    assert r.rate == pytest.approx(100)
    assert (r.gaps, r.missing) == (1, 1)
    assert np.isnan(r.samples[N])
    assert f"after row {N - 1}" in said(r, "seam")
    assert "out_of_order" not in kinds(r)
    later = np.concatenate((np.arange(N) / 100, 500 + np.arange(N // 2) / 100))
    assert read_stamps(later).gaps == ((N - 1, 30_000),)


@pytest.mark.parametrize(
    ("bits", "step", "unit", "rate"),
    [(16, 10, "ms", 100), (16, 1000, "us", 1000), (16, 5, "ms", 200), (32, 5000, "us", 200)],
)
@pytest.mark.parametrize("signed", [False, True])
def test_counters_that_wrap(bits, step, unit, rate, signed):
    low = -(2 ** (bits - 1)) if signed else 0
    t = (np.arange(N) * step + 2**bits - 40 * step) % 2**bits + low
    r = al.Recording(noise(), time=t)
    assert (r.rate, r.stamps.unit, r.gaps) == (pytest.approx(rate), unit, 0)
    assert "begins anew" in said(r, "wraps")
    assert "out_of_order" not in kinds(r)
    assert read_stamps(t * 1e-6, "s").wraps == r.stamps.wraps


def test_time_of_the_day_past_midnight():
    s = read_stamps((np.arange(N) / 10 + 86_000) % 86_400)
    assert (s.rate, len(s.wraps), s.gaps) == (pytest.approx(10), 1, ())


def test_two_logs_of_a_day_each_are_no_counter():
    t = np.tile(np.arange(86_400 // 5) * 5.0, 2)
    s = read_stamps(t, "s")
    assert (s.wraps, len(s.seams)) == ((), 1)


def test_whole_milliseconds_are_not_taken_for_seconds():
    t = np.arange(N) + 123_456
    with pytest.raises(al.InputError, match=r"1 Hz.*1000 Hz.*rate="):
        al.Recording(noise(), time=t)
    assert al.Recording(noise(), 1000, time=t).stamps.unit == "ms"
    assert al.Recording(noise(), time=t, time_unit="ms").rate == pytest.approx(1000)
    # Rounded intervals of a 600 Hz log: 1, 2, 2, 1, … ms.
    s = read_stamps(np.floor(np.arange(N) / 0.6))
    assert (s.unit, s.rate, s.gaps) == ("ms", pytest.approx(600, rel=1e-4), ())
    s = read_stamps(np.floor(np.arange(N) * 1000 / 128))
    assert (s.rate, s.gaps) == (pytest.approx(128, rel=1e-4), ())


def test_a_microsecond_counter_is_no_date():
    # 1.1e9 µs since boot are as large as the seconds since 1970 of 2004.
    s = read_stamps(1_100_000_000 + np.arange(N) * 5000)
    assert (s.unit, s.rate) == ("us", pytest.approx(200))


def test_jitter_bursts_and_drift():
    rng = np.random.default_rng(1)
    s = read_stamps((np.arange(N) + rng.uniform(-1, 1, N)) / 100)
    assert (s.rate, s.gaps, s.lost) == (pytest.approx(100, rel=1e-4), (), True)
    bursts = np.repeat(np.arange(N // 10) * 0.02, 10) + np.tile(np.arange(10) * 1e-4, N // 10)
    s = read_stamps(bursts)
    assert (s.rate, s.gaps, s.lost) == (pytest.approx(500, rel=1e-3), (), True)
    t = np.cumsum(0.01 * (1 + 1e-3 * np.linspace(0, 1, N)))
    assert "ppm" in said(al.Recording(noise(), time=t), "clock_drift")
    assert read_stamps(np.arange(N) / 9.862).drift == 0


def test_a_rate_that_changes_is_refused_with_its_row():
    t = np.concatenate((np.arange(N) / 100, N / 100 + np.arange(N) / 200))
    with pytest.raises(al.InputError, match=r"0\.01 to 0\.005.*row \d+") as caught:
        read_stamps(t)
    row = int(str(caught.value).split("row ")[1].split(":")[0])
    assert row == pytest.approx(N, abs=2 * N / 16)


def test_damaged_stamps_move_nothing():
    for wrong in (0.0, 1e308, -5.0, 1.7e9):
        t = np.arange(N) / 100
        t[77] = wrong
        s = read_stamps(t)
        assert (s.rate, s.gaps, s.seams) == (pytest.approx(100), (), ()), wrong
        assert s.first_backwards in (77, 78)


# -- one jump of the clock -----------------------------------------------------------------------


def limited(function, *arguments):
    """Result of a call, which must take less than 2 s and 500 MB."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    result = function(*arguments)
    assert time.perf_counter() - start < 2
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000
    return result


JUMPS = {
    "a clock set by GPS": np.concatenate((np.arange(600) / 100, 1.7e9 + np.arange(N) / 100)),
    "a month without power": np.concatenate((np.arange(N), 2.6e8 + np.arange(N // 2))) / 100,
    "a last stamp of 1e308": np.append(np.arange(N - 1) / 100, 1e308),
    "both ends": np.concatenate(([-1e308], np.arange(N) / 100, [1e308])),
}


@pytest.mark.parametrize("jump", JUMPS)
def test_one_jump_of_the_clock_parts_the_record(jump):
    t = JUMPS[jump]
    r = limited(lambda: al.Recording(noise(t.size), time=t))
    assert r.rate == pytest.approx(100)
    assert r.n >= N - 1
    assert r.missing == 0
    text = said(r, "pieces")
    first, end = r.stamps.rows
    assert f"rows {first}–{end - 1}" in text
    assert "piece=" in text
    other = al.Recording(noise(t.size), time=t, piece=1)
    assert other.n == r.stamps.pieces[0][1]
    np.testing.assert_array_equal(other.samples, noise(t.size)[: other.n])
    with pytest.raises(al.InputError, match="piece 9"):
        al.Recording(noise(t.size), time=t, piece=9)


def test_a_text_log_with_a_jump(tmp_path):
    path = tmp_path / "gps.csv"
    rows = np.column_stack((JUMPS["a clock set by GPS"], noise(N + 600)))
    np.savetxt(path, rows, "%.12g", ",", header="time,gyro_x [deg/s]", comments="")
    assert limited(al.read, path).n == N
    assert al.read(path, piece=1).n == 600
    assert al.read(path, rate=100, time_column="none").n == N + 600
    with pytest.raises(al.InputError, match="piece 7"):
        al.read(path, piece=7)


def test_gaps_that_fit_are_filled():
    t = np.concatenate((np.arange(N), 4 * N + np.arange(N))) / 100
    r = al.Recording(noise(2 * N), time=t)
    assert r.n == 5 * N
    assert kinds(r).count("pieces") == 0


# -- date-times ----------------------------------------------------------------------------------

START = np.datetime64("2026-01-31T12:00:00")
DATES = START + np.arange(1000) * np.timedelta64(10, "ms")


@pytest.mark.parametrize(
    "time",
    [DATES, DATES.astype("datetime64[us]"), DATES - START, DATES.astype(str), list(DATES.tolist())],
    ids=["ms", "us", "timedelta", "iso", "datetime"],
)
def test_date_times(time):
    r = al.Recording(noise(1000), time=time)
    assert r.rate == pytest.approx(100)
    assert r.gaps == 0


def test_date_times_with_the_day_first():
    days = [f"{d[8:10]}.{d[5:7]}.{d[:4]} {d[11:]}" for d in DATES.astype(str)]
    assert al.Recording(noise(1000), time=days).rate == pytest.approx(100)


def test_nat_and_text_are_refused_by_row():
    time = DATES.copy()
    time[5] = "NaT"
    with pytest.raises(al.InputError, match="NaT at row 5"):
        al.Recording(noise(1000), time=time)
    with pytest.raises(al.InputError, match=r"'noon' at row 0.*ISO"):
        al.Recording([1.0, 2.0], time=["noon", "one"])


def test_an_index_of_pandas_is_the_time():
    pandas = pytest.importorskip("pandas")
    index = pandas.date_range("2026-01-31", periods=1000, freq="10ms")
    series = pandas.Series(noise(1000), index=index)
    assert al.Recording(series).rate == pytest.approx(100)
    assert al.oadev(series).tau[0] == pytest.approx(0.01)
    assert al.oadev(series.drop(index[5:8])).tau[0] == pytest.approx(0.01)
    assert al.Recording(series.drop(index[5:8])).missing == 3
    assert al.Recording(series.tz_localize("Europe/Berlin")).rate == pytest.approx(100)
    frame = pandas.DataFrame({"gx": noise(1000), "gy": noise(1000, 1)}, index=index)
    assert al.Recording(frame, unit="deg/s").columns == ("gx", "gy")
    assert al.Recording(frame).rate == pytest.approx(100)
    seconds = pandas.Series(noise(1000), index=pandas.Index(np.arange(1000) / 50, name="t"))
    assert al.Recording(seconds).rate == pytest.approx(50)
    with pytest.raises(al.InputError, match="no sampling rate"):
        al.Recording(pandas.Series(noise(1000)))
    with pytest.raises(al.InputError, match="NaT at row 3"):
        al.Recording(pandas.Series(noise(9), index=index[:9].where(np.arange(9) != 3)))


def test_a_coordinate_of_xarray_is_the_time():
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(noise(1000), dims=["time"], coords={"time": DATES})
    assert al.Recording(array).rate == pytest.approx(100)
    with pytest.raises(al.InputError, match="no sampling rate"):
        al.Recording(xarray.DataArray(noise(1000), dims=["n"]))


def test_polars_date_times():
    polars = pytest.importorskip("polars")
    assert al.Recording(noise(1000), time=polars.Series(DATES)).rate == pytest.approx(100)


def test_nanoseconds_since_a_telephone_was_switched_on_are_no_date():
    step = 2_000_000 + np.random.default_rng(3).integers(-3000, 3000, N)
    found = read_stamps(672_705_976_809_250 + np.cumsum(step))
    assert (found.unit, found.rate) == ("ns", pytest.approx(500.0, rel=1e-3))


def test_whole_milliseconds_of_several_sensors():
    rng = np.random.default_rng(4)
    stamps = 156_496 + np.cumsum(rng.choice([0, 1, 2], N, p=[0.2, 0.45, 0.35]))
    assert read_stamps(stamps).unit == "ms"


def test_samples_that_come_late_in_bursts_are_not_lost():
    rng = np.random.default_rng(6)
    n, rate = 40_000, 100.0
    taken = np.arange(n) / rate
    # Handed over a few at a time; three times the reader slept for half a second, once samples were lost.
    arrived = np.ceil(taken / 0.07) * 0.07 + rng.uniform(0.0, 1e-4, n).cumsum() * 1e-4
    for at in (5_000, 17_000, 30_000):
        late = slice(at, at + 50)
        arrived[late] = np.maximum(arrived[late], taken[at] + 0.5 + 1e-5 * np.arange(50))
    found = read_stamps(arrived + 1e-6 * np.arange(n))
    # Three times half a second is 0.4 % of the record.
    assert found.rate == pytest.approx(rate, rel=1e-3)
    assert found.gaps == ()
    arrived[20_000:] += 3.0
    found = read_stamps(arrived + 1e-6 * np.arange(n))
    ((row, missing),) = found.gaps
    assert row == pytest.approx(19_999, abs=8)
    assert missing == pytest.approx(300, abs=8)
