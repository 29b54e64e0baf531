"""What holes leave unknown of each ordinate, beside the inverse of the whole matrix."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.fft import dct

import allanite as al
from allanite.fit.missing.shares import MAX_CELLS, unknown_share, unknown_share_of_lowest
from allanite.spectrum import bins_of

RATE = 10.0
MODELS = {
    "N": "N(N=0.01)",
    "N+B+K": "N(N=0.0126)+B(B=0.006)+K(K=4e-4)",
    "N+K": "N(N=0.001)+K(K=2e-3)",
    "N+GM": "N(N=0.0126)+GM(q_c=3e-2,T=2)",
}


def spectrum_of(name, n):
    """Variances of the ordinates, with a free mean."""
    j = np.arange(1, n)
    terms = al.parse_model(MODELS[name]).terms(RATE)
    return np.concatenate([[np.inf], sum(t.cosine_variance(j, n) for t in terms)])


def naive(missing, spectrum):
    """The covariance of the missing samples given the others, in each ordinate: Q_mm⁻¹, Q = Cᵀ S⁻¹ C."""
    cosines = dct(np.eye(missing.size), norm="ortho", axis=0)[:, missing]
    known = cosines.T @ (cosines / spectrum[:, None])
    share = np.einsum("jt,tj->j", cosines, np.linalg.solve(known, cosines.T)) / spectrum
    share[0] = 0.0
    return share


def holes(n, length, part, seed):
    rng = np.random.default_rng(seed)
    missing = np.zeros(n, dtype=bool)
    while missing.sum() < part * n:
        start = rng.integers(0, n - length)
        missing[start : start + length] = True
    return missing


@pytest.mark.slow
@settings(max_examples=60)
@given(
    st.sampled_from(sorted(MODELS)),
    st.integers(40, MAX_CELLS),
    st.integers(1, 30),
    st.floats(0.02, 0.6),
    st.integers(0, 2**32 - 1),
)
def test_shares_of_a_short_record_are_exact(name, n, length, part, seed):
    missing = holes(n, length, part, seed)
    assume(missing.sum() < 0.8 * n)
    spectrum = spectrum_of(name, n)
    found = unknown_share(missing, spectrum, None, bins_of(n))
    # Both lose digits where walks leave the lowest ordinates 10⁶ times the others.
    np.testing.assert_allclose(found, np.clip(naive(missing, spectrum), 0.0, 0.98), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("length", [1, 3, 10, 30, 100, 300, "every second"])
def test_the_lowest_ordinates_of_a_long_record_ask_the_means_of_cells(name, length):
    """When holes counted as noise, powers of long records were up to a third too high, and B was 12 % too low."""
    n = 2000
    if length == "every second":
        missing = np.zeros(n, dtype=bool)
        missing[1::2] = True
    else:
        missing = holes(n, length, 0.3, 3)
    spectrum = spectrum_of(name, n)
    found, _ = unknown_share_of_lowest(missing, spectrum)
    assert found.size >= MAX_CELLS // 16
    exact = naive(missing, spectrum)[1 : 1 + found.size]
    # Of holes shorter than a cell the shape is the noise's that stands for them: 1.5 % of what is seen at most, but for
    # one ordinate in which 512 cells of 3 or 4 samples and every second sample beat.
    np.testing.assert_allclose(
        1.0 - found, 1.0 - exact, rtol=0.035 if length == "every second" else 0.015
    )


@pytest.mark.parametrize("exponent", [3.0, 4.0, 5.0, 7.0])
def test_a_steep_spectrum_has_shares(exponent):
    """Its highest ordinates have less power than the rounding errors of the lowest."""
    missing = np.zeros(86_400, dtype=bool)
    missing[20_000:20_120] = True
    found, empty = unknown_share_of_lowest(missing, np.arange(1.0, 86_401.0) ** -exponent)
    assert empty == 0.0
    # A gap of 1/720 of the record hides less than that of the lowest ordinates; interpolation finds the rest.
    assert np.abs(found).max() < 120 / 86_400
