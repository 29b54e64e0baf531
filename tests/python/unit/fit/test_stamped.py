"""The filter at arbitrary times against dense covariances."""

import numpy as np
import pytest

import allanite as al
from allanite import _kernels
from allanite.effects.terms import Blue, Exponential, Flicker, Lags, PowerLaw, RandomWalk, White
from allanite.fit.stamped.candidates import Candidate, fit_noise
from allanite.fit.stamped.likelihood import StampedSeries
from allanite.fit.stamped.noise import StampedNoise, integrated_noise, sampled_noise, sum_of_noises


def covariance(noise, t):
    """Covariance of the samples from the autocovariances of lags, of their integrals and of a walk."""
    t = t.astype(np.longdouble)  # slow lags are differences of nearly equal numbers
    apart = np.abs(t[:, None] - t[None, :])
    first = np.minimum(t[:, None], t[None, :]) - t[0]
    out = noise.white * np.eye(t.size) + noise.walk * first
    for variance, rate, summed in noise.gauss_markov:
        if not summed:
            out += variance * np.exp(-rate * apart)
            continue
        a, b = t[:, None] - t[0], t[None, :] - t[0]
        # ∫∫ e^{−λ|u−v|} over [0, a] × [0, b]
        both = (
            2.0 * rate * first - 1.0 + np.exp(-rate * a) + np.exp(-rate * b) - np.exp(-rate * apart)
        )
        out += variance * both / rate**2
    return out.astype(float) if not any(rate < 1e-5 for _, rate, _ in noise.gauss_markov) else out


def test_likelihood_and_regression_equal_those_of_the_dense_covariance():
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.2, 3.0, 60))
    noise = StampedNoise(((1.5, 0.3, True), (2.0, 0.05, False), (0.7, 4.0, False)), 0.4, 0.6)
    y = rng.standard_normal(60)
    design = np.array([np.ones(60), t, t > 40.0], dtype=float)
    series = StampedSeries(t, y, design)
    found = series.regressed(noise)

    dense = covariance(noise, t)
    inverse = np.linalg.inv(dense)
    normal = design @ inverse @ design.T
    amplitudes = np.linalg.solve(normal, design @ inverse @ y)
    left = y - amplitudes @ design
    squares = left @ inverse @ left
    logs = np.linalg.slogdet(dense)[1] + np.linalg.slogdet(normal)[1]
    assert found.amplitudes == pytest.approx(amplitudes, rel=1e-9)
    assert found.covariance == pytest.approx(np.linalg.inv(normal), rel=1e-9)
    assert found.squares == pytest.approx(squares, rel=1e-9)
    expected = -0.5 * (57 * np.log(2 * np.pi) + logs + squares)
    assert found.log_likelihood == pytest.approx(expected, rel=1e-10)
    scaled = series.regressed(noise.scaled(found.scale))
    assert scaled.log_likelihood == pytest.approx(found.profiled, rel=1e-10)

    later = np.array([t[-1] + 2.0, t[-1] + 30.0])
    there = np.array([np.ones(2), later, np.ones(2)])
    likelihood, mean, variance = series.predicted(noise, later, there)
    assert likelihood == pytest.approx(found.log_likelihood, rel=1e-12)
    every = covariance(noise, np.concatenate([t, later]))
    gain = every[60:, :60] @ inverse
    assert mean == pytest.approx(amplitudes @ there + gain @ left, rel=1e-8)
    unexplained = there - design @ gain.T
    known = np.diag(every[60:, 60:] - gain @ every[:60, 60:])
    assert variance == pytest.approx(
        known + np.diag(unexplained.T @ np.linalg.inv(normal) @ unexplained), rel=1e-8
    )


