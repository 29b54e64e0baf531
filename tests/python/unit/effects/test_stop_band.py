"""A filter of the whole record leaves next to nothing in its stop band: nothing is found there, and that is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import allanite as al
import generators as g

RATE, LENGTH = 100.0, 90_000
N, B, K = 0.0126, 0.002, 9.07e-5


def _record(seed: int, count: int = LENGTH) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return (
        g.white(rng, count, RATE, N) + g.flicker(rng, count, RATE, B) + g.walk(rng, count, RATE, K)
    )


def _recursive(b, a, seed):
    return signal.lfilter(b, a, _record(seed, LENGTH + 4096))[4096:]


def _taps(taps, seed):
    return signal.fftconvolve(_record(seed, LENGTH + len(taps) - 1), taps, "valid")


FILTERED = {
    "butterworth 4, 10 Hz": lambda seed: _recursive(*signal.butter(4, 0.2), seed),
    "butterworth 4, 30 Hz": lambda seed: _recursive(*signal.butter(4, 0.6), seed),
    "64 taps, 40 Hz": lambda seed: _taps(signal.firwin(64, 0.4, fs=1), seed),
    "mean of 5": lambda seed: _taps(np.full(5, 0.2), seed),
}


@pytest.mark.long
@pytest.mark.parametrize("name", FILTERED)
def test_a_filter_of_the_whole_record_is_found_and_hardly_more(name):
    """Lobes of a stop band, and leakage of the ends of the transform, were once resonances, notches and disturbances."""
    samples = FILTERED[name](len(name))
    study = al.improve(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K")
    added = [rung.added.kind for rung in study.ladder[1:]]
    assert added[0] == "bandwidth", study
    assert len(added) <= 2, study
    assert study.adequate, study
    assert study.fit["N"].value == pytest.approx(N, rel=0.03)


@pytest.mark.slow
def test_what_is_not_judged_is_said():
    samples = FILTERED["butterworth 4, 10 Hz"](1)
    fit = al.fit_model(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K+BW")
    # |H|² of a bilinear Butterworth of order 4 is 1e-4 where (tan(πf/100)/tan(π/10))⁸ is 1e4: 25.5 Hz.
    [(low, high)] = fit.not_judged
    assert low == pytest.approx(25.5, rel=0.05)
    assert high == pytest.approx(RATE / 2, rel=1e-4)
    assert fit.to_dict()["not_judged_hz"] == [[low, high]]
    assert f"not judged: {low:.3g}–{high:.3g} Hz" in str(fit)


def _seen(samples: np.ndarray) -> list[tuple[float, float]]:
    return al.fit_model(al.Recording(samples, rate=RATE), "N").not_judged


def _time() -> np.ndarray:
    return np.arange(LENGTH) / RATE


WHOLE = {
    "noise": lambda rng: _record(1),
    "a strong line": lambda rng: rng.standard_normal(LENGTH) + 300 * np.sin(80.0 * _time()),
    "drift": lambda rng: 1e-3 * rng.standard_normal(LENGTH) + np.sin(_time() / 300.0) + _time(),
    "random walk": lambda rng: np.cumsum(rng.standard_normal(LENGTH)),
    "white phase": lambda rng: np.diff(rng.standard_normal(LENGTH + 1)),
    "filter of order 1": lambda rng: signal.lfilter([0.5], [1, -0.5], rng.standard_normal(LENGTH)),
    "filter and rounding": lambda rng: np.round(_recursive(*signal.butter(4, 0.2), 2), 2),
}


@pytest.mark.parametrize("name", WHOLE)
def test_what_holds_something_is_judged(name):
    assert _seen(WHOLE[name](np.random.default_rng(3))) == []


def test_few_samples_are_not_empty_by_chance():
    rng = np.random.default_rng(4)
    for size in (32, 33, 64, 127, 500):
        assert all(_seen(rng.standard_normal(size)) == [] for _ in range(20))


@pytest.mark.slow
def test_the_border_of_an_empty_band_hides_no_line():
    samples = FILTERED["butterworth 4, 10 Hz"](5) + 0.01 * np.sin(2 * np.pi * 4.0 * _time())
    behind = "N+B+K+BW(cutoff=10, order=4, design=digital)"
    fit = al.fit_model(al.Recording(samples, rate=RATE, unit="rad/s"), behind)
    # A level that half of nothing lowers made what leaks out of the filter's pass band the strongest line.
    assert fit.discrepancy.percent > 0.0
    (line,) = (s.effect for s in fit.check().significant if s.kind == "sinusoid")
    assert line.frequency == pytest.approx(4.0, abs=1e-3)


@pytest.mark.long
def test_lines_of_a_record_behind_a_filter_are_found_where_it_passes():
    samples = FILTERED["butterworth 4, 10 Hz"](5) + 0.01 * np.sin(2 * np.pi * 4.0 * _time())
    study = al.improve(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K")
    assert {e.kind for e in study.fit.model} >= {"bandwidth", "sinusoid"}, study
    assert study.adequate, study
