"""What stands for something else: a cutoff for quantization, a second lag for a random walk, a long lag for a step."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

import allanite as al
import generators as g
from allanite.study.ladder import kinds_added_again

RATE, LENGTH = 50.0, 180_000
N = 0.0126


def _temperature(time_s):
    return 2.0 * np.sin(2 * np.pi * time_s / 2500.0) + 3.0 * np.exp(-time_s / 1500.0)


def _weather(time_s):
    """Variations of a few degrees that resemble no sinusoid."""
    return 2.0 * np.sin(2 * np.pi * time_s / 9000.0) + np.abs(time_s / 8000.0 % 2.0 - 1.0) * 2.0


@pytest.mark.long
def test_a_candidate_is_refitted_with_the_shapes_of_the_others():
    """A filter just below the Nyquist frequency had changed to imitate the quantization: ΔlogL 2 instead of 26."""
    rng = np.random.default_rng(10)
    b, a = signal.butter(2, 24.6 / (RATE / 2))
    x = signal.lfilter(b, a, g.white(rng, LENGTH + 4096, RATE, N))[4096:]
    x += g.quantization(rng, LENGTH, RATE, 2.6e-4)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert {e.kind for e in study.fit.model} == {"angle_random_walk", "bandwidth", "quantization"}
    assert study.adequate


@pytest.mark.long
def test_a_temperature_and_a_walk_come_before_two_lags_of_the_temperature():
    """The second lag imitates the walk: the same logL with one more parameter."""
    rng = np.random.default_rng(3)
    t = np.arange(LENGTH) / RATE
    x = g.white(rng, LENGTH, RATE, N) + g.walk(rng, LENGTH, RATE, 1e-4)
    x += 8.8e-3 * (_temperature(t) - _temperature(t).mean())
    measured = _temperature(t) + 0.01 * rng.standard_normal(LENGTH)
    recording = al.Recording(x, rate=RATE, unit="rad/s", covariates={"temperature": measured})
    study = al.improve(recording, "N")
    assert {e.kind for e in study.fit.model} == {
        "angle_random_walk",
        "covariate",
        "rate_random_walk",
    }
    # Neither came alone: one rung holds both.
    assert len(study.ladder) <= 3


def test_shapes_are_looked_for_again_once_the_functions_of_time_are_known():
    """A lag of an hour once imitated the step in the first round, and had no power left in the second."""
    rng = np.random.default_rng(9)
    x = g.white(rng, LENGTH, RATE, N) + g.step(LENGTH, RATE, 1600.0, 5.5e-3)
    x += g.gauss_markov(rng, LENGTH, RATE, 3.2e-3, 3.5)
    fit = al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), "N+STEP+GM")
    lag = fit.model.effects[-1]
    assert (
        1.2 < lag.correlation_time < 10.0
    )  # a factor of e either way: its scatter is about 0.4 of ln T
    assert fit.estimates[-1]["q_c"].detected


@pytest.mark.slow
def test_a_slow_function_is_looked_for_with_the_amplitudes_of_the_others_free():
    """A warm-up with a temperature that also warms up: the coefficient had halved, and the warm-up was not found."""
    rng = np.random.default_rng(5)
    n, rate = 40_000, 1.0
    t = np.arange(n) / rate
    temperature = 20.0 - 5.0 * np.exp(-t / 900.0) + _weather(t)
    x = g.white(rng, n, rate, 1.74) + g.walk(rng, n, rate, 1e-3)
    x += 0.45 * (temperature - temperature.mean()) - 3.0 * np.exp(-t / 700.0)
    recording = al.Recording(x, rate=rate, unit="mrad/s", covariates={"temperature": temperature})
    fit = al.fit_model(recording, "N+K+COV(column=temperature)")
    first = fit.check().suggestions[0]
    assert first.kind == "warm_up"
    assert first.significant
    better = fit.add(first)
    low, high = better.estimates[2]["coefficient"].interval
    assert low < 0.45 < high


@pytest.mark.long
def test_a_band_near_a_line_is_another_thing():
    """A band one and a half half-widths beside a line was once refused as the same effect, though worth 35 of logL."""
    rng = np.random.default_rng(1)
    x = g.white(rng, LENGTH, RATE, N) + g.sinusoid(LENGTH, RATE, 12.18, 2.8e-3)
    x += g.resonance(rng, LENGTH, RATE, 11.5, 0.035, 9e-3)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert {e.kind for e in study.fit.model} == {"angle_random_walk", "sinusoid", "resonance"}
    assert study.adequate


@pytest.mark.long
def test_a_power_law_gives_way_to_a_walk_and_a_lag():
    """Once an exponent between theirs described both; or flicker did, and a filter and a band the remainder."""
    rng = np.random.default_rng(1)
    x = g.white(rng, LENGTH, RATE, N) + g.walk(rng, LENGTH, RATE, 2.8e-4)
    x += g.gauss_markov(rng, LENGTH, RATE, 2.5e-3, 13.0)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    kinds = {e.kind for e in study.fit.model}
    assert {"angle_random_walk", "gauss_markov"} < kinds
    assert not {"power_law", "bias_instability", "bandwidth", "resonance"} & kinds
    # In this record a ramp in place of the walk has 3 more of logL: the walk stands beside it.
    undecided = study.undecided
    assert "rate_random_walk" in kinds or "N+GM+K" in dict(undecided.models)
    assert study.adequate


@pytest.mark.slow
def test_the_filter_of_the_model_is_designed_anew_beside_what_was_missing():
    """Flicker in the stop band had changed the design of the filter, which one or two resonances then repaired."""
    rng = np.random.default_rng([0, 11])
    b, a = signal.butter(2, 8.0 / (RATE / 2))
    x = signal.lfilter(b, a, g.white(rng, 20_000 + 4096, RATE, N))[4096:]
    x += g.flicker(rng, 20_000, RATE, 0.008)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    kinds = {e.kind for e in study.fit.model}
    assert kinds == {"angle_random_walk", "bandwidth", "bias_instability"}
    pairs = zip(study.fit.model, study.fit.estimates, strict=True)
    (values,) = (values for effect, values in pairs if effect.short == "BW")
    assert values["design"] == "digital"
    assert values["order"] == 2
    low, high = study.fit["BW.cutoff"].interval
    assert low < 8.0 < high


def test_what_has_left_and_come_back_is_needed():
    """Another effect of this kind that never left is not needed: it may be dropped."""
    rungs = [
        SimpleNamespace(new=new, removed=removed)
        for new, removed in [
            ((), ()),
            ((al.effects.Resonance(), al.effects.Resonance()), ("rate_random_walk",)),
            ((al.effects.DriftingResonance(),), ("resonance",)),
            ((al.RateRandomWalk(),), ()),
        ]
    ]
    assert kinds_added_again(rungs[:3]) == set()
    assert kinds_added_again(rungs) == {"rate_random_walk"}


@pytest.mark.long
def test_what_is_nothing_beside_another_leaves_in_the_same_step():
    """Flicker was added first, as half of a pair with a power law, and once stayed with a coefficient of 0."""
    rng = np.random.default_rng([17, 3])
    rng.uniform()
    x = g.white(rng, LENGTH, RATE, N)
    for q_c, time in ((0.0245042, 0.4992634), (0.00774891, 4.992634)):
        x += g.gauss_markov(rng, LENGTH, RATE, q_c, time)
    study = al.improve(al.Recording(x, rate=RATE, unit="rad/s"), "N")
    assert all(effect.values[effect.coefficient] > 0.0 for effect in study.fit.model.stochastic)
