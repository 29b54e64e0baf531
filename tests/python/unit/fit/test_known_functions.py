"""Known functions of time in a fit: what an effect says of itself is all that the fit asks."""

import json
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from scipy.fft import dct

import allanite as al
from allanite import _kernels
from allanite.effects import Deterministic, Parameter, Periodic
from allanite.effects.bias_step import BiasStep
from allanite.effects.warm_up import WarmUp
from allanite.fit.likelihood.data import prepare
from allanite.fit.shapes.deterministic import (
    Design,
    design_of,
    line_ordinates,
    regress,
    regress_designs,
)
from allanite.fit.shapes.matched import matched_gains
from generators import settling, sinusoid, white

RATE, N = 50.0, 20_000
TIME = np.arange(N) / RATE


@dataclass(frozen=True)
class Hum(Periodic):
    """A line that is not in the catalog."""

    strength: float | None = None
    angle: float | None = None

    kind: ClassVar[str] = "hum"
    short: ClassVar[str] = "HUM"
    title: ClassVar[str] = "hum"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("frequency", "Hz", "frequency", "shape", low=1e-12),
        Parameter("strength", 0.0, "amplitude"),
        Parameter("angle", "rad", "phase", low=-np.inf),
    )

    @property
    def lines(self):
        return ((1, self.strength or 0.0, self.angle or 0.0),)

    def with_amplitudes(self, amplitudes):
        a, b = map(float, amplitudes)
        return self.with_values(strength=float(np.hypot(a, b)), angle=float(np.arctan2(b, a)))


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(3)
    temperature = 20.0 + np.cumsum(rng.standard_normal(N)) * 0.01
    samples = white(rng, N, RATE, 0.014) + sinusoid(N, RATE, 3.0, 0.02) + 0.05 * (TIME >= 200.0)
    samples += 0.03 * (temperature - temperature.mean())
    return al.Recording(samples, RATE, unit="rad/s", covariates={"temperature": temperature})


def test_a_periodic_effect_of_ones_own_is_fitted_like_the_sinusoid(recording):
    """Frequency, slow effects in the same model, error and predictive score are those of `SIN`."""
    others = al.parse_model("N+COV(column=temperature)+STEP(t=200!)")
    mine, known = ((others + e).fit(recording) for e in (Hum(), al.Sinusoid()))
    assert mine.solution.log_likelihood == known.solution.log_likelihood
    assert mine.error == known.error
    assert mine["frequency"].interval == known["frequency"].interval
    assert mine["strength"].interval == known["amplitude"].interval
    assert mine["coefficient"].interval == known["coefficient"].interval


