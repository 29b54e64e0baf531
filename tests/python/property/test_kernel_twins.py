"""Kernels of the core equal their definitions, computed in the plainest way."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from allanite import _kernels

SEEDS = st.integers(0, 2**32 - 1)
REACH = 16


def lapped(half, seed):
    """Kernel of segments of 2·half samples with a random power-complementary window, and that window."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, np.pi / 2.0, half)
    taps = rng.standard_normal(REACH)
    after, before = np.cos(angle), np.sin(angle)
    return _kernels.Lapped(after, before, taps), after, before, taps


@given(seed=SEEDS, half=st.sampled_from([16, 20, 32, 48]), segments=st.integers(1, 4))
@settings(max_examples=25)
def test_lapped_segments_are_projections_on_windowed_cosines(seed, half, segments):
    kernel, after, before, _ = lapped(half, seed)
    n = 2 * half
    x = np.random.default_rng([seed, 1]).standard_normal((segments + 1) * n)
    t, k = np.arange(-half, n + half), np.arange(n)
    window = np.concatenate((before[::-1], after, after[::-1], before))
    basis = np.sqrt(2.0 / n) * np.cos(np.pi / n * np.outer(k + 0.5, t + 0.5)) * window
    expected = [basis @ x[s * n : (s + 2) * n] for s in range(segments)]
    found = kernel.segments(x).reshape(segments, n)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.sqrt(n))


@given(seed=SEEDS, size=st.integers(0, 1200))
@settings(max_examples=25)
def test_halved_samples_are_filtered_ones(seed, size):
    kernel, _, _, taps = lapped(16, seed)
    x = np.random.default_rng([seed, 2]).standard_normal(2 * (size + REACH))
    both_sides = np.concatenate((taps[::-1], taps))
    expected = np.convolve(x, both_sides, "valid")[1::2][:size]
    np.testing.assert_allclose(kernel.halved(x), expected, atol=1e-12)


def identified(x, m):
    """Estimate of α of the phase at every m-th point (Riley & Greenhall 2004)."""
    z = np.concatenate(([0.0], np.cumsum(x)))[::m]
    t = np.linspace(-1.0, 1.0, z.size)
    z = z - np.polynomial.polynomial.polyval(t, np.polynomial.polynomial.polyfit(t, z, 2))
    for d in range(3):
        z = z - z.mean()
        r = (z[1:] @ z[:-1]) / (z @ z)
        delta = r / (1.0 + r)
        if delta < 0.25 or d == 2:
            return float(np.clip(2.0 - 2.0 * (delta + d), -4.0, 2.5))
        z = np.diff(z)
    raise AssertionError


@given(seed=SEEDS, n=st.integers(400, 3000), integrated=st.integers(0, 2), m=st.integers(1, 4))
@settings(max_examples=40)
def test_the_identified_noise_is_the_nearest_power_law(seed, n, integrated, m):
    x = np.random.default_rng(seed).standard_normal(n)
    for _ in range(integrated):
        x = np.cumsum(x)
    alpha, borders = identified(x, m), np.array([-1.75, -0.55, 0.65, 1.8])
    # Sums in another order differ in the last bits.
    assume(np.abs(borders - alpha).min() > 1e-6)
    found = _kernels.overlapping_allan(x, np.array([m]), False)[2]
    assert found[0] == np.searchsorted(borders, alpha) - 2.0


@pytest.mark.slow
@given(
    n=st.integers(20, 60),
    m=st.integers(1, 6),
    white=st.floats(0.0, 1.0),
    order=st.sampled_from([2, 3]),
)
@settings(max_examples=12, deadline=None)
def test_quantiles_of_an_estimate_are_those_of_its_quadratic_form(n, m, white, order):
    """A variance of Gaussian samples is Σ λ χ²₁ with the eigenvalues λ of the covariance of its differences."""
    assume(n > (order + 1) * m + 2)
    # A little white noise keeps the covariance regular.
    terms = [("white", [white + 0.01]), ("random_walk", [1.0 - white])]
    weights = np.array([1.0])
    for _ in range(order - 1):
        weights = np.convolve(weights, np.r_[1.0, np.zeros(m - 1), -1.0])
    weights = np.convolve(weights, np.ones(m))
    rows = n - weights.size + 1
    differences = np.array(
        [np.r_[np.zeros(i), weights, np.zeros(rows - 1 - i)] for i in range(rows)]
    )
    k = np.arange(n)
    covariance = (white + 0.01) * np.eye(n) + (1.0 - white) * np.minimum.outer(k, k)
    eigenvalues = np.linalg.eigvalsh(differences @ covariance @ differences.T).clip(0.0)
    eigenvalues /= eigenvalues.sum()
    draws = np.random.default_rng(3).chisquare(1.0, (40_000, rows)) @ eigenvalues
    probabilities = [0.025, 0.5, 0.975]
    kind = {2: "oadev", 3: "hdev"}[order]
    law = _kernels.allan_law(terms, n, m, probabilities, kind)
    for q, p in zip(law, probabilities, strict=True):
        # The saddle point is accurate to 0.2 % of probability; five standard errors of 40 000 draws.
        error = 0.003 + 5.0 * np.sqrt(p * (1.0 - p) / draws.size)
        assert abs(np.mean(draws <= q) - p) < error, (q, p)


