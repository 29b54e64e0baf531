"""A line whose frequency drifts: named as one, measured, and nothing else is taken for it."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.shapes.drifting import DRIFT_STEP, Band

RATE, LENGTH = 50.0, 60_000
T = LENGTH / RATE


def _noise(rng):
    return (
        g.white(rng, LENGTH, RATE, 0.0126)
        + g.flicker(rng, LENGTH, RATE, 0.002)
        + g.walk(rng, LENGTH, RATE, 9e-5)
    )


def _recording(samples):
    return al.Recording(samples, rate=RATE, unit="rad/s")


def _chirp(rng, first, last, amplitude):
    """The phase summed sample by sample."""
    frequency = np.linspace(first, last, LENGTH, endpoint=False)
    angle = 2.0 * np.pi * (np.cumsum(frequency) - frequency) / RATE
    return amplitude * np.sin(angle + rng.uniform(0.0, 2.0 * np.pi))


@pytest.mark.long
@pytest.mark.parametrize(("first", "last"), [(12.3, 12.5), (7.2, 7.15), (20.0, 19.0)])
def test_a_motor_that_warms_up_is_one_line(first, last):
    rng = np.random.default_rng(4)
    study = al.improve(_recording(_noise(rng) + _chirp(rng, first, last, 0.012)), "N+B+K")
    assert [r.added.kind for r in study.ladder[1:]] == ["drifting_line"], study
    assert study.adequate, study
    found = study.fit
    assert found["CHIRP.frequency"].value == pytest.approx(first, abs=3e-3)
    assert found["CHIRP.drift"].value == pytest.approx((last - first) / T, abs=3e-6)
    assert found["CHIRP.amplitude"].value == pytest.approx(0.012, rel=0.15)


def test_its_intervals_hold_the_truth():
    """Of 24 records, each 95 % interval misses at most 5 (more in 0.5 % of the cases)."""
    truth = {"frequency": 12.3, "drift": 0.2 / T, "amplitude": 0.012}
    missed = dict.fromkeys(truth, 0)
    for seed in range(24):
        rng = np.random.default_rng([seed, 9])
        white = g.white(rng, LENGTH, RATE, 0.0126)
        fit = al.fit_model(
            _recording(white + _chirp(rng, 12.3, 12.5, 0.012)), "N+CHIRP(f=12.3,drift=1.6667e-4)"
        )
        for name, true in truth.items():
            low, high = fit[f"CHIRP.{name}"].interval
            missed[name] += not low <= true <= high
    assert max(missed.values()) <= 5, missed


def test_a_steady_line_and_a_resonance_stay_what_they_are():
    rng = np.random.default_rng(6)
    line = _recording(_noise(rng) + g.sinusoid(LENGTH, RATE, 12.3, 0.012))
    assert al.fit_model(line, "N+B+K").check().suggestions[0].kind == "sinusoid"
    shaken = _recording(_noise(rng) + g.resonance(rng, LENGTH, RATE, 12.3, 0.005, 0.012))
    kinds = [s.kind for s in al.fit_model(shaken, "N+B+K").check().suggestions if s.significant]
    assert kinds[0] == "resonance"
    assert "drifting_line" not in kinds


def test_without_values_it_is_looked_for():
    rng = np.random.default_rng(7)
    fit = al.fit_model(_recording(_noise(rng) + _chirp(rng, 9.0, 9.05, 0.02)), "N+B+K+CHIRP")
    assert fit["CHIRP.frequency"].value == pytest.approx(9.0, abs=3e-3)


@pytest.mark.parametrize("strength", [0.0, 18.0, 25.0])
def test_a_search_finds_the_highest_of_all_rates_of_drift(strength):
    """The naive search computes all frequencies and those half way between for each rate of drift."""
    k = 256
    u = np.arange(k) / k
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noise = (rng.standard_normal(k) + 1j * rng.standard_normal(k)) / np.sqrt(2 * k)
        f, d = rng.uniform(20.0, 230.0), rng.uniform(-80.0, 80.0)
        line = np.exp(2j * np.pi * (f * u + 0.5 * d * (u - 0.5) ** 2)) / k
        band = Band(noise + np.sqrt(strength) * line, 10, 1.0)
        drifts = DRIFT_STEP * np.arange(-(band.trials // 2), band.trials // 2 + 1)
        turned = band.series * np.exp(-1j * np.pi * np.outer(drifts, (u - 0.5) ** 2))
        highest = float(np.max(np.abs(np.fft.fft(turned, 2 * k, axis=1)) ** 2))
        assert band.search()[2] == pytest.approx(highest, rel=1e-9)


@pytest.mark.long
def test_what_is_not_refitted_could_not_be_suggested(monkeypatch):
    """Drifting lines near the limit of significance: refits of all searches change nothing."""
    n, rate = 20_000, 50.0
    u = np.arange(n) / n - 0.5

    def named(x):
        check = al.AngleRandomWalk().fit(al.Recording(x, rate=rate)).check()
        return [(s.kind, round(s.log10_p, 6)) for s in check.significant]

    records = []
    for seed in range(16):
        rng = np.random.default_rng([seed, 31])
        # A rise of logL of A² n/4 in noise of a standard deviation of 1.
        turns = rng.uniform(1000.0, 8000.0) * u + 30.0 * u**2
        line = np.sqrt(4.0 * rng.uniform(16.0, 30.0) / n) * np.sin(2.0 * np.pi * turns)
        records.append(rng.standard_normal(n) + line)
    some = [named(x) for x in records]
    screen = "allanite.suggestion.screens.drifting_lines"
    monkeypatch.setattr(f"{screen}.may_become_significant", lambda *_: True)
    assert [named(x) for x in records] == some
    # It says something: some are named, and some are not.
    assert 2 <= sum(bool(one) for one in some) <= 14


@pytest.mark.parametrize("drift", [2.5, 4.0])
def test_a_line_of_few_strong_ordinates_is_found(drift):
    """A line that drifts by a few cycles has a few ordinates of high power, which the search of a band must not cut off."""
    n, rate = 200_000, 100.0
    t = np.arange(n) / rate
    turns = 17.123 * t + 0.5 * drift * (t * rate / n) ** 2
    x = np.random.default_rng(2).standard_normal(n) + 0.04 * np.sin(2.0 * np.pi * turns)
    check = al.fit_model(al.Recording(x, rate=rate, unit="rad/s"), "N").check()
    assert check.significant[0].kind == "drifting_line"
