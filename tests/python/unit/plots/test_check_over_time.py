"""The figure of a check shows the samples over time if the text names an effect over time."""

import numpy as np
import pytest

import allanite as al
from allanite.plots import plot_check
from allanite.plots.spec import Line


def check_of(drift, temperature):
    n, rate = 36_000, 10.0
    white = al.parse_model("N(N=0.005)").simulate(n=n, rate=rate, seed=1, unit="deg/s").samples
    record = al.Recording(
        white + drift, rate=rate, unit="deg/s", columns=["x"], covariates={"temp": temperature}
    )
    return al.fit_model(record, "N+B").check()


@pytest.fixture(scope="module")
def temperature():
    return 25.0 + 5.0 * np.sin(5.0 * np.arange(36_000) / 36_000)


def test_a_drift_with_the_temperature_is_drawn_over_time(temperature, tmp_path):
    check = check_of(0.002 * temperature, temperature)
    assert check.significant[0].kind == "covariate"
    figure = plot_check(check, tmp_path / "check.svg")
    *_, samples, column = figure.panels
    assert samples.y.label == "samples (°/s)"
    assert column.y.label == "temp"
    means, drift = samples.find(Line)
    assert drift.label == "explained by logged column temp"
    # The drawn function is the true drift; 0.0006 °/s is ten standard errors of its fit.
    found = np.interp(np.linspace(0.0, 60.0, 9), drift.x, drift.y)
    truth = 0.002 * (25.0 + 5.0 * np.sin(np.linspace(0.0, 5.0, 9)))
    assert found == pytest.approx(truth, abs=6e-4)
    assert np.ptp(means.y) > 0.015
    assert "time (min)" in (tmp_path / "check.svg").read_text(encoding="utf-8")


def test_a_check_without_such_an_effect_has_the_two_curves_alone(temperature):
    check = check_of(0.0, temperature)
    assert len(plot_check(check).panels) == 4
