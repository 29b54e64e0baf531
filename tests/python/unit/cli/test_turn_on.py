"""The bias at switch-on: several logs of one sensor, and the initial covariance of filters."""

import json
import re

import numpy as np
import pytest

import allanite as al
from allanite.axes.turn_on import turn_on_biases
from allanite.effects.files import model_to_dict
from allanite.exports import axes_of
from allanite.scale.logs import rows_of
from command_line import strict

RATE = 50.0
SIGMA, MEAN = 2e-3, 5e-3


def logs(seed, count=8, slope=0.0, n=500):
    """Short logs with a random bias each, which also follows the temperature of its day."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        t = rng.uniform(15, 30)
        bias = MEAN + SIGMA * rng.standard_normal() + slope * (t - 22)
        x = bias + 1e-3 * rng.standard_normal(n)
        warm = np.full(n, t) + 0.01 * rng.standard_normal(n)
        out.append(
            al.Recording(x, RATE, unit="rad/s", columns=["gx"], covariates={"temperature": warm})
        )
    return out


def found(given):
    return turn_on_biases(given[:1], [[log] for log in given[1:]])["gx"]


@pytest.mark.slow
def test_the_interval_of_the_spread_covers():
    """95 % of 400 lie between 92 and 98 %, except once in 300 (three standard errors of 1.1 %)."""
    inside = [
        low < SIGMA < high
        for low, high in (found(logs(seed, n=16)).interval for seed in range(400))
    ]
    assert 0.917 < np.mean(inside) < 0.983


def test_temperature_is_an_explanation_where_it_is_one():
    one = found(logs(1, count=12, slope=2e-3))
    assert one.column == "temperature"
    assert one.slope == pytest.approx(2e-3, rel=0.3)
    assert one.share > 0.7
    # 10 degrees of freedom: the deviation about the line is known to 22 %.
    assert one.residual == pytest.approx(SIGMA, rel=0.6)
    assert "temperature explains" in str(one)
    # Without a slope it is called one in 20.
    named = [found(logs(seed, n=16)).column for seed in range(200)]
    assert np.mean([bool(name) for name in named]) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 200)
    assert not found(logs(3, count=3, slope=1.0)).column


def documents(turn_on=True):
    model = model_to_dict(al.parse_model("N(N=1e-3)+K(K=1e-5)"))
    log = {"rate_hz": RATE, "duration_s": 300.0}
    fit = {**model, "recording": {**log, "column": "gx", "unit": "rad/s"}}
    accel = {**model, "recording": {**log, "column": "ax", "unit": "m/s^2"}}
    if turn_on:
        for one in (fit, accel):
            one["turn_on"] = {**found(logs(1)).to_dict(), "unit": one["recording"]["unit"]}
    return [fit, accel]


def test_filters_get_the_initial_deviation():
    """For a filter that begins with a bias of 0: mean and spread of a gyroscope, but the spread of an accelerometer."""
    one = found(logs(1))
    spread = one.sigma * np.sqrt(1 + 1 / one.logs)
    whole = np.hypot(spread, one.mean)
    axes = axes_of(documents())
    text = al.export(axes, "px4")
    value = {key: float(re.search(rf"EKF2_{key}BIAS_INIT (\S+)", text)[1]) for key in "GA"}
    assert value["G"] == pytest.approx(whole, rel=1e-5)
    assert value["A"] == pytest.approx(spread, rel=1e-5)
    assert "gravity hides the mean" in text
    text = al.export(axes, "okvis2")
    assert float(re.search(r"sigma_bg: (\S+)", text)[1]) == pytest.approx(whole, rel=1e-5)
    assert float(re.search(r"sigma_ba: (\S+)", text)[1]) == pytest.approx(spread, rel=1e-5)
    text = al.export(axes, "gtsam")
    sigmas = re.search(r"bias_prior = .*array\(\[(\S+)\] \* 3 \+ \[(\S+)\] \* 3\)", text)
    assert sigmas is not None
    assert [float(v) for v in sigmas.groups()] == pytest.approx([spread, whole], rel=1e-5)
    text = al.export(axes, "robot_localization")
    row = re.search(r"initial_estimate_covariance: \[([^\]]+)\]", text)
    assert row is not None
    initial = np.diag(np.array(row[1].split(","), dtype=float).reshape(15, 15))
    np.testing.assert_allclose(initial[9:12], whole**2, rtol=1e-5)
    np.testing.assert_allclose(initial[12:], spread**2, rtol=1e-5)
    text = al.export(axes, "insekf")
    assert float(re.search(r"'Gyroscope_Bias', (\S+)\^2", text)[1]) == pytest.approx(
        whole, rel=1e-5
    )
    space = json.loads(al.export(axes, "statespace"))["axes"]
    assert space[0]["turn_on_variance"] == pytest.approx(whole**2)
    # A conservative filter: the upper end of the interval.
    upper = json.loads(al.export(axes, "statespace", overbound=True))["axes"][1]["turn_on_variance"]
    assert upper == pytest.approx(one.interval[1] ** 2 * (1 + 1 / one.logs))


@pytest.mark.parametrize(
    "target", ["px4", "px4-params", "okvis2", "gtsam", "robot_localization", "insekf"]
)
def test_one_log_says_what_is_known_and_that_the_rest_is_not(target):
    text = al.export(axes_of(documents(turn_on=False)), target)
    # Comments wrap at 120 characters.
    flat = re.sub(r"\s*\n\s*(?:#|%|//|;)\s*", " ", text)
    assert "the bias at switch-on is not known from one log" in flat
    left = float(re.search(r"of alignment at rest (\S+) rad/s remain", flat)[1])
    # √2 Allan deviations at 30 s, a tenth of the log.
    assert left == pytest.approx(np.sqrt(2) * 1e-3 / np.sqrt(30), rel=0.1)
    assert not re.search(r"^[^#]*BIAS_INIT", text, re.MULTILINE)


@pytest.mark.long
def test_the_command_takes_several_logs(run, tmp_path):
    paths = []
    for k, log in enumerate(logs(2, count=5, slope=2e-3)):
        paths.append(tmp_path / f"day{k}.csv")
        rows = np.column_stack([log.samples, log.covariates["temperature"]])
        np.savetxt(paths[-1], rows, delimiter=",", header="gx [rad/s],temperature", comments="")
    models = tmp_path / "models.json"
    code, out, err = run("characterize", *paths, "--rate", "50", "--model", "N", "--save", models)
    assert (code, err) == (0, "")
    assert "bias at switch-on" in out
    assert re.search(r"5 (logs|switch-ons)", out)
    document = strict(models.read_text())
    assert document["turn_on"]["gx"]["logs"] == 5
    code, out, _ = run("export", models, "--format", "px4")
    assert code == 0
    assert "EKF2_GBIAS_INIT" in out
    assert "5 logs" in out


def test_a_fleet_tells_the_bias_at_switch_on(tmp_path):
    """The same numbers as of `characterize`, from the rows of `rows_of`; other units are not mixed."""
    given = logs(1, count=12, slope=2e-3)
    rows = []
    for k, log in enumerate(given):
        path = tmp_path / f"day{k}.csv"
        table = np.column_stack([log.samples, log.covariates["temperature"]])
        np.savetxt(path, table, delimiter=",", header="gx [rad/s],temperature", comments="")
        rows += rows_of(str(path), "N", RATE, None)
    one = found(given)
    told = al.fleet(rows).biases["gx"]
    assert told.logs == 12
    assert told.sigma == pytest.approx(one.sigma, rel=1e-9)
    assert told.interval == pytest.approx(one.interval, rel=1e-9)
    assert (told.column, told.share) == ("temperature", pytest.approx(one.share, rel=1e-9))
    text = str(al.fleet(rows))
    assert "bias between logs (of one sensor: the bias at switch-on):" in text
    assert "temperature explains" in text
    assert al.fleet(rows).to_dict()["turn_on"]["gx"]["temperature"]["column"] == "temperature"
    rows[0]["unit"] = "deg/s"
    assert al.fleet(rows).biases == {}
