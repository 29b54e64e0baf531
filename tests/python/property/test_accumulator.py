"""The stream equals the batch at its strides."""

import copy
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al


def batch(x, m, stride):
    theta = np.concatenate([[0], np.cumsum(x)])
    k = np.arange(0, theta.size - 2 * m, stride)
    d = theta[k + 2 * m] - 2 * theta[k + m] + theta[k]
    return int(np.sum(d.astype(object) ** 2)), k.size


@given(
    st.integers(3, 6000),
    st.integers(0, 2**32 - 1),
    st.lists(st.floats(0, 1), max_size=8),
    st.sampled_from(["octave", 2, 5, 8]),
)
@settings(max_examples=50)
def test_any_chunks_and_stretches(n, seed, cuts, taus):
    rng = np.random.default_rng(seed)
    x = rng.integers(-3000, 5000, n)
    borders = sorted({0, n, *(int(c * n) for c in cuts)})
    stretches = []
    for start, end in itertools.pairwise(borders):
        part = al.Accumulator(10.0, taus, start=start)
        for chunk in np.array_split(x[start:end], rng.integers(1, 5)):
            part.update(chunk)
        stretches.append(part)
    while len(stretches) > 1:
        i = int(rng.integers(0, len(stretches) - 1))
        stretches[i].merge(stretches.pop(i + 1))
    curve = stretches[0].oadev()
    strides = np.maximum(1, 2 ** np.floor(np.log2(curve.factors / 16))).astype(int)
    for m, s, count, value in zip(curve.factors, strides, curve.n, curve.deviation, strict=True):
        total, terms = batch(x, m, s)
        assert count == terms
        assert value == pytest.approx(np.sqrt(total / (2 * float(m) ** 2 * terms)), rel=1e-15)


@pytest.mark.parametrize(
    ("dtype", "offset"), [(np.int64, 2**60), (np.int64, -(2**62)), (np.uint64, 2**63)]
)
def test_integers_that_doubles_do_not_hold(dtype, offset):
    x = np.random.default_rng(2).integers(0, 100, 9_000)
    large = np.array([int(v) + offset for v in x], dtype)
    stream, part = al.Accumulator(), al.Accumulator(start=5_000)
    for chunk in (large[:10], large[10:5_000]):
        stream.update(chunk)
    part.update(large[5_000:])
    stream.merge(part)
    plain = al.Accumulator()
    plain.update(x)
    np.testing.assert_array_equal(stream.oadev().deviation, plain.oadev().deviation)


def test_terms_that_gaps_cost_are_counted():
    x = np.random.default_rng(3).normal(size=3_000)
    x[1_500] = np.nan
    stream = al.Accumulator()
    stream.update(x)
    curve, whole = stream.oadev(), al.oadev(x)
    np.testing.assert_array_equal(curve.factors, whole.factors)
    np.testing.assert_array_equal(curve.lost[:5], whole.lost[:5])
    # The sample touches the 2m terms before it; at m = 1024 only 953 begin before the end of the record allows no more.
    stride = np.maximum(1, curve.factors // 16)
    np.testing.assert_array_equal(curve.lost, -(-whole.lost // stride))
    assert np.isnan(curve.deviation[-1]) == np.isnan(whole.deviation[-1])


def test_short_factors_are_those_of_the_batch():
    x = np.random.default_rng(1).normal(size=100_000) + 9.81
    stream = al.Accumulator(100.0)
    for chunk in np.array_split(x, 37):
        stream.update(chunk)
    curve, whole = stream.oadev(), al.oadev(x, 100.0)
    np.testing.assert_allclose(curve.deviation[:5], whole.deviation[:5], rtol=1e-11)
    # at stride m/16 the estimate differs by a fraction of its own error, 1/√(2 edf)
    error = np.abs(curve.deviation / whole.deviation[: len(curve)] - 1)
    assert (error < 1.5 / np.sqrt(2 * curve.edf)).all()
    assert (np.abs(curve.edf[:10] / whole.edf[:10] - 1) < 0.05).all()
    assert curve.diagnostics[0].startswith("stream")


def test_gaps_and_copies():
    x = np.random.default_rng(2).normal(size=5000)
    x[[100, 2000, 2001]] = np.nan
    stream = al.Accumulator()
    stream.update(x[:3000])
    twin = copy.deepcopy(stream)
    stream.update(x[3000:])
    assert (stream.n, stream.missing, twin.n) == (5000, 3, 3000)
    np.testing.assert_allclose(stream.oadev().deviation[:4], al.oadev(x).deviation[:4], rtol=1e-11)
    assert "3 of 5000 samples are missing" in stream.oadev().diagnostics


def test_what_does_not_fit():
    stream = al.Accumulator(10.0)
    stream.update([])
    with pytest.raises(al.TooShortError, match="at least 3"):
        stream.oadev()
    with pytest.raises(al.InputError, match="sample 1 is inf"):
        stream.update([1.0, np.inf])
    stream.update([1, 2, 3])
    with pytest.raises(al.InputError, match="begins at sample 7"):
        stream.merge(al.Accumulator(10.0, start=7))
    with pytest.raises(al.InputError, match="cannot merge"):
        stream.merge(al.Accumulator(20.0, start=3))
    with pytest.raises(al.InputError, match="per octave"):
        al.Accumulator(10.0, 17)
    with pytest.raises(al.InputError, match="unknown taus"):
        al.Accumulator(10.0, "decade")
    with pytest.raises(al.InputError, match="positive"):
        al.Accumulator(0.0)
    assert repr(stream) == "Accumulator(3 samples at 10 Hz from sample 0)"


def test_missing_samples_are_counted_also_under_the_former_name():
    accumulator = al.Accumulator(1.0)
    accumulator.update(np.array([1.0, np.nan, np.nan, 2.0, np.nan, 1.0]))
    assert (accumulator.n, accumulator.missing) == (6, 3)
    with pytest.warns(DeprecationWarning, match=r"Accumulator\.missing"):
        assert accumulator.gaps == 3
