"""A mean over many samples is read from the zeros of the spectrum; the design of a filter that is given stays."""

import numpy as np
import pytest

import allanite as al
import generators as g


def _mean_of(length, n, seed, rate=100.0):
    rng = np.random.default_rng([seed, length])
    white = g.white(rng, n + length - 1, rate, 0.01)
    return al.Recording(np.convolve(white, np.ones(length) / length, "valid"), rate, unit="deg/s")


@pytest.mark.slow
@pytest.mark.parametrize(("length", "n"), [(50, 10_000), (230, 12_000)])
def test_a_mean_over_many_samples_is_named(length, n):
    study = al.improve(_mean_of(length, n, 1), "N+B+K")
    (found,) = (e for e in study.fit.model if e.kind == "bandwidth")
    assert (found.design, found.order) == ("moving_average", 1)
    # −3 dB of a mean over a time T is 0.4429/T.
    assert found.cutoff == pytest.approx(0.442947 * 100.0 / length, rel=2e-3)
    assert {"rate_random_walk", "gauss_markov"}.isdisjoint(e.kind for e in study.fit.model)
    # White noise behind the mean of L samples leaves n/L independent ones; five standard errors of an amplitude.
    assert study.fit["N"] == pytest.approx(0.01, rel=5.0 / np.sqrt(2.0 * n / length))


@pytest.mark.slow
def test_a_design_that_is_given_stays():
    study = al.improve(_mean_of(50, 10_000, 2), "N+BW(design=sampled,order=2)", limit=1)
    (found,) = (e for e in study.fit.model if e.kind == "bandwidth")
    assert (found.design, found.order) == ("sampled", 2)
    assert not study.adequate


@pytest.mark.parametrize("seed", range(20))
def test_no_mean_is_seen_in_white_noise(seed):
    power = np.random.default_rng([seed, 4]).standard_normal(20_000) ** 2
    assert al.effects.Bandwidth.seen_in(power, 100.0) == ()


@pytest.mark.slow
def test_leakage_from_the_ends_of_a_mean_is_no_event():
    """At the zeros of the filter only leakage remains, which all ordinates share; it once looked like steps and decays."""
    false = 0
    for seed in range(12):
        fit = al.fit_model(_mean_of(40, 9000, 100 + seed), "N+BW(design=moving_average,order=1)")
        kinds = {s.kind for s in fit.check().significant}
        false += not kinds.isdisjoint(
            {"bias_step", "transition", "excursion", "transient", "warm_up"}
        )
    # At 1 % false alarms, two of twelve records have one with a probability of 0.6 %.
    assert false <= 1


@pytest.mark.slow
def test_a_jump_after_a_mean_is_found():
    """A jump within a twentieth of a second is a step or a transition, and nothing is found at the ends of the record."""
    samples = np.asarray(_mean_of(40, 9000, 3).samples).ravel()
    record = al.Recording(samples + 0.02 * (np.arange(9000) > 4000), 100.0, unit="deg/s")
    first = al.fit_model(record, "N+BW(design=moving_average,order=1)").check().significant[0]
    assert first.kind in {"bias_step", "transition"}
    assert np.asarray(first.effect.when) == pytest.approx(40.0, abs=0.1)
    assert first.effect.height == pytest.approx(0.02, rel=0.2)
