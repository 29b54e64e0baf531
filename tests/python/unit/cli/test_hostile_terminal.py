"""A log whose path and columns speak to terminals: every command shows them as letters."""

import json
import os

import numpy as np
import pytest

HOSTILE = ["\x1b[2J\x1b]0;gone\x07gx", "\x9b31m\r\u202egy\u2028", "gz\nallanite: done\x08\x00"]
COMMANDS = {
    "inspect": [], "adev": [], "fit": ["--model", "N"], "check": ["--model", "N"], "improve": [], "characterize": [],
    "predict": ["--model", "N+K", "--aided", "1"],
}  # fmt: skip


@pytest.fixture
def log(tmp_path):
    path = tmp_path / ("gyro" + "\x1b[31m\r\u202e" * (os.name == "posix") + ".npz")
    samples = np.random.default_rng(1).standard_normal((700, 3))
    with path.open("wb") as file:
        np.savez(file, data=samples, rate_hz=10.0, unit="deg/s", channels=np.array(HOSTILE))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("form", ["text", "json"])
@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_speaks_to_the_terminal(run, log, command, form):
    words = [command, log, *COMMANDS[command], *["--json"] * (form == "json")]
    code, out, err = run(*words)
    assert code in (0, 1), err
    assert "gx" in out + err
    for line in (out + err).split("\n"):
        assert line.isprintable(), repr(line)
    if form == "json":
        json.loads(out)


def quiet(run, *words):
    """Output of a command, all lines of which must be printable."""
    code, out, err = run(*words)
    assert code == 0, err
    for line in (out + err).split("\n"):
        assert line.isprintable(), repr(line)
    return out + err


@pytest.mark.slow
def test_files_that_are_written_are_named_in_letters(run, log):
    folder, name = log.parent, log.stem
    model, sent = folder / f"{name}.json", folder / f"{name}.yaml"
    quiet(run, "fit", log, "--model", "N", "--save", model)
    assert name.split("\x1b")[0] in quiet(run, "export", model, "--format", "kalibr", "-o", sent)
    quiet(run, "simulate", "N(N=1)", "--rate", 10, "-n", 50, "-o", folder / f"{name}2.npz")
    quiet(run, "report", log, "--model", "N", "--column", 0, "-o", folder / f"{name}.md")


def test_models_whose_columns_speak_to_terminals(run, log):
    model = log.parent / "m.json"
    quiet(run, "fit", log, "--model", "N+B", "--column", 0, "--save", model)
    document = json.loads(model.read_text(encoding="utf-8"))
    text = json.dumps(document).replace(json.dumps(document["recording"]["column"]), json.dumps(HOSTILE[0]))  # fmt: skip
    model.write_text(text, encoding="utf-8")
    assert "gx" in quiet(run, "export", model, "--format", "kalibr", "-o", log.parent / "x.yaml")


@pytest.mark.slow
def test_a_fleet_of_logs_with_such_names(run, log):
    (log.parent / "fleet").mkdir()
    log = log.rename(log.parent / "fleet" / log.name)
    said = quiet(run, "fleet", log.parent, "--out", log.parent.parent / "rows.csv", "--model", "N")
    assert said.startswith("1 logs, 3 axes, 0 failed")
