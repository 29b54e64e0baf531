"""allanite predict: a table or JSON, with and without a log."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import allanite as al
from allanite.cli import cli
from allanite.cli.output import save_fits
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


@pytest.fixture
def two(tmp_path):
    """A log of two axes, and the files in which a fit and a characterisation keep their models."""
    rng = np.random.default_rng(4)
    x = rng.standard_normal((4000, 2)) * [0.1, 0.3]
    log = al.Recording(x, rate=10, unit="deg/s", columns=["gx", "gy"])
    np.savez(tmp_path / "log.npz", data=x, rate_hz=10.0, channels=["gx", "gy"], unit="deg/s")
    save_fits(
        [parse_model("N+K").fit(log["gx"]), parse_model("N").fit(log["gy"])], tmp_path / "fit.json"
    )
    al.characterize(log, "N").save(tmp_path / "axes.json")
    return tmp_path


@pytest.mark.parametrize("name", ["fit.json", "axes.json"])
def test_of_a_file_of_several_axes_that_of_the_column_is_taken(two, name):
    log, models = str(two / "log.npz"), str(two / name)
    aided = ("--model", models, "--aided", "10", "--json")
    alone = json.loads(run(*aided, "--column", "gy").output)
    measured = json.loads(run(log, *aided, "--column", "gy").output)
    for document in (alone, measured):
        assert document["model"].startswith("N(N=0.09")
        assert "columns" not in document
    assert measured["recording"]["column"] == "gy"
    assert [d["recording"]["column"] for d in json.loads(run(log, *aided).output)["columns"]] == [
        "gx",
        "gy",
    ]
    for command in ("fit", "check"):
        given = [command, log, "--model", models, "--column", "gy", "--json"]
        found = CliRunner().invoke(cli, given, catch_exceptions=False).output
        assert [e["kind"] for e in json.loads(found)["effects"]] == ["angle_random_walk"]
    with pytest.raises(InputError, match=f"{name}: unknown column 'gz': the columns are gx, gy"):
        run(*aided, "--column", "gz")
    with np.load(log) as whole:
        np.savez(two / "other.npz", **{**whole, "channels": ["gz", "gy"]})
    with pytest.raises(InputError, match=f"{name} holds no model of column gz: it holds gx, gy"):
        run(str(two / "other.npz"), *aided)


def test_a_file_of_several_axes_where_one_model_is_meant(two):
    with pytest.raises(InputError, match=r"fit\.json: holds the models of several columns"):
        parse_model(str(two / "fit.json"))
    path = two / "odd.json"
    path.write_text('{"schema": "allanite/fit/1", "columns": [1]}')
    with pytest.raises(InputError, match=r"odd\.json: its columns are not as"):
        run("--model", str(path), "--aided", "10")


def test_refusals():
    with pytest.raises(InputError, match="--unit and --rate"):
        run("--model", "N(N=1)", "--aided", "10")
    with pytest.raises(InputError, match="--aided"):
        run("--model", "N(N=1)", "--aided", "-1", "--unit", "mg", "--rate", "1")
