"""allanite predict: a table or JSON, with and without a log."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import allanite as al
from allanite.cli import cli
from allanite.cli.output import save_fits
from allanite.effects.files import model_to_dict

pytestmark = pytest.mark.slow


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
    recording = al.parse_model("N(N=0.01)+B(B=1e-3)").simulate(
        n=60_000, rate=10.0, seed=1, unit="mg"
    )
    np.savetxt(tmp_path / "a.csv", recording.samples, header="acc_x", comments="")
    result = run(
        str(tmp_path / "a.csv"), "--model", "N+B", "--aided", "5", "--until", "20",
        "--unit", "mg", "--rate", "10", "--json",
    )  # fmt: skip
    velocity = json.loads(result.output)["quantities"][0]
    assert velocity["measured"]["segments"][-1] == 240
    # 240 segments of the longest time: the root mean square is known to 1/√480 = 4.6 %, better before.
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
    """A log of two axes, and the files with the models of a fit and of a characterization."""
    rng = np.random.default_rng(4)
    x = rng.standard_normal((4000, 2)) * [0.1, 0.3]
    log = al.Recording(x, rate=10, unit="deg/s", columns=["gx", "gy"])
    np.savez(tmp_path / "log.npz", data=x, rate_hz=10.0, channels=["gx", "gy"], unit="deg/s")
    save_fits(
        [al.parse_model("N+K").fit(log["gx"]), al.parse_model("N").fit(log["gy"])],
        tmp_path / "fit.json",
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
    with pytest.raises(al.InputError, match=f"{name}: unknown column 'gz': the columns are gx, gy"):
        run(*aided, "--column", "gz")
    with np.load(log) as whole:
        np.savez(two / "other.npz", **{**whole, "channels": ["gz", "gy"]})
    with pytest.raises(al.InputError, match=f"{name} has no model of column gz, only of gx, gy"):
        run(str(two / "other.npz"), *aided)


def test_a_file_of_several_axes_where_one_model_is_meant(two):
    with pytest.raises(al.InputError, match=r"fit\.json contains models of several columns"):
        al.parse_model(str(two / "fit.json"))
    path = two / "odd.json"
    path.write_text('{"schema": "allanite/fit/1", "columns": [1]}')
    with pytest.raises(al.InputError, match=r"odd\.json: 'columns'"):
        run("--model", str(path), "--aided", "10")


def test_refusals():
    with pytest.raises(al.InputError, match="--unit UNIT and --rate HZ"):
        run("--model", "N(N=1)", "--aided", "10")
    with pytest.raises(al.InputError, match="--aided"):
        run("--model", "N(N=1)", "--aided", "-1", "--unit", "mg", "--rate", "1")


def test_an_effect_that_was_not_detected_counts_with_its_expected_size_and_its_limit(tmp_path):
    """The fitted K of 0 would be overconfident; the expected square is 0.407 of that of the limit."""
    parameters = {"value": 0.0, "interval": [0.0, 1e-3], "unit": "rad/s/s^½", "detected": False}
    white = {"value": 1e-3, "interval": [0.9e-3, 1.1e-3], "unit": "rad/s·s^½", "detected": True}
    document = {
        "schema": "allanite/fit/1",
        "recording": {"column": "gx", "unit": "rad/s", "rate_hz": 10.0, "duration_s": 600.0},
        "effects": [
            {"kind": "angle_random_walk", "parameters": {"N": white}},
            {"kind": "rate_random_walk", "parameters": {"K": parameters}},
        ],
    }
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(document))
    words = ("--model", str(path), "--aided", "10", "--until", "100", "--json")
    plain, upper = (
        json.loads(run(*words, *more).output)["quantities"][0]["budget"]
        for more in ((), ("--overbound",))
    )
    np.testing.assert_allclose(np.array(plain["K"]) / upper["K"], np.sqrt(0.798 / 1.960), rtol=1e-6)
    np.testing.assert_allclose(np.array(upper["N"]) / plain["N"], 1.1, rtol=1e-6)


def simulated_channel(gyro, accel, g=9.80665, radius=6.371e6):
    """Position of a horizontal channel by small steps of its differential equations; samples of shape (runs, n) at 1 Hz."""
    tilt, v, p = (np.zeros(len(gyro)) for _ in range(3))
    h = 0.1
    for k in range(gyro.shape[1]):
        for _ in range(10):
            a = accel[:, k] - g * tilt
            tilt = tilt + h * (gyro[:, k] + (v + h / 2 * a) / radius)
            v, p = v + h * a, p + h * (v + h / 2 * a)
    return p


def test_six_axes_together_swing_with_the_schuler_period(tmp_path):
    """Position after 1000 s and 6000 s by integration of the equations; 400 runs have a standard error of 3.5 %."""
    gyro, accel = "N(N=1e-5)", "N(N=1e-3)"
    found = json.loads(
        run_six(tmp_path, gyro, accel, "--aided", "500", "--until", "6000", "--json").output
    )["six_axes"]
    position = found[1]
    assert [one["quantity"] for one in found] == ["horizontal velocity", "horizontal position"]
    at = {t: i for i, t in enumerate(position["tau_s"])}
    rng = np.random.default_rng(1)
    runs = 400
    for tau in (1000.0, 6000.0):
        errors = []
        for sigma in (1e-5, 1e-3):
            noise = sigma * rng.standard_normal((runs, 500 + int(tau)))
            errors.append(noise[:, 500:] - noise[:, :500].mean(axis=1, keepdims=True))
        for i, name in enumerate(("gyroscopes", "accelerometers")):
            one = [e if k == i else np.zeros_like(e) for k, e in enumerate(errors)]
            # Both channels together.
            expected = np.sqrt(2 * np.mean(simulated_channel(*one) ** 2))
            assert position["budget"][name][at[tau]] == pytest.approx(expected, rel=4 * 0.035)
    # Short times: t³/6 and t²/2, as each axis says by itself.
    total = np.hypot(*position["budget"].values())
    np.testing.assert_allclose(total, position["sigma"])


def run_six(folder, gyro, accel, *words):
    documents = []
    for column, unit, text in (("gyro_x", "rad/s", gyro), ("acc_y", "m/s^2", accel)):
        document = {**model_to_dict(al.parse_model(text)), "schema": "allanite/fit/1"}
        documents.append(
            {**document, "recording": {"column": column, "unit": unit, "rate_hz": 1.0}}
        )
    path = folder / "imu.json"
    path.write_text(json.dumps({"schema": "allanite/fit/1", "columns": documents}))
    return run("--model", str(path), *words)
