"""What must hold of the overlapping Allan deviation for every record."""

import allantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import allanite as al

SEEDS = st.integers(0, 2**32 - 1)
LENGTHS = st.integers(3, 400)


def record(seed, n):
    return np.random.default_rng(seed).normal(size=n)


@pytest.mark.parametrize("n", [*range(3, 201), 16384, 16385, 50001])
def test_equals_allantools(n):
    x = record(n, n)
    for ours, theirs in ((al.oadev, allantools.oadev), (al.adev, allantools.adev)):
        factors = np.arange(1, n // 2 + 1) if n < 201 else 2 ** np.arange(int(np.log2(n)))
        curve = ours(x, rate=4.0, factors=factors)
        with np.errstate(all="ignore"):
            tau, deviation, _, terms = theirs(x, rate=4.0, data_type="freq", taus=curve.tau)
        # allantools drops what has a single term
        kept = np.isin(np.round(curve.tau * 4), np.round(tau * 4))
        np.testing.assert_allclose(curve.deviation[kept], deviation, rtol=1e-10)
        assert curve.n[kept].tolist() == [int(v) for v in terms]


def test_equals_allantools_of_a_million():
    x = record(1, 10**6)
    curve = al.oadev(x, rate=100.0)
    _, deviation, _, _ = allantools.oadev(x, rate=100.0, data_type="freq", taus=curve.tau)
    np.testing.assert_allclose(curve.deviation, deviation, rtol=1e-10)


@given(SEEDS, LENGTHS, st.floats(-1e3, 1e3), st.sampled_from([1e-6, 0.1, 7.0, 1e9]))
def test_constant_scale_and_direction(seed, n, constant, scale):
    x = record(seed, n)
    base = al.oadev(x).deviation
    # x + c is rounded to ulp(1000) = 1e-13
    np.testing.assert_allclose(al.oadev(x + constant).deviation, base, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(al.oadev(x * scale).deviation, base * scale, rtol=1e-12)
    np.testing.assert_allclose(al.oadev(x[::-1]).deviation, base, rtol=1e-9, atol=1e-14)


@given(SEEDS, st.integers(10, 300), st.integers(1, 30))
def test_gaps_cost_only_the_terms_that_touch_them(seed, n, holes):
    x = record(seed, n)
    rng = np.random.default_rng(seed)
    x[rng.integers(1, n, min(holes, n - 1))] = np.nan
    theta = np.concatenate([[0.0], np.cumsum(np.nan_to_num(x))])
    missing = np.concatenate([[0], np.cumsum(np.isnan(x))])
    curve = al.oadev(x, taus="all")
    for m, count, value in zip(curve.factors, curve.n, curve.deviation, strict=True):
        whole = missing[2 * m :] == missing[: -2 * m]
        d = (theta[2 * m :] - 2 * theta[m:-m] + theta[: -2 * m])[whole]
        assert count == d.size
        if count:
            assert value == pytest.approx(np.sqrt(np.mean(d**2) / 2) / m, rel=1e-9)
        else:
            assert np.isnan(value)


@given(SEEDS, st.integers(10, 300), st.integers(1, 30))
def test_gaps_of_a_phase_cost_three_terms(seed, n, holes):
    x = np.cumsum(record(seed, n))
    x[np.random.default_rng(seed).integers(0, n, min(holes, n - 1))] = np.nan
    if np.isnan(x).all():
        return
    curve = al.oadev(x, quantity="angle", taus="all")
    for m, count, value in zip(curve.factors, curve.n, curve.deviation, strict=True):
        d = x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]
        d = d[~np.isnan(d)]
        assert count == d.size
        if count:
            assert value == pytest.approx(np.sqrt(np.mean(d**2) / 2) / m, rel=1e-9)


KINDS = [np.int8, np.int16, np.int32, np.int64, np.uint8, np.uint16, np.uint32, np.uint64]


@pytest.mark.parametrize("kind", KINDS)
def test_integers_are_exact(kind):
    rng = np.random.default_rng(3)
    info = np.iinfo(kind)
    middle = info.max // 2 if info.min == 0 else info.max // 3
    x = (rng.integers(-50, 50, 40000) + int(middle)).astype(kind)
    curve = al.oadev(x)
    theta = np.concatenate([[0], np.cumsum([int(v) - int(middle) for v in x])])
    for m, n, value in zip(curve.factors, curve.n, curve.deviation, strict=True):
        d = theta[2 * m :] - 2 * theta[m:-m] + theta[: -2 * m]
        exact = int(np.sum(d.astype(object) ** 2))
        assert value == pytest.approx((exact / (2 * int(m) ** 2 * int(n))) ** 0.5, rel=4e-16)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int16, np.int64])
def test_strides_and_layouts_change_nothing(kind):
    block = np.random.default_rng(4).normal(scale=100, size=(70000, 3)).astype(kind)
    column = np.ascontiguousarray(block[:, 1])
    expected = al.oadev(column).deviation
    assert (al.oadev(block[:, 1]).deviation == expected).all()
    assert (al.oadev(np.asfortranarray(block)[:, 1]).deviation == expected).all()
    np.testing.assert_allclose(al.oadev(block[::-1, 1]).deviation, expected, rtol=1e-10)
    assert (al.oadev(column.astype(column.dtype.newbyteorder(">"))).deviation == expected).all()
    packed = np.zeros(column.size, dtype=[("a", "i1"), ("x", kind)])
    packed["x"] = column
    assert (al.oadev(packed["x"]).deviation == expected).all()
