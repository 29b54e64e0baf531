"""Stamps in two columns and in date-time cells; and logs with random holes, jumps, joins, wraps and units."""

import json
from datetime import datetime, timedelta

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import allanite as al
from allanite.cli import main
from allanite.recording.timebase import read_stamps

N, RATE = 3000, 100.0
#: 10 ms apart; the first at 0.987654321 s of a second.
STAMPS = 1_700_000_000_987_654_321 + np.arange(N) * 10_000_000


def _log(path, names, rows, delimiter=","):
    lines = [delimiter.join(map(str, names)), *(delimiter.join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _signal():
    return np.random.default_rng(0).standard_normal(N).round(5).tolist()


PAIRS = [
    ("secs", "nsecs"), ("stamp.sec", "stamp.nanosec"), ("seconds", "nanoseconds"), ("tv_sec", "tv_usec"),
    (".header.stamp.sec", ".header.stamp.nanosec"), ("header/stamp/secs", "header/stamp/nsecs"), ("time_s", "time_ms"),
    ("Seconds", "Microseconds"),
]  # fmt: skip


@pytest.mark.parametrize(("whole", "part"), PAIRS)
def test_seconds_and_the_rest_are_one_stamp(tmp_path, whole, part):
    scale = 1 if "n" in part.split(".")[-1].split("/")[-1][:4] else 1000
    scale = 10**6 if part.endswith("_ms") else scale
    gone = np.delete(np.arange(N), slice(500, 507))
    rows = [
        (int(s) // 10**9, int(s) % 10**9 // scale, x)
        for s, x in zip(STAMPS[gone], np.array(_signal())[gone], strict=True)
    ]
    path = _log(tmp_path / "log.csv", (whole, part, "gyro_x"), rows)
    recording = al.read(path, unit="deg/s")
    assert recording.columns == ("gyro_x",)
    assert recording.rate == pytest.approx(RATE, rel=1e-9)
    assert recording.stamps.gaps == ((499, 7),)
    assert not [f.kind for f in recording.audit if f.kind in ("two_clocks", "coarse_time")]
    seen = {c.name: c.role for c in al.inspect(path).columns}
    assert seen == {whole: "time", part: "time", "gyro_x": "sensor"}


def test_seconds_and_the_rest_of_a_log_read_in_chunks(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("allanite.readers.long_log.is_too_large", lambda path: True)
    rows = [(int(s) // 10**9, int(s) % 10**9, x) for s, x in zip(STAMPS, _signal(), strict=True)]
    path = _log(tmp_path / "log.csv", ("sec", "nanosec", "gyro_x"), rows)
    with pytest.raises(SystemExit) as stop:
        main(["adev", str(path), "--unit", "deg/s", "--json"])
    assert stop.value.code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["recording"]["rate_hz"] == pytest.approx(RATE, rel=1e-6)


def test_two_whole_clocks_are_no_pair(tmp_path):
    """Both count from the start: one is used, and a remark says that there are two."""
    rows = [
        ((s - STAMPS[0]) / 1e9, s - STAMPS[0], x) for s, x in zip(STAMPS, _signal(), strict=True)
    ]
    recording = al.read(_log(tmp_path / "log.csv", ("time_s", "time_ns", "gyro_x"), rows))
    assert recording.rate == pytest.approx(RATE)
    assert "two_clocks" in [f.kind for f in recording.audit]


MOMENTS = [datetime(2026, 1, 31, 23, 59, 50) + timedelta(milliseconds=10 * k) for k in range(N)]
CELLS = {
    "blank": lambda t: t.isoformat(sep=" ", timespec="milliseconds"),
    "T and zone": lambda t: t.isoformat(timespec="milliseconds") + "Z",
    "slashes": lambda t: t.strftime("%Y/%m/%d %H:%M:%S.%f"),
}


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("header", [True, False])
@pytest.mark.parametrize("delimiter", ["\t", ",", ";"])
def test_cells_of_date_times(tmp_path, cell, header, delimiter):
    rows = [(CELLS[cell](t), x, -x) for t, x in zip(MOMENTS, _signal(), strict=True)]
    names = ("time", "gyro_x", "gyro_y")
    path = _log(tmp_path / "log.txt", names if header else rows.pop(0), rows, delimiter)
    recording = al.read(path, unit="deg/s")
    assert recording.rate == pytest.approx(RATE, rel=1e-6)
    assert recording.columns == (("gyro_x", "gyro_y") if header else ("x1", "x2"))


def test_a_comma_in_seconds_and_in_numbers_between_tabs(tmp_path):
    rows = [
        (t.strftime("%Y-%m-%d %H:%M:%S,%f"), str(x).replace(".", ","))
        for t, x in zip(MOMENTS, _signal(), strict=True)
    ]
    recording = al.read(_log(tmp_path / "log.txt", ("Zeit", "gyro_x"), rows, "\t"), unit="deg/s")
    assert recording.columns == ("gyro_x",)
    assert recording.rate == pytest.approx(RATE, rel=1e-6)


def test_a_day_and_a_time_of_the_day_past_midnight(tmp_path):
    rows = [(t.date(), t.time(), x) for t, x in zip(MOMENTS, _signal(), strict=True)]
    recording = al.read(_log(tmp_path / "log.txt", ("Date", "Time", "gyro_x"), rows, "\t"))
    assert (recording.rate, recording.gaps) == (pytest.approx(RATE, rel=1e-6), 0)


def _slashed_log(path, form, header="time"):
    """Log of two days from 4 May 2026 with a sample each 100 s."""
    moments = [datetime(2026, 5, 4) + timedelta(seconds=100 * k) for k in range(1728)]
    rows = [(t.strftime(form), x) for t, x in zip(moments, _signal(), strict=False)]
    return _log(path, (*header.split(","), "gyro_x"), rows)


@pytest.mark.parametrize(
    ("header", "day_first", "month_first"),
    [
        ("time", "%d/%m/%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S"),
        ("date,time", "%d/%m/%Y,%H:%M:%S", "%m/%d/%Y,%H:%M:%S"),
    ],
)
def test_users_are_told_if_the_day_comes_first(
    tmp_path, capsys, monkeypatch, header, day_first, month_first
):
    path = _slashed_log(tmp_path / "log.csv", day_first, header)
    recording = al.read(path, unit="deg/s")
    (note,) = [f.message for f in recording.audit if f.kind == "reader"]
    assert note.startswith("dates such as 04/05/2026")
    assert "the day first" in note
    assert recording.rate == pytest.approx(0.01, rel=1e-9)
    assert note in [f.message for f in al.inspect(path, unit="deg/s").findings]
    other = al.read(_slashed_log(tmp_path / "us.csv", month_first, header), unit="deg/s")
    assert "reader" not in [f.kind for f in other.audit]
    assert (other.rate, other.gaps) == (pytest.approx(0.01, rel=1e-9), 0)
    monkeypatch.setattr("allanite.readers.long_log.is_too_large", lambda path: True)
    with pytest.raises(SystemExit) as stop:
        main(["adev", str(path), "--unit", "deg/s", "--json"])
    assert stop.value.code == 0
    document = json.loads(capsys.readouterr().out)["recording"]
    assert document["rate_hz"] == pytest.approx(0.01, rel=1e-6)
    assert note in [f["message"] for f in document["audit"]]


UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


@pytest.mark.slow
@settings(max_examples=60)
@given(
    st.sampled_from([1.0, 5.0, 10.0, 100.0, 200.0, 1000.0]),
    st.sampled_from(list(UNITS)),
    st.lists(st.tuples(st.integers(50, 3900), st.integers(1, 2000)), max_size=6, unique_by=lambda hole: hole[0]),
    st.sampled_from(["none", "join", "jump", "wrap"]),
    st.floats(0.0, 0.05),
    st.integers(0, 2**31),
)  # fmt: skip
def test_random_logs(rate, unit, holes, event, jitter, seed):
    """The rate is right to 1 in 10⁴, and every hole has its row and number, with jitter of up to a twentieth of a step.

    The rate determines a hole of more than 32 samples; jitter changes it by less than one sample in 2000.
    """
    rng = np.random.default_rng(seed)
    n = 4000
    ticks = np.arange(n, dtype=np.float64)
    expected = {}
    for row, count in sorted(holes):
        ticks[row + 1 :] += count
        expected[row] = count
    at = 2000
    if event == "join":
        ticks[at:] -= ticks[at]
        expected[at - 1] = 1
    elif event == "jump":
        ticks[at:] += 3e7
        expected[at - 1] = expected.get(at - 1, 0) + 30_000_000
    ticks = ticks + rng.uniform(-jitter, jitter, n)
    numbers = ticks / rate * UNITS[unit]
    if event == "wrap":
        numbers = np.mod(np.rint(ticks / rate * 1e6) + 2.0**32 - 1e6, 2.0**32)
        unit = "us"
    back = np.diff(numbers)[np.diff(numbers) < 0] if event == "wrap" else np.empty(0)
    wraps = back.size
    # A counter that ends in a hole of more than a thousandth of its span looks like a log joined to another.
    assume(wraps == 0 or back.max() + 2**32 < 4e6)
    found = read_stamps(numbers, unit)
    assert found.rate == pytest.approx(rate, rel=1e-4)
    assert (len(found.wraps), len(found.seams)) == (wraps, event == "join")
    gaps = dict(found.gaps)
    assert gaps.keys() == expected.keys()
    for row, count in expected.items():
        assert abs(gaps[row] - count) <= max(0, round(1e-4 * count)), (row, count, gaps[row])


@pytest.mark.parametrize(
    ("step", "words"), [(1.0 / 12.0, "12 Hz"), (7.0 / 365.25, "52.18 Hz"), (1.0, "1 Hz")]
)
def test_series_in_decimal_years_are_not_taken_for_seconds(step, words):
    """Monthly, weekly and yearly means of a tide gauge, whose times have no header."""
    years = 1953.5 + step * np.arange(60)
    with pytest.raises(al.InputError, match="decimal years") as caught:
        al.Recording(
            np.random.default_rng(1).standard_normal(60), time=np.round(years, 4), unit="1"
        )
    assert words in str(caught.value)


def test_a_unit_of_time_says_that_the_samples_are_a_phase(tmp_path):
    log = tmp_path / "phase.csv"
    log.write_text("t [s],x\n" + "".join(f"{k},{k % 7}.5\n" for k in range(50)))
    recording = al.read(log, unit="ns")
    assert recording.quantity == "angle"
    moving = tmp_path / "gyro.csv"
    moving.write_text("t [s],x [deg/s]\n" + "".join(f"{k},{k % 7}.5\n" for k in range(50)))
    with pytest.raises(al.InputError, match="deg/s"):
        al.read(moving, unit="s")