@pytest.mark.parametrize(
    "effect",
    [
        BiasStep(time=123.4, height=1.0),
        al.RateRamp(R=1.0),
        al.effects.Excursion(start=40.0, end=333.3, height=1.0),
        al.effects.Transient(time=123.4, time_constant=30.0, height=1.0),
        al.effects.Transient(time=250.0, time_constant=0.5, height=1.0),
        al.effects.Transition(begin=40.03, end=333.38, height=1.0),
        al.effects.Transition(begin=120.01, end=120.02, height=1.0),
        WarmUp(time_constant=2.0, amplitude=1.0),
        WarmUp(time_constant=170.0, amplitude=1.0),
    ],
)
@pytest.mark.parametrize("half", [0, 1])
def test_closed_forms_are_the_transforms(recording, effect, half):
    part = prepare(recording.half(half))
    data = replace(part, start=half * (recording.n // 2) / recording.rate)
    design = design_of((effect,), data)
    column = effect.regressors(data.time, {})[:, 0]
    plain = _kernels.cosine_transform(np.ascontiguousarray(column))[design.ordinates]
    # Rounding of the transform: 1e-16 of its largest ordinate, the mean, times some log n.
    largest = max(np.abs(plain).max(), np.sqrt(data.n) * np.abs(column).mean())
    np.testing.assert_allclose(design.matrix[:, 0], plain, rtol=0, atol=1e-11 * largest)


def test_a_step_happens_once():
    assert BiasStep.happens_once
    assert not Deterministic.happens_once


def test_several_shapes_may_be_unknown_at_once(recording):
    fit = al.fit_model(recording, "N+COV(column=temperature)+SIN+STEP")
    # A step of 0.05 in N = 0.014 is placed to 11 N²/h² ≈ 1 s (95 %); lag and step share a little.
    assert fit["time"] == pytest.approx(200.0, abs=2.0)
    assert fit["frequency"] == pytest.approx(3.0, abs=1e-3)


def test_documents_are_plain(recording):
    json.dumps(al.fit_model(recording, "N").check().to_dict(), allow_nan=False)


def test_a_matched_filter_counts_what_a_function_adds_to_those_beside_it():
    """½z² with free amplitudes of the others is the gain of the regression on all minus that on the others."""
    rng = np.random.default_rng(2)
    samples = white(rng, N, RATE, 0.1) + 1e-3 * TIME
    fit = al.fit_model(al.Recording(samples, rate=RATE), "N+WARM(T=60)+STEP(time=150)")
    data, noise = fit.data, fit.solution.noise(fit.data)
    j = np.arange(1, 4096)
    variance = noise.variance(j)
    # No trial shape may be that of a fitted effect, which would add nothing: the fitted time constant is near 200 s.
    points = [al.RateRamp(), *(WarmUp(time_constant=t) for t in (20.0, 600.0))]
    for point in points:
        gain, unit = matched_gains(
            [point], fit.solution.ordinates, noise, data, fit.model.deterministic
        )
        beside = design_of(fit.model.deterministic, data, j).matrix
        own = design_of((point,), data, j).matrix
        values = fit.solution.ordinates[j]
        alone = regress(beside, values, variance).gain
        both = regress(np.hstack([beside, own]), values, variance).gain
        assert gain[0] == pytest.approx(both - alone, rel=1e-6, abs=1e-9)
        assert np.linalg.norm(unit[0]) == pytest.approx(1.0, rel=1e-9)
    known = list(fit.model.deterministic)
    for effect in known:
        again, unit = matched_gains([effect], fit.solution.ordinates, noise, data, known)
        assert not again.any()
        assert not unit.any()


def test_designs_at_their_own_ordinates_are_one_regression():
    """Partly overlapping designs, against least squares on all ordinates with zeros outside of each."""
    rng, size = np.random.default_rng(9), 300
    at = np.arange(10, 10 + 2 * size, 2)
    spans = [(0, 180), (120, 240), (230, 300), (100, 150)]
    designs = [
        Design(at[low:high], rng.standard_normal((high - low, columns)))
        for (low, high), columns in zip(spans, (3, 2, 4, 1), strict=True)
    ]
    whole = np.zeros((size, 10))
    for (low, high), design, start in zip(spans, designs, (0, 3, 5, 9), strict=True):
        whole[low:high, start : start + design.matrix.shape[1]] = design.matrix
    values, variance = rng.standard_normal(size), rng.uniform(0.5, 2.0, size)
    found = regress_designs(designs, at, values, variance)
    white = whole / np.sqrt(variance)[:, None]
    covariance = np.linalg.inv(white.T @ white)
    expected = covariance @ white.T @ (values / np.sqrt(variance))
    np.testing.assert_allclose(found.amplitudes, expected, rtol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-8, atol=1e-12)
    hat = np.einsum("ij,jk,ik->i", white, covariance, white)
    np.testing.assert_allclose(found.leverage, hat, rtol=1e-9)


def test_lines_of_a_comb_are_regressed_in_their_own_windows():
    """Amplitudes of 20 lines, each ten times its standard error, against regressors in the windows of all lines."""
    rng, n, rate = np.random.default_rng(12), 50_000, 100.0
    multiples = [1.0 + 0.73 * k for k in range(20)]
    t = np.arange(n) / rate
    x = rng.standard_normal(n)
    for m in multiples:
        x += 0.063 * np.sin(2 * np.pi * 2.1 * m * t + m)
    data = prepare(al.Recording(x, rate))
    design = design_of((al.Sinusoid.at(2.1, multiples),), data)
    at = design.ordinates
    found = regress_designs((design,), at, data.ordinates[at], np.ones(at.size))
    dense = np.hstack([line_ordinates(2.1 * m, at, data) for m in multiples])
    expected = regress(dense, data.ordinates[at], np.ones(at.size))
    error = np.sqrt(np.diag(expected.covariance))
    # A line 1533 ordinates away leaks 10·2/(1533π) = 0.4 % of an error.
    assert np.abs(found.amplitudes - expected.amplitudes).max() < 0.05 * error.max()
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(error, rel=0.005)
    assert found.leverage.sum() == pytest.approx(40.0)


@pytest.mark.parametrize("n", [1001, 40_000])
def test_the_ordinates_of_a_line_are_the_cosine_transform_of_its_samples(n):
    rate = 50.0
    data = prepare(al.Recording(np.random.default_rng(1).standard_normal(n), rate))
    step = rate / (2 * n)
    j = np.arange(1, n, dtype=np.int64)
    # On an ordinate, next to it, between two, and near both ends of the spectrum.
    middle = n // 3
    places = np.array([middle, middle + 1e-9, middle + 1e-3, middle + 0.5, 1.3, n - 1.0])
    t = data.start + np.arange(n) / rate
    found = line_ordinates(places * step, j, data)
    for one, f in zip(found, places * step, strict=True):
        for column, wave in enumerate((np.sin(2 * np.pi * f * t), np.cos(2 * np.pi * f * t))):
            expected = dct(wave, norm="ortho")[1:]
            # The phase nω/2 has a rounding error of n·ε; the largest ordinate is √(n/2).
            error = 4.0 * n * np.finfo(float).eps * np.sqrt(0.5 * n)
            np.testing.assert_allclose(one[:, column], expected, rtol=0, atol=error)


@pytest.mark.parametrize("start", [60.0, 205.0, 500.0])
def test_a_time_constant_is_found_from_any_start(start):
    """The start lies several points of the grid away."""
    rng = np.random.default_rng(15)
    n, rate = 20_000, 10.0
    x = white(rng, n, rate, 0.01) + settling(n, rate, 150.0, 0.03)
    record = al.Recording(x, rate=rate, unit="deg/s")
    best = al.fit_model(record, "N+WARM")
    fit = al.fit_model(record, f"N+WARM(time_constant={start})")
    assert fit["WARM.time_constant"].value == pytest.approx(
        best["WARM.time_constant"].value, rel=1e-3
    )
    assert fit.solution.log_likelihood > best.solution.log_likelihood - 0.01
