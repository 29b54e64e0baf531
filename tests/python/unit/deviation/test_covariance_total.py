"""The covariance of total variances against the double sum over all reflected differences."""

import numpy as np
import pytest

import allanite as al
from allanite import _kernels
from variograms import MIXTURES, summed, variogram

SLOW = sorted(name for name in MIXTURES if name not in ("blue", "power law 0.8", "all"))


def naive(terms, n, factors):
    """Expected estimates and their covariance, from the kernel at every pair of points of every pair of differences."""
    kernel = summed(sum(variogram(t, 2 * n + 8) for t in terms))
    lag = np.abs(np.arange(n + 1)[:, None] - np.arange(n + 1)[None, :])
    points = kernel[lag].astype(float)
    matrices = []
    for m in factors:
        rows = np.zeros((n - 1, n + 1))
        for row, k in zip(rows, range(1, n), strict=True):
            row[k] -= 2
            for at, end in ((k - m, 0), (k + m, n)):
                if 0 <= at <= n:
                    row[at] += 1
                else:
                    row[end] += 2
                    row[2 * end - at] -= 1
        matrices.append(rows)
    scale = 2.0 * np.square(factors, dtype=float) * (n - 1)
    between = [[a @ points @ b.T for b in matrices] for a in matrices]
    covariance = np.array([[2 * np.sum(np.square(x)) for x in row] for row in between], dtype=float)
    expected = np.array([np.trace(between[k][k]) for k in range(len(factors))], dtype=float)
    return expected / scale, covariance / np.outer(scale, scale)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_agrees_with_the_full_sum(name):
    n, factors = 120, [3, 7, 16, 40, 77, 119]
    expected, variance = _kernels.allan_variances(MIXTURES[name], n, np.array(factors), "totdev")
    want, covariance = naive(MIXTURES[name], n, factors)
    # All 119 centres are taken, so only rounding and the series of the kernel differ.
    np.testing.assert_allclose(expected, want, rtol=1e-7)
    np.testing.assert_allclose(variance, np.diag(covariance), rtol=1e-6)
    _, found = _kernels.allan_covariance(MIXTURES[name], n, np.array(factors), "totdev")
    spread = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        found / np.outer(spread, spread), covariance / np.outer(spread, spread), atol=1e-6
    )


@pytest.mark.slow
def test_means_over_some_centres_are_those_over_all():
    # 1200 samples: 400 of 1199 centres; the covariance from 128 of them.
    n, factors = 1200, [24, 100, 400, 900]
    want, covariance = naive(MIXTURES["white"], n, factors)
    expected, found = _kernels.allan_covariance(MIXTURES["white"], n, np.array(factors), "totdev")
    np.testing.assert_allclose(expected, want, rtol=1e-3)
    # At 24, one in fifty, eight centres an averaging time sample the corners of white noise's triangles.
    np.testing.assert_allclose(np.diag(found), np.diag(covariance), rtol=0.02)
    spread = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        found / np.outer(spread, spread), covariance / np.outer(spread, spread), atol=0.02
    )


def test_bias_of_long_averaging_times_is_the_published_one():
    # NIST SP 1065 table 9: E totvar/σ² = 1 − a τ/T with a = 0, 1/(3 ln 2), 0.75; derived for τ ≤ T/2.
    n, factors = 8192, np.array([512, 1024, 2048, 4096])
    for name, a in (("white", 0.0), ("flicker", 1 / (3 * np.log(2))), ("random walk", 0.75)):
        expected, _ = _kernels.allan_variances(MIXTURES[name], n, factors, "totdev")
        true, _ = _kernels.allan_variances(MIXTURES[name], n, factors, "oadev")
        np.testing.assert_allclose(expected / true, 1 - a * factors / n, atol=0.004)


def test_refuses():
    with pytest.raises(al.TooShortError, match="factor 100 of 100"):
        _kernels.allan_variances([("white", [1.0])], 100, np.array([100]), "totdev")
    with pytest.raises(al.InputError, match="slower than quantization"):
        _kernels.allan_law([("blue", [1.0])], 100, 50, [0.5], "totdev")
