"""Logs with random headers: roles, units and rate are recovered, or the program asks; no factor is invented."""

from __future__ import annotations

import numpy as np
import pytest

import allanite as al
from allanite.common.errors import InputError

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


@pytest.mark.parametrize("seed", range(60))
def test_random_headers(tmp_path, seed):
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([25, 50, 100, 200]))
    x = rng.standard_normal((N, 6))
    bracket = str(rng.choice(["[]", "()"]))
    columns: list[tuple[str, list[str]]] = []
    expected: dict[str, str | None] = {}
    for first, forms in ((0, SENSORS), (3, ACCELERATIONS)):
        name, unit, known = forms[rng.integers(len(forms))]
        for i, axis in enumerate("xyz"):
            title = name.format(a=axis, i=i)
            expected[title] = known
            columns.append(
                (_with_unit(title, unit, bracket), [f"{v:.6f}" for v in x[:, first + i]])
            )
    title, stamp = TIMES[rng.integers(len(TIMES))]
    columns.append((title, [stamp(k, rate) for k in range(N)]))
    for at in rng.permutation(len(OTHERS))[: rng.integers(1, 6)]:
        name, cell = OTHERS[at]
        columns.append((name, [cell(k, x[k, :3]) for k in range(N)]))
    # A triad stays together; where it stands among the others is random.
    blocks = [columns[0:3], columns[3:6], *([c] for c in columns[6:])]
    columns = [c for i in rng.permutation(len(blocks)) for c in blocks[i]]
    comma = bool(rng.integers(2))
    rows = [";".join(c[0] for c in columns) if comma else ",".join(c[0] for c in columns)]
    for k in range(N):
        cells = [c[1][k] for c in columns]
        dates = [cell.count("-") == 2 for cell in cells]
        if comma:
            cells = [
                cell if d else cell.replace(".", ",") for cell, d in zip(cells, dates, strict=True)
            ]
        rows.append((";" if comma else ",").join(cells))
    path = tmp_path / "log.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    try:
        r = al.read(path)
    except InputError as error:
        assert "give" in str(error) or "?" in str(error)  # noqa: PT017 - the program asks
        return
    found = {c.name: c for c in r.log_columns}
    assert set(r.columns) == set(expected)
    assert {name: found[name].unit for name in expected} == expected
    assert r.rate == pytest.approx(rate, rel=1e-3)
    assert all(c.scale == 1.0 for c in r.log_columns)
    for i, name in enumerate(r.columns):
        source = next(
            c for c in columns if c[0].split(" [")[0].split(" (")[0] == name or c[0] == name
        )
        np.testing.assert_array_equal(r.samples[:, i], [float(v) for v in source[1]], err_msg=name)
    one = al.read(path, column=r.columns[0])
    assert one.rate == r.rate
    seen = al.inspect(path)
    assert [c.name for c in seen.columns if c.used and c.role == "sensor"] == list(r.columns)
