"""A fleet goes on whatever a log does to its process, and never repeats finished work or reuses that of other options."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import allanite as al
from allanite.scale import run_fleet
from allanite.scale.journal import JOURNAL, Journal, read_journal
from allanite.scale.log_process import journal_key
from allanite.scale.logs import child_setup, logs_of, logs_without_table, write_table
from allanite.scale.population import read_table
from command_line import spent, started, until

#: Samples of a log: a ladder of so short a record takes 0.15 s of processor time.
N = 48

#: Python runs this when it starts. In the processes of a fleet it makes logs of some names do what damaged logs did.
FAULTS = """
import os, pathlib, signal, sys, time
if "allanite.scale.log_process" in " ".join(sys.orig_argv):
    import numpy as np
    from allanite import readers
    def read(path, *options, original=readers.read, **more):
        name = pathlib.Path(path).stem
        if name == "crashes":
            os.kill(os.getpid(), signal.SIGSEGV)
        if name == "exits":
            os._exit(3)
        if name == "hangs":
            time.sleep(1000.0)
        if name == "large":
            np.ones(400_000_000)
        found = original(path, *options, **more)
        if name == "rotated":
            new = pathlib.Path(path).with_suffix(".new")
            new.write_text("gx\\n" + "1\\n2\\n" * 40)
            new.replace(path)
        return found
    readers.read = read
"""


@pytest.fixture
def faults(tmp_path, monkeypatch):
    """Processes started from here on have the faults, and each log may take 1 GB."""
    folder = tmp_path / "site"
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(FAULTS)
    monkeypatch.setenv("PYTHONPATH", str(folder))
    monkeypatch.setenv("ALLANITE_MEMORY", "1G")


def write_logs(folder, names):
    folder.mkdir(exist_ok=True)
    for seed, name in enumerate(names):
        x = np.random.default_rng(seed).standard_normal(N)
        np.savetxt(folder / f"{name}.csv", x, header="gx", comments="")
    return folder


def by_name(rows):
    return {row["file"].rsplit("/", 1)[-1].removesuffix(".csv"): row for row in rows}


REASONS = {
    "crashes": "SIGSEGV",
    "hangs": "not done after 40 s",
    "large": "needs more memory",
    "rotated": "changed while it was read",
}
OTHERS = {
    "exits": "ended with code 3",
    "pipe": "a pipe or a device may never end",
    "broken": "No such file",
}


@pytest.mark.skipif(os.name != "posix", reason="signals, pipes and links of POSIX")
@pytest.mark.long  # a log that hangs takes its whole time
@pytest.mark.parametrize(("good", "reasons"), [(2, REASONS | OTHERS), (56, REASONS)])
def test_logs_that_fail_leave_the_others_alone(good, reasons, faults, tmp_path):
    units = [f"unit{k:02d}" for k in range(good)]
    folder, out = write_logs(tmp_path / "logs", [*REASONS, *units]), tmp_path / "fleet.csv"
    if "pipe" in reasons:
        write_logs(folder, ["exits"])
        os.mkfifo(folder / "pipe.csv")
        (folder / "broken.csv").symlink_to(folder / "nowhere")
    done, notes = [], []

    def run(**options):
        done.clear()
        on_done = lambda i, n, path: done.append(path.rsplit("/", 1)[-1].removesuffix(".csv"))  # noqa: E731
        given = {"model": "N", "rate": 100.0, "deadline": 40.0, **options}
        return by_name(run_fleet(folder, out, on_done=on_done, on_note=notes.append, **given))

    rows = run()
    assert len(rows) == good + len(reasons)
    for name, reason in reasons.items():
        assert rows[name]["status"] == "failed"
        assert reason in rows[name]["remarks"]
    for name in units:
        x = np.loadtxt(folder / f"{name}.csv", skiprows=1)
        assert rows[name]["status"] == "done"
        found = json.loads(rows[name]["numbers"])
        assert found["mean"][0] == pytest.approx(x.mean(), rel=1e-9)
        if name == units[0]:
            fit = al.improve(al.Recording(x, 100.0), "N").fit
            assert found["N"][0] == pytest.approx(float(fit["N"]), rel=1e-9)
    with out.open(newline="") as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    assert not notes
    # The same options: only what failed is tried again, and so is a log whose line of the journal is damaged.
    for name in set(reasons) - {"rotated"}:
        (folder / f"{name}.csv").unlink()
    journal = out.with_name(out.name + JOURNAL)
    lines = journal.read_bytes().split(b"\n")
    journal.write_bytes(b"\n".join([lines[0][:-9], *lines[1:]]))
    again = run()
    assert len(done) == 2
    assert "rotated" in done
    assert len(notes) == 1
    seconds = lambda row: {**row, "seconds": 0.0}  # noqa: E731
    assert [seconds(again[name]) for name in units] == [seconds(rows[name]) for name in units]
    # Other options: other results.
    other = run(rate=200.0)
    assert set(units) <= set(done)
    assert all(other[name]["rate_hz"] == 200.0 for name in units)


def test_whatever_changes_a_result_changes_the_key(tmp_path):
    def key(model="N", rate=1.0, unit="deg/s", log="a.csv", anyway=False):
        settings = child_setup(model, rate, unit, anyway, 1.0, 1, {}).settings
        return journal_key(settings, log, "content")

    model, keys = tmp_path / "model.json", [key()]
    keys += [
        key(rate=2.0),
        key(rate=None),
        key(unit="deg/h"),
        key("N+K"),
        key("N(N=2)"),
        key(log="a.txt"),
        key(anyway=True),
    ]
    # The content of a model file counts, not its name.
    record = al.parse_model("N(N=1)").simulate(rate=1.0, duration=100.0, seed=1)
    for text in ("N", "K"):
        al.parse_model(text).fit(record).save(model)
        keys.append(key(str(model)))

    @al.register
    class Breathing(al.Sinusoid):
        kind, short, title = "breathing", "BREATH", "breathing of the mount"

    keys.append(key())
    al.CATALOG.remove(Breathing)
    assert len(set(keys)) == len(keys)
    assert key() == keys[0]


MODULE = """
import allanite as al
from allanite.readers import LogFormat
class Breathing(al.Sinusoid):
    kind, short, title = "breathing", "BREATH", "breathing of the mount"