def test_a_prior_of_the_last_amplitude_lies_between_a_flat_one_and_none():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.2, 3.0, 60)) - 100.0
    noise = StampedNoise(((1.5, 0.3, True),), 0.4, 0.6)
    design = np.array([np.ones(60), t, 0.5 * t**2])
    y = rng.standard_normal(60) + 0.01 * t**2
    later = t[-1] + np.array([2.0, 30.0])
    there = np.array([np.ones(2), later, 0.5 * later**2])
    whole, part = StampedSeries(t, y, design), StampedSeries(t, y, design[:2])
    found = whole.predicted(noise, later, there, (np.inf, 1e-9, 0.02))
    for one, other in (
        (0, whole.predicted(noise, later, there)),
        (1, part.predicted(noise, later, there[:2])),
    ):
        for many, single in zip(found, other, strict=True):
            assert many[one] == pytest.approx(single, rel=1e-6)
    # A random drift is noise: its covariance is added to that of the samples.
    dense = covariance(noise, np.concatenate([t, later])) + 0.02**2 * np.outer(
        *2 * [np.concatenate([design[2], there[2]])]
    )
    inverse = np.linalg.inv(dense[:60, :60])
    normal = design[:2] @ inverse @ design[:2].T
    amplitudes = np.linalg.solve(normal, design[:2] @ inverse @ y)
    gain = dense[60:, :60] @ inverse
    assert found[1][2] == pytest.approx(
        amplitudes @ there[:2] + gain @ (y - amplitudes @ design[:2]), rel=1e-6
    )
    unexplained = there[:2] - design[:2] @ gain.T
    known = np.diag(dense[60:, 60:] - gain @ dense[:60, 60:])
    more = np.diag(unexplained.T @ np.linalg.inv(normal) @ unexplained)
    assert found[2][2] == pytest.approx(known + more, rel=1e-6)


def test_the_last_slope_equals_that_of_the_dense_covariance():
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.2, 3.0, 60))
    lags = ((1.5, 0.3, True), (0.8, 0.02, True), (2.0, 0.05, False))
    noise = StampedNoise(lags, 0.4, 0.6)
    y = rng.standard_normal(60)
    design, slopes = np.array([np.ones(60), t - t[-1], (t - t[-1]) ** 2]), np.array([0.0, 1.0, 0.0])
    value, variance = StampedSeries(t, y, design).last_slope(noise, slopes)

    inverse = np.linalg.inv(covariance(noise, t))
    normal = np.linalg.inv(design @ inverse @ design.T)
    amplitudes = normal @ design @ inverse @ y
    # cov(u(T), ∫ u) = ∫ a e^(−λ(T − s)) ds from the first time to t.
    common = sum(
        a / r * (np.exp(-r * (t[-1] - t)) - np.exp(-r * (t[-1] - t[0]))) for a, r, s in lags if s
    )
    gain = common @ inverse
    unexplained = slopes - design @ gain
    known = 1.5 + 0.8 - gain @ common
    assert value == pytest.approx(slopes @ amplitudes + gain @ (y - amplitudes @ design), rel=1e-9)
    assert variance == pytest.approx(known + unexplained @ normal @ unexplained, rel=1e-9)


@pytest.mark.parametrize(
    "term",
    [
        White(2.0),
        Flicker(3.0),
        RandomWalk(0.5),
        PowerLaw(-0.4, 1.0),
        PowerLaw(-1.6, 1.0),
        PowerLaw(-2.0, 1.0),
        Exponential(2.0, 0.9),
    ],
    ids=repr,
)
def test_samples_have_the_variogram_of_the_term(term):
    n, rate = 400, 0.25
    noise = sampled_noise(term, rate, n)
    t = np.arange(n) / rate
    dense = covariance(noise, t)
    found = 0.5 * (dense[0, 0] + dense.diagonal() - 2.0 * dense[0])
    # The bank describes a power law to 0.1 % of its density.
    assert found == pytest.approx(term.variogram(n), rel=4e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("term", "close"),
    [(White(2.0), 1e-9), (Blue(3.0), 1e-9), (RandomWalk(0.5), 0.01), (Flicker(1.0), 0.03)],
    ids=repr,
)
def test_integrals_have_the_allan_variance_of_the_term(term, close):
    # Of one sample continuous and sampled noise differ; the Allan variance over many samples is the same.
    n, rate = 600, 2.0
    noise = integrated_noise(term, rate, n)
    t = np.arange(n) / rate
    dense = covariance(noise, t)
    m = 64 if close > 1e-6 else 1
    weights = np.zeros(n, dtype=np.longdouble)
    weights[[100, 100 + m, 100 + 2 * m]] = 1.0, -2.0, 1.0
    found = 0.5 * float(weights @ dense @ weights) * (rate / m) ** 2
    assert found == pytest.approx(float(term.allan_variance(np.array([float(m)]))[0]), rel=close)


