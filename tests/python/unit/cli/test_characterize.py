"""allanite characterize."""

import os
import signal
import time

import numpy as np
import pytest

import allanite as al
from allanite.exports import TARGETS
from command_line import refused, started, strict
from six_axes import NAMES, six_axes, write_csv


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    log = six_axes(2000)
    path = tmp_path_factory.mktemp("six") / "six.csv"
    warm = 20 + np.arange(log.n) * 1e-3
    return write_csv(log, path, temperature=warm)


@pytest.mark.long
def test_one_command_gives_table_figure_report_models_and_exports(run, six, tmp_path):
    made = {name: tmp_path / name for name in ("six.svg", "six.html", "six.json", "imu.yaml")}
    plot, report, save, kalibr = made.values()
    code, out, err = run(
        "characterize", six, "--plot", plot, "--report", report, "--save", save,
        "--export", "kalibr", "--output", kalibr,
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines()[:-1])) <= 100
    assert all(name in out for name in NAMES)
    assert "logged column temperature" in out
    assert all(path.stat().st_size > 300 for path in made.values())
    assert "gyroscope_noise_density" in kalibr.read_text()
    # What was saved is read as any file of models is.
    code, out, _ = run("export", save, "--format", "kalibr")
    assert code == 0
    assert out.count("# gyro_") == 3
    code, out, err = run("characterize", six, "--export", "all", "--output", tmp_path / "all")
    assert code == 0
    files = {p.name for p in (tmp_path / "all").iterdir() if p.is_file()}
    others = {"models.json", "axes.svg", "report.html"}
    assert files == {target.file_name for target in TARGETS.values()} | others
    folders = {p.name for p in (tmp_path / "all").iterdir() if p.is_dir()}
    assert folders == set(NAMES)


@pytest.mark.long
def test_json_is_the_contract(run, six):
    code, out, err = run("characterize", six, "--json")
    document = strict(out)
    assert (code, err) == (0, "")
    assert document["schema"] == "allanite/characterize/1"
    assert [d["schema"] for d in document["columns"]] == ["allanite/improve/2"] * 6
    assert set(document) == {"schema", "version", "columns", "failed", "common", "samples"}


@pytest.mark.long
def test_a_stuck_axis_is_a_remark(run, tmp_path):
    log = six_axes(3000)
    samples = log.samples.copy()
    samples[:, 4] = 9.8
    stuck = al.Recording(samples, 100, unit=log.units, columns=log.columns)
    path = write_csv(stuck, tmp_path / "stuck.csv")
    code, out, _ = run("characterize", path)
    assert code == 0
    assert "acc_y: not characterized" in out


def test_what_cannot_be_written_is_refused_first(run, six, tmp_path):
    refused(run("characterize", six, "--export", "kalibr"), 2, "--output")
    refused(run("characterize", six, "--output", "x"), 2, "--export", "/ at its end")
    refused(run("characterize", six, "--report", "x.pdf"), 2, ".html")
    (tmp_path / "file").write_text("")
    under = tmp_path / "file" / "below"
    refused(run("characterize", six, "--export", "all", "--output", under), 2, "cannot be created")
    refused(run("characterize", six, "--time", "soon"), 2, "'soon' is not a time: write 60s")
    refused(run("characterize", six, "--time", "-1s"), 2, "is not a time")
    refused(run("characterize", six, "--steps", "0"), 2, "--steps")
    refused(run("characterize", six, "--plot", tmp_path / "no" / "x.svg"), 2, "does not exist")


@pytest.mark.long
def test_several_columns_in_every_command(run, six, tmp_path):
    two = ("--column", "gyro_x", "--column", "acc_x")
    models = tmp_path / "two.json"
    code, out, err = run("fit", six, *two, "--model", "N", "--save", models)
    assert (code, err) == (0, "")
    saved = strict(models.read_text())
    assert [d["recording"]["column"] for d in saved["columns"]] == ["gyro_x", "acc_x"]
    code, out, _ = run("export", models, "--format", "kalibr", "--column", "acc_x")
    assert code == 0
    assert "gyroscope_noise_density: " not in out.replace("# gyroscope", "")
    refused(run("export", models, "--column", "acc_y"), 2, "acc_y", "gyro_x")
    figure = tmp_path / "two.svg"
    assert run("adev", six, *two, "--plot", figure)[0] == 0
    assert [p.name for p in tmp_path.glob("*.svg")] == ["two.svg"]
    ladder = tmp_path / "ladder.json"
    code, out, _ = run("improve", six, *two, "--model", "N", "--save", ladder, "--json")
    assert code == 0
    assert [d["schema"] for d in strict(out)["columns"]] == ["allanite/improve/2"] * 2
    assert len(strict(ladder.read_text())["columns"]) == 2
    # A ladder goes on where that of the same column ended.
    ended = [d["ladder"][-1]["model"] for d in strict(out)["columns"]]
    assert ended[0] != ended[1]
    code, out, _ = run("improve", six, *two, "--model", ladder, "--json")
    assert code == 0
    assert [d["ladder"][0]["model"] for d in strict(out)["columns"]] == ended
    refused(run("improve", six, "--column", "acc_y", "--model", ladder), 2, "acc_y", "gyro_x")
    for command in ("check", "adev", "report"):
        code, out, _ = run(
            command, six, *two, "--json", *(() if command == "adev" else ("--model", "N"))
        )
        assert code == 0
        assert [d["recording"]["column"] for d in strict(out)["columns"]] == ["gyro_x", "acc_x"]


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_ends_it_at_once(tmp_path):
    # Long enough that the first steps of both columns take seconds.
    path = tmp_path / "long.npy"
    np.save(path, np.random.default_rng(1).standard_normal((400_000, 2)))
    code = (
        "import os, allanite.axes.run as r; inner = r.improve\n"
        "def told(*a, **k):\n    os.write(1, b'begun')\n    return inner(*a, **k)\n"
        "r.improve = told\nfrom allanite.cli import main; main()"
    )
    with started("characterize", path, "--rate", "100", "--unit", "deg/s", code=code) as process:
        assert process.stdout.read(5) == b"begun"
        before = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        # A second, and what a busy machine adds.
        assert time.monotonic() - before < 10
    assert process.returncode == 130
    assert err.decode().strip().endswith("interrupted")


