"""Every effect of the catalogue keeps the contract; its processes agree with first principles."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import dct
from scipy.signal import butter

import allanite as al
from allanite import effects as fx
from allanite import testing
from allanite.effects import find, lowpass, terms
from allanite.effects._lags import power_law_lags

RNG = np.random.default_rng(5)
COLUMNS = {"temperature": np.cumsum(RNG.standard_normal(testing.LENGTH))}
#: Where the noise that follows it by 2 % a unit has its root mean square level.
LOUD = float(np.log(np.mean(np.exp(0.04 * COLUMNS["temperature"]))) / 0.04)

#: Values for a record of 2048 samples at 50 Hz. Kinds without values here are tried with typical values.
VALUES = [
    ("Q", {"Q": 0.02}),
    ("N", {"N": 0.3}),
    ("B", {"B": 0.7}),
    ("K", {"K": 0.4}),
    ("R", {"R": -0.02}),
    ("GM", {"q_c": 0.5, "correlation_time": 2.0}),
    ("GM", {"q_c": 0.5, "correlation_time": 0.03}),
    ("SIN", {"frequency": 3.3, "amplitude": 0.5, "phase": 1.0}),
    ("CHIRP", {"frequency": 3.3, "drift": -0.02, "amplitude": 0.5, "phase": 1.0}),
    (
        "TONE",
        {"frequency": 3.3, "start": 11.0, "end": 23.0, "amplitude": 0.5, "phase": 1.0},
    ),
    *(
        ("BW", {"cutoff": 8.0, "order": order, "design": design})
        for design, orders in lowpass.DESIGNS.items()
        for order in orders
        if order <= 16
    ),
    ("BW", {"cutoff": 5.5375, "order": 1, "design": "moving_average"}),
    ("BW", {"cutoff": 0.5, "order": 4, "design": "sampled"}),
    ("BW", {"cutoff": 12.5, "order": 3, "design": "digital"}),
    ("BW", {"cutoff": 20.0, "order": 64, "design": "fir"}),
    ("HP", {"cutoff": 0.5, "order": 1}),
    ("HP", {"cutoff": 0.2, "order": 2}),
    ("NOTCH", {"frequency": 12.0, "quality": 5.0}),
    ("NOTCH", {"frequency": 17.0, "quality": 0.9, "left": 0.2}),
    ("NOTCH", {"frequency": 1.0, "quality": 30.0}),
    ("RES", {"frequency": 4.0, "damping": 0.05, "rms": 0.8}),
    ("RES", {"frequency": 0.4, "damping": 0.28, "rms": 0.8}),
    (
        "MOD",
        {"frequency": 4.0, "damping": 0.01, "rms": 0.8, "modulation": 0.7, "depth": 0.9},
    ),
    ("HUMP", {"width": 3.0, "time": 20.0, "height": 0.8}),
    ("WLINE", {"frequency": 4.0, "wander": 0.3, "rms": 0.8}),
    ("DRES", {"course": (4.0, 3.5, 3.4), "damping": 0.05, "rms": 0.8}),
    ("F", {"F": 0.05}),
    ("PL", {"exponent": -1.4, "level": 0.3}),
    ("PL", {"exponent": -0.5, "level": 0.3}),
    ("PL", {"exponent": 0.6, "level": 0.3}),
    ("X", {"rms": 0.8, "bands": (0.5, 0.3, 7.0, 0.7)}),
    (
        "COV",
        {"column": "temperature", "coefficient": 0.3, "lag": 1.5, "quadratic": 0.01, "cubic": 1e-3},
    ),
    ("COV", {"column": "temperature", "coefficient": -0.3}),
    ("HYS", {"column": "temperature", "coefficient": 0.3, "width": 5.0}),
    (
        "LAGS",
        {"column": "temperature", "fast": 0.3, "slow": -0.1, "fast_lag": 0.5, "slow_lag": 4.0},
    ),
    ("DOT", {"column": "temperature", "coefficient": 0.3, "lag": 1.5}),
    ("STEP", {"time": 11.0, "height": -0.4}),
    ("EXC", {"start": 11.0, "end": 23.0, "height": -0.4}),
    ("EXCS", {"starts": (11.0, 30.0), "ends": (23.0, 33.0), "heights": (-0.4, 0.2)}),
    ("RISE", {"begin": 11.0, "end": 23.0, "height": -0.4}),
    ("PULSE", {"time": 11.0, "time_constant": 3.0, "height": -0.4}),
    ("WARM", {"time_constant": 5.0, "amplitude": -0.4}),
    ("RTS", {"amplitude": 0.5, "dwell_time": 1.5}),
    ("LEVEL", {"start": 10.0, "end": 22.0, "factor": 1.7}),
    ("LEVELS", {"times": (10.0, 22.0), "factors": (1.7, 0.8)}),
    ("BLEVEL", {"low": 5.0, "high": 12.0, "start": 10.0, "end": 22.0, "factor": 1.7}),
    ("CYCLE", {"period": 4.0, "start": 1.0, "share": 0.25, "factor": 1.7}),
    ("NCOL", {"column": "temperature", "coefficient": 0.02, "reference": LOUD}),
    ("DIST", {"start": 10.0, "end": 13.0}),
    ("OUT", {"count": 2, "times": (3.0, 7.0)}),
]


CASES = [
    *VALUES,
    *((cls.short, None) for cls in al.CATALOG if cls.short not in {short for short, _ in VALUES}),
]


def of(short, values):
    return (
        testing.example_of(find(short), columns=COLUMNS)
        if values is None
        else find(short)(**values)
    )


def test_names_are_unique():
    names = [n for e in al.CATALOG for n in (e.short, e.kind)]
    assert len(set(names)) == len(names)
    kinds = {e.kind for e in al.CATALOG}
    for e in al.CATALOG:
        assert set(e.rivals) <= kinds


@pytest.mark.slow
@pytest.mark.parametrize(("short", "values"), CASES, ids=lambda v: v if isinstance(v, str) else "")
def test_contract(short, values):
    testing.check_effect(of(short, values), COLUMNS)


def test_the_check_finds_a_wrong_variance(monkeypatch):
    """A test that cannot fail proves nothing."""
    true = terms.Exponential.allan_variance
    monkeypatch.setattr(terms.Exponential, "allan_variance", lambda t, m: 1.001 * true(t, m))
    with pytest.raises(AssertionError, match="integrates to"):
        testing.check_density(of("GM", {"q_c": 0.5, "correlation_time": 2.0}))


def test_the_check_finds_a_wrong_level(monkeypatch):
    """Flicker 3 % too high in deviation shows in the Monte Carlo part."""
    true = testing.simulate

    def louder(model, **options):
        made = true(model, **options)
        return type(made)(1.03 * made.samples, rate=made.rate)

    monkeypatch.setattr(testing, "simulate", louder)
    with pytest.raises(AssertionError, match="simulated"):
        testing.check_simulation(of("B", {"B": 0.7}))


@dataclass(frozen=True)
class InRow(fx.Stochastic):
    """Noise through lags of T and T/2 in a row: σ² (2 e^{−t/T} − e^{−2t/T}); the second term alone is no process."""

    rms: float = 1.0

    kind, short, title, coefficient = "in_row", "ROW", "lags in a row", "rms"
    physics = looks_like = check_by = "for this test"
    parameters = (fx.Parameter("rms", 0.0, "standard deviation"),)
    parts = ((2.0, 1.0), (-1.0, 2.0))

    def unit_terms(self, rate):
        return tuple(terms.Exponential(a, float(np.exp(-k / (rate * 2.0)))) for a, k in self.parts)


def test_what_only_together_is_a_process_is_simulated_together():
    testing.check_density(InRow())
    testing.check_simulation(InRow())


def test_more_of_them_need_a_generator(monkeypatch):
    monkeypatch.setattr(InRow, "parts", ((3.0, 1.0), (-3.0, 2.0), (1.0, 3.0)))
    with pytest.raises(al.InputError, match="declare its `generator`"):
        InRow().simulate(n=100, rate=10.0)


# -- limits


def test_gauss_markov_of_a_long_time_is_a_random_walk():
    tau = np.geomspace(0.01, 1000.0, 30)
    walk = find("K")(K=0.3).allan_variance(tau, 100.0)
    for time, tolerance in [(1e6, 2e-3), (1e8, 2e-5)]:
        lag = find("GM")(q_c=0.3, correlation_time=time).allan_variance(tau, 100.0)
        np.testing.assert_allclose(lag, walk, rtol=tolerance)


def test_gauss_markov_of_a_short_time_is_white():
    tau = np.array([0.1, 1.0, 10.0])
    # Density q_c²T² at zero frequency; one sample remembers e^{−1/(rate T)} of the last.
    lag = find("GM")(q_c=1e3, correlation_time=1e-3).allan_variance(tau, 1e5)
    np.testing.assert_allclose(lag, 1.0 / tau, rtol=0.02)


def test_gauss_markov_peak():
    """IEEE 952-1997 C.1.6: 0.4365 q_c √T at 1.8926 T."""
    tau = np.linspace(1.5, 2.4, 9001)
    deviation = np.sqrt(find("GM")(q_c=2.0, correlation_time=1.0).allan_variance(tau, 1e4))
    assert tau[deviation.argmax()] == pytest.approx(1.8926, abs=2e-3)
    assert deviation.max() == pytest.approx(0.4365 * 2.0, rel=2e-4)


def test_published_levels():
    """N²/τ, 3Q²/τ², K²τ(2m²+1)/6m², R²τ²/2 and flicker over its plateau at m = 1, 2, 4, 16."""
    m, rate = np.array([1.0, 2.0, 4.0, 16.0]), 50.0
    tau = m / rate
    flicker = find("B")(B=1.0).allan_variance(tau, rate) / (2.0 * np.log(2.0) / np.pi)
    np.testing.assert_allclose(flicker, [1.44270, 1.15416, 1.05000, 1.00458], atol=1e-5)
    for effect, expected in [
        (find("N")(N=2.0), 4.0 / tau),
        (find("Q")(Q=2.0), 12.0 / tau**2),
        (find("K")(K=2.0), 4.0 * tau * (2 * m**2 + 1) / (6 * m**2)),
        (find("R")(R=2.0), 2.0 * tau**2),
    ]:
        np.testing.assert_allclose(effect.allan_variance(tau, rate), expected, rtol=1e-12)


def test_power_law_passes_through_the_standard_slopes():
    tau = np.array([1, 3, 50, 4000]) / 10.0
    for exponent, short, name in [(-1.0, "B", "B"), (-2.0, "K", "K"), (0.0, "N", "N")]:
        law = find("PL")(exponent=exponent, level=0.4).allan_variance(tau, 10.0)
        own = find(short)(**{name: 0.4}).allan_variance(tau, 10.0)
        np.testing.assert_allclose(law, own, rtol=1e-9)
        near = find("PL")(exponent=exponent + 1e-3, level=0.4).allan_variance(tau, 10.0)
        # The variance changes with the exponent by at most ln(τ rate)… per unit.
        np.testing.assert_allclose(near, own, rtol=2e-2)


def test_burst_noise_has_the_spectrum_of_a_gauss_markov():
    """A² e^{−2t/D}: T = D/2, σ = A."""
    burst = find("RTS")(amplitude=0.3, dwell_time=4.0)
    lag = find("GM")(q_c=0.3 * np.sqrt(2.0 / 2.0), correlation_time=2.0)
    f = np.geomspace(1e-3, 20.0, 40)
    np.testing.assert_allclose(burst.psd(f, 50.0), lag.psd(f, 50.0), rtol=1e-12)


def test_bandwidth_of_a_high_cutoff_changes_nothing():
    white = find("N")(N=0.3)
    f = np.geomspace(0.01, 24.9, 40)
    filtered = al.Model((white, find("BW")(cutoff=5e3, order=1, design="sampled"))).psd(f, 50.0)
    np.testing.assert_allclose(filtered, white.psd(f, 50.0), rtol=1e-6)


@pytest.mark.parametrize(
    ("design", "order"), [(d, order) for d, orders in lowpass.DESIGNS.items() for order in orders]
)
def test_bandwidth_is_down_by_half_at_its_cutoff(design, order):
    # Sampled designs fold: a cutoff of 1/100 of the rate adds little at the cutoff. A FIR is too short for that one.
    cutoff = 5.0 if design == "fir" else 0.5
    model = al.Model((find("N")(N=1.0), find("BW")(cutoff=cutoff, order=order, design=design)))
    assert model.psd(cutoff, 50.0) == pytest.approx(0.5, rel=2e-3)
    assert model.psd(1e-6, 50.0) == pytest.approx(1.0, rel=1e-9)


def test_the_filters_are_those_of_the_textbook():
    """Spectra of scipy's Butterworth, of smoothers in a row and of a mean of four, at seven cutoffs."""
    w = np.linspace(0.01, 3.1, 200)
    z = np.exp(-1j * w)
    for cutoff in (0.01, 0.05, 0.1, 0.25, 0.3, 0.4, 0.45):
        for order in (1, 2, 3, 4):
            b, a = butter(order, 2.0 * cutoff)
            expected = np.abs(np.polyval(b[::-1], z) / np.polyval(a[::-1], z)) ** 2
            found = sum(t.spectrum(w) for t in lowpass.terms("digital", order, cutoff))
            # A pole at 0 (odd orders, cutoff 1/4) is moved by 1e-5; far below, rounding is left.
            np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-10)
        for order in (2, 3):
            found = sum(t.spectrum(w) for t in lowpass.terms("smoothed", order, cutoff))
            cosine = np.cos(2.0 * np.pi * cutoff)
            share = 0.5 ** (1.0 / order)
            middle = (1.0 - share * cosine) / (1.0 - share)
            pole = middle - np.sqrt(middle**2 - 1.0)
            expected = ((1.0 - pole) ** 2 / np.abs(1.0 - pole * z) ** 2) ** order
            # Equal poles stand apart by up to 0.8 %: its square, times a few pairs of them.
            np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-9)
    mean = lowpass.terms("moving_average", 1, lowpass.MEAN_CUTOFFS[1] / 4.0)
    expected = np.abs(1 + z + z**2 + z**3) ** 2 / 16.0
    np.testing.assert_allclose(mean[0].spectrum(w), expected, atol=1e-12)


