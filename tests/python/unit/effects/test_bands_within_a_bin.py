"""A band narrower than a bin: a line whose phase wanders. Named as one band, measured by single ordinates."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

import allanite as al
import generators as g
from allanite.fit.engine import solve
from allanite.fit.likelihood import peaks
from allanite.fit.likelihood.data import prepare
from allanite.fit.likelihood.expected import column_of, density
from allanite.fit.likelihood.peaks import bins_near, is_narrow, means_near, ordinates_of_bins
from allanite.fit.likelihood.whitened import whitened_ordinates
from allanite.fit.measures import Discrepancy
from allanite.fit.shapes.narrow import Window, ordinates_delta_logl
from allanite.spectrum import bins_of
from allanite.study.judgement import no_error_rises
from allanite.suggestion.screens.spectral import narrow_bands, widths_tried

RATE, LENGTH = 50.0, 90_000
DURATION = LENGTH / RATE
N = 0.0126


def _recording(samples):
    return al.Recording(samples, rate=RATE, unit="rad/s")


def _wandering(rng, frequency, half_width, amplitude, multiple=1):
    """A line whose phase is a random walk: a Lorentzian band of this half-width at half its height, Hz."""
    phase = np.cumsum(rng.standard_normal(LENGTH)) * np.sqrt(4.0 * np.pi * half_width / RATE)
    t = np.arange(LENGTH) / RATE
    return amplitude * np.sin(multiple * (2.0 * np.pi * frequency * t + phase)), phase


@pytest.mark.slow
@pytest.mark.parametrize(("frequency", "half_width", "seed"), [(7.3, 0.0016, 0), (18.9, 0.006, 1)])
def test_a_line_that_wanders_is_one_band_of_its_width(frequency, half_width, seed):
    rng = np.random.default_rng(seed)
    x = g.white(rng, LENGTH, RATE, N) + g.walk(rng, LENGTH, RATE, 9e-5)
    x += _wandering(rng, frequency, half_width, 0.03)[0]
    study = al.improve(_recording(x), "N+K")
    assert [r.added.kind for r in study.ladder[1:]] == ["resonance"], study
    assert study.adequate, study
    fit = study.fit
    # 2·half-width·T = 6 and 22 bandwidths in the record: the width is known to √(2/(π·these)), 33 and 17 %; three of these.
    bands = 2.0 * half_width * DURATION
    spread = np.exp(3.0 * np.sqrt(2.0 / (np.pi * bands)))
    width = fit["RES.damping"].value * fit["RES.frequency"].value
    assert half_width / spread < width < half_width * spread
    # Its middle is known to a half-width over √(half of these); three of these.
    assert abs(fit["RES.frequency"].value - frequency) < 3.0 * half_width * np.sqrt(2.0 / bands)
    # Of a sine of constant size the power is a² / 2, whatever its phase does; noise in its bin is 0.5 % of that.
    assert fit["RES.rms"].value == pytest.approx(0.03 / np.sqrt(2.0), rel=0.05)
    for name in ("frequency", "damping", "rms"):
        low, high = fit[f"RES.{name}"].interval
        assert low < fit[f"RES.{name}"].value < high


def test_what_is_held_stays():
    rng = np.random.default_rng(9)
    x = g.white(rng, LENGTH, RATE, N) + _wandering(rng, 7.3, 0.003, 0.03)[0]
    values = {"frequency": 7.3, "damping": 0.003 / 7.3, "rms": 0.03 / np.sqrt(2.0)}
    for held in ("rms", "damping"):
        band = al.effects.Resonance(**values | {held: 0.8 * values[held]}, hold=(held,))
        fit = al.fit_model(_recording(x), al.Model((al.AngleRandomWalk(), band)))
        assert fit.model.effects[1].values[held] == 0.8 * values[held]
        # With one shape held the other is found in the bins, 1.2 % wide.
        assert fit.model.effects[1].frequency == pytest.approx(7.3, abs=0.05)


@pytest.mark.slow
def test_its_harmonics_come_with_it():
    rng = np.random.default_rng(3)
    first, phase = _wandering(rng, 1.7, 0.001, 0.03)
    t = np.arange(LENGTH) / RATE
    third = 0.01 * np.sin(3.0 * (2.0 * np.pi * 1.7 * t + phase))
    study = al.improve(_recording(g.white(rng, LENGTH, RATE, N) + first + third), "N")
    assert study.adequate, study
    step = study.ladder[1]
    assert step.added.kind == "resonance"
    assert [e.kind for e in step.brought] == ["resonance"]
    found = sorted(e.frequency for e in study.fit.model if e.kind == "resonance")
    # Within three of their half-widths: 1 and 9 mHz.
    assert found == [pytest.approx(1.7, abs=0.003), pytest.approx(5.1, abs=0.027)]


@pytest.mark.slow
def test_a_line_that_does_not_wander_is_a_line():
    rng = np.random.default_rng(4)
    x = g.white(rng, LENGTH, RATE, N) + g.sinusoid(LENGTH, RATE, 7.3, 0.004)
    study = al.improve(_recording(x), "N")
    assert study.fit.model.name == "N+SIN"


@pytest.mark.slow
def test_noise_has_no_band():
    rng = np.random.default_rng(5)
    check = al.fit_model(_recording(g.white(rng, 4096, RATE, N)), "N").check()
    assert not check.significant


@pytest.mark.slow
@given(
    frequency=st.floats(2.0, 24.0),
    ordinates=st.floats(1.0, 20.0),
    n=st.sampled_from([20_000, 30_011]),
)
def test_the_mean_of_a_bin_is_that_of_its_ordinates(frequency, ordinates, n):
    half = ordinates * RATE / (2.0 * n)
    band = al.effects.Resonance(frequency=frequency, damping=half / frequency, rms=1.0)
    data = prepare(_recording(np.random.default_rng(0).standard_normal(n)))
    found = column_of(al.Model((band,)), band, data)
    if not is_narrow(band):
        return
    for b in bins_near(band, data.bins, RATE):
        j = np.arange(data.bins.edges[b], data.bins.edges[b + 1])
        naive = density(tuple(band.terms(RATE)), j, n).mean()
        assert found[b] == pytest.approx(naive, rel=1e-9)


@pytest.mark.parametrize("half", [3.0, 80.0, 2000.0])
@pytest.mark.parametrize("depth", [None, 0.8])
def test_few_ordinates_tell_the_means_of_bins_that_have_many(half, depth, monkeypatch):
    n = 3_000_000
    bins, hertz = bins_of(n), RATE / (2.0 * n)
    band = al.effects.Resonance(frequency=7.3, damping=half * hertz / 7.3, rms=1.0)
    if depth is not None:
        band = al.effects.ModulatedVibration.like(band, modulation=0.9, depth=depth)
    terms = tuple(band.terms(RATE))
    found = []
    for singly in (n, 0):
        monkeypatch.setattr(peaks, "MAX_SUMMED_ORDINATES", singly)
        near, means = means_near(band, bins, RATE, lambda j: density(terms, j, n))
        found.append(means)
    assert near.size == (7 if depth is None else 21)
    assert found[1] == pytest.approx(found[0], rel=2e-4)


@pytest.mark.slow
def test_a_band_of_no_strength_explains_nothing():
    """In the stop band of a digital filter, the spectrum changes within a bin, whatever band is there."""
    rng = np.random.default_rng(11)
    b, a = signal.butter(2, 0.98)
    x = signal.lfilter(b, a, g.white(rng, LENGTH + 4096, RATE, N))[4096:]
    filtered = "N+BW(cutoff=24.5!,order=2,design=digital)"
    without = al.fit_model(_recording(x), filtered)
    band = "RES(frequency=24.86!,damping=0.00286!,rms=1e-9!)"
    beside = al.fit_model(_recording(x), f"{filtered}+{band}")
    assert abs(beside.solution.log_likelihood - without.solution.log_likelihood) < 0.01
    study = al.improve(_recording(x), "N+B+K")
    assert [e.kind for e in study.fit.model if e.occupies is not None] == [], study


def test_bins_and_what_is_within_them_are_the_likelihood_of_the_ordinates():
    """For two widths of one band, the difference of logL is that of Whittle's likelihood of all ordinates near it."""
    rng = np.random.default_rng(6)
    x = g.white(rng, LENGTH, RATE, N) + _wandering(rng, 7.3, 0.002, 0.03)[0]
    data = prepare(_recording(x))
    found = []
    for half in (0.001, 0.002, 0.004):
        band = f"RES(frequency=7.3, damping={half / 7.3}, rms=0.02)"
        model = al.parse_model(f"N(N={N})+{band}")
        columns = sum(
            e.values[e.coefficient] ** 2 * column_of(model, e, data) for e in model.stochastic
        )
        power, count = data.bins.power(data.ordinates), data.bins.count
        binned = -0.5 * float(np.sum(count * (np.log(columns) + power / columns)))
        near = bins_near(model.effects[1], data.bins, RATE)
        j = ordinates_of_bins(near, data.bins)
        expected = density(data.terms(model), j, data.n)
        whole = -0.5 * float(np.sum(np.log(expected) + data.ordinates[j] ** 2 / expected))
        part = -0.5 * float(
            np.sum(count[near] * (np.log(columns[near]) + power[near] / columns[near]))
        )
        assert ordinates_delta_logl(model, data, data.ordinates, count) == pytest.approx(
            whole - part, abs=1e-6
        )
        found.append(binned + whole - part)
    assert max(found) == found[1]


