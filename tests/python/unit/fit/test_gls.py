"""Least squares on the Allan variance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

import allanite as al
from allanite import _kernels
from allanite.effects.terms import Flicker, RandomWalk, White
from allanite.fit.bands import bands, degrees_of_freedom
from allanite.fit.classical.gls import fit_gls, gls_factors

UNITS = [[White(1.0)], [Flicker(1.0)], [RandomWalk(1.0)]]


@given(st.integers(1, 5), st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_solver_agrees_with_scipy(p, seed):
    rng = np.random.default_rng(seed)
    k = p + int(rng.integers(0, 10))
    design = rng.standard_normal((k, p))
    target = rng.standard_normal(k)
    root = rng.standard_normal((k, k)) / k
    covariance = root @ root.T + np.eye(k)
    found, spread, chi2 = _kernels.gls_nonnegative(design, target, covariance)
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    want, norm = nnls(whiten @ design, whiten @ target)
    # The jitter of 1e-9 on the correlation is felt as 1e-9 times its condition number.
    np.testing.assert_allclose(found, want, atol=1e-5 * (1 + np.abs(want).max()))
    assert chi2 == pytest.approx(norm**2, rel=1e-4, abs=1e-6)
    np.testing.assert_allclose(spread, spread.T, rtol=1e-6, atol=1e-12)


def test_solver_refuses():
    with pytest.raises(al.InputError, match="same curve"):
        _kernels.gls_nonnegative(np.ones((4, 2)), np.ones(4), np.eye(4))
    with pytest.raises(al.InputError, match="do not fit"):
        _kernels.gls_nonnegative(np.ones((1, 2)), np.ones(1), np.eye(1))
    with pytest.raises(al.InputError, match="positive definite"):
        _kernels.gls_nonnegative(np.ones((2, 1)), np.ones(2), np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(al.InputError, match="is not positive"):
        _kernels.gls_nonnegative(np.ones((2, 1)), np.ones(2), np.diag([1.0, 0.0]))


def test_exact_curve_gives_exact_coefficients():
    n, squares = 100_000, np.array([1.0, 1e-3, 1e-7])
    factors = gls_factors(n)
    mixture = [t[0].scaled(float(s)).kernel for t, s in zip(UNITS, squares, strict=True)]
    expected, _ = _kernels.allan_covariance(mixture, n, factors)
    fit = fit_gls(expected, factors, n, UNITS)
    np.testing.assert_allclose(fit.squares, squares, rtol=1e-4)
    assert fit.chi2 < 1e-8
    assert fit.dof == factors.size - 3
    low, high, _ = fit.intervals()
    assert np.all((low < fit.coefficients) & (fit.coefficients < high))


def test_white_noise_alone():
    rng = np.random.default_rng(2)
    n = 100_000
    curve = al.oadev(rng.standard_normal(n), factors=gls_factors(n))
    fit = fit_gls(curve.deviation**2, curve.factors, n, UNITS)
    # The best estimate of white noise has a relative error of √(2/n) in variance, here 0.45 %.
    assert abs(fit.squares[0] - 1) < 5 * np.sqrt(2 / n)
    assert np.all(fit.squares[1:] < 3 * fit.std_errors[1:])
    assert fit.std_errors[0] == pytest.approx(np.sqrt(2 / n), rel=0.3)


def test_fit_refuses():
    with pytest.raises(al.InputError, match="must be positive"):
        fit_gls([1.0, 0.0, 1.0], [1, 2, 4], 100, UNITS)
    with pytest.raises(
        al.TooShortError, match="3 effects need at least as many averaging factors, found 2"
    ):
        fit_gls([1.0, 1.0], [1, 2], 100, UNITS)
    with pytest.raises(al.InputError, match="do not match"):
        fit_gls([1.0, 1.0], [1, 2, 3], 100, UNITS)
    with pytest.raises(al.InputError, match="at least one effect"):
        fit_gls([1.0, 1.0], [1, 2], 100, [])


def test_bands_are_nested_and_wider_where_less_is_known():
    factors = np.array([1, 10, 100, 400])
    band = bands(UNITS[0], 1001, factors)
    assert np.all(band.low_everywhere < band.low_factor)
    assert np.all(band.low_factor < 1)
    assert np.all(band.high_factor > 1)
    assert np.all(band.high_everywhere > band.high_factor)
    assert np.all(np.diff(band.high_factor) > 0)
    np.testing.assert_allclose(band.edf, degrees_of_freedom(UNITS[0], 1001, factors), rtol=1e-12)


def test_bands_meet_where_the_law_takes_over():
    # At 40 degrees of freedom χ² and the weighted sum agree to half a per cent of σ.
    factors = np.arange(30, 50)
    band = bands(UNITS[0], 1200, factors)
    assert band.edf.min() < 40 < band.edf.max()
    assert np.all(np.abs(np.diff(band.high_factor)) < 0.012)


def test_published_degrees_of_freedom():
    """NIST SP 1065 by simulation: 4000 records of 1000 samples gave 662, 141.8, 13.06 (white), 809 (flicker, m = 1).

    Greenhall's closed formula, which Stable32 uses, gives 782 for white noise at m = 1; exact are 999²/(999 + 998/2) =
    666.2 for 999 differences. The standard error of a variance of a variance from 4000 records is 2.3 %.
    """
    edf = degrees_of_freedom(UNITS[0], 1000, [1, 10, 100])
    np.testing.assert_allclose(edf, [662, 141.8, 13.06], rtol=0.07)
    assert edf[0] == pytest.approx(999**2 / (999 + 998 / 2), rel=1e-9)
    assert degrees_of_freedom(UNITS[1], 1000, [1])[0] == pytest.approx(809, rel=0.07)