# -- cosine ordinates: exact expectations

NUMBERS = st.floats(0.05, 5.0)
SIZES = st.integers(32, 160)


def toeplitz(lags):
    h = np.abs(np.subtract.outer(np.arange(lags.size), np.arange(lags.size)))
    return lags[h]


def ordinates_of(covariance):
    """Diagonal of the covariance of the orthonormal cosine transform."""
    return np.diag(dct(dct(covariance, axis=0, norm="ortho"), axis=1, norm="ortho"))[1:]


def check_cosine(term, covariance, rtol=1e-8):
    n = covariance.shape[0]
    got = term.cosine_variance(np.arange(1, n), n)
    np.testing.assert_allclose(got, ordinates_of(covariance), rtol=rtol)


@given(NUMBERS, SIZES)
def test_cosine_variance_of_white_and_blue(v, n):
    check_cosine(terms.White(v), v * np.eye(n))
    lags = np.zeros(n)
    lags[:2] = 2 * v, -v
    check_cosine(terms.Blue(v), toeplitz(lags))


@given(NUMBERS, SIZES)
def test_cosine_variance_of_a_random_walk(v, n):
    check_cosine(terms.RandomWalk(v), v * np.minimum.outer(np.arange(n), np.arange(n)), 1e-6)


@given(st.floats(0.01, 0.999), SIZES)
def test_cosine_variance_of_a_lag(phi, n):
    check_cosine(terms.Exponential(0.7, phi), toeplitz(0.7 * phi ** np.arange(n)), 1e-6)