def test_parts_of_one_rate_are_one_lag():
    one = StampedNoise(((1.0, 0.1, False),), 1.0, 2.0)
    both = sum_of_noises([one, StampedNoise(((3.0, 0.1, False), (1.0, 0.1, True)))])
    assert both == StampedNoise(((4.0, 0.1, False), (1.0, 0.1, True)), 1.0, 2.0)


@pytest.mark.parametrize("form", [sampled_noise, integrated_noise])
def test_processes_without_such_a_form_are_refused(form):
    with pytest.raises(al.InputError, match="not supported for samples at arbitrary times"):
        form(Lags((1.0, 0.5)), 1.0, 100)


def test_times_that_run_back_are_refused():
    noise = ([(1.0, 1.0, False)], 0.0, 1.0)
    with pytest.raises(al.InputError, match="before that of the last"):
        _kernels.stamped_filter(np.array([1.0, 0.0]), np.ones(2, bool), np.zeros((1, 2)), *noise)


def test_flicker_phase_is_the_allan_variance_of_its_samples():
    phase = al.effects.FlickerPhase(F=1.0)
    x = phase.simulate(n=2**17, rate=1.0, seed=1).samples
    m = np.array([1, 16, 256])
    # Of 2^17/m terms and more; beyond m = 1024 the closed form has a logarithm.
    found = al.oadev(x, factors=m).deviation ** 2
    assert found == pytest.approx(phase.allan_variance(m.astype(float), rate=1.0), rel=0.1)
    near, far = phase.allan_variance(np.array([1024.0, 1025.0]), rate=1.0)
    assert far / near == pytest.approx((1024 / 1025) ** 2, rel=1e-3)


@pytest.mark.parametrize("seed", [2, 9])
def test_slow_noise_is_found_far_below_the_frequency_offset(seed):
    # The size of random-walk FM beside white PM once ended at its bound, as if the frequency offset were its noise.
    rate, n = 0.1, 1200
    model = al.parse_model("Q(Q=1e-9)+K(K=3e-13)")
    x = np.cumsum(model.simulate(n=n, rate=rate, seed=seed, axis=3).samples) / rate
    t = np.arange(n) / rate
    series = StampedSeries(t, x, np.array([np.ones(n), t]))
    candidate = Candidate((al.Quantization(), al.RateRandomWalk()))
    fit = fit_noise(series, candidate, rate, integrated_noise)
    terms = [term for effect in model.stochastic for term in effect.terms(rate)]
    truth = series.regressed(sum_of_noises([integrated_noise(term, rate, n) for term in terms]))
    assert fit.regressed.log_likelihood > truth.log_likelihood - 0.01


def test_nearly_dependent_functions_give_the_likelihood_of_independent_ones():
    # The span of 1 and 1 + εt is that of 1 and t; the likelihood differs by ln ε alone.
    t = np.arange(200.0)
    y, noise, small = np.random.default_rng(3).standard_normal(200), StampedNoise(white=1.0), 1e-11
    plain = StampedSeries(t, y, np.array([np.ones(200), t])).regressed(noise)
    near = StampedSeries(t, y, np.array([np.ones(200), 1.0 + small * t])).regressed(noise)
    # Rounding of the functions, 1e-16 of ε times the spread of t, is 1e-7.
    assert near.log_likelihood + np.log(small) == pytest.approx(plain.log_likelihood, abs=1e-5)
    assert near.squares == pytest.approx(plain.squares, rel=1e-5)
