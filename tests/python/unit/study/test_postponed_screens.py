"""A search postpones the screens of events while other effects are missing, and forgets none of them."""

import numpy as np
import pytest
from scipy.signal import lfilter

import allanite as al
from allanite.suggestion import check_fit

RATE, SECONDS = 20.0, 1000.0
SLOW = frozenset({"slow functions"})


def record(step=0.0, line=0.0, band=0.0, seed=1):
    """White noise of standard deviation 1 with a step in the middle, a line at 7 Hz and a band at 3 Hz."""
    t = np.arange(int(RATE * SECONDS)) / RATE
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(t.size) + step * (t > 0.5 * SECONDS)
    x += line * np.sin(2.0 * np.pi * 7.0 * t)
    ringing = lfilter(
        [1.0], [1.0, -1.8 * np.cos(2.0 * np.pi * 3.0 / RATE), 0.81], rng.normal(size=t.size)
    )
    x += band * ringing / ringing.std()
    return al.Recording(x, rate=RATE, unit="deg/s")


def test_screens_of_events_wait_for_effects_at_high_frequencies():
    check = check_fit(al.fit_model(record(line=0.3), "N"), quiet=SLOW)
    assert {s.kind for s in check.significant} == {"sinusoid"}
    assert check.postponed == ("slow functions",)


@pytest.mark.parametrize("line", [0.0, 0.3])
def test_they_do_not_wait_if_a_step_looks_like_a_random_walk(line):
    check = check_fit(al.fit_model(record(step=0.3, line=line), "N"), quiet=SLOW)
    assert {"bias_step", "rate_random_walk"} <= {s.kind for s in check.significant}
    assert check.postponed == ()


def test_they_do_not_wait_if_nothing_else_is_missing():
    assert check_fit(al.fit_model(record(), "N"), quiet=SLOW).postponed == ()


@pytest.mark.parametrize("limit", [1, 32])
def test_the_last_check_of_a_search_has_all_screens(limit, monkeypatch):
    checks = []

    def kept(fit, on_progress=None, **options):
        checks.append(check_fit(fit, on_progress, **options))
        return checks[-1]

    monkeypatch.setattr(al.suggestion, "check_fit", kept)
    study = al.improve(record(step=0.2, line=0.15, band=5.0), "N", limit=limit)
    assert any(check.postponed for check in checks)
    assert study.check.postponed == ()


def test_a_step_that_a_band_hides_is_found_after_it():
    first = al.fit_model(record(step=0.3, line=0.15, band=3.0), "N")
    assert "bias_step" not in {s.kind for s in check_fit(first).significant}
    study = al.improve(first.recording, "N")
    assert "bias_step" in {effect.kind for effect in study.fit.model}