@given(st.floats(0.3, 0.999), st.floats(0.05, 3.0), st.floats(-0.9, 0.9), SIZES)
def test_cosine_variance_of_an_oscillation(radius, angle, imag, n):
    phi, a = radius * np.exp(1j * angle), 1.0 + 1j * imag * (1 - radius)
    lags = (a * phi ** np.arange(n)).real
    term = terms.Exponential(a, phi)
    n_j = term.cosine_variance(np.arange(1, n), n)
    exact = ordinates_of(toeplitz(lags))
    # Far from the peak an ordinate is the small difference of large sums.
    np.testing.assert_allclose(n_j, exact, rtol=1e-6, atol=1e-9 * np.abs(exact).max())


@settings(max_examples=20)
@given(st.sampled_from([-2.5, -1.7, -1.3, -1.0, -0.6, 0.4, 0.8]), st.integers(64, 300))
def test_cosine_variance_of_a_power_law(exponent, n):
    """Below −1, the lags are those of a variogram, because a constant in the covariance does not change j ≥ 1."""
    lags = -power_law_lags(exponent, n)
    exact = ordinates_of(toeplitz(lags))
    got = terms.PowerLaw(exponent, 1.0).cosine_variance(np.arange(1, n), n)
    np.testing.assert_allclose(got[:64], exact[:64], rtol=1e-6)
    # Beyond the 64 ordinates computed exactly the correction is extrapolated as 1/j.
    np.testing.assert_allclose(got[64:], exact[64:], rtol=5e-3)
    if exponent == -1.0:
        own = terms.Flicker(1.0).cosine_variance(np.arange(1, n), n)
        np.testing.assert_allclose(own, got, rtol=1e-9)


