"""Fourier sums of a band of ordinates, beside the transform of the whole record."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import fft, idct

from allanite.fit.shapes.drifting import fourier_sums


@given(st.data())
def test_sums_of_a_band_are_those_of_the_whole_record(data):
    n = data.draw(st.integers(8, 700))
    start = data.draw(st.integers(1, n - 3))
    size = data.draw(st.integers(2, n - start))
    first = data.draw(st.integers(0, n // 2 - 1))
    count = data.draw(st.integers(1, n // 2 - first))
    seed = data.draw(st.integers(0, 2**32 - 1))
    ordinates = np.zeros(n)
    ordinates[start : start + size] = np.random.default_rng(seed).standard_normal(size)
    whole = fft(idct(ordinates, norm="ortho"))[first : first + count]
    found = fourier_sums(ordinates[start : start + size], start, first, count, n)
    # Sums of n terms of size 1 in double precision: some 1e-16 · n.
    assert np.abs(found - whole).max() < 1e-13 * n
