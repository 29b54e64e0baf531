"""Noise that is not normal: its large samples are no outliers, and N is its standard deviation's."""

import numpy as np
import pytest

import allanite as al
from allanite.fit.likelihood.heavy import sum_of_squares_quantiles
from allanite.recording.tails import Tail, outlier_limit, tail_of

RATE, N = 100.0, 20_000


def noise(kind, n, seed):
    """Samples of variance 1 with that marginal distribution."""
    rng = np.random.default_rng(seed)
    if kind == "laplace":
        return rng.laplace(size=n) / np.sqrt(2.0)
    if kind == "uniform":
        return rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), n)
    if kind == "clipped":
        return np.clip(rng.standard_normal(n), -1.5, 1.5)
    if kind == "rounded":
        return 3.0 * np.round(rng.standard_normal(n) / 3.0)
    freedom = float(kind)
    return rng.standard_t(freedom, n) / np.sqrt(freedom / (freedom - 2.0))


@pytest.mark.parametrize("kind", ["3", "5", "laplace", "uniform", "clipped", "rounded"])
def test_a_marginal_is_no_effect(kind):
    for seed in (1, 2):
        fit = al.parse_model("N").fit(al.Recording(noise(kind, N, seed), rate=RATE))
        check = fit.check()
        assert not check.significant
        assert check.adequate


SKEWED = {
    "exponential": lambda rng, n: rng.exponential(size=n),
    "gamma": lambda rng, n: rng.gamma(4.0, size=n),
    "lognormal": lambda rng, n: np.exp(0.8 * rng.standard_normal(n)),
    "mirrored": lambda rng, n: -rng.exponential(size=n),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SKEWED)
def test_the_long_tail_of_a_skewed_law_has_no_outliers(kind):
    """Four records; one in a hundred records of true noise has an outlier."""
    for seed in range(4):
        samples = SKEWED[kind](np.random.default_rng([seed, 6]), N)
        check = al.parse_model("N").fit(al.Recording(samples, rate=RATE)).check()
        assert "outliers" not in {s.kind for s in check.significant}


@pytest.mark.slow
def test_wrong_samples_on_the_short_side_of_a_skewed_law_are_outliers():
    samples = SKEWED["exponential"](np.random.default_rng(1), N)
    samples[[1000, 7000]] -= 8.0
    check = al.parse_model("N").fit(al.Recording(samples, rate=RATE)).check()
    assert check.significant[0].kind == "outliers"
    assert check.significant[0].effect.count == 2


@pytest.mark.parametrize("kind", ["3", "10", "laplace"])
def test_the_interval_is_as_wide_as_the_tails_ask(kind):
    """Relative to a normal sample: √((κ − 1)/2) with κ = 4 for t (10) and 6 for Laplace; more for t (3), which has no κ."""
    fit = al.parse_model("N").fit(al.Recording(noise(kind, N, 3), rate=RATE))
    low, high = fit["N"].interval
    plain = 2 * 1.96 / np.sqrt(2.0 * N)
    wider = np.log(high / low) / plain
    if kind == "3":
        assert wider > 3.0
    else:
        # The fourth moment of 20 000 samples is known to some ten per cent.
        assert wider == pytest.approx(
            np.sqrt((float({"10": 4, "laplace": 6}[kind]) - 1) / 2), rel=0.25
        )


def test_wrong_samples_among_normal_ones_are_outliers():
    samples = noise("1e6", N, 4)
    samples[[1000, 7000, 15_000]] += 12.0
    check = al.parse_model("N").fit(al.Recording(samples, rate=RATE)).check()
    assert check.significant[0].kind == "outliers"
    assert check.significant[0].effect.count == 3


def test_wrong_samples_among_heavy_ones_are_outliers():
    samples = noise("10", N, 5)
    samples[4000] += 40.0
    check = al.parse_model("N").fit(al.Recording(samples, rate=RATE)).check()
    assert check.significant[0].kind == "outliers"
    assert check.significant[0].effect.count == 1


def test_the_freedom_of_a_law_is_found_beside_wrong_samples():
    sizes = np.abs(noise("5", 50_000, 6))
    sizes[:20] = 1000.0
    tail = tail_of(sizes, 0.01)
    assert tail.heavy
    # 1/ν of 50 000 samples is known to 0.005.
    assert tail.inverse_freedom == pytest.approx(0.2, abs=0.02)
    assert tail_of(np.abs(noise("1e6", 50_000, 6)), 0.01).inverse_freedom < 0.02


def test_the_limit_is_what_the_tail_reaches():
    for seed in range(5):
        for kind in ("3", "10", "laplace", "uniform"):
            sizes = np.abs(noise(kind, 5000, seed))
            assert sizes.max() < outlier_limit(sizes, 0.01 / sizes.size)
    sizes = np.abs(noise("1e6", N, 1))
    assert 4.5 < outlier_limit(sizes, 0.01 / N) < 6.5


def test_many_equal_largest_values_make_no_law():
    """A third of the samples is clipped; what is far beyond the range is still an outlier."""
    sizes = np.minimum(np.abs(noise("1e6", N, 2)), 1.0)
    assert outlier_limit(sizes, 0.01 / N) > 1.0
    sizes[:3] = 30.0
    assert 1.0 < outlier_limit(sizes, 0.01 / N) < 30.0


@pytest.mark.parametrize("freedom", [3.0, 5.0])
def test_the_law_of_a_sum_of_squares(freedom):
    """Against 600 simulated records, which give the 2.5 % quantiles to a tenth of their distance from 1."""
    rng = np.random.default_rng(0)
    samples = rng.standard_t(freedom, (600, 5000))
    drawn = (samples**2).mean(axis=1) * (freedom - 2.0) / freedom
    law = Tail(1.0 / freedom, 1.0 / freedom, 1.0 / freedom, 1.0)
    quantiles = sum_of_squares_quantiles(law, np.abs(samples[0]))
    for found, wanted in zip(quantiles, np.quantile(drawn, [0.025, 0.975]), strict=True):
        assert np.log(found) == pytest.approx(np.log(wanted), rel=0.3)
