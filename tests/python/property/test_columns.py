"""Logs with random headers: roles, units and rate are recovered, or the program asks; no factor is invented."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import allanite as al

N = 240
#: (name of the axis a, unit in brackets, unit that must come out).
SENSORS = [
    ("gyro_{a}", "deg/s", "deg/s"),
    ("gyro_{a}", "", None),
    ("gyro[{i}]", "", None),
    ("gyro({a})", "", None),
    ("Gyroscope {a}", "rad/s", "rad/s"),
    ("w{a}", "°/s", "°/s"),
    ("6284.12345:gyro_{a}", "", None),
    ("angular_velocity.{a}", "rad/s", "rad/s"),
]
ACCELERATIONS = [
    ("acc_{a}", "m/s^2", "m/s^2"),
    ("acc_{a}", "", None),
    ("accelerometer[{i}]", "", None),
    ("a{a}", "g", "g"),
    ("alpha_{a}", "", None),
    ("linear_acceleration.{a}", "m/s²", "m/s²"),
]
#: (header, k and rate → cell); whether the header states the unit.
TIMES = [
    ("time [s]", lambda k, rate: f"{k / rate:.6f}"),
    ("timestamp_us", lambda k, rate: str(round(1e6 * k / rate))),
    ("time (ms)", lambda k, rate: f"{1e3 * k / rate:.3f}"),
    ("Time since start in ms", lambda k, rate: f"{1e3 * k / rate:.3f}"),
    ("timestamp [ns]", lambda k, rate: str(1_700_000_000_000_000_000 + round(1e9 * k / rate))),
    ("MJD", lambda k, rate: f"{60000 + k / rate / 86400:.12f}"),
    ("time", lambda k, rate: f"2024-05-03 12:00:{k / rate:09.6f}"),
    ("time [min]", lambda k, rate: f"{k / rate / 60:.9f}"),
]
OTHERS = [
    ("index", lambda k, _x: str(k)),
    ("packet_counter", lambda k, _x: str(k % 256)),
    ("serial", lambda _k, _x: "12345678"),
    ("device_id", lambda k, _x: str(17 + k % 2)),
    ("board", lambda k, _x: str(1 + k % 3)),
    ("Absolute [rad/s]", lambda _k, x: f"{np.linalg.norm(x):.6f}"),
    ("angular_velocity_covariance_0", lambda _k, _x: "0.0001"),
    ("date", lambda _k, _x: "2024-05-03"),
    ("state", lambda _k, _x: "idle"),
    ("mag_x [uT]", lambda _k, x: f"{20 + x[0]:.3f}"),
    ("roll [deg]", lambda _k, x: f"{10 * x[1]:.4f}"),
    ("status", lambda _k, _x: "0"),
]


def _with_unit(name: str, unit: str, bracket: str) -> str:
    return f"{name} {bracket[0]}{unit}{bracket[1]}" if unit else name


class Log:
    """Text of a log, its sensors with the unit that the header states, their cells, and the rate in Hz."""

    def __init__(self, text, stated, cells, rate):
        self.text, self.stated, self.cells, self.rate = text, stated, cells, rate

    def __repr__(self):
        return f"Log({self.text[:400]!r} …, rate={self.rate})"


@st.composite
def logs(draw):
    """Logs with random headers."""
    rate = draw(st.sampled_from([25.0, 50.0, 100.0, 200.0]))
    x = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).standard_normal((N, 6))
    bracket = draw(st.sampled_from(["[]", "()"]))
    blocks: list[list[tuple[str, list[str]]]] = []
    # One device; a bare alpha is Kalibr's accelerometer only beside no other name.
    prefix = draw(st.sampled_from(["", "", "imu0.", "6284.12345:", "left/"]))
    stated: dict[str, str | None] = {}
    cells: dict[str, list[str]] = {}
    for first, forms in ((0, SENSORS), (3, ACCELERATIONS)):
        name, unit, known = draw(
            st.sampled_from([form for form in forms if not (prefix and "alpha" in form[0])])
        )
        block = []
        for i, axis in enumerate(draw(st.sampled_from(["xyz", "XYZ"]))):
            title = prefix + name.format(a=axis, i=i)
            stated[title] = known
            cells[title] = [f"{v:.6f}" for v in x[:, first + i]]
            block.append((_with_unit(title, unit, bracket), cells[title]))
        blocks.append(block)
    title, stamp = draw(st.sampled_from(TIMES))
    blocks.append([(title, [stamp(k, rate) for k in range(N)])])
    for name, cell in draw(st.lists(st.sampled_from(OTHERS), unique_by=lambda o: o[0], max_size=6)):
        blocks.append([(name, [cell(k, x[k, :3]) for k in range(N)])])
    # A triad stays together; where it stands among the others is random.
    columns = [column for block in draw(st.permutations(blocks)) for column in block]
    comma = draw(st.booleans())
    separator = ";" if comma else draw(st.sampled_from([",", "\t", ";"]))
    rows = [separator.join(name for name, _ in columns)]
    for k in range(N):
        row = [column[k] for _, column in columns]
        rows.append(
            separator.join(c.replace(".", ",") if comma and c.count("-") < 2 else c for c in row)
        )
    end = draw(st.sampled_from(["\n", "\r\n"]))
    before = draw(st.sampled_from(["", "", "# exported by a logger" + end, "\ufeff"]))
    text = before + end.join(rows) + end
    return Log(text, stated, cells, rate)


@pytest.mark.slow
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(logs())
def test_random_headers(tmp_path, log):
    """The reader uses what the header states, or asks; it invents no factor."""
    stated = log.stated
    path = tmp_path / "log.csv"
    path.write_text(log.text, encoding="utf-8", newline="")
    try:
        r = al.read(path)
    except al.InputError as error:
        assert "give" in str(error) or "?" in str(error)  # noqa: PT017 - the program asks
        return
    found = {c.name: c for c in r.log_columns}
    assert set(r.columns) == set(stated)
    assert {name: found[name].unit for name in stated} == stated
    assert r.rate == pytest.approx(log.rate, rel=1e-3)
    assert all(c.scale == 1.0 for c in r.log_columns)
    for i, name in enumerate(r.columns):
        np.testing.assert_array_equal(
            r.samples[:, i], [float(v) for v in log.cells[name]], err_msg=name
        )
    one = al.read(path, column=r.columns[0])
    assert one.rate == r.rate
    seen = al.inspect(path)
    assert [c.name for c in seen.columns if c.used and c.role == "sensor"] == list(r.columns)
