"""If the best band of a check is refused, bands at other frequencies are searched."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.study import steps
from allanite.study.ladder import Rung
from allanite.suggestion import check_fit, suggestions_elsewhere

RATE, LENGTH = 100.0, 60_000


def check_of(seed, *bands):
    """Check of the model N for a record of white noise and resonances (frequency, damping, rms)."""
    rng = np.random.default_rng([seed, 8])
    x = g.white(rng, LENGTH, RATE, 0.03)
    for band in bands:
        x += g.resonance(rng, LENGTH, RATE, *band)
    return check_fit(al.fit_model(al.Recording(x, rate=RATE, unit="deg/s"), "N"))


@pytest.fixture(scope="module")
def two_bands():
    return check_of(1, (12.0, 0.03, 0.06), (31.0, 0.12, 0.07))


def best_band(check):
    return next(s for s in check.significant if s.kind == "resonance")


def test_the_weaker_of_two_bands_is_found_elsewhere(two_bands):
    refused = best_band(two_bands)
    assert refused.effect.frequency == pytest.approx(12.0, rel=0.01)
    found = list(suggestions_elsewhere(refused))
    assert [s.effect.frequency for s in found] == [pytest.approx(31.0, rel=0.03)]
    assert found[0].trials == pytest.approx(refused.trials, rel=0.01)


def test_a_refused_band_does_not_end_the_search(two_bands, monkeypatch):
    """A judgement that refuses 12 Hz leads to the band at 31 Hz."""
    judged = steps._step_with

    def refusing(ladder, before, suggestion, check):
        if suggestion in check.suggestions:
            return None
        return judged(ladder, before, suggestion, check)

    monkeypatch.setattr(steps, "_step_with", refusing)
    found = steps.step_and_suggestions([Rung(two_bands.fit)], two_bands)
    assert found is not None
    assert found[0].added.kind == "resonance"
    assert found[0].added.frequency == pytest.approx(31.0, rel=0.03)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_found_beside_a_single_band(seed):
    """With other seeds, 0 of 40 records of one band had a second one."""
    assert list(suggestions_elsewhere(best_band(check_of(seed, (12.0, 0.03, 0.06))))) == []


def test_only_bands_are_searched_elsewhere():
    rng = np.random.default_rng(2)
    x = g.white(rng, LENGTH, RATE, 0.03) + g.walk(rng, LENGTH, RATE, 0.05)
    first = check_fit(al.fit_model(al.Recording(x, rate=RATE, unit="deg/s"), "N")).significant[0]
    assert first.effect.occupies is None
    assert list(suggestions_elsewhere(first)) == []
