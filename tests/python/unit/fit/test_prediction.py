"""What a fit predicts of ordinates and blocks of time that it was not fitted to."""

import numpy as np
import pytest

import allanite as al
from allanite import _kernels
from allanite.fit.likelihood.discrepancy import marginal_likelihood
from allanite.fit.prediction import (
    BLOCKS,
    FOLDS,
    MIN_PREDICTED_SAMPLES,
    block_losses,
    compare,
    function_costs,
    log_likelihood_of_bins,
    predict,
)
from allanite.spectrum import bins_of
from generators import ramp, sinusoid, walk, white

N, RATE, LEVEL = 4000, 10.0, 0.01
TIME = np.arange(N) / RATE


def fitted(samples, model, **columns):
    fit = al.fit_model(al.Recording(samples, RATE, unit="rad/s", covariates=columns), model)
    return fit, predict(fit.data, fit.solution)


def noise(seed):
    return white(np.random.default_rng(seed), N, RATE, LEVEL)


def test_a_short_record_has_none():
    fit, prediction = fitted(noise(0)[: MIN_PREDICTED_SAMPLES - 1], "N")
    assert prediction is None
    assert fit.error.predictive is None
    assert fit.to_dict()["error"]["predictive"] is None
    assert fitted(noise(0)[:MIN_PREDICTED_SAMPLES], "N")[1] is not None


def test_json_and_score():
    fit, prediction = fitted(noise(0), "N+K")
    told = fit.to_dict()["error"]["predictive"]
    assert told == {"score": prediction.score, "std_error": prediction.std_error}
    bins = fit.data.bins
    assert prediction.losses.shape == (FOLDS * bins.groups.size + BLOCKS,)
    assert prediction.score == pytest.approx(prediction.losses.sum() / bins.count.size)
    assert compare(prediction, prediction) == (0.0, 0.0)


def test_folds_hold_every_ordinate_once():
    bins = bins_of(N)
    ordinates = _kernels.cosine_transform(noise(1))
    number, total = bins.folded(ordinates, FOLDS)
    np.testing.assert_array_equal(number.sum(axis=0), bins.count)
    np.testing.assert_allclose(total.sum(axis=0) / bins.count, bins.power(ordinates), rtol=1e-12)
    j = np.arange(1, N)
    for fold in range(FOLDS):
        place = np.searchsorted(bins.edges, j[j % FOLDS == fold], side="right") - 1
        np.testing.assert_array_equal(number[fold], np.bincount(place, minlength=bins.count.size))


@pytest.mark.parametrize("scale", [None, 3, 20, 50])
def test_a_few_bins_are_judged_as_all_are(scale):
    rng = np.random.default_rng(2)
    count = np.array([1.0, 2.0, 7.0, 40.0, 1e5])
    power, spectrum = rng.gamma(2.0, size=(2, 5))
    whole, _ = marginal_likelihood(power, count, spectrum, scale)
    cell = np.arange(5)
    parts = (
        log_likelihood_of_bins(power[p], count[p], spectrum[p], scale, cell[p])
        for p in (slice(2), slice(2, 5))
    )
    assert sum(parts) == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("mean", [False, True])
