"""The covariance across averaging factors against naive twins: double sums of variograms, full double loops."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite import _kernels
from variograms import MIXTURES, summed, term_of, variogram

COEFFICIENTS = {2: np.array([1.0, -2.0, 1.0]), 3: np.array([-1.0, 3.0, -3.0, 1.0])}
ORDER = {"oadev": 2, "mdev": 3, "hdev": 3}


def naive(terms, n, factors, kind):
    """Expected variance and covariance by full sums over every pair of differences."""
    order, points = ORDER[kind], n + 1
    kernel = summed(sum(variogram(t, 2 * n + 8) for t in terms))
    if kind == "mdev":
        kernel, points = -summed(kernel), n + 2
    c = COEFFICIENTS[order]
    scale = {"oadev": lambda m: 2 * m**2, "mdev": lambda m: 2 * m**4, "hdev": lambda m: 6 * m**2}[
        kind
    ]

    def cross(i, j):
        lag = np.arange(points - order * i)[:, None] - np.arange(points - order * j)[None, :]
        steps = range(order + 1)
        return sum(c[a] * c[b] * kernel[np.abs(lag + a * i - b * j)] for a in steps for b in steps)

    covariance = np.empty((len(factors), len(factors)))
    expected = np.empty(len(factors))
    for a, i in enumerate(factors):
        for b, j in enumerate(factors[: a + 1]):
            between = cross(i, j).astype(float)
            covariance[a, b] = 2 * np.mean(between**2) / (scale(i) * scale(j))
            covariance[b, a] = covariance[a, b]
        expected[a] = between[0, 0] / scale(i)
    return expected, covariance


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["oadev", "mdev", "hdev"])
@pytest.mark.parametrize("name", MIXTURES)
def test_agrees_with_the_full_sum(name, kind):
    n, factors = 160, [1, 2, 3, 7, 16, 17, 40, 53]
    expected, covariance = _kernels.allan_covariance(MIXTURES[name], n, np.array(factors), kind)
    naive_expected, naive_covariance = naive(MIXTURES[name], n, factors, kind)
    np.testing.assert_allclose(expected, naive_expected, rtol=1e-7)
    spread = np.sqrt(np.diag(naive_covariance))
    # The longest panels of 160 lags hold eight nodes: 1e-5 of the correlation.
    np.testing.assert_allclose(
        covariance / np.outer(spread, spread),
        naive_covariance / np.outer(spread, spread),
        atol=2e-5,
    )


@given(
    st.lists(st.sampled_from(sorted(set(MIXTURES) - {"all"})), min_size=1, max_size=3, unique=True),
    st.integers(20, 120),
    st.sampled_from(["oadev", "mdev", "hdev"]),
    st.data(),
)
@settings(max_examples=40)
def test_agrees_with_the_full_sum_on_any_mixture(names, n, kind, data):
    terms = [t for name in names for t in MIXTURES[name]]
    factors = sorted(data.draw(st.sets(st.integers(1, n // 3), min_size=1, max_size=4)))
    expected, covariance = _kernels.allan_covariance(terms, n, np.array(factors), kind)
    naive_expected, naive_covariance = naive(terms, n, factors, kind)
    np.testing.assert_allclose(expected, naive_expected, rtol=1e-6)
    spread = np.sqrt(np.diag(naive_covariance))
    np.testing.assert_allclose(
        covariance / np.outer(spread, spread),
        naive_covariance / np.outer(spread, spread),
        atol=1e-4,
    )


@pytest.mark.parametrize("name", MIXTURES)
def test_expected_variance_is_that_of_the_effects(name):
    # The closed form of a rising spectrum is itself a sum of 2m terms that cancel: it is good to m ≈ 3000.
    top = 3000 if "0.8" in name else 300_000
    factors = np.unique(np.round(np.geomspace(1, top, 20)).astype(np.int64))
    expected, _ = _kernels.allan_covariance(MIXTURES[name], 1_000_000, factors)
    terms = [term_of(*given) for given in MIXTURES[name]]
    closed = sum(t.allan_variance(factors.astype(float)) for t in terms)
    np.testing.assert_allclose(expected, closed, rtol=1e-5)


def test_white_at_factor_one_is_two_thirds_of_the_differences():
    # Differences of white samples have neighbours correlated by −½: edf = M²/(M + 2(M−1)/4), M = n − 1.
    for n in (10, 1000, 1_000_000):
        expected, covariance = _kernels.allan_covariance([("white", [1.0])], n, np.array([1]))
        m = n - 1
        exact = m**2 / (m + (m - 1) / 2)
        assert 2 * expected[0] ** 2 / covariance[0, 0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ([("pink", [1.0])], "pink"),
        ([("white", [1.0, 2.0])], "white"),
        ([("power_law", [-3.5, 1.0])], "exponent -3.5"),
        ([("exponential", [1.0, 0.0, 1.0, 0.0])], "unit circle"),
        ([("white", [float("nan")])], "not finite"),
    ],
)
def test_bad_terms_are_named(terms, message):
    with pytest.raises(al.InputError, match=message):
        _kernels.allan_covariance(terms, 100, np.array([1]))


def test_too_long_a_factor_is_named():
    with pytest.raises(al.TooShortError, match="factor 60 of 100"):
        _kernels.allan_covariance([("white", [1.0])], 100, np.array([60]))
    with pytest.raises(al.InputError, match="known are oadev"):
        _kernels.allan_covariance([("white", [1.0])], 100, np.array([6]), "adev")
