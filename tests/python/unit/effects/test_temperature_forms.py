"""Play, two masses and a rate of change: as the plain recursions say, named where they are, each in its unit."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite._kernels import play
from allanite.fit.likelihood.data import prepare
from allanite.fit.shapes.matched import CACHED_ORDINATES, COLUMN_MEANS, regressor_ordinates

RATE, N = 10.0, 36_000


def _temperature(rng, n=N, swing=3.0):
    """True and logged temperature: two cycles. The derivative of the thermometer's noise is small compared with N."""
    time = np.arange(n) / RATE
    one, other = rng.uniform(0.0, 2.0 * np.pi, 2)
    true = swing * np.sin(2.0 * np.pi * time / 1300.0 + one)
    true += 0.6 * swing * np.sin(2.0 * np.pi * time / 523.0 + other)
    return 25.0 + true, 25.0 + true + 0.002 * rng.standard_normal(n)


@pytest.mark.parametrize("n", [1, 2, 17, 1000, 10_007])
@pytest.mark.parametrize("width", [0.0, 0.3, 2.0, 1e3])
def test_play_is_its_recursion(n, width):
    rng = np.random.default_rng([n, int(10 * width)])
    column = np.cumsum(rng.standard_normal(n)) * 0.2 + 5.0
    np.testing.assert_allclose(play(column, width), g.backlash(column, width), rtol=0, atol=1e-12)


def test_a_wide_play_never_moves():
    assert np.ptp(play(np.sin(np.arange(1000.0)), 1.5)) == 0.0


FORMS = {
    "hysteresis": lambda true: 4e-3 * g.backlash(true, 1.0),
    "two_lags": lambda true: 8e-3 * (g.lagged(true, RATE, 5.0) - 0.7 * g.lagged(true, RATE, 250.0)),
    "rate_of_change": lambda true: 1.5 * np.gradient(g.lagged(true, RATE, 15.0)) * RATE,
}
TRUTH = {
    "hysteresis": {"coefficient": 4e-3, "width": 1.0},
    "two_lags": {"fast": 8e-3, "slow": -5.6e-3, "slow_lag": 250.0},
    "rate_of_change": {"coefficient": 1.5},
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMS)
def test_each_form_is_named_and_measured(kind):
    rng = np.random.default_rng([5, *kind.encode()])
    true, seen = _temperature(rng)
    samples = g.white(rng, N, RATE, 0.01) + g.walk(rng, N, RATE, 1e-5) + FORMS[kind](true)
    recording = al.Recording(samples, RATE, unit="deg/s", covariates={"temp_c": seen})
    check = al.parse_model("N+B+K").fit(recording).check()
    first = check.suggestions[0]
    assert (first.kind, first.significant) == (kind, True), check.suggestions
    for name, value in TRUTH[kind].items():
        found = first.estimates[name]
        # Two standard errors and one more: one record, three numbers.
        assert abs(found.value - value) < 3.0 * found.std_error, (name, found)
    unit = {"hysteresis": "deg/s/C", "two_lags": "deg/s/C", "rate_of_change": "deg/s·s/C"}[kind]
    name = next(iter(TRUTH[kind]))
    assert first.estimates[name].unit.replace("°", "") == unit
    assert first.solution.model.effects[-1].follows == "temp_c"


def test_a_width_is_in_the_unit_of_its_column():
    rng = np.random.default_rng(2)
    true, seen = _temperature(rng, 4000)
    samples = g.white(rng, 4000, RATE, 0.001) + 0.01 * g.backlash(true, 1.0)
    recording = al.Recording(samples, RATE, unit="deg/s", covariates={"temp_c": seen})
    fit = al.parse_model("N+HYS(column=temp_c)").fit(recording)
    assert fit["width"].unit == "°C"
    assert fit["width"].interval[0] < 1.0 < fit["width"].interval[1]


def test_a_play_stays_beside_a_line_of_the_same_column():
    """c·u + h·play(u) is two effects of one column; a second line of this column would be redundant."""
    columns = {"temperature": np.arange(100.0)}
    beside = al.parse_model("N+COV(column=temperature)")
    assert al.effects.Hysteresis.candidates(beside, columns)
    assert al.effects.RateOfChange.candidates(beside, columns)
    assert not al.effects.TwoLags.candidates(beside, columns)
    assert not al.effects.Covariate.candidates(beside, columns)
    assert not al.effects.Hysteresis.candidates(
        al.parse_model("N+HYS(column=temperature)"), columns
    )


def test_ordinates_of_a_long_column_are_those_of_its_transform():
    """Computed from means, for speed: the error is 3e-5 of the size, and 6e-4 for a rate of change, which is noisier."""
    n = 2 * COLUMN_MEANS + 77
    rng = np.random.default_rng(8)
    column = 3.0 * np.sin(np.arange(n) / n * 31.0) + 0.01 * rng.standard_normal(n)
    data = prepare(al.Recording(rng.standard_normal(n), RATE, covariates={"t": column}))
    j = np.arange(1, CACHED_ORDINATES, dtype=np.int64)
    for effect in (
        al.effects.Covariate(column="t", lag=20.0),
        al.effects.Hysteresis(column="t", width=0.5),
        al.effects.RateOfChange(column="t", lag=50.0),
    ):
        found = regressor_ordinates([effect], j, data)[0]
        series = effect.regressors(data.time, data.covariates)[:, 0]
        exact = data.transform(np.ascontiguousarray(series))[j]
        assert np.linalg.norm(found - exact) < 1e-3 * np.linalg.norm(exact)


def test_a_model_that_names_no_column_follows_the_only_one_there_is():
    rng = np.random.default_rng(2)
    temperature = np.linspace(20.0, 30.0, 2000)
    log = al.Recording(
        rng.standard_normal(2000) + temperature,
        rate=10,
        unit="deg/s",
        covariates={"temp": temperature},
    )
    bare = al.fit_model(log, "N+COV")
    assert bare.model == al.fit_model(log, "N+COV(column=temp)").model
    with pytest.raises(al.InputError, match=r"write COV\(column=NAME\) \(offered: none\)"):
        al.fit_model(al.Recording(log.samples, rate=10), "N+COV")
    with pytest.raises(
        al.InputError, match=r"'temperature' is a column.* COV\(column=temperature\)"
    ):
        al.parse_model("N+temperature")
