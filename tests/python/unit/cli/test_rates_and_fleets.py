"""Logs of two rates in one table, few units of a fleet, lines that are one effect, and the rate of a plan."""

import csv
import json
import re

import numpy as np
import pytest

from generators import sinusoid, white

RATE, N = 20.0, 6000


def write(path, x, rate=RATE):
    np.savez(path, data=x, rate_hz=rate, unit="deg/s", channels=["gx"])
    return path


def test_compare_gives_ratios_with_intervals_at_the_common_averaging_times(run, tmp_path):
    rng = np.random.default_rng(1)
    slow = write(tmp_path / "slow.npz", white(rng, 4000, 7.0, 0.02), 7.0)
    fast = write(tmp_path / "fast.npz", white(rng, 40_000, 100.0, 0.01), 100.0)
    code, out, _ = run("compare", slow, fast)
    assert code == 0
    assert "slow.npz" in out
    found = re.findall(r"^ *([\d.]+) .* ([\d.]+) \(([\d.]+) … ([\d.]+)\)$", out, re.MULTILINE)
    taus, ratios, low, high = np.array(found, dtype=float).T
    assert len(taus) >= 6
    assert taus[0] == pytest.approx(1 / 7)
    assert np.all(low < ratios)
    assert np.all(ratios < high)
    # White noise of half the density: 19 of 20 intervals of ± 95 % have the true ratio; of ten, seven or more have it.
    assert np.count_nonzero((low < 0.5) & (high > 0.5)) >= 0.7 * len(taus)


@pytest.mark.long
def test_a_fleet_of_few_says_so_and_a_comb_is_one_effect(run, tmp_path):
    logs, table = tmp_path / "logs", tmp_path / "fleet.csv"
    logs.mkdir()
    rng = np.random.default_rng(6)
    comb = sum(sinusoid(N, RATE, 1.3 * m, a) for m, a in ((1, 0.01), (2, 0.006), (3, 0.006)))
    write(logs / "plain.npz", white(rng, N, RATE, 0.01))
    write(logs / "combed.npz", white(rng, N, RATE, 0.01) + comb)
    (logs / "broken.npz").write_bytes(b"no log")
    code, out, err = run("fleet", logs, "--out", table, "--model", "N", "--quiet")
    assert code == 0, err
    assert "too few units: a population needs 8 logs with the same axis, found 2 logs" in out
    with table.open(encoding="utf-8", newline="") as file:
        rows = {row["file"]: row for row in csv.DictReader(file)}
    assert rows.pop(str(logs / "broken.npz"))["status"] == "failed"
    found = {name.rpartition("/")[2]: json.loads(row["effects"]) for name, row in rows.items()}
    assert set(found["combed.npz"]) == {"sinusoid"}
    assert found["plain.npz"] == {}
    combed = next(row for name, row in rows.items() if name.endswith("combed.npz"))
    assert combed["model"].count("SIN") == 1


def test_a_plan_keeps_the_rate_of_its_model(run, tmp_path):
    log = write(tmp_path / "gyro.npz", white(np.random.default_rng(2), N, RATE, 0.01))
    model = tmp_path / "model.json"
    assert run("fit", log, "--model", "N", "--save", model, "--quiet")[0] == 0
    asked = ["plan", "--model", model, "--know", "N", "--to", "1%", "--json"]
    code, out, _ = run(*asked)
    assert code == 0
    found = json.loads(out)
    assert found["rate_hz"] == RATE
    # σ(N)/N = 1/√(2n): 1 % needs 5000 samples, 250 s.
    assert found["duration_s"] == pytest.approx(5000 / RATE, rel=0.05)
    # Another rate only if it is asked for.
    assert json.loads(run(*asked, "--rate", 100)[1])["rate_hz"] == 100.0


def test_compare_relates_the_same_columns_of_logs_of_one_name(run, tmp_path):
    rng = np.random.default_rng(2)
    logs = []
    for folder, size in (("old", 1.0), ("new", 2.0)):
        (tmp_path / folder).mkdir()
        logs.append(tmp_path / folder / "imu.csv")
        rows = size * rng.standard_normal((2000, 6)) * [1, 1, 1, 3, 3, 3]
        np.savetxt(
            logs[-1],
            rows,
            delimiter=",",
            header=",".join(f"g{x} [deg/s]" for x in "xyz")
            + ","
            + ",".join(f"a{x} [g]" for x in "xyz"),
            comments="",
        )
    code, out, _ = run("compare", *logs, "--rate", 100, "--anyway", "--quiet")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 100
    assert "[1] recording old/imu.csv gx\n" in out
    assert "[7] recording new/imu.csv gx\n" in out
    for first in range(1, 7):
        table = out.partition(f"[{first + 6}]/[{first}]")[2]
        assert float(table.splitlines()[1].split()[3]) == pytest.approx(2.0, rel=0.1)
