"""Missing samples of a summary invent nothing and hide nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import allanite as al
import generators as g
from allanite.summary import level, reading, summary
from allanite.summary.gaps import MAX_DRAWN_RUN, fill_missing

RATE, LENGTH = 100.0, 300_000


@pytest.fixture
def short(monkeypatch):
    """Levels keep fewer samples, so that records of 3e5 samples have octaves of segments."""
    for module in (level, reading, summary):
        monkeypatch.setattr(module, "MAX_KEPT_SAMPLES", 1 << 16)


def _noise(kind, rng, n=LENGTH):
    white = g.white(rng, n, RATE, 0.1)
    return {
        "N": lambda: white,
        "N+K": lambda: white + g.walk(rng, n, RATE, 0.01),
        "N+GM": lambda: white + g.gauss_markov(rng, n, RATE, 0.05, 20.0),
        "N+RES": lambda: white + g.resonance(rng, n, RATE, 18.0, 0.02, 0.5),
    }[kind]()


def _lost(kind, rng, n=LENGTH):
    bad = np.zeros(n, dtype=bool)
    if kind == "single samples":
        bad[rng.random(n) < 0.05] = True
    elif kind == "dropouts":
        for start in rng.integers(0, n - 60, n // 1500):
            bad[start : start + int(rng.integers(5, 60))] = True
    elif kind == "pauses":
        for start in rng.integers(0, n - 9000, 3):
            bad[start : start + int(rng.integers(500, 9000))] = True
    elif kind == "a tenth at once":
        bad[n // 3 : n // 3 + n // 10] = True
    else:
        bad[-n // 15 :] = True
    return bad


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["single samples", "dropouts", "pauses", "a tenth at once", "end"])
@pytest.mark.parametrize("noise", ["N", "N+K", "N+GM", "N+RES"])
def test_gaps_invent_nothing(short, noise, lost):
    rng = np.random.default_rng(17)
    x = _noise(noise, rng)
    model = noise.replace("RES", "RES(f=18,damping=0.02)")
    whole = al.fit_model(al.summarize(x, rate=RATE, unit="rad/s"), model)
    x[_lost(lost, rng)] = np.nan
    fit = al.fit_model(al.summarize(x, rate=RATE, unit="rad/s"), model)
    check = fit.check()
    assert check.adequate, (check.left, [s.kind for s in check.significant])
    for found, expected in zip(fit.estimates, whole.estimates, strict=True):
        for name, value in expected.items():
            # A tenth of the samples, or what was drawn for them, moves a number by a third of its standard error: three of
            # that. An image turns the phase of a band: 200 turns in 3000 s beside its own decay of ωζ = 2.3 per second make
            # it 3 % wider, of which a standard error of the damping is 2.2 %.
            if value.std_error:
                allowed = 1.0 + 0.03 / 0.022 * (name == "damping" and lost == "dropouts")
                assert abs(float(found[name]) - float(value)) < allowed * value.std_error, name


@pytest.mark.slow
def test_a_step_beside_a_gap_is_still_found(short):
    rng = np.random.default_rng(5)
    x = _noise("N", rng) + g.step(LENGTH, RATE, 1200.0, 0.2)
    x[100_000:110_000] = np.nan
    study = al.improve(al.summarize(x, rate=RATE, unit="rad/s"), "N")
    assert [e.kind for e in study.fit.model] == ["angle_random_walk", "bias_step"], study
    # The gap lasts from 1000 to 1100 s; N is known to 0.13 %, a mean over 1800 s to 0.0024.
    assert study.fit["STEP.height"].value == pytest.approx(0.2, abs=0.02)


@given(
    seed=st.integers(0, 2**32 - 1),
    runs=st.lists(st.tuples(st.integers(0, 999), st.integers(1, 300)), min_size=1, max_size=12),
)
def test_what_is_there_stays_and_what_is_filled_is_finite(seed, runs):
    x = np.random.default_rng(seed).standard_normal(1000)
    for start, size in runs:
        x[start : start + size] = np.nan
    seen = np.isfinite(x)
    if not seen.any():
        with pytest.raises(al.TooShortError):
            fill_missing(x)
        return
    out = fill_missing(x)
    assert np.array_equal(out[seen], x[seen])
    assert np.isfinite(out).all()
    assert np.array_equal(out, fill_missing(x.copy()))


@pytest.mark.parametrize("size", [1, 3, MAX_DRAWN_RUN, 40, 1000])
def test_white_noise_stays_white(size):
    """Power of the low, middle and high third of the spectrum, with a fifth of the samples missing in runs."""
    ratio = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        x = rng.standard_normal(20_000)
        for start in range(2 * size, x.size - 2 * size, 5 * size):
            x[start : start + size] = np.nan
        power = np.abs(np.fft.rfft(fill_missing(x)))[1:] ** 2 / x.size
        ratio.append([part.mean() for part in np.array_split(power, 3)])
    # 20 × 3333 ordinates of χ²₂ scatter by 0.4 %, those of a draw that shares its images by half as much again; the
    # autocovariance at 64 lags is known to 0.8 %.
    assert np.mean(ratio, axis=0) == pytest.approx(1.0, abs=0.03)


def test_a_walk_is_bridged():
    """Values drawn in a short gap have the error of a Brownian bridge."""
    rng = np.random.default_rng(3)
    walk = np.cumsum(rng.standard_normal(20_000))
    x = walk.copy()
    at = np.arange(50, x.size - 50, 50)
    x[at] = np.nan
    # The middle of three points of a walk, known from both: variance ½ for the truth and as much for the draw.
    error = fill_missing(x)[at] - walk[at]
    assert np.mean(error**2) == pytest.approx(1.0, rel=0.25)