@given(st.integers(1, 12), st.integers(128, 300))
def test_cosine_variance_of_lags(length, n):
    lags = np.zeros(n)
    lags[:length] = (1.0 - np.arange(length) / length) / length
    got = terms.Lags(tuple(lags[:length])).cosine_variance(np.arange(1, n), n)
    # At the zeros of the filter what is left is the difference of sums of order 1.
    np.testing.assert_allclose(got, ordinates_of(toeplitz(lags)), rtol=1e-9, atol=1e-13)


@given(st.integers(2, 12), st.integers(40, 90))
def test_ordinates_of_lags_are_independent_without_the_ends(length, n):
    """Independent ordinates with the same spectrum have the same covariance, except for `memory` samples at each end."""
    term = terms.Lags(tuple((1.0 - np.arange(length) / length) / length))
    cosines = dct(np.eye(n), axis=0, norm="ortho")
    spectrum = term.spectrum(np.pi * np.arange(n) / n)
    independent = cosines.T @ (spectrum[:, None] * cosines)
    lags = np.zeros(n)
    lags[:length] = term.covariance
    inner = slice(term.memory, n - term.memory)
    np.testing.assert_allclose(independent[inner, inner], toeplitz(lags)[inner, inner], atol=1e-12)


@given(st.floats(1e-7, 3.0), st.floats(0.3, 3.0))
def test_spectrum_of_a_lag_keeps_its_digits(rate_times, w):
    """1 − 2φ cos w + φ² against extended precision for φ → 1."""
    phi = float(np.exp(-rate_times))
    got = terms.Exponential(1.0, phi).spectrum(np.array([w * 1e-4]))[0]
    p, c = np.longdouble(phi), np.cos(np.longdouble(w * 1e-4))
    assert got == pytest.approx(float((1 - p * p) / (1 - 2 * p * c + p * p)), rel=1e-6)


