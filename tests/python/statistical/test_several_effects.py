"""Two and three effects hidden at once: the ladder finds all of them and nothing else. And what it must not find."""

import numpy as np
import pytest

import allanite as al
import generators as g
from counts import halves, nightly, records

pytestmark = pytest.mark.statistical

RATE, LENGTH = 50.0, 180_000
DURATION = LENGTH / RATE
N, B, K = 0.0126, 0.002, 9.07e-5


def _drift(rng):
    return g.flicker(rng, LENGTH, RATE, B) + g.walk(rng, LENGTH, RATE, K)


def _line(rng, frequency=3.1, amplitude=3e-3):
    return g.sinusoid(LENGTH, RATE, frequency, amplitude, rng.uniform(0.0, 2.0 * np.pi))


def _recording(samples, **covariates):
    return al.Recording(samples, rate=RATE, unit="rad/s", covariates=covariates)


def _lag_and_line(rng):
    samples = g.white(rng, LENGTH, RATE, N) + _drift(rng) + _line(rng)
    return _recording(samples + g.gauss_markov(rng, LENGTH, RATE, 4.5e-3, 20.0))


def _steps_and_temperature(rng):
    true = g.temperature(LENGTH, RATE, 1800.0)
    samples = g.white(rng, LENGTH, RATE, N) + _drift(rng)
    samples += g.quantization(rng, LENGTH, RATE, 3.5e-4)
    samples += 5e-3 * g.lagged(true - true.mean(), RATE, 60.0)
    return _recording(samples, temperature=true + 0.02 * rng.standard_normal(LENGTH))


def _flicker_walk_and_line(rng):
    samples = g.white(rng, LENGTH, RATE, N) + _line(rng)
    samples += g.flicker(rng, LENGTH, RATE, 6e-3) + g.walk(rng, LENGTH, RATE, 1.2e-3)
    return _recording(samples)


def _louder_and_step(rng):
    samples = g.louder(g.white(rng, LENGTH, RATE, N), RATE, 1000.0, 1600.0, 1.06) + _drift(rng)
    return _recording(samples + g.step(LENGTH, RATE, rng.uniform(0.2, 0.8) * DURATION, 0.04))


def _comb(rng):
    samples = g.white(rng, LENGTH, RATE, N) + _drift(rng)
    for multiple, amplitude in ((1, 3.5e-3), (2, 2.5e-3), (3, 2.5e-3)):
        samples += _line(rng, 2.1 * multiple, amplitude)
    return _recording(samples)


# Name: (recording, start, kinds that have to be in the last model beside those of the start).
CASES = {
    "lag and line": (_lag_and_line, "N+B+K", ["gauss_markov", "sinusoid"]),
    "quantization and temperature": (
        _steps_and_temperature,
        "N+B+K",
        ["covariate", "quantization"],
    ),
    "flicker, random walk and line": (
        _flicker_walk_and_line,
        "N",
        ["bias_instability", "rate_random_walk", "sinusoid"],
    ),
    "level and step": (_louder_and_step, "N+B+K", ["bias_step", "noise_level_change"]),
    "comb": (_comb, "N+B+K", ["sinusoid"]),
}


@pytest.mark.parametrize(
    "case",
    nightly(
        CASES,
        "quantization and temperature",
        "lag and line",
        "flicker, random walk and line",
        "level and step",
    ),
)
def test_the_ladder_finds_all_and_nothing_else(case):
    make, start, kinds = CASES[case]

    def told_of(seed):
        study = al.improve(make(np.random.default_rng([seed, *case.encode()])), start)
        # What one rung added may take another's place on a later one: the set that the ladder ends with counts.
        first = [e.kind for e in study.ladder[0].fit.model]
        found = sorted(e.kind for e in study.fit.model if e.kind not in first)
        right = found == kinds and study.adequate
        return "" if right else f"seed {seed}: {study.fit.model.name}, {study.stopped_because}"

    # Asked for: 90 %, of eight or of the first four: `halves` says what that shows of about as many.
    told = list(filter(None, halves(told_of, range(records(8, 10)), lambda first: not any(first))))
    assert len(told) <= 1, "\n".join(told)


@pytest.mark.long
def test_a_temperature_that_has_nothing_to_do_with_it():
    """Columns of noise, of an independent random walk and of a smooth day, in records that drift."""
    false, count = [], records(45, 200)
    for seed in range(count):
        rng = np.random.default_rng([seed, 4])
        n, rate = 20_000, 10.0
        samples = g.white(rng, n, rate, N) + g.flicker(rng, n, rate, B)
        samples += g.walk(rng, n, rate, 10.0 * K)
        if seed % 3 == 0:
            column = 20.0 + 0.1 * rng.standard_normal(n)
        elif seed % 3 == 1:
            column = 20.0 + g.walk(rng, n, rate, 0.05)
        else:
            column = g.temperature(n, rate, rng.uniform(500.0, 4000.0))
        recording = al.Recording(
            samples, rate=rate, unit="rad/s", covariates={"temperature": column}
        )
        check = al.fit_model(recording, "N+B+K").check()
        false += [seed for s in check.significant if s.kind == "covariate"]
    # Eleven families of effects share the 1 % of a check: of 45 two or more would be found by chance in 0.1 % of cases, at
    # 2 % for columns alone in 23 %, at 5 % in 67 %. (Of 200, four or more in 0.01, 57 and 99 %.)
    assert len(false) <= records(1, 3), false


def test_no_step_of_unknown_time_replaces_a_transition():
    """A step beside a random walk fits a transition of 50 s as well, but then the time of the step is not known.

    Without this condition, the record of seed 5 ends with a step at 77 to 156 s.
    """
    length, rate = 30_000, 100.0
    duration, t = length / rate, np.arange(length) / rate
    for seed in range(4, 7):
        rng = np.random.default_rng([seed, 150])
        samples = g.white(rng, length, rate, 0.01) + g.flicker(rng, length, rate, 2e-3)
        samples += 4e-2 * np.clip((t - 100.0) / 50.0, 0.0, 1.0)
        study = al.improve(al.Recording(samples, rate=rate, unit="deg/s"), "N+B")
        for effect, values in zip(study.fit.model, study.fit.estimates, strict=True):
            if effect.kind == "bias_step":
                low, high = values["time"].interval
                assert high - low < 2 * 1.96 * 0.02 * duration
