"""What a command offers it takes, and what is easily mistaken is asked about."""

import json
import re

import numpy as np
import pytest

from allanite.cli import main
from command_line import refused


@pytest.mark.parametrize("share", ["10", "5.0", "1"])
def test_a_bare_number_is_no_percentage(run, share):
    answer = run("plan", "--model", "N(N=1)", "--know", "N", "--to", share)
    refused(answer, 2, f"--to {share}", f"{share}%", f"{float(share) / 100:g}")


@pytest.mark.parametrize("share", ["10%", "0.1", "150%"])
def test_a_share_is_taken(run, share):
    assert run("plan", "--model", "N(N=1)", "--know", "N", "--to", share, "--rate", 1)[0] == 0


def test_the_effect_of_a_plan_may_have_units(run):
    model = "N(N=0.3 deg/sqrt(h))+K(K=1e-3 deg/s/sqrt(s))"
    found = []
    for find in ("GM(T=60,q_c=7e-4 deg/s/sqrt(s))", f"GM(T=1 min,q_c={np.radians(7e-4):.15g})"):
        code, out, err = run(
            "plan", "--model", model, "--find", find, "--rate", 10, "--duration", 3600, "--json"
        )
        assert code == 0, err
        found.append(json.loads(out))
    assert found[0]["probability"] == pytest.approx(found[1]["probability"], rel=1e-6)
    assert found[0]["effect"] == "gauss_markov"
    with_units = "GM(T=60,q_c=7e-4 deg/s/sqrt(s))"
    answer = run("plan", "--model", "N(N=3e-3)", "--find", with_units, "--rate", 10)
    refused(answer, 2, "--find", "has a unit, but the values of --model have none", "both")
    answer = run("plan", "--model", model, "--find", "N(N=1)+K(K=1)", "--rate", 10)
    refused(answer, 2, "--find", "2 effects; give one")


def test_only_what_is_taken_is_offered_of_averaging_times(run, log):
    answer = run("adev", log, "--taus", "1,10")
    refused(answer, 2, "--taus", "1,10", "octave, decade, all or a number of points per decade")


def test_a_model_file_is_no_log(run, log, tmp_path):
    saved = tmp_path / "gyro.json"
    assert run("fit", log, "--model", "N", "--save", saved)[0] == 0
    for command in ("fit", "adev", "inspect"):
        refused(run(command, saved), 2, "gyro.json", "a model file", "--model")
    assert "--model" in run("check", saved, "--model", saved)[2]
    text = tmp_path / "any.json"
    text.write_text('{"a": [\n1,\n2\n]}\n')
    assert "model file" not in run("fit", text, "--rate", 1)[2]


@pytest.mark.slow
def test_progress_of_a_fleet_is_for_a_terminal(run, log, tmp_path):
    code, _, err = run("fleet", log, "--out", tmp_path / "fleet.csv", "--model", "N")
    assert (code, err) == (0, "")


def test_inspect_says_that_a_sensor_was_shaken(tmp_path, capsys):
    x = np.random.default_rng(3).standard_normal(90_000)
    x[:10_000] *= 100
    path = tmp_path / "gyro.csv"
    np.savetxt(path, x, fmt="%.4g", header="gx [deg/s]", comments="")
    shown = (["inspect", str(path), "--rate", "100"], ["adev", str(path), "--rate", "100"])
    for arguments in shown:
        with pytest.raises(SystemExit):
            main(arguments)
        out = " ".join(capsys.readouterr().out.split())
        assert re.search(
            r"gx: not at rest: activity .* around 0–\d+.*; --trim 10\d\S*:900 excludes", out
        )
    with pytest.raises(SystemExit):
        main(["adev", str(path), "--rate", "100", "--trim", "50:"])
    # Seconds are those of the part that is used: as numbers of --trim they would be wrong.
    assert "; --trim START:END excludes it" in " ".join(capsys.readouterr().out.split())