@given(st.floats(0.5, 0.999999), st.integers(1, 4000))
def test_allan_variance_of_a_lag_is_one_formula(phi, m):
    """Direct sums, closed form and walk limit agree with extended precision (METHODS formula)."""
    p, k = np.longdouble(phi), np.longdouble(m)
    top = k - 3 * p - k * p**2 + 4 * p ** (k + 1) - p ** (2 * k + 1)
    expected = float(top / (k**2 * (1 - p) ** 2))
    got = terms.Exponential(1.0, phi).allan_variance(np.array([float(m)]))[0]
    # The formula itself loses 3 log10(1/(m(1−φ))) of its 19 digits.
    lost = 1e-18 / max(float(k * (1 - p)), 1e-9) ** 3
    assert got == pytest.approx(expected, rel=1e-9 + lost, abs=1e-15 / m**2 / (1 - phi) ** 2)


def test_sum_is_flat_and_checked():
    model = find("N")(N=1.0) + find("K")(K=1.0) + find("GM")(q_c=1.0, correlation_time=2.0)
    assert [e.short for e in model] == ["N", "K", "GM"]
    with pytest.raises(al.InputError, match="twice"):
        model + find("N")(N=2.0)
    assert len(model + find("GM")(q_c=1.0, correlation_time=9.0)) == 4
    assert isinstance(model, fx.Model)
