"""allanite predict: a table or JSON, with and without a log."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from allanite.cli import cli
from allanite.common.errors import InputError
from allanite.effects.files import parse_model


def run(*arguments):
    result = CliRunner().invoke(cli, ["predict", *arguments], catch_exceptions=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def test_a_model_alone():
    result = run(
        "--model", "N(N=0.01)+K(K=1e-4)", "--aided", "10", "--unit", "deg/s", "--rate", "100"
    )
    assert "angle since the fix, deg" in result.output
    assert "position by tilt" in result.output
    document = json.loads(
        run(
            "--model", "N(N=0.01)", "--aided", "10", "--unit", "deg/s", "--rate", "100", "--json"
        ).output
    )
    angle = document["quantities"][0]
    # N²t + N²t²/a in rad.
    t = np.array(angle["tau_s"])
    np.testing.assert_allclose(angle["sigma"], np.radians(0.01) * np.sqrt(t + t**2 / 10))
    assert angle["measured"] is None


def test_a_log_is_measured(tmp_path):
    recording = parse_model("N(N=0.01)+B(B=1e-3)").simulate(n=60_000, rate=10.0, seed=1, unit="mg")
    np.savetxt(tmp_path / "a.csv", recording.samples, header="acc_x", comments="")
    result = run(
        str(tmp_path / "a.csv"), "--model", "N+B", "--aided", "5", "--until", "20",
        "--unit", "mg", "--rate", "10", "--json",
    )  # fmt: skip
    velocity = json.loads(result.output)["quantities"][0]
    assert velocity["measured"]["segments"] == 240
    # 240 segments: the root mean square is known to 1/√480 = 4.6 %.
    np.testing.assert_allclose(velocity["measured"]["rms"], velocity["sigma"], rtol=4 * 0.046)
    table = run(
        str(tmp_path / "a.csv"),
        "--model",
        "N(N=0.01)",
        "--aided",
        "5",
        "--unit",
        "mg",
        "--rate",
        "10",
    ).output
    assert "measured rms" in table


def test_refusals():
    with pytest.raises(InputError, match="--unit and --rate"):
        run("--model", "N(N=1)", "--aided", "10")
    with pytest.raises(InputError, match="--aided"):
        run("--model", "N(N=1)", "--aided", "-1", "--unit", "mg", "--rate", "1")