def test_a_block_given_its_neighbours(mean):
    """Against the covariance of the samples: what the other samples alone determine of two amplitudes."""
    rng = np.random.default_rng(3)
    k = 40 - mean
    j = np.arange(k) + mean
    variance = 1.0 + 30.0 / (1.0 + j) ** 2
    matrix, values = rng.standard_normal((k, 2)), rng.standard_normal(k) * np.sqrt(variance)
    cosine = np.cos(np.pi / 40 * np.outer(np.arange(40) + 0.5, np.arange(40))) * np.sqrt(2 / 40)
    cosine[:, 0] /= np.sqrt(2.0)
    # A mean that may be anything.
    whole = np.concatenate([[1e9], variance]) if mean else variance
    covariance = (cosine * whole) @ cosine.T
    samples, design = cosine[:, int(mean) :] @ values, cosine[:, int(mean) :] @ matrix

    def known(rows):
        inverse = np.linalg.inv(covariance[np.ix_(rows, rows)])
        normal = design[rows].T @ inverse @ design[rows]
        return normal, np.linalg.solve(normal, design[rows].T @ inverse @ samples[rows])

    a, best = known(np.arange(40))
    expected = []
    for block in np.array_split(np.arange(40), BLOCKS):
        r, others = known(np.setdiff1d(np.arange(40), block))
        part = np.linalg.eigvals(np.linalg.solve(a, r)).real
        moved = others - best
        price = np.log(np.minimum(part + 1.0 / k, 1.0)).sum()
        expected.append(0.5 * (moved @ r @ moved - price))
    np.testing.assert_allclose(block_losses(values, matrix, variance, mean), expected, rtol=1e-5)


def test_a_function_of_time_costs_what_it_fits_by_chance():
    """At least 1 nat per parameter: three for a line, one for a ramp, two for a step; a held amplitude costs nothing."""
    samples = noise(4) + sinusoid(N, RATE, 1.0, 0.01) + ramp(N, RATE, 3e-4) + 0.05 * (TIME > 200.0)
    for model, numbers, most in (
        ("N+SIN(frequency=1)", 3, 7),
        ("N+R", 1, 6),
        ("N+STEP(time=200)", 2, 2),
        ("N+R(R=3e-4!)", 0, 0),
        ("N+K", 0, 0),
    ):
        fit, _ = fitted(samples, model)
        price = function_costs(fit.data, fit.solution)
        assert price.shape == (BLOCKS,)
        assert numbers - 1e-9 <= price.sum() <= most + 1e-9, model


def test_true_effects_predict_better():
    rng = np.random.default_rng(5)
    temperature = walk(rng, N, RATE, 0.1)
    samples = noise(6) + sinusoid(N, RATE, 1.0, 0.01) + 0.01 * temperature
    before = fitted(samples, "N+K", temperature=temperature)[1]
    for model in ("N+K+SIN(frequency=1)", "N+K+COV(column=temperature,lag=0!)"):
        difference, _ = compare(before, fitted(samples, model, temperature=temperature)[1])
        assert difference < -15.0, model
    both = fitted(samples, "N+K+SIN(frequency=1)+COV(column=temperature)", temperature=temperature)
    difference, std_error = compare(before, both[1])
    assert difference <= std_error


def test_a_coefficient_that_differs_between_the_halves_is_kept():
    """0.38 in the first half, 0.56 in the second: far better than none."""
    rng = np.random.default_rng(7)
    temperature = walk(rng, N, RATE, 1.0)
    samples = noise(8) + 1e-2 * np.where(TIME < 200.0, 0.38, 0.56) * temperature
    before = fitted(samples, "N+B+K", temperature=temperature)[1]
    fit, after = fitted(samples, "N+B+K+COV(column=temperature)", temperature=temperature)
    difference, error = compare(before, after)
    assert difference < -error, fit.model


def test_a_line_that_stops_costs_more_than_one_that_stays():
    stays = sinusoid(N, RATE, 1.0, 0.02)
    prices_of = []
    for signal in (stays, 2.0 * stays * (TIME < 200.0)):
        fit, _ = fitted(noise(9) + signal, "N+SIN(frequency=1)")
        prices_of.append(function_costs(fit.data, fit.solution).sum())
    assert prices_of[1] > prices_of[0] + 10.0


def test_an_outlier_costs_ln_n():
    samples = noise(10)
    samples[777] += 1.0
    plain, cleaned = fitted(samples, "N")[0], fitted(samples, "N+OUT(times=77.7)")[0]
    difference, _ = compare(plain.error.predictive, cleaned.error.predictive)
    assert difference < 0.0
    last = cleaned.error.predictive.losses[-BLOCKS:]
    assert last[1] == pytest.approx(np.log(N))
    assert last.sum() == pytest.approx(np.log(N))
