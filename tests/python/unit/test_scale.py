"""Summaries by Dask, fleets, and the watch."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.scale import run_fleet
from allanite.scale.bets import Bets, ClippedPower, PowerBets, capital_share
from allanite.scale.journal import JOURNAL
from allanite.scale.logs import SearchOfKinds, study_columns, study_of_kinds
from allanite.scale.watch import DEFAULT_TOLERANCE, SEGMENT
from allanite.study import Rung
from command_line import started, until
from moving_records import hand

RATE = 100.0


def same(ours, theirs, rounding=0.0):
    for one, other in zip(ours, theirs, strict=True):
        a, b = one.reading(), other.reading()
        assert np.array_equal(a.samples, b.samples)
        for x, y in zip(a.octaves, b.octaves, strict=True):
            assert np.array_equal(x.power.value, y.power.value)
        curve, expected = one.oadev().deviation, other.oadev().deviation
        assert np.max(np.abs(curve / expected - 1.0)) <= rounding


@pytest.fixture(scope="module")
def array():
    da = pytest.importorskip("dask.array")
    # Whole numbers: of them the Allan curve too is exact, whatever the tree.
    x = np.round(np.random.default_rng(1).standard_normal((700_000, 2)) * 100.0)
    return x, da.from_array(x, chunks=(90_001, 1))


@pytest.mark.parametrize("scheduler", ["synchronous", "threads"])
def test_dask_changes_no_bit(array, scheduler):
    import dask

    x, chunks = array
    with dask.config.set(scheduler=scheduler):
        found = al.scale.summarize(chunks, rate=RATE, columns=["a", "b"])
    assert found.n == 700_000
    same(found, al.summarize(x, rate=RATE, columns=["a", "b"]))


CLUSTER = """
import os, signal, sys, threading, time
import numpy as np, dask.array as da
from dask.distributed import Client, LocalCluster
import allanite as al
if __name__ == "__main__":
    x = np.load(sys.argv[1])
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster.scheduler_address) as client:
            pids = list(client.run(os.getpid).values())
            threading.Timer(0.3, lambda: os.kill(pids[0], signal.SIGKILL)).start()
            s = al.scale.summarize(da.from_array(x, chunks=20_000), rate=100.0, client=client)
            s.save(sys.argv[2])