def read(path, pick):
    raise al.InputError("nothing to read")
FORMAT = LogFormat("a format", read, suffixes=(".breath",))
# changed: {}
"""


@pytest.mark.parametrize("what", ["effect", "format"])
def test_an_extension_that_changes_changes_the_key(tmp_path, monkeypatch, what):
    """After an effect or a reader was corrected, its old rows were once taken from the journal."""
    from importlib import import_module, reload

    from allanite.readers import FORMATS

    monkeypatch.syspath_prepend(tmp_path)
    keys = []
    for change in (1, 2):
        (tmp_path / "breathing_module.py").write_text(MODULE.format(change))
        module = import_module("breathing_module")
        module = reload(module) if change == 2 else module
        with monkeypatch.context() as patch:
            if what == "format":
                patch.setattr("allanite.readers.FORMATS", [*FORMATS, module.FORMAT], raising=True)
            else:
                al.register(module.Breathing)
            keys.append(child_setup("N", 1.0, None, False, 1.0, 1, {}).settings)
            if what == "effect":
                al.CATALOG.remove(module.Breathing)
    sys.modules.pop("breathing_module")
    assert keys[0] != keys[1]


@pytest.mark.parametrize(
    "line", [b"{", b"5", b"null", b"[]", b"[[{}]]", b"\xff\xfe", b"[" * 20_000, b'{"form": 2}']
)
def test_lines_of_the_journal_that_are_damaged_are_reported_and_skipped(line, tmp_path):
    path, rows, notes = tmp_path / "t.csv.journal", [{"file": "a", "status": "done"}], []
    with Journal(path) as journal:
        journal.add("one", rows)
    path.write_bytes(path.read_bytes() + line)
    with Journal(path) as journal:
        journal.add("two", rows)
    assert read_journal(path, notes.append) == {"one": rows, "two": rows}
    assert len(notes) == 1
    assert "line 2 is" in notes[0]
    # A changed number is found as well.
    path.write_bytes(path.read_bytes().replace(b"done", b"dome"))
    assert read_journal(path, notes.append) == {}


@pytest.mark.parametrize("source", ["folder", "pattern", "list"])
def test_the_table_is_no_log(source, tmp_path):
    folder, out = write_logs(tmp_path / "logs", ["unit0"]), tmp_path / "logs" / "table.csv"
    named = {"folder": folder, "pattern": f"{folder}/*", "list": tmp_path / "logs.txt"}[source]
    (tmp_path / "logs.txt").write_text(f"{folder / 'unit0.csv'}\n{out}\n")
    (folder / ".table-1-abc.csv").write_text("a draft of a run that was killed")
    for _ in range(2):
        assert logs_without_table(logs_of(named), out) == [folder / "unit0.csv"]
        # As the first run leaves them.
        out.touch()
        out.with_name(out.name + JOURNAL).touch()
    # Of another run, too.
    if source != "list":
        assert logs_of(named) == [folder / "unit0.csv"]


def test_a_log_is_not_replaced_by_the_table(tmp_path):
    folder = write_logs(tmp_path / "logs", ["unit0", "unit1"])
    before = (folder / "unit0.csv").read_bytes()
    with pytest.raises(al.InputError, match="among the logs: give the table another name"):
        run_fleet(folder, folder / "unit0.csv", rate=1.0)
    assert (folder / "unit0.csv").read_bytes() == before


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_an_interrupt_keeps_finished_logs_and_ends_the_run(faults, tmp_path):
    folder = write_logs(tmp_path / "logs", ["a", "hangs"])
    out = tmp_path / "t.csv"
    journal = out.with_name(out.name + JOURNAL)
    with started("fleet", folder, "--out", out, "--model", "N", "--rate", 1) as process:
        until(lambda: journal.is_file() and journal.read_bytes().endswith(b"\n"), 200.0)
        before, begun = spent(process), time.monotonic()
        process.send_signal(signal.SIGINT)
        # Within 1 s where a processor is free: what this process itself takes is counted where others are busy.
        while process.poll() is None and time.monotonic() < begun + 20.0:
            used = spent(process) - before
            time.sleep(0.02)
        assert process.wait(1) == 130
        assert used < 0.7
    with out.open(newline="") as file:
        rows = by_name(csv.DictReader(file))
    assert rows["a"]["status"] == "done"
    assert "run it again" in rows["hangs"]["remarks"]


POISON = "raise SystemExit(open({marker!r}, 'a').write(__name__) and 'poisoned')\n"


@pytest.mark.long
def test_modules_beside_the_logs_are_never_imported(tmp_path):
    folder, marker = write_logs(tmp_path / "logs", ["unit0", "unit1"]), tmp_path / "marker"
    names = {name.partition(".")[0] for name in sys.modules} | set(sys.stdlib_module_names)
    for name in names | {"dask", "pyarrow", "cloudpickle", "sitecustomize"}:
        if name not in ("allanite", "__main__"):
            (folder / f"{name}.py").write_text(POISON.format(marker=str(marker)))
    (folder / "sum.txt").write_text("unit0.csv\nunit1.csv\n")
    command = "from allanite.cli import main; main()"
    words = ["fleet", "sum.txt", "--out", "t.parquet", "--model", "N", "--rate", "1"]
    program = [sys.executable, "-P", "-c"]
    (folder / "t.parquet.journal").write_text("nonsense\n")
    done = subprocess.run([*program, command, *words], cwd=folder, capture_output=True, check=False)
    assert not marker.exists(), marker.read_text()
    assert b"2 logs, 2 axes, 0 failed" in done.stdout, done.stderr
    assert done.stderr.count(b"\n") == 1
    assert b"t.parquet.journal: line 1 is truncated, damaged" in done.stderr
    pytest.importorskip("dask")
    summarize = """
