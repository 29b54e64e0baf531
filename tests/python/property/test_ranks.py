"""Samples in order, and series turned back at every rate, beside NumPy."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from allanite import _kernels

number = st.one_of(st.sampled_from([0.0, -1.5, 2.0]), st.floats(-1e9, 1e9))


@given(st.lists(number, max_size=300))
def test_samples_in_order(values):
    x = np.array(values)
    assert np.array_equal(_kernels.in_order(x), np.sort(x))
    order = _kernels.order(x)
    assert np.array_equal(np.sort(order), np.arange(x.size))
    assert (np.diff(x[order].astype(np.float32)) >= 0.0).all()


def test_the_order_of_equal_samples_is_white():
    """The ratio of the largest of 2¹⁵ ordinates to their mean exceeds ln n + 3.2 in one of 25 records (Gumbel)."""
    order = _kernels.order(np.zeros(1 << 16)).astype(float)
    power = np.abs(np.fft.rfft(order - order.mean()))[1:-1] ** 2
    assert power.max() / power.mean() < np.log(power.size) + 3.2


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 80), st.floats(-50.0, 50.0), st.integers(0, 2**32 - 1))
def test_heights_of_turned_series(n, first, seed):
    rng = np.random.default_rng(seed)
    series = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    drifts = first + 2.0 * np.arange(70)
    turned = series * np.exp(-1j * np.pi * np.outer(drifts, (np.arange(n) / n - 0.5) ** 2))
    spectra = np.fft.fft(turned, axis=1)
    halfway = 0.25 * np.pi * np.diff(spectra, axis=1)
    expected = np.maximum((np.abs(spectra) ** 2).max(axis=1), (np.abs(halfway) ** 2).max(axis=1))
    found = _kernels.chirp_heights(series.view(np.float64), first, 2.0, drifts.size)
    # Some 64 products and butterflies of single precision, 6e-8 each.
    assert np.allclose(found, expected, rtol=3e-5)