"""


@pytest.mark.statistical
def test_a_worker_killed_changes_nothing(array, tmp_path):
    pytest.importorskip("distributed")
    x = np.ascontiguousarray(array[0][:, 0])
    np.save(tmp_path / "x.npy", x)
    (tmp_path / "run.py").write_text(CLUSTER)
    arguments = [sys.executable, "run.py", "x.npy", "s.summary"]
    subprocess.run(arguments, cwd=tmp_path, check=True, capture_output=True, timeout=120)
    same(al.Summary.load(tmp_path / "s.summary"), al.summarize(x, rate=RATE))


def test_a_broken_log_is_reported(tmp_path):
    pytest.importorskip("dask")
    good, bad = tmp_path / "good.npy", tmp_path / "bad.npy"
    np.save(good, np.random.default_rng(2).standard_normal(1000))
    bad.write_bytes(b"\x93NUMPY damaged")
    found = al.scale.summarize([good, bad], rate=RATE)
    assert found[good].n == 1000
    assert list(found.failed) == [str(bad)]
    assert "bad.npy" in found.failed[str(bad)]
    with pytest.raises(al.InputError, match="no logs"):
        al.scale.summarize([])


# -- fleets ----------------------------------------------------------------------------------------


def write_log(path, seed, effect=""):
    model = al.parse_model(f"N(N=0.01)+K(K=0.001){effect}")
    r = model.simulate(rate=20.0, duration=50.0, seed=seed)
    np.savetxt(path, np.asarray(r.samples), header="gx", comments="")


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for seed in range(3):
        write_log(folder / f"unit{seed}.csv", seed)
    (folder / "unit3.csv").write_text("gx\nno number\n")
    return folder


@pytest.mark.long
def test_a_fleet_is_resumed_by_content(logs, tmp_path):
    out, done = tmp_path / "fleet.parquet", []
    run = lambda: run_fleet(  # noqa: E731
        logs, out, rate=20.0, on_done=lambda i, n, path: done.append(path)
    )
    rows = run()
    assert len(done) == 4
    assert [row["status"] for row in rows] == ["done", "done", "done", "failed"]
    # As after a kill: the last line of the journal is cut. A log that failed is tried again.
    journal = out.with_name(out.name + JOURNAL)
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:20])
    done.clear()
    with pytest.warns(UserWarning, match="line 3 is truncated"):
        again = run()
    assert len(done) == 2
    # What followed the cut line is not lost with it.
    done.clear()
    with pytest.warns(UserWarning, match="line 3 is truncated"):
        assert run() == again
    assert [Path(path).name for path in done] == ["unit3.csv"]
    assert [row["file"] for row in again] == [row["file"] for row in rows]
    assert al.fleet(out).files == 4
    assert list(al.fleet(out).failed)


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="processes of Linux")
def test_a_fleet_that_was_killed_goes_on_and_leaves_no_process(tmp_path):
    folder, out = tmp_path / "logs", tmp_path / "fleet.csv"
    folder.mkdir()
    for seed in range(8):
        write_log(folder / f"unit{seed}.csv", seed)
    journal = out.with_name(out.name + JOURNAL)
    lines = lambda: journal.read_text().count("\n") if journal.is_file() else 0  # noqa: E731
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with started("fleet", folder, "--out", out, "--rate", 20, **quiet) as process:
        until(lambda: lines() >= 2)
        tasks = Path(f"/proc/{process.pid}/task")
        children = [pid for at in tasks.iterdir() for pid in (at / "children").read_text().split()]
        process.send_signal(signal.SIGKILL)
        process.wait(60)
    # What is left of a process that ended may stand there until somebody asks for it.
    stopped = lambda pid: not (at := Path(f"/proc/{pid}/stat")).is_file() or " Z " in at.read_text()  # noqa: E731
    until(lambda: all(stopped(pid) for pid in children))
    before, again = lines(), []
    rows = run_fleet(folder, out, rate=20.0, on_done=lambda i, n, path: again.append(path))
    # Nothing that was in the journal is done again, and nothing is missing.
    assert len(again) == 8 - before
    assert len({row["file"] for row in rows}) == 8


def unit(name, n, effects=None, column="gx"):
    numbers = {"N": [n, 0.98 * n, 1.02 * n, 0.01 * n], "mean": [0.1, None, None, None]}
    return {
        "file": name,
        "column": column,
        "status": "done",
        "numbers": json.dumps(numbers),
        "effects": json.dumps(effects or {}),
        "remarks": "",
    }


def test_units_that_deviate_are_named_and_by_what():
    rng = np.random.default_rng(3)
    rows = [unit(f"u{i}", 0.01 * np.exp(0.05 * rng.standard_normal())) for i in range(200)]
    rows += [unit("loud", 0.02), unit("buzzing", 0.01, {"sinusoid": 1e-9})]
    # One false addition among 200 ladders is what 1 % a ladder gives: not a deviating unit.
    rows += [unit("chance", 0.01, {"resonance": 8e-3})]
    found = al.fleet(rows)
    assert {(d.file, d.by) for d in found.deviating} == {("loud", "N"), ("buzzing", "sinusoid")}
    n = found["gx.N"]
    assert n.median == pytest.approx(0.01, rel=0.02)
    # 5 % spread, known to 1/√(2·200)·1.6 by its median: 8 %; three of these.
    assert n.spread == pytest.approx(0.05, rel=0.25)
    assert n.maximum is not None
    assert n.maximum > 0.0105
    said = str(found)
    assert "buzzing, gx: sinusoid" in said
    # A number by its ratio to the median, N first.
    assert re.search(r"loud, gx: N × [\d.]+ \(p = ", said)
    assert said.index("loud, gx: N") < said.index("buzzing, gx: sinusoid")
    names = [line.split()[1] for line in said.splitlines() if line.startswith("gx ")]
    assert names[0] == "N"
    assert "too few" not in said
    few = [{"file": f"{k}.csv", "column": "gx", "status": "done", "effects": "{}",
            "numbers": json.dumps({"N": [0.01, None, None, 1e-5]})} for k in range(3)]  # fmt: skip
    assert "too few units: a population needs 8 logs with the same axis, found 3" in str(
        al.fleet(few)
    )


def test_an_effect_of_all_of_a_few_units_is_no_deviation():
    line = {"sinusoid": 1e-9}
    assert al.fleet([unit(f"u{i}", 0.01, line) for i in range(3)]).deviating == ()
    found = al.fleet([unit("u0", 0.01), unit("u1", 0.01), unit("u2", 0.01, line)])
    assert [d.file for d in found.deviating] == ["u2"]
    assert al.fleet([unit("u0", 0.01, line)]).deviating == ()


def test_a_number_that_most_units_do_not_have_names_nobody():
    # Of most units B is 0, without a width: 0/0 was no chance at all, and put every unit among the deviating.
    rng = np.random.default_rng(5)
    rows = [unit(f"u{i}", 0.01 * np.exp(0.05 * rng.standard_normal())) for i in range(60)]
    for i, row in enumerate(rows):
        b = [0.001 + 5e-5 * i if i < 20 else 0.0, 0.0, 0.004, None]
        row["numbers"] = json.dumps(json.loads(row["numbers"]) | {"B": b})
    assert al.fleet(rows).deviating == ()


def test_an_effect_of_a_wide_search_must_be_as_much_clearer():
    # A burst of a tone may be anywhere and of any length: a hundred million tests. Noise gives 24 in logL as well.
    fit = al.parse_model("N").fit(
        al.parse_model("N(N=1)").simulate(rate=10.0, duration=60.0, seed=1)
    )
    found = [
        al.Study(
            fit.recording,
            (Rung(fit), Rung(fit, fit.model.effects[0], risen=24.0, trials=trials)),
            fit.check(),
            "adequate",
        )
        for trials in (None, 1e10)
    ]
    few, many = (
        json.loads(study_columns(study)["effects"])["angle_random_walk"] for study in found
    )
    assert few < 1e-6
    assert many == pytest.approx(1e7 * few)


def test_the_clearest_of_several_effects_of_a_kind_counts():
    fit = al.parse_model("N").fit(
        al.parse_model("N(N=1)").simulate(rate=10.0, duration=60.0, seed=1)
    )
    rungs = [Rung(fit, fit.model.effects[0], risen=risen) for risen in (40.0, 8.0)]

    def effect(*steps):
        """P-value of the effect in the row of a study."""
        study = al.Study(fit.recording, (Rung(fit), *steps), fit.check(), "adequate")
        return json.loads(study_columns(study)["effects"])["angle_random_walk"]

    assert effect(*rungs) == effect(rungs[0]) < 1e-9 < effect(rungs[1])


def test_an_effect_explains_what_the_effects_explained_whose_place_it_takes():
    log = al.parse_model("N(N=0.1)+B(B=0.1)").simulate(rate=10.0, duration=600.0, seed=1)
    fits = {model: al.fit_model(log, model) for model in ("N", "N+K", "N+B", "N+B+SIN(f=1)")}

    def effects(*steps):
        """Dict from kind to p-value in the row of a study."""
        study = al.Study(log, (Rung(fits["N"]), *steps), fits["N+B"].check(), "adequate")
        return json.loads(study_columns(study)["effects"])

    walk, flicker = fits["N+K"].model.effects[1], fits["N+B"].model.effects[1]
    whole = fits["N+B"].solution.log_likelihood - fits["N"].solution.log_likelihood
    # The ΔlogL of a step without one is the difference of its fits.
    alone = effects(Rung(fits["N+B"], flicker))
    assert alone == effects(Rung(fits["N+B"], flicker, risen=whole)) != {}
    taken = effects(
        Rung(fits["N+K"], walk), Rung(fits["N+B"], flicker, removed=("rate_random_walk",))
    )
    assert taken == pytest.approx(alone, rel=1e-6)
    # An effect that a step brings along counts with its own part of the ΔlogL.
    both = fits["N+B+SIN(f=1)"]
    brought = effects(Rung(both, both.model.effects[1], brought=both.model.effects[2:]))
    assert brought["sinusoid"] == 1.0 > brought["bias_instability"]


def test_a_row_of_a_fleet_needs_no_fit_of_steps_for_readers(monkeypatch):
    monkeypatch.setattr("allanite.study.search.story", None)
    log = al.parse_model("N(N=0.1)+K(K=0.02)").simulate(rate=10.0, duration=600.0, seed=1)
    assert study_of_kinds(log, "N").fit.model.name == "N+K"


def test_a_fleet_adds_the_lines_of_one_check():
    lines = "SIN(f=1.3,A=0.03,phase=1)+SIN(f=3.1,A=0.03,phase=2)"
    log = al.parse_model(f"N(N=0.01)+{lines}").simulate(rate=20.0, duration=400.0, seed=1)
    study = study_of_kinds(log, "N")
    assert [effect.short for effect in study.fit.model] == ["N", "SIN", "SIN"]
    assert study.adequate
    # A later check finds the second line; its kind is known.
    search = SearchOfKinds([Rung(al.fit_model(log, "N+SIN(f=1.3)"))], 8, None, np.inf)
    stop = search.run()
    assert [s.effect.short for s in search.check.significant] == ["SIN"]
    assert len(search.ladder) == 1
    assert stop == "nothing helps"
    assert not search.study(stop).adequate


def test_the_spread_of_records_is_not_that_of_units():
    rng = np.random.default_rng(4)
    rows = [unit(f"u{i}", 0.01 * np.exp(0.01 * rng.standard_normal())) for i in range(300)]
    assert al.fleet(rows)["gx.N"].spread < 0.005


# -- watch -----------------------------------------------------------------------------------------

MODEL = "N(N=0.01)+K(K=0.001)"


def watched(watch, samples, size=5000):
    for at in range(0, samples.size, size):
        alarm = watch.update(samples[at : at + size])
        if alarm is not None:
            return alarm
    return None


def test_shares_of_all_starts_are_one_capital():
    shares = np.array([capital_share(k) for k in range(1, 100_000)])
    assert (shares > 0.0).all()
    assert shares.sum() < 1.0


def shape_e_values(bets, power, draws, seed):
    """E-values of the shape bets if the ordinates of normal scores have these expected squares; shape (draws, bets)."""
    z = np.random.default_rng(seed).standard_normal((draws, power.size)) ** 2
    total = np.cumsum(power * bets._used * z, axis=1)
    return np.exp(bets.gains(np.insert(total, 0, 0.0, axis=1)))


def test_no_shape_bet_gains_on_a_spectrum_within_the_tolerance():
    # Sixteen samples: few enough to draw the largest e-values often.
    bets = Bets(al.parse_model("N(N=0.1)"), RATE, 16, 0.05, lines=False)
    ends = np.array([0.95, 1.05]) ** 2
    spectra = [np.ones(15), np.repeat(ends, [7, 8]), np.repeat(ends[::-1], [7, 8])]
    for seed, power in enumerate(spectra):
        values = shape_e_values(bets, power, 8000, seed)
        error = values.std(axis=0) / np.sqrt(len(values))
        assert (values.mean(axis=0) < 1.0 + 4.0 * error + 1e-9).all()
    assert shape_e_values(bets, np.repeat([1.0, 9.0], [7, 8]), 1000, 9).mean(axis=0).max() > 3.0
    for lines in (False, True):
        weights = Bets(al.parse_model(MODEL), RATE, SEGMENT, 0.01, lines=lines).weights
        assert np.exp(weights).sum() == pytest.approx(1.0, rel=1e-12)


#: Samples of variance 1.
DISTRIBUTIONS = {
    "normal": lambda rng, n: rng.standard_normal(n),
    "laplace": lambda rng, n: rng.laplace(size=n) / np.sqrt(2.0),
    "t6": lambda rng, n: rng.standard_t(6, n) / np.sqrt(1.5),
    "t4": lambda rng, n: rng.standard_t(4, n) / np.sqrt(2.0),
    "two values": lambda rng, n: rng.choice([-1.0, 1.0], n),
    "rare": lambda rng, n: rng.choice([-10.0, 0.0, 10.0], n, p=[0.005, 0.99, 0.005]),
}


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_no_power_bet_gains_whatever_the_distribution(name):
    levels = np.array([0.25, 0.7, 0.9, 0.95, 1.05, 1.2, 2.0, 4.0])
    bets, clipped = PowerBets(levels, DEFAULT_TOLERANCE), ClippedPower()
    rng = np.random.default_rng(11)
    assert (bets.gains(np.ones(100), clipped.bound())[:4] == 0.0).all()  # nothing is known yet
    clipped.update(DISTRIBUTIONS[name](rng, 20_000))
    # Factors of single samples: the mean of their product over independent samples is the product of their means.
    x, bound = DISTRIBUTIONS[name](rng, 2000), clipped.bound()
    factors = np.array([np.exp(bets.gains(one[None], bound)) for one in x])
    error = factors.std(axis=0) / np.sqrt(x.size)
    assert (factors.mean(axis=0) <= 1.0 + 3.0 * error).all()


def test_clipped_power_is_bounded_by_what_was_seen():
    rng = np.random.default_rng(12)
    for name, true in (("normal", 0.005), ("t4", 0.125)):
        clipped = ClippedPower()
        assert clipped.bound() == np.inf
        bounds = []
        for _ in range(100):
            clipped.update(DISTRIBUTIONS[name](rng, SEGMENT))
            bounds.append(clipped.bound())
        assert min(bounds) > true
        assert bounds[-1] < 1.5 * true + 0.005


def test_no_alarm_under_the_model_and_one_beyond_it():
    model = al.parse_model(MODEL)
    quiet = model.simulate(rate=RATE, duration=2000.0, seed=5).samples
    watch = al.Watch(model, RATE)
    assert watched(watch, quiet) is None
    louder = al.parse_model("N(N=0.011)+K(K=0.001)").simulate(rate=RATE, duration=200.0, seed=6)
    alarm = watched(watch, np.asarray(louder.samples))
    assert alarm is not None
    # 10 % are 8 nats a segment of 10 s: two or three of them, and one that straddles the change.
    assert 2000.0 <= alarm.time_s < 2060.0
    assert alarm.since_s == pytest.approx(2000.0, abs=11.0)
    # The clearest bet is on more power below 12.5 Hz: a quarter of the ordinates of three segments.
    assert alarm.ratio == pytest.approx(1.21, rel=0.15)
    assert watch.summary.n == watch.taken


def test_a_line_and_a_lag_are_found():
    for effect, low in (("SIN(frequency=20,amplitude=0.05)", 19.0), ("GM(q_c=0.02,T=1)", 0.0)):
        model = al.parse_model(MODEL)
        watch = al.Watch(model, RATE)
        x = al.parse_model(f"{MODEL}+{effect}").simulate(rate=RATE, duration=600.0, seed=7)
        alarm = watched(watch, np.asarray(x.samples))
        assert alarm is not None
        assert alarm.low_hz >= low
        assert alarm.ratio > 1.2


@pytest.mark.slow
def test_a_watch_survives_a_restart(tmp_path):
    model = al.parse_model(MODEL)
    x = np.asarray(model.simulate(rate=RATE, duration=300.0, seed=8).samples)
    whole, first = al.Watch(model, RATE), al.Watch(model, RATE)
    whole.update(x)
    first.update(x[:12_345])
    first.save(tmp_path / "state")
    second = al.Watch(model, RATE)
    second.restore(tmp_path / "state")
    second.update(x[12_345:])
    assert second.to_dict() == whole.to_dict()
    # The curve's sums are of differences about another origin after a restart.
    same(second.summary, whole.summary, rounding=1e-12)
    # Killed between the two files, the summary was of more samples than the state: they are not counted twice.
    first.update(x[12_345:20_000])
    first.summary.save(tmp_path / "state.summary")
    third = al.Watch(model, RATE)
    third.restore(tmp_path / "state")
    for piece in (x[12_345:15_000], x[15_000:]):
        third.update(piece)
    same(third.summary, whole.summary, rounding=1e-12)
    # Without its summary a watch goes on, and begins another there.
    (tmp_path / "state.summary").unlink()
    third.restore(tmp_path / "state")
    third.update(x[12_345:])
    assert (third.summary.start, third.summary.n) == (12_345, x.size - 12_345)
    # What a version before has written is refused, and damage too, in one line.
    state = (tmp_path / "state").read_text()
    for text, told in (
        (state.replace("state/3", "state/2"), "state/2"),
        (state[:-9], "not a JSON file"),
    ):
        (tmp_path / "old").write_text(text)
        with pytest.raises(al.InputError, match=told) as raised:
            second.restore(tmp_path / "old")
        assert "\n" not in str(raised.value)
    with pytest.raises(al.InputError, match="saved for model"):
        al.Watch(al.parse_model("N(N=1)"), RATE).restore(tmp_path / "state")
    with pytest.raises(al.InputError, match="has no value"):
        al.Watch(al.parse_model("N"), RATE)


def run(*arguments, **options):
    code = "from allanite.cli import main; main()"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)


@pytest.mark.long
def test_watch_from_the_command_line(tmp_path):
    model = al.parse_model(MODEL)
    x = np.asarray(model.simulate(rate=RATE, duration=100.0, seed=9).samples)
    log = tmp_path / "log.csv"
    np.savetxt(log, x, header="gx", comments="")
    options = ["--model", MODEL, "--rate", "100", "--state", "s", "--prometheus", "p.prom"]
    for samples in (10_000, 20_000):
        done = run("watch", str(log), *options, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout.splitlines()[-1])["samples"] == samples
        with log.open("a") as file:
            np.savetxt(file, x)
    assert "allanite_model_holds 1" in (tmp_path / "p.prom").read_text()
    assert run("watch", "udp://10.0.0.1:99", *options).returncode == 2


def test_watch_of_datagrams():
    from allanite.cli.first_rows import WatchedColumn
    from allanite.cli.live_source import Stop, samples_of_source

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    found, stop = [], Stop()
    rows = samples_of_source(f"udp://127.0.0.1:{port}", lambda _: WatchedColumn(1), stop)
    reader = threading.Thread(target=lambda: found.extend(some.samples for some in rows))
    reader.start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        refused = True
        while refused:
            sender.send(b"0.1,0.5\n0.2,0.6\n")
            reader.join(0.05)
            refused = sender.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) != 0
        sender.send(b"end")
        reader.join(30.0)
    assert np.concatenate(found)[:2].tolist() == [0.5, 0.6]
    assert SEGMENT == 1024


def test_one_log_is_a_fleet_of_one(tmp_path):
    """A log is no list of logs, although both are text."""
    from allanite.scale.logs import logs_of

    log, names = tmp_path / "a.csv", tmp_path / "names.txt"
    log.write_text("x\n0.1\n0.2\n")
    names.write_text("a.csv\n\ngone.csv\n")
    assert logs_of(log) == [log]
    assert logs_of(names) == [log, tmp_path / "gone.csv"]


@pytest.mark.slow
def test_logs_in_motion_have_a_row_with_the_reason(tmp_path):
    moving = hand(1, rate=50, seconds=120, only=("gyro_x",))
    np.savetxt(tmp_path / "moving.csv", moving.samples, header="gx [deg/s]", comments="")
    x = np.random.default_rng(1).standard_normal(3000) * 0.1
    np.savetxt(tmp_path / "still.csv", x, header="gx [deg/s]", comments="")
    rows = run_fleet(tmp_path, tmp_path / "table.csv", rate=50, model="N")
    reasons = {row["file"].rsplit("/", 1)[-1]: (row["status"], row["remarks"]) for row in rows}
    assert reasons["still.csv"][0] == "done"
    assert reasons["moving.csv"][0] == "failed"
    assert "not at rest" in reasons["moving.csv"][1]


def test_the_former_spelling_of_summarize_warns():
    with pytest.warns(DeprecationWarning, match=r"al\.scale\.summarize"):
        assert al.scale.summarise is al.scale.summarize
