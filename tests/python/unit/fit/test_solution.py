"""A solution is a tuple of fitted effects: each has what is its own, wherever it stands in the model."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.engine import solve
from allanite.fit.estimates import estimates, with_noise_uncertainty
from allanite.fit.marginal import Mixture
from allanite.fit.solution import Process, Regressed

PARTS = ("N", "K", "SIN(frequency=2.1)", "R", "LEVEL(start=100,end=200,factor=1.5)")


@pytest.fixture(scope="module")
def recording():
    truth = "N(N=0.01)+K(K=1e-3)+SIN(frequency=2.1,amplitude=0.02)+R(R=1e-4)"
    model = al.parse_model(f"{truth}+LEVEL(start=100,end=200,factor=1.5)")
    return model.simulate(duration=1000, rate=10, seed=3, unit="deg/s")


def test_each_effect_has_what_is_its_own(recording):
    solution = al.parse_model("+".join(PARTS)).fit(recording).solution
    assert solution.model.effects == tuple(own.effect for own in solution.effects)
    white, walk, line, ramp, change = solution.effects
    assert [type(own) for own in (white, walk, line, ramp)] == [*[Process] * 2, *[Regressed] * 2]
    assert change.effect.kind == "noise_level_change"
    assert pytest.approx(np.sqrt(white.theta)) == white.effect.N
    assert pytest.approx(np.sqrt(walk.theta)) == walk.effect.K
    assert (ramp.amplitudes == ramp.effect.amplitudes()).all()
    assert line.amplitudes == pytest.approx(line.effect.amplitudes())
    assert line.covariance.shape == (2, 2)
    assert line.matrix.shape == (line.ordinates.size, 2)
    assert np.isin(line.ordinates, solution.regressed_ordinates).all()
    assert solution.regressed_ordinates.size == np.union1d(line.ordinates, ramp.ordinates).size
    # The vectors are made of the effects.
    assert solution.theta.tolist() == [white.theta, walk.theta]
    np.testing.assert_array_equal(solution.columns[:, 1], walk.column)
    expected = white.power + walk.power
    np.testing.assert_allclose(solution.spectrum, expected, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("order", list(permutations(range(4)))[5::6])
def test_the_order_of_a_model_changes_no_number(recording, order):
    parts = [*PARTS[:4], PARTS[4]]
    first = al.parse_model("+".join(parts)).fit(recording)
    other = al.parse_model("+".join([PARTS[4], *(parts[i] for i in order)])).fit(recording)
    for name in ("N", "K", "R"):
        one, two = first[name], other[name]
        # Sums in another order, and a climb that ends where logL rises by less than 1e-9 of itself.
        assert float(two) == pytest.approx(float(one), rel=1e-5)
        # The law of R is an average over 400 draws of the noise (`fit.marginal`), other ones in another order: its
        # width is known to about 1/√800, 4 %.
        drawn = 0.1 if name == "R" else 1e-3
        assert two.std_error == pytest.approx(one.std_error, rel=drawn)
        assert two.interval == pytest.approx(one.interval, rel=drawn)


def test_held_values_stay(recording):
    model = al.parse_model("R(R=1e-4!)+K+SIN(frequency=2.1)+N(N=0.02!)")
    ramp, walk, line, white = model.fit(recording).solution.effects
    assert (ramp.effect.R, white.effect.N) == (1e-4, 0.02)
    assert ramp.covariance[0, 0] == 0.0
    assert line.covariance[0, 0] > 0.0
    assert walk.theta > 0.0


def test_one_object_twice(recording):
    lag = al.GaussMarkov(correlation_time=5.0, q_c=1e-3, hold=("q_c", "correlation_time"))
    model = al.Model((lag, al.AngleRandomWalk(), lag))
    first, _, last = al.fit_model(recording, model).solution.effects
    assert first is not last
    assert first.theta == last.theta == pytest.approx(1e-6)


def test_without_functions_of_time_nothing_is_regressed(recording):
    fit = al.parse_model("N+K").fit(recording)
    found = solve(fit.data, fit.model)
    assert found.functions == ()
    assert found.regressed_ordinates.size == found.leverage.size == 0
    assert found.removed_functions == ()


@pytest.mark.parametrize("away", [0.0, 2.0, 8.0, -8.0])
def test_an_interval_over_the_noise_holds_its_value(away):
    """With equally likely noise, the best height is elsewhere, so the value was once outside of its own interval."""
    step = al.effects.BiasStep(time=10.0, height=1.0)
    law = Mixture(np.array([[1.0 + 0.1 * away]]), np.array([[[0.01]]]), np.ones(1))
    _, (low, high) = with_noise_uncertainty(step, {"height": (0.1, (0.8, 1.2))}, law)["height"]
    assert low <= 1.0 <= high
    assert low <= law.interval(0)[0]
    assert high >= law.interval(0)[1]


@pytest.mark.parametrize(
    ("term", "shape"),
    [
        ("WARM(time_constant=150)", lambda t: np.exp(-t / 150.0)),
        ("R", lambda t: t / 2000.0),
        ("RISE(begin=600,end=1100)", lambda t: np.clip((t - 600.0) / 500.0, 0.0, 1.0)),
    ],
)
def test_the_error_of_a_slow_function_knows_of_flicker_that_is_not_in_the_model(term, shape):
    """Without slow noise in the model, flicker that is too weak to be detected still widens the interval."""
    n, rate = 20_000, 10.0
    t = np.arange(n) / rate
    rng = np.random.default_rng(7)
    samples = g.white(rng, n, rate, 0.01) + g.flicker(rng, n, rate, 1e-3)
    log = al.Recording(samples + 0.02 * shape(t), rate=rate, unit="deg/s")
    without, beside = (al.fit_model(log, f"{noise}+{term}") for noise in ("N", "N+B"))
    one, other = without.estimates[-1], beside.estimates[-1]
    for name in one:
        # Each is an average over 400 draws of the noise, known to 4 %; without the average it is about two thirds. The
        # fitted values differ, and the error of a time constant is proportional to it.
        errors = [each[name].std_error / abs(each[name].value) for each in (one, other)]
        assert errors[0] == pytest.approx(errors[1], rel=0.15)


def two_lags(seed):
    """White noise and two Gauss-Markov processes, 2000 s at 10 Hz."""
    rng, n, rate = np.random.default_rng([seed, 9]), 20_000, 10.0
    x = g.gauss_markov(rng, n, rate, 1.5e-2, 1.0) + g.gauss_markov(rng, n, rate, 5e-3, 30.0)
    return al.Recording(x + g.white(rng, n, rate, 0.01), rate=rate, unit="deg/s")


def test_a_resonance_does_not_keep_the_place_of_a_line_that_is_found_later():
    """A line has most of the power; before its frequency is known, the resonance describes it."""
    rng, n, rate = np.random.default_rng(0), 8000, 10.0
    x = g.white(rng, n, rate, 0.01) + g.resonance(rng, n, rate, 2.0, 0.03, 0.02)
    x += 0.2 * np.sin(2.0 * np.pi * 1.3 * np.arange(n) / rate)
    fit = al.fit_model(al.Recording(x, rate=rate, unit="deg/s"), "N+RES+SIN")
    assert fit["RES.frequency"] == pytest.approx(2.0, abs=0.05)
    assert fit["SIN.frequency"] == pytest.approx(1.3, abs=1e-4)


@pytest.mark.parametrize("start", [(10.0, 0.5), (15.5, 0.76), (60.0, 3.0), (5.0, 0.2)])
def test_a_fit_reaches_the_maximum_from_other_start_values(start):
    """The grid search and any start near the two time constants end at one maximum."""
    log = two_lags(3)
    best = al.fit_model(log, "N+GM+GM").solution.log_likelihood
    slow, fast = start
    found = al.fit_model(log, f"N+GM(correlation_time={slow})+GM(correlation_time={fast})")
    assert found.solution.log_likelihood == pytest.approx(best, abs=0.01)


def test_the_estimates_of_the_last_effect_are_those_of_all_effects():
    log = al.parse_model("N(N=0.1)+K(K=0.01)+STEP(time=300,height=1)").simulate(
        rate=10.0, duration=1000.0, seed=1
    )
    for model in ("K+N", "N+K", "N+K+STEP(time=300)", "N+BW"):
        fit = al.fit_model(log, model)
        [alone] = estimates(fit.solution, fit.data, log, [len(fit.model) - 1])
        assert alone == fit.estimates[-1]