import dask, sys
import allanite as al
if __name__ == "__main__":
    with dask.config.set(scheduler="processes", num_workers=1):
        print(len(al.scale.summarize(["unit0.csv"], rate=1.0)))
"""
    done = subprocess.run([*program, summarize], cwd=folder, capture_output=True, check=False)
    assert not marker.exists(), marker.read_text()
    assert done.stdout.strip() == b"1", done.stderr


def test_texts_that_are_formulas_are_quoted_in_the_table(tmp_path):
    texts = ["=1+2", "+1", "-x", "@a", "'=1", "''+", "'plain", "a=b"]
    fixed = {"file": "a.csv", "status": "done", "numbers": "{}", "effects": "{}", "n": -3}
    rows, out = [{**fixed, "column": text} for text in texts], tmp_path / "t.csv"
    write_table(rows, out)
    with out.open(newline="") as file:
        cells = [row["column"] for row in csv.DictReader(file)]
    assert cells == ["'=1+2", "'+1", "'-x", "'@a", "''=1", "'''+", "'plain", "a=b"]
    assert [(row["column"], row["n"]) for row in read_table(out)] == [
        (text, "-3") for text in texts
    ]


PROGRAM = """
import sys
import allanite as al
from allanite.scale import run_fleet
@al.register
class Breathing(al.Sinusoid):
    kind, short, title = "breathing", "BREATH", "breathing of the mount"
if __name__ == "__main__" or "bare" in sys.argv:
    print(run_fleet(sys.argv[1], sys.argv[2], model="N+BREATH", rate=10.0)[0]["model"])
"""


@pytest.mark.long
@pytest.mark.parametrize("how", ["guarded", "bare"])
def test_effects_of_a_program_are_known_to_its_processes(how, tmp_path):
    folder = write_logs(tmp_path / "logs", ["unit0"])
    (tmp_path / "program.py").write_text(PROGRAM)
    words = [sys.executable, "program.py", folder, tmp_path / "t.csv", how]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    # A program without a guard on its main module is run once, not again in every process.
    assert done.stdout.count("BREATH") == 1, done.stderr