ZONES = st.integers(-14 * 60, 14 * 60).map(lambda minutes: timezone(timedelta(minutes=minutes)))
MOMENTS = st.datetimes(
    datetime(1600, 1, 1),
    datetime(9000, 1, 1),
    timezones=ZONES,
)


@given(when=MOMENTS, separator=st.sampled_from("T _"), comma=st.booleans())
@settings(max_examples=60)
def test_a_date_time_is_its_seconds_since_1970(tmp_path_factory, when, separator, comma):
    text = when.isoformat(separator, "microseconds")
    text = text.replace(".", ",") if comma else text
    path = tmp_path_factory.mktemp("moments", numbered=True) / "log.csv"
    path.write_text("time;x\n" + f"{text};1\n" * 3, encoding="utf-8")
    _, columns, _ = _kernels.read_text(path, ";")
    epoch = datetime(1970, 1, 1, tzinfo=UTC)
    # Doubles hold today's seconds with 0.2 µs, those of the year 9000 with 30 µs.
    assert columns[0][0] == pytest.approx((when - epoch) / timedelta(seconds=1), abs=6e-5)


@given(
    seed=SEEDS,
    radius=st.floats(0.0, 0.98),
    angle=st.floats(0.0, np.pi),
    size=st.floats(0.1, 10.0),
)
@settings(max_examples=25)
def test_filtered_noise_is_its_recursion(seed, radius, angle, size):
    """The recursion, solved for the noise that drives it, gives the same normal numbers for any poles."""
    n = 3000
    a = (-2.0 * radius * np.cos(angle), radius**2)
    x = _kernels.simulate([("filtered", [size, 1.0, 0.0, 0.0, *a])], n, seed)
    plain = _kernels.simulate([("filtered", [1.0, 1.0, 0.0, 0.0, 0.0, 0.0])], n, seed)
    driven = (x[2:] + a[0] * x[1:-1] + a[1] * x[:-2]) / size
    np.testing.assert_allclose(driven, plain[2:], atol=1e-9)


@given(exponent=st.floats(-2.0, 0.0), n=st.integers(16, 10**7))
@settings(max_examples=40)
def test_a_bank_of_lags_has_the_spectrum_of_the_power_law(exponent, n):
    phi, variance = np.array(_kernels.power_law_bank(exponent, n)).T[:, :, None]
    x = (2.0 * np.sin(np.pi * np.geomspace(0.25 / n, 0.5, 60))) ** 2
    spectrum = (variance * (1.0 - phi**2) / ((1.0 - phi) ** 2 + phi * x)).sum(axis=0)
    # The ripple of two poles per decade is 0.04 %; least squares leaves up to 0.12 % at the ends of the band.
    np.testing.assert_allclose(spectrum, x ** (0.5 * exponent), rtol=1.5e-3)


@given(values=st.lists(st.integers(-(2**40), 2**40), min_size=5, max_size=200), angle=st.booleans())
@settings(max_examples=40)
def test_running_sums_of_whole_numbers_give_the_exact_variance(values, angle):
    phase = values if angle else [0, *np.cumsum(np.array(values, dtype=object))]
    m = np.arange(1, (len(phase) - 1) // 2 + 1)
    steps = [
        [phase[i + 2 * k] - 2 * phase[i + k] + phase[i] for i in range(len(phase) - 2 * k)]
        for k in m.tolist()
    ]
    expected = [sum(d * d for d in own) / (2 * len(own)) for own in steps]
    found, *_ = _kernels.overlapping_allan(np.array(values, dtype=np.int64), m, angle)
    # The phase is at most 200·2^40, a double holds it to 2^-5 of a unit; terms are sums of squares of such differences.
    scale = 1.0 if angle else m.astype(float) ** 2
    np.testing.assert_allclose(found * scale, expected, rtol=1e-9, atol=1.0)
