"""A model that fails no view is called adequate only if its Allan error and its rivals allow it."""

import numpy as np
import pytest
from scipy.signal import lfilter

import allanite as al
import generators as g
from allanite.fit.rivals.undecided import Undecided, undecided
from allanite.fit.table import undecided_sentence


def slow_rise():
    """A quantized sensor with one rise of half an hour and a weak walk."""
    rng = np.random.default_rng(0)
    n = 43_200
    t = np.arange(n)
    x = rng.normal(0.0, 1.57e-3, n) + 6e-4 * np.clip((t - 26_000) / 3400, 0.0, 1.0)
    x += 2e-3 * np.clip((t - 29_200) / 1600, 0.0, 1.0) + np.cumsum(rng.normal(0.0, 4e-7, n))
    return al.Recording(np.round(x / 5.3e-4) * 5.3e-4, rate=1.0, unit="rad/s")


def lag_and_ramp(seed):
    """White noise, a lag of 10 s and a ramp."""
    rng = np.random.default_rng([seed, 21])
    n, rate = 100_000, 100.0
    phi, sigma = np.exp(-1.0 / (rate * 10.0)), 0.0018457 * np.sqrt(5.0)
    drive = sigma * rng.standard_normal(n)
    drive[1:] *= np.sqrt(1.0 - phi**2)
    x = 0.1 * rng.standard_normal(n) + lfilter([1.0], [1.0, -phi], drive)
    return al.Recording(x + 1.78e-5 * np.arange(n) / rate, rate=rate, unit="deg/s")


def test_a_curve_beyond_twice_its_scatter_is_not_adequate():
    """One of 400 records of white noise: only its Allan deviation is off, by chance."""
    x = np.random.default_rng([57, 5]).standard_normal(4000)
    study = al.improve(al.Recording(x, 10.0), "N")
    assert study.check.adequate
    assert not study.adequate
    assert (study.verdict, study.stopped_because) == ("unexplained", "nothing helps")
    document = study.to_dict()
    assert (document["adequate"], document["stopped_because"]) == (False, "nothing helps")
    text = str(study)
    assert "rms from the model, where" in text
    assert ": adequate" not in text


@pytest.mark.long
def test_a_rise_of_half_an_hour_is_no_random_walk():
    """Its walk of 5 °/h/√h must not be measured as 87."""
    study = al.improve(slow_rise(), "N+B+K")
    assert study.adequate
    assert "transition" in {e.kind for e in study.fit.model}
    low, high = study.fit["K"].interval
    assert low <= 4e-7 <= high


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_two_effects_in_the_place_of_one_are_named_with_their_weight(seed):
    """They may also be the model itself."""
    study = al.improve(lag_and_ramp(seed), "N")
    if sorted(e.short for e in study.fit.model) == ["GM", "N", "R"]:
        return
    weights = dict(study.undecided.models)
    assert weights["N+R+GM"] > 0.3
    assert sum(weights.values()) == pytest.approx(1.0)
    # The table says beside B what may take its place, with the odds.
    with_ramp = "rate_ramp" in {e.kind for e in study.fit.model}
    instead = "Gauss-Markov process" if with_ramp else "rate ramp and Gauss-Markov process"
    assert f"not needed in a model with {instead} (" in str(study)
    # One that leads by more than 3 nats is no alternative: the model is wrong.
    ahead = np.log(max(weights.values()) / weights[study.fit.model.name])
    assert study.adequate == bool(ahead <= 3.0)


def test_a_fit_that_needs_a_discrepancy_says_so():
    """The p-value of white noise with a weak line, fitted by white noise, allows for the error of the model."""
    rng, n = np.random.default_rng([3, 9]), 6000
    x = g.white(rng, n, 10.0, 0.005) + g.sinusoid(n, 10.0, 2.5, 2e-3, 1.0)
    fit = al.fit_model(al.Recording(x, rate=10.0, unit="deg/s"), "N")
    assert fit.discrepancy.percent > 0.0
    assert fit.misfit.p_value > 0.01
    assert "not adequate (only with a model discrepancy)" in str(fit)


def test_a_p_value_below_one_percent_is_shown_with_its_limit():
    """An adequate fit with p = 0.002 would look like a contradiction."""
    x = 0.01 * np.random.default_rng([72, 9]).standard_normal(4000)
    fit = al.fit_model(al.Recording(x, rate=10.0, unit="deg/s"), "N")
    assert 0.001 < fit.misfit.p_value < 0.01
    assert "p = 0.0074 (limit 0.001): adequate" in str(fit)