@pytest.mark.parametrize("target", ["kalibr", "all"])
def test_columns_without_a_unit_are_refused_before_anything_is_computed(run, tmp_path, target):
    path = tmp_path / "log.csv"
    rows = "".join(f"{k / 100},{k % 7},{k % 5},{k % 3}\n" for k in range(200))
    path.write_text("time [s],GyrX,GyrY,AccX\n" + rows)
    output = tmp_path if target == "all" else tmp_path / "imu.yaml"
    given = run("characterize", path, "--export", target, "--output", output)
    refused(given, 2, "GyrX, GyrY, AccX have no unit", "add --unit deg/s,m/s^2")


def test_what_a_target_has_no_place_for_is_refused_at_once(run, log, tmp_path):
    given = run("characterize", log, "--export", "kfgins", "--output", tmp_path / "k.yaml")
    refused(given, 2, "kfgins needs models of both a gyroscope and an accelerometer")


@pytest.fixture
def two(tmp_path):
    """A log of two axes, one of which has a line."""
    t = np.arange(1000) / 10
    x = np.random.default_rng(3).standard_normal((t.size, 2))
    x[:, 1] += np.sin(2 * np.pi * 1.3 * t)
    path = tmp_path / "two.npz"
    np.savez(path, data=x, rate_hz=10.0, channels=["gx", "gy"], unit="deg/s")
    return path


@pytest.fixture
def one_at_a_time(monkeypatch):
    """Compute columns one after the other on every machine."""
    monkeypatch.setattr("allanite.common.threads.WORKERS", 1)


@pytest.mark.long
@pytest.mark.usefixtures("one_at_a_time")
def test_an_interrupt_loses_only_the_current_axis(run, two, tmp_path, monkeypatch):
    from allanite.cli import run_folder

    folder = tmp_path / "out"
    words = ("characterize", two, "--export", "kalibr", "--output", f"{folder}/")
    inner = run_folder.RunFolder.write

    def interrupted(self, study):
        if study.recording.columns == ("gy",):
            raise KeyboardInterrupt
        inner(self, study)

    with monkeypatch.context() as patch:
        patch.setattr(run_folder.RunFolder, "write", interrupted)
        code, out, err = run(*words)
    assert (code, out) == (130, "")
    assert "finished axes gx; run the same command again" in err
    kept = {path.name for path in (folder / "gx").iterdir()}
    assert kept == {"model.json", "table.txt", "kalibr.yaml", "input.sha256"}
    assert "gyroscope_noise_density" in (folder / "gx" / "kalibr.yaml").read_text()
    assert not (folder / "gy").exists()

    code, out, err = run(*words)
    assert code == 0
    assert err.count("continuing from") == 1
    assert "gx: continuing from" in err
    assert {path.name for path in folder.iterdir()} == {
        "gx", "gy", "models.json", "kalibr.yaml", "axes.svg", "report.html"
    }  # fmt: skip
    # The same numbers as without an interrupt.
    other = tmp_path / "whole"
    code, whole, _ = run("characterize", two, "--export", "kalibr", "--output", f"{other}/")
    assert code == 0
    assert out.split("written:")[0] == whole.split("written:")[0]
    given = [(path / "kalibr.yaml").read_text() for path in (folder, other)]
    assert given[0] == given[1]


@pytest.mark.long
@pytest.mark.usefixtures("one_at_a_time")
def test_what_was_not_examined_is_said_and_continued(run, two, tmp_path):
    folder = tmp_path / "out"
    words = ("characterize", two, "--model", "N", "--output", f"{folder}/")
    code, out, _ = run(*words, "--time", "0.001s", "--column", "gy")
    assert code == 0
    said = "gy: the time limit was reached after 0 steps; further effects were not examined"
    assert said in " ".join(out.split())
    document = strict((folder / "gy" / "model.json").read_text())
    assert document["stopped_because"] == "time"
    # More time: it goes on from the first model. Another log, another unit or a damaged file: it begins again.
    code, out, err = run(*words, "--column", "gy")
    assert code == 0
    assert "gy: continuing from" in err
    assert "not examined" not in out
    assert "N+SIN" in out
    assert "continuing" not in run(*words, "--column", "gx")[2]
    assert "continuing" not in run(*words, "--column", "gy", "--tolerance", "5")[2]
    (folder / "gy" / "model.json").write_text("{")
    assert "continuing" not in run(*words, "--column", "gy")[2]


@pytest.mark.long
def test_a_limit_of_steps_is_said(run, tmp_path):
    truth = al.parse_model("N(N=0.1)+GM(q_c=0.1,T=5)+EXC(start=100,end=140,height=2)")
    x = truth.simulate(n=6000, rate=20, seed=2, unit="deg/s").samples
    path = tmp_path / "one.npz"
    np.savez(path, data=x, rate_hz=20.0, channels=["gx"], unit="deg/s")
    code, out, _ = run("characterize", path, "--model", "N", "--steps", "1")
    assert code == 0
    said = "the limit of steps was reached after 1 step; further effects were not examined"
    assert said in " ".join(out.split())
