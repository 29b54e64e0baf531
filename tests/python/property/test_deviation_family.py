"""What must hold of every estimator, with and without gaps."""

import allantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite import deviation
from allanite._kernels import family_variance

# The Allan deviations have tests of their own, Theo1 takes other factors, and an interval error is no mean of terms.
KINDS = [
    name
    for name in deviation.ESTIMATORS
    if name not in {"oadev", "adev", "theo1", "theoh", "tierms", "mtie"}
]
LENGTHS = st.integers(12, 120)
SEEDS = st.integers(0, 2**32 - 1)


def plain(kind, x, m, angle=False):
    return np.sqrt(family_variance(kind, x, m, angle)[0])


@pytest.mark.slow
@pytest.mark.parametrize("n", [6, 9, 10, 17, 50, 120])
@pytest.mark.parametrize(
    "kind", ["hdev", "ohdev", "mdev", "pdev", "totdev", "mtotdev", "htotdev", "tierms", "mtie"]
)
def test_equals_allantools(kind, n):
    x = np.random.default_rng(n).normal(size=n)
    m = np.arange(1, max(2, n // 4))
    with np.errstate(all="ignore"):
        tau, expected, _, _ = getattr(allantools, kind)(
            x, rate=1.0, data_type="freq", taus=m.astype(float)
        )
    kept = np.isin(m, np.round(tau))
    np.testing.assert_allclose(plain(kind, x, m)[kept], expected, rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=SEEDS, n=LENGTHS, constant=st.floats(-1e3, 1e3))
@settings(max_examples=30)
def test_constant_scale_and_direction(kind, seed, n, constant):
    x = np.random.default_rng(seed).normal(size=n)
    factors = np.arange(1, n // 4 + 1)
    estimator = getattr(deviation, kind)
    base = estimator(x, factors=factors)
    shifted = estimator(x + constant, factors=factors)
    np.testing.assert_allclose(shifted.deviation, base.deviation, rtol=1e-8, atol=1e-11)
    scaled = estimator(x * 1e6, factors=factors)
    np.testing.assert_allclose(scaled.deviation, base.deviation * 1e6, rtol=1e-10, atol=1e-9)
    # adjacent averages begin at the start; the parabolic variance is summed without its last term
    if kind not in ("hdev", "pdev"):
        turned = estimator(x[::-1], factors=factors)
        np.testing.assert_allclose(turned.deviation, base.deviation, rtol=1e-8, atol=1e-12)


# (of the parabolic variance every side would leave its last term out)
@pytest.mark.parametrize("kind", ["ohdev", "mdev", "mtotdev", "htotdev", "theo1", "tierms"])
@given(seed=SEEDS, n=st.integers(30, 120), hole=st.integers(1, 28))
@settings(max_examples=20)
def test_a_gap_leaves_the_terms_of_both_sides(kind, seed, n, hole):
    """With one gap, the estimate is the mean over the two segments, weighted by their numbers of differences."""
    x = np.random.default_rng(seed).normal(size=n)
    x[hole] = np.nan
    for m in (2, 4):
        found, count, _, _ = family_variance(kind, x, np.array([m]), False)
        parts = []
        for part in (x[:hole], x[hole + 1 :]):
            v, c, _, _ = family_variance(kind, part, np.array([m]), False)
            if c[0]:
                parts.append((v[0], c[0]))
        assert count[0] == sum(c for _, c in parts)
        if kind != "tierms" and parts:  # its trend is the whole record's
            expected = sum(v * c for v, c in parts) / count[0]
            assert found[0] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("kind", [*KINDS, "tierms", "mtie"])
def test_integers_equal_their_doubles(kind):
    x = np.random.default_rng(7).integers(-1000, 1000, 500)
    estimator = getattr(deviation, kind)
    np.testing.assert_allclose(
        estimator(x).deviation, estimator(x.astype(float)).deviation, rtol=1e-10
    )


def test_theo1_takes_seconds_and_even_factors():
    x = np.random.default_rng(8).normal(size=300)
    assert al.theo1(x, rate=10.0, taus=[0.75, 3.0]).factors.tolist() == [10, 40]
    curve = al.theo1(x, factors=[9, 10])
    assert curve.factors.tolist() == [10]
    assert "odd" in curve.diagnostics[0]


def test_dynamic_is_the_deviation_of_its_windows():
    x = np.random.default_rng(9).normal(size=1000)
    x[500:] *= 3.0
    x[100] = np.nan
    found = al.dynamic_oadev(x, 10.0, window=20.0, step=10.0, taus=[0.1, 1.0])
    assert found.deviation.shape == (9, 2)
    for time, row in zip(found.time, found.deviation, strict=True):
        start = round(time * 10) - 100
        expected = deviation.oadev(x[start : start + 200], 10.0, taus=[0.1, 1.0]).deviation
        np.testing.assert_array_equal(row, expected)
    assert found.deviation[-1, 0] == pytest.approx(3 * found.deviation[0, 0], rel=0.2)


@pytest.mark.statistical
@pytest.mark.parametrize("color", ["white", "walk"])
def test_intervals_cover(color):
    """95 % intervals with identified noise hold 92-98 % of the time, here ± 3 σ of 400 records (1.1 %)."""
    rng = np.random.default_rng(10)
    factors = 2 ** np.arange(9)
    truth = 1 / factors if color == "white" else (2 * factors**2 + 1) / (6 * factors)
    hits = np.zeros(factors.size)
    for _ in range(400):
        x = rng.normal(size=4096)
        curve = deviation.oadev(np.cumsum(x) if color == "walk" else x, factors=factors)
        hits += (curve.low**2 <= truth) & (truth <= curve.high**2)
    assert (hits / 400 > 0.92 - 0.033).all()
    assert (hits / 400).mean() == pytest.approx(0.95, abs=0.02)


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="no wider floats to compare with")
@pytest.mark.parametrize("backwards", [False, True])
def test_a_drifting_phase_keeps_its_digits(backwards):
    phase = np.cumsum(1.0 + 1e-6 * np.random.default_rng(0).standard_normal(10**6))
    phase = phase[::-1].copy() if backwards else phase
    found = deviation.oadev(phase, quantity="angle", factors=[1, 2, 4, 64, 3000, 50_000, 300_000])
    wide, before = phase.astype(np.longdouble), []
    for m, value in zip(found.factors.tolist(), found.deviation, strict=True):
        d = wide[2 * m :] - 2 * wide[m:-m] + wide[: -2 * m]
        # What a double loses in terms that reach from near zero to far away stays below this.
        assert value == pytest.approx(float(np.sqrt((d**2).mean() / 2) / m), rel=1e-9), m
        # The first point taken away from all, and sums before differences: what must not come back.
        z = phase - phase[0]
        d = (z[2 * m :] + z[: -2 * m]) - 2 * z[m:-m]
        before.append(abs(np.sqrt((d**2).mean() / 2) / m / value - 1))
    assert max(before) > 1e-8