@pytest.mark.parametrize("n", [10_000, 100_000])
def test_a_spectrum_smoother_than_noise_is_not_adequate(n):
    """Two spikes hold nearly all of the power, and their spectrum has no scatter: χ²/dof is below 0.4."""
    x = 0.01 * np.random.default_rng(2).standard_normal(n)
    x[3 * n // 10] += 1000.0
    x[6 * n // 10] -= 1000.0
    fit = al.fit_model(al.Recording(x, rate=10.0, unit="deg/s"), "N+B+K")
    assert fit.misfit.p_value > 0.9
    assert fit.misfit.is_too_small
    assert not fit.adequate
    assert "not adequate (χ² is smaller than that of noise)" in str(fit)


@pytest.mark.parametrize("seed", [1, 4])
def test_a_model_that_is_too_high_at_all_long_times_is_not_adequate(seed):
    """A bias that stops walking after 300 s, fitted by a random walk: no single τ fails, but all long ones are too high."""
    rng, n = np.random.default_rng([seed, 5]), 20_000
    x = g.white(rng, n, 1.0, 0.7) + g.gauss_markov(rng, n, 1.0, 8e-3, 300.0)
    fit = al.fit_model(al.Recording(x, rate=1.0, unit="deg/s"), "N+K")
    assert fit.misfit.p_value > 0.001
    assert "not adequate (the Allan deviation contradicts it)" in str(fit)
    assert np.abs(fit.curve.z).max() < 4.0
    assert fit.curve.rms_percent > 3.0 * fit.curve.expected_scatter_percent
    assert not fit.adequate
    assert al.fit_model(fit.recording, "N+GM").adequate


@pytest.mark.parametrize(("ends", "words"), [((-2e-4, 0.0), "R −"), ((0.0, 0.0), "no R")])
def test_an_interval_of_negative_values_is_named(ends, words):
    """A ramp that falls has an interval that ends at 0 if alternatives have no ramp."""
    x = 0.1 * np.random.default_rng(1).standard_normal(20_000) - 1e-5 * np.arange(20_000)
    fit = al.fit_model(al.Recording(x, rate=10.0, unit="deg/s"), "N+R")
    found = Undecided((("N+R", 0.6), ("N+K", 0.4)), ({}, {"R": ends}))
    sentence = undecided_sentence(fit, found)
    assert f"over all of them {words}" in sentence


@pytest.mark.parametrize("seed", range(3))
def test_a_lag_and_a_ramp_are_listed_beside_flicker(seed):
    """The correlation time of the lag alone is ten times too long; only beside the ramp it is right."""
    rng = np.random.default_rng([seed, 21])
    n, rate = 20_000, 20.0
    x = g.white(rng, n, rate, 0.01) + g.gauss_markov(rng, n, rate, 2e-3, 10.0)
    fit = al.fit_model(al.Recording(x + 9e-6 * np.arange(n) / 10.0, rate), "N+B")
    kinds = [
        {effect.kind for effect in pair.model.effects[-2:]} for pair in fit.alternative_pairs(1)
    ]
    assert {"gauss_markov", "rate_ramp"} in kinds


@pytest.mark.parametrize("seed", [2, 3])
def test_no_alternative_is_much_more_likely_than_the_model_shown(seed):
    """A steep process: a power law has 2 nats more than a random walk, and needs 3 more because it names no cause."""
    rng = np.random.default_rng([seed, 76])
    n, rate = 30_000, 1.0
    x = g.white(rng, n, rate, 0.02) + g.power_law(rng, n, rate, -2.3, 2e-4)
    study = al.improve(al.Recording(x, rate), "N+B+K")
    assert study.undecided is not None
    (_, own), *others = study.undecided.models
    assert max(p for _, p in others) <= own * np.exp(0.5)


def test_no_alternatives_are_listed_for_a_fit_that_is_not_adequate():
    """The intervals of such a fit do not hold, and those averaged over the alternatives do not either."""
    rng = np.random.default_rng(75)
    x = g.white(rng, 20_000, 10.0, 0.02) + g.gauss_markov(rng, 20_000, 10.0, 0.05, 3.0)
    fit = al.fit_model(al.Recording(x, 10.0), "N+K")
    assert not fit.adequate
    assert undecided(fit) is None
