"""A year, a day, the tides and the mains have trials of their own; no other line pays much for that."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.rivals.line_trials import expected_line_gain, known_bands, line_trials, trials_at

DAY = 86400.0


@pytest.mark.parametrize("seed", range(2))
def test_an_annual_line_is_found_beside_flicker(seed):
    """In 17 years of daily heights, the line has about 15 of logL, which is little for a search of all frequencies."""
    n, rng = 6236, np.random.default_rng([seed, 17])
    x = g.flicker(rng, n, 1.0 / DAY, 3.0) + 3.5 * rng.standard_normal(n)
    x += 2.7 * np.cos(2.0 * np.pi * np.arange(n) / 365.2422 + 1.0)
    study = al.improve(al.Recording(1e-3 * x, rate=1.0 / DAY), "N+B")
    (line,) = (e for e in study.fit.model if e.kind == "sinusoid")
    assert 1.0 / line.frequency == pytest.approx(365.2422 * DAY, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("days", [2.6, 3.0])
def test_a_few_days_show_the_day_and_its_half(days):
    """Other lines need four periods, since fewer are a drift. Amplitudes have the error √(S/T), 0.02 of the first."""
    rng, rate = np.random.default_rng(3), 0.02
    n = round(days * DAY * rate)
    turn = 2.0 * np.pi * np.arange(n) / rate / DAY
    x = g.white(rng, n, rate, 0.2) + g.flicker(rng, n, rate, 0.02)
    x += np.sin(turn) + 0.3 * np.sin(2.0 * turn + 1.0)
    study = al.improve(al.Recording(1e-3 * x, rate=rate, unit="m/s^2"))
    lines = sorted(e.frequency * DAY for e in study.fit.model if e.occupies is not None)
    assert lines == pytest.approx([1.0, 2.0], rel=0.05), study
    assert not study.fit["K"].detected


def test_mains_are_known_where_they_are_aliased():
    bands = known_bands(100_000, 99.0)
    # 50 Hz is seen at 99 − 50, 60 Hz at 39, 120 Hz at 21 Hz.
    for alias in (49.0, 39.0, 21.0, 1.0):
        assert ((bands[:, 0] <= alias) & (alias <= bands[:, 1])).any(), alias
    assert (bands[:, 1] <= 49.5).all()


def test_a_known_line_pays_less_and_another_hardly_more():
    n, rate = 200_000, 110.0
    at_mains, beside = trials_at(np.array([50.0, 44.0]) * n / rate, n, rate)
    assert at_mains < 0.1 * beside
    # A third of the false alarms is left for all frequencies.
    assert beside < 3.0 * line_trials(n)


def test_a_frequency_that_may_be_anywhere_takes_no_share_of_the_others():
    """0.2 % of 50 Hz are 0.1 Hz, wider than the whole spectrum of samples each 25 s; the day is still a known frequency."""
    n, rate = 30_000, 0.04
    day, beside = (expected_line_gain(f * n / rate, n, rate) for f in (1.0 / DAY, 0.0031))
    assert day > 3.0
    assert beside < 0.5


def test_the_shares_of_all_frequencies_add_up_to_one():
    """Each of W independent frequencies has W/trials of the false alarms of the search."""
    n, rate = 200_000, 110.0
    cycles = np.arange(1.0, 0.5 * n, 0.25)
    total = 0.25 * np.sqrt(np.pi / 3.0) * np.sum(1.0 / trials_at(cycles, n, rate))
    assert total == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("cycles", "gains"), [(17.07, True), (23.0, False)])
def test_only_a_line_at_a_known_frequency_costs_less(cycles, gains):
    """17 years of daily values: a year has 17.07 cycles, and is the alias of the sidereal day, too: two of nine shares."""
    gain = expected_line_gain(cycles, 6236, 1.0 / DAY)
    assert gain == pytest.approx(3.7, abs=0.1) if gains else gain == 0.0


@pytest.mark.parametrize("seed", range(2))
def test_the_tide_is_no_harmonic_of_the_day_beside_its_half(seed):
    """In 28 days, half of the frequency of the lunar tide is one cycle from the day: three lines, each of its own."""
    rng, rate, n = np.random.default_rng([seed, 28]), 1.0 / 240.0, 10_000
    x = g.white(rng, n, rate, 0.3) + g.walk(rng, n, rate, 3e-4)
    hours = np.arange(n) / rate / 3600.0
    for period, size in ((12.4206, 0.05), (25.8193, 0.03), (24.0, 0.06)):
        x += size * np.sin(2.0 * np.pi * hours / period + period)
    study = al.improve(al.Recording(x, rate=rate))
    lines = [e for e in study.fit.model if e.kind == "sinusoid"]
    assert all(e.overtones is None for e in lines), study
    periods = sorted(1.0 / e.frequency / 3600.0 for e in lines)
    assert periods == pytest.approx([12.4206, 24.0, 25.8193], rel=0.01)
