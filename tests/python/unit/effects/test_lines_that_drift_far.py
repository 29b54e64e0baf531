"""Lines that drift over more frequencies than are searched at every rate: named as one, and nothing else is."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.rivals.line_trials import line_trials
from allanite.fit.shapes.drifting import MAX_EXHAUSTIVE_FREQUENCIES, Band
from allanite.suggestion.p_values import Family, log_p_value

RATE, LENGTH, N = 50.0, 100_000, 0.0126
T = LENGTH / RATE


def _line(rng, first, last, amplitude):
    """The phase summed sample by sample."""
    frequency = np.linspace(first, last, LENGTH, endpoint=False)
    angle = 2.0 * np.pi * (np.cumsum(frequency) - frequency) / RATE
    return amplitude * np.sin(angle + rng.uniform(0.0, 2.0 * np.pi))


def _series(rng, k):
    """Noise of a band of k frequencies; the gain of any line in it is exponentially distributed with mean 1."""
    return (rng.standard_normal(k) + 1j * rng.standard_normal(k)) / np.sqrt(2 * k)


@pytest.mark.parametrize(
    ("k", "gain"), [(5000, 40.0), (8192, 40.0), (16_384, 60.0), (65_536, 80.0)]
)
def test_courses_lead_to_the_line(k, gain):
    """The sum over M sections is gain/√M ≥ 7 standard deviations high, among some millions of sums."""
    u = np.arange(k) / k
    for seed in range(3):
        rng = np.random.default_rng([seed, k])
        f, d = rng.uniform(0.3, 0.7) * k, rng.uniform(-0.45, 0.45) * k
        line = np.exp(2j * np.pi * (f * u + 0.5 * d * (u - 0.5) ** 2)) / k
        band = Band(_series(rng, k) + np.sqrt(gain) * line, 10, 1.0)
        frequency, drift, found = band.search()
        # Half a step of either.
        assert frequency == pytest.approx(10.0 + f, abs=0.5)
        assert drift == pytest.approx(d, abs=2.0)
        # The gain scatters by √(2 gain); off by a quarter of a cycle and a step it is a fifth lower.
        assert found > 0.8 * gain - 3.0 * np.sqrt(2.0 * gain)


def test_noise_of_a_wide_band_is_no_line():
    """If every rate had been searched at every frequency, its probability would still be far below 1 %."""
    for seed in range(12):
        band = Band(
            _series(np.random.default_rng([seed, 1]), 2 * MAX_EXHAUSTIVE_FREQUENCIES), 10, 1.0
        )
        family = Family("line", width=line_trials(8 * MAX_EXHAUSTIVE_FREQUENCIES) * band.trials)
        assert log_p_value(family, band.search()[2]) > np.log(0.01)


@pytest.mark.long
@pytest.mark.parametrize(
    ("first", "last", "amplitude"), [(12.0, 14.5, 0.012), (14.0, 9.0, 0.02), (8.0, 20.0, 0.02)]
)
def test_a_line_that_drifts_far_is_one(first, last, amplitude):
    """None of six such lines was named once: two were nothing, two a resonance, two a moving band, always adequate."""
    rng = np.random.default_rng(31)
    noise = g.white(rng, LENGTH, RATE, N) + g.walk(rng, LENGTH, RATE, 9e-5)
    samples = noise + _line(rng, first, last, amplitude)
    study = al.improve(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K")
    assert [r.added.kind for r in study.ladder[1:]] == ["drifting_line"], study
    assert study.adequate
    found = study.fit["CHIRP.drift"]
    assert found.value == pytest.approx((last - first) / T, abs=4.0 * found.std_error)


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.02, 0.15])
def test_a_wide_resonance_is_no_line(damping):
    rng = np.random.default_rng(32)
    shaken = g.resonance(rng, LENGTH, RATE, 11.0, damping, 0.03)
    recording = al.Recording(g.white(rng, LENGTH, RATE, N) + shaken, rate=RATE, unit="rad/s")
    for start in ("N", "N+RES"):
        suggested = al.fit_model(recording, start).check().significant
        assert "drifting_line" not in {s.kind for s in suggested}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_line_that_raises_no_ordinate_clearly_is_found(seed):
    """Over 900 frequencies, ΔlogL is about 70: a mean excess of 8 % of the noise, 2.5 standard deviations."""
    rng = np.random.default_rng(seed)
    n, rate = 30_000, 100.0
    t = np.arange(n) / rate
    samples = g.white(rng, n, rate, 0.01) + 9e-3 * np.sin(
        2.0 * np.pi * (10.0 * t + 0.005 * t**2) + 1.0
    )
    check = al.fit_model(al.Recording(samples, rate=rate), "N").check()
    assert [s.kind for s in check.significant] == ["drifting_line"]
    assert float(check.significant[0].effect.drift) == pytest.approx(0.01, rel=0.01)


def test_a_search_of_a_random_walk_keeps_lines_above_zero():
    """The screen of lines once proposed a negative frequency, the mirror image of a line below the first ordinate."""
    rng = np.random.default_rng([15, 77])
    noise = 0.1 * rng.standard_normal(100_000)
    samples = noise + rng.uniform(0.7, 1.6) * 4e-5 * np.cumsum(rng.standard_normal(100_000))
    study = al.improve(al.Recording(samples, 100.0, unit="deg/s"), "N")
    assert {effect.kind for effect in study.fit.model} == {"angle_random_walk", "rate_random_walk"}
