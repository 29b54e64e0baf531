"""Samples so small or large that their squares are no doubles have the deviation of others, times their scale."""

import numpy as np
import pytest

import allanite as al
from allanite.deviation.estimators import ESTIMATORS

NAMES = [name for name in ESTIMATORS if hasattr(al, name)]


@pytest.mark.parametrize("exponent", [-900, -540, -512, 505, 512, 900])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("quantity", ["rate", "angle"])
def test_a_power_of_two_changes_no_bit(name, exponent, quantity):
    x = np.random.default_rng(1).normal(size=600)
    x[100] = np.nan
    plain = getattr(al, name)(x, quantity=quantity)
    scaled = getattr(al, name)(np.ldexp(x, exponent), quantity=quantity)
    np.testing.assert_array_equal(scaled.deviation, np.ldexp(plain.deviation, exponent))
    np.testing.assert_array_equal(scaled.alpha, plain.alpha)


def test_no_noise_is_still_none():
    for value in (0.0, 1e-200, 1e200, 3.0):
        assert (al.oadev(np.full(100, value)).deviation == 0.0).all()


def test_windows_of_a_record_and_a_mixture_of_estimators():
    x = np.random.default_rng(2).normal(size=2000)
    for estimate in (al.theoh, lambda x: al.dynamic_oadev(x, window=500.0, step=500.0)):
        plain, scaled = estimate(x), estimate(np.ldexp(x, -700))
        np.testing.assert_array_equal(scaled.deviation, np.ldexp(plain.deviation, -700))
