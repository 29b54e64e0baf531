"""Ctrl-C during `improve` keeps the steps that were found."""

import json

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.study import SearchInterrupted

RATE, LENGTH = 100.0, 20_000


@pytest.fixture
def log(tmp_path):
    """A gyroscope with a random walk."""
    rng = np.random.default_rng(1)
    samples = g.white(rng, LENGTH, RATE, 0.01) + g.walk(rng, LENGTH, RATE, 2e-3)
    path = tmp_path / "gyro.npz"
    np.savez(path, data=samples, unit="deg/s")
    return path


@pytest.fixture
def interrupted_check(monkeypatch):
    """Let the second check of a search raise KeyboardInterrupt, as Ctrl-C does."""
    checks = []
    real = al.suggestion.check_fit

    def check_fit(fit, on_progress=None):
        checks.append(fit)
        if len(checks) == 2:
            raise KeyboardInterrupt
        return real(fit, on_progress)

    monkeypatch.setattr(al.suggestion, "check_fit", check_fit)


@pytest.mark.usefixtures("interrupted_check")
def test_the_study_holds_the_steps_that_were_checked(log):
    with pytest.raises(KeyboardInterrupt) as caught:
        al.improve(al.read(log, rate=RATE), "N")
    study = caught.value.study
    assert isinstance(caught.value, SearchInterrupted)
    assert [rung.fit.model.name for rung in study.ladder] == ["N"]
    assert not study.adequate
    assert study.stopped_because == "interrupted"
    assert "interrupted after 0 steps" in study.ending


@pytest.mark.usefixtures("interrupted_check")
def test_the_command_prints_and_saves_them(run, log, tmp_path):
    code, out, err = run(
        "improve", log, "--rate", RATE, "--model", "N", "--save", tmp_path / "model.json"
    )
    assert code == 130
    assert "interrupted after 0 steps" in out
    assert err.endswith("allanite: interrupted\n")
    assert json.loads((tmp_path / "model.json").read_text())["model"] == "N"


def test_an_interrupt_of_the_first_check_has_nothing_to_keep(log, monkeypatch):
    def check_fit(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(al.suggestion, "check_fit", check_fit)
    with pytest.raises(KeyboardInterrupt) as caught:
        al.improve(al.read(log, rate=RATE), "N")
    assert not isinstance(caught.value, SearchInterrupted)