def test_standard_errors_are_those_of_the_curvature():
    """Fisher's information of the window against second differences of its expected logL."""
    rng = np.random.default_rng(7)
    x = g.white(rng, LENGTH, RATE, N) + _wandering(rng, 7.3, 0.004, 0.03)[0]
    fit = al.fit_model(_recording(x), "N+RES(frequency=7.3, damping=0.0005, rms=0.02)")
    window = Window.of(fit.model, 1, fit.data, fit.solution.ordinates)
    at = window.coordinates(fit.model.effects[1])
    expected = replace(window, power=window.spectrum(at))
    steps = np.diag(1e-3 * window.scales(at))
    curvature = np.empty((4, 4))
    for i, a in enumerate(steps):
        for k, b in enumerate(steps):
            values = [
                expected.log_likelihood(at + s * a + t * b)
                for s, t in ((1, 1), (1, -1), (-1, 1), (-1, -1))
            ]
            four = values[0] - values[1] - values[2] + values[3]
            curvature[i, k] = -four / (4.0 * a.sum() * b.sum())
    naive = np.sqrt(np.diag(np.linalg.inv(curvature)))
    np.testing.assert_allclose(np.sqrt(np.diag(window.covariance(at))), naive, rtol=0.02)


def test_the_excess_is_where_it_was_put():
    rng = np.random.default_rng(8)
    samples = g.white(rng, LENGTH, RATE, N) + _wandering(rng, 7.3, 0.003, 0.03)[0]
    data = prepare(_recording(samples))
    known = solve(data, al.parse_model("N"))
    white = whitened_ordinates(known, data, np.ones(known.count.size))
    _, low, high, variance = max(narrow_bands(known, data, white))
    assert low < 7.303
    assert high > 7.297
    # Most of the power of the process is in the band.
    assert variance == pytest.approx(0.03**2 / 2.0, rel=0.3)
    assert widths_tried(100) == 1


