"""Moves of the search that the score decides: which of several suggestions is added, and what leaves."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit import refitted
from allanite.fit.missing import completion
from allanite.fit.rivals.evidence import evidence_gain
from allanite.study.ladder import Rung
from allanite.study.moves.add import with_addition
from allanite.study.moves.drop import models_with_one_dropped, without_needless_effects
from allanite.study.moves.replace import models_with_replacement
from allanite.study.state import State
from allanite.study.steps import next_step

RATE = 50.0


@pytest.mark.parametrize("seed", [11, 17])
def test_the_score_tells_which_of_the_suggestions_is_missing(seed):
    """A weak low-pass filter: a broad resonance is significant with a lower score, or the whole curve alone is off."""
    white = np.random.default_rng([seed, 11]).standard_normal(4701)
    samples = np.convolve(white, [0.94, 0.06], "valid")
    study = al.improve(al.Recording(samples, rate=100.0, unit="deg/s"), "N")
    assert study.adequate
    assert [e.short for e in study.fit.model] == ["N", "BW"]


@pytest.mark.parametrize("there", [False, True])
def test_a_band_leaves_if_it_costs_more_than_it_explains(there):
    rng = np.random.default_rng(4)
    samples = g.white(rng, 20_000, RATE, 0.01)
    if there:
        samples += g.resonance(rng, 20_000, RATE, 5.0, 0.05, 0.02)
    before = State.of(al.fit_model(al.Recording(samples, rate=RATE, unit="deg/s"), "N"))
    band = al.effects.Resonance(frequency=5.0, damping=0.05)
    after = before.after(refitted(before.fit, before.fit.model + band))
    [(promised, places, model, _)] = models_with_one_dropped(after, ())
    assert (places, model.name) == ((1,), "N")
    # Three parameters cost ½ ln n each, and white noise pays for less than two of them.
    assert (promised < 0.0) if there else (promised > 0.5 * np.log(10_000))
    assert not list(models_with_one_dropped(after, {"resonance"}))


@pytest.mark.parametrize("seed", range(4))
def test_a_column_leaves_if_it_is_not_detected_beside_its_hysteresis(seed):
    """It explains 0.4 to 2.2 nats, more than the cost of a coefficient near 0, but would be printed as not detected."""
    rng, n = np.random.default_rng(seed), 20_000
    temperature = g.temperature(n, 1.0, 6000.0)
    samples = g.white(rng, n, 1.0, 0.02) + 0.01 * g.backlash(temperature, 1.0)
    columns = {"temperature": temperature}
    fit = al.fit_model(al.Recording(samples, 1.0, unit="m/s^2", covariates=columns), "N")
    before = State.of(fit)
    for effect in (al.effects.Covariate, al.effects.Hysteresis):
        last = before
        before = last.after(refitted(last.fit, last.fit.model + effect(column="temperature")))
    assert without_needless_effects(last, before, ()).fit.model.name == "N+HYS"


def test_a_split_promises_what_its_refit_gains():
    """A lag of 300 s and a warm-up instead of a random walk: the refit gains more than the shapes of the grid."""
    rng, n = np.random.default_rng(1), 20_000
    samples = g.white(rng, n, 1.0, 0.02) + g.gauss_markov(rng, n, 1.0, 6e-5, 300.0)
    samples += g.settling(n, 1.0, 1500.0, -0.006)
    fit = al.fit_model(al.Recording(samples, 1.0, unit="deg/s"), "N+K")
    lasting = {"gauss_markov", "bias_instability", "rate_ramp", "quantization"}
    clear = 0
    for promised, places, model, _ in models_with_replacement(fit):
        if len(model) < 3:
            continue  # one effect instead of the random walk
        assert places == (1,)
        gain = evidence_gain(refitted(fit, model).solution, fit.solution, fit.data)
        # Two effects replace a random walk by evidence alone if both last; a pair with a one-time event costs 3 nats.
        price = 0.0 if {e.kind for e in model.effects[-2:]} <= lasting else 3.0
        assert promised == pytest.approx(gain - price, abs=0.1)
        clear += promised > 0.5
    assert clear


def test_an_effect_of_the_start_may_come_back_in_the_last_step():
    """A split brings back the random walk, which an earlier step dropped: nothing is known about it before."""
    rng = np.random.default_rng(3)
    samples = g.white(rng, 4000, RATE, 0.01) + g.gauss_markov(rng, 4000, RATE, 0.02, 5.0)
    record = al.Recording(samples, rate=RATE, unit="deg/s")
    first = State.of(al.fit_model(record, "N+B+K"))
    before = first.after(al.fit_model(record, "N+B"), (2,))
    after = before.after(al.fit_model(record, "N+K+GM"), (1,))
    assert (before.numbers, after.numbers) == ((0, 1), (0, 2, 3))
    assert 2 in without_needless_effects(before, after, ()).numbers


def test_a_lag_and_a_ramp_are_not_called_flicker():
    """A lag of 10 s and a ramp, each of about 30 nats: most are named."""
    n, rate = 100_000, 100.0
    found = []
    for seed in range(8):
        rng = np.random.default_rng([seed, 9])
        samples = g.white(rng, n, rate, 0.01) + g.gauss_markov(rng, n, rate, 0.0018457, 10.0)
        record = al.Recording(samples + 1.78e-5 * np.arange(n) / rate, rate, unit="deg/s")
        found.append({effect.kind for effect in al.improve(record, "N").fit.model})
    truth = {"angle_random_walk", "gauss_markov", "rate_ramp"}
    assert sum(kinds == truth for kinds in found) >= 5


def test_only_an_accepted_step_completes_missing_samples_again(monkeypatch):
    """With many gaps, completing them takes nearly all of the time of a trial."""
    rng = np.random.default_rng(3)
    samples = 0.1 * rng.standard_normal(3000) + 0.2 * np.sin(0.817 * np.arange(3000))
    samples[rng.random(3000) < 0.3] = np.nan
    fit = al.fit_model(al.Recording(samples, 10.0), "N")
    check = fit.check()
    calls = []

    def complete_and_fit(*given):
        """Count the call, and complete."""
        calls.append(given)
        return completion.complete_and_fit(*given)

    monkeypatch.setattr("allanite.fit.fitting.complete_and_fit", complete_and_fit)
    for suggestion in check.suggestions[:4]:
        trial = with_addition(State.of(fit), suggestion)
        assert trial is None or trial.fit.data is fit.data
    assert not calls
    rung = next_step([Rung(fit)], check)
    assert rung.fit.model.name == "N+SIN"
    assert rung.fit.data is not fit.data
    assert len(calls) == 1
