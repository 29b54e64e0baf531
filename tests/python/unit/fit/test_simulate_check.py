"""A fit tried on records simulated from itself."""

import numpy as np
import pytest

import allanite as al

TRUTH = al.parse_model("N(N=0.1)+K(K=0.006)")


def test_the_true_model_is_usual_and_a_wrong_one_is_not():
    recording = TRUTH.simulate(n=20_000, rate=10, seed=4, unit="deg/s")
    told = []
    right = al.fit_model(recording, "N+K").simulate_check(
        39, seed=1, progress=lambda done, total: told.append((done, total))
    )
    assert right.p_value > 0.02
    assert told == [(k, 39) for k in range(1, 40)]
    wrong = al.fit_model(recording, "N").simulate_check(39, seed=1)
    assert wrong.p_value == 1 / 40
    assert "p = 0.025" in str(wrong)


def test_replicates_scatter_as_the_standard_errors_say():
    recording = TRUTH.simulate(n=20_000, rate=10, seed=5, unit="deg/s")
    fit = al.fit_model(recording, "N+K")
    check = fit.simulate_check(60, seed=2)
    for name in ("N", "K"):
        bias, deviation, error = check.spread(name)
        # 60 replicates know a standard deviation to 9 %, a mean to 0.13 of it.
        assert deviation == pytest.approx(fit[name].std_error, rel=0.4)
        assert abs(bias) < 0.6 * deviation
        assert error == pytest.approx(np.hypot(bias, deviation))
    row = check.to_dict()["parameters"]["K"]
    assert row["simulated_95"][0] < fit["K"] < row["simulated_95"][1]
    assert row["unit"] == fit["K"].unit


def test_seeds_gaps_and_refusals():
    recording = TRUTH.simulate(n=4000, rate=10, seed=6, unit="deg/s")
    samples = np.array(recording.samples)
    samples[1000:1200] = np.nan
    fit = al.fit_model(al.Recording(samples, rate=10, unit="deg/s"), "N+K")
    one, two = (fit.simulate_check(3, seed=9) for _ in range(2))
    np.testing.assert_array_equal(one.simulated_chi2, two.simulated_chi2)
    assert fit.simulate_check(3, seed=10).simulated_chi2[0] != one.simulated_chi2[0]
    with pytest.raises(al.InputError, match=r"n is 0; .* 1 replicate"):
        fit.simulate_check(0)


def test_parameters_of_one_name_have_the_units_of_their_effects():
    rng = np.random.default_rng(7)
    temperature = 20.0 + np.cumsum(rng.standard_normal(2000)) * 0.05
    samples = rng.standard_normal(2000) + 0.5 * temperature + 20.0 * np.gradient(temperature)
    recording = al.Recording(
        samples,
        rate=1.0,
        unit="deg/s",
        covariates={"temperature": temperature},
        covariate_units={"temperature": "degC"},
    )
    fit = al.fit_model(recording, "N+COV(column=temperature)+DOT(column=temperature,lag=2)")
    units = fit.simulate_check(2, seed=1).units
    assert units["COV.coefficient"] == fit.estimates[1]["coefficient"].unit
    assert units["DOT.coefficient"] == fit.estimates[2]["coefficient"].unit
    assert units["COV.coefficient"] != units["DOT.coefficient"]