@pytest.mark.parametrize(
    ("before", "after", "falls"),
    [
        (3.0, 13.9, True),
        (9.7, 13.9, True),
        (9.7, 16.8, False),
        (24.0, 24.9, True),
        (24.0, 26.0, False),
    ],
)
def test_an_allan_error_beyond_its_scatter_rises_by_no_more_than_that(before, after, falls):
    """With a scatter of 7 %: up to twice the scatter, or up to the root of the sum of squares of error and scatter."""

    def fit(error):
        return SimpleNamespace(
            discrepancy=Discrepancy(1.0, (0.5, 2.0)),
            data=None,
            curve=SimpleNamespace(
                rms_percent=error, expected_scatter_percent=7.0, error_increase=lambda *_: 0.0
            ),
        )

    assert no_error_rises(fit(before), fit(after)) == falls


@pytest.mark.parametrize("seed", range(6))
def test_what_single_ordinates_show_is_detected(seed):
    """Bins of 500 ordinates do not exclude 0, but four of the ordinates are tens of times as high."""
    rng = np.random.default_rng([seed, 9])
    x = g.white(rng, LENGTH, RATE, N) + g.resonance(rng, LENGTH, RATE, 21.0, 2.5e-5, 0.004)
    fit = al.fit_model(_recording(x), f"N(N={N})+RES(f=21,damping=2.5e-5,rms=0.004)")
    found = fit["RES.rms"]
    low, high = found.interval
    assert found.detected
    assert 0.0 < low < found < high
    assert low < 0.004 < high


def test_a_band_narrower_than_a_bin_leaves_the_intervals_of_other_shapes():
    """The correlation time of a lag (5 s) has a standard error of about 7 %, with and without a line at 0.2 Hz."""
    n, rate, rng = 20_000, 5.0, np.random.default_rng(0)
    noise = g.white(rng, n, rate, 4.5e-4) + g.gauss_markov(rng, n, rate, 6.3e-4, 5.0)
    phase = np.cumsum(rng.standard_normal(n)) * np.sqrt(4.0 * np.pi * 1.0 / (n * 12.0))
    line = 5e-4 * np.sin(2.0 * np.pi * 0.2 * np.arange(n) / rate + phase)
    errors = []
    for model, x in (("N+GM", noise), ("N+GM+RES(frequency=0.2)", noise + line)):
        fit = al.parse_model(model).fit(al.Recording(x, rate=rate, unit="rad/s"))
        found = fit["GM.correlation_time"]
        assert found.interval[0] < 5.0 < found.interval[1]
        errors.append(found.std_error / found.value)
    # The line takes few of the ordinates that determine the lag. The fault was an error thousands of times too small.
    assert errors[1] == pytest.approx(errors[0], rel=0.2)
