"""A change of level by chance: the law that `screen_levels` judges by."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.likelihood.whitened import whiten
from allanite.study.relations import lies_mostly_within
from allanite.suggestion.p_values import best_interval
from allanite.suggestion.screens.level_forms import (
    refined_gate,
    screen_columns,
    screen_cycle,
    screen_several,
    series_of,
)


@pytest.mark.slow
@pytest.mark.parametrize("cells", [32, 256])
def test_chance_of_an_interval_is_no_smaller_than_simulated(cells):
    records, rng = 3000, np.random.default_rng(7)
    chances = np.array(
        [best_interval(rng.standard_normal(16 * cells) ** 2, 1.0, cells)[3] for _ in range(records)]
    )
    for p in (0.1, 0.01):
        found = np.mean(chances < np.log(p))
        # Three standard errors of a share of 3000 records.
        assert found <= p + 3.0 * np.sqrt(p * (1.0 - p) / records)
        assert found >= 0.1 * p, "more careful than it need be"


@pytest.mark.slow
def test_chance_of_the_other_forms_is_no_smaller_than_simulated():
    records, rng = 150, np.random.default_rng(8)
    model = al.parse_model("N")
    column = {"temperature": np.cumsum(rng.standard_normal(8192))}
    chances = {"cycle": [], "several": [], "column": []}
    for _ in range(records):
        power = rng.standard_normal(4096) ** 2
        series = series_of(power, power, 1.0, 1.0, (0.0, 100.0))
        found = screen_cycle(series, model)
        chances["cycle"] += [] if found is None else [found.log_p_value]
        chances["several"] += [c.log_p_value for c in screen_several(series, model)]
        chances["column"] += [c.log_p_value for c in screen_columns(series, model, column)]
    for kind, values in chances.items():
        # Three standard errors of a share of 150 records beyond 1 %: five. A true 5 % would be more in 76 % of such tests.
        assert sum(v < np.log(0.01) for v in values) <= 5, kind


def test_levels_are_times_and_factors_together():
    with pytest.raises(al.InputError, match="2 times and 1 factors"):
        al.effects.NoiseLevels(times=(1.0, 2.0), factors=(2.0,))
    with pytest.raises(al.InputError, match="must increase"):
        al.effects.NoiseLevels(times=(2.0, 1.0), factors=(2.0, 1.0))


@pytest.mark.parametrize(
    "effect",
    [
        al.effects.NoiseLevels(times=(3.0, 7.5), factors=(2.0, 0.5)),
        al.effects.PeriodicNoiseLevel(period=2.3, start=-1.1, share=0.4, factor=3.0),
        al.effects.NoiseLevelChange(start=2.2, end=4.1, factor=1.5),
    ],
)
def test_mean_power_is_the_mean_of_the_gain(effect):
    fine = np.linspace(0.0, 10.0, 1_000_001)[:-1]
    edges = np.linspace(0.0, 10.0, 9)
    means = (effect.gain(fine) ** 2).reshape(8, -1).mean(axis=1)
    np.testing.assert_allclose(effect.mean_power(edges[:-1], edges[1:]), means, rtol=1e-4)


def test_a_strong_change_leaves_few_independent_ordinates():
    """ν with a tenth of the record seven times as loud: (0.9 + 0.1·7⁴)/(0.9 + 0.1·7²)² = 7.16.

    The measured share of the white noise in a bin is at most 1, which lowers this by 9 %: 6.54 ± 0.17 in 40 records.
    """
    rng = np.random.default_rng(3)
    x = rng.standard_normal(20_000)
    x[4000:6000] *= 7.0
    fit = (
        al.AngleRandomWalk() + al.effects.NoiseLevelChange(start=40.0, end=60.0, factor=7.0)
    ).fit(al.Recording(x, rate=100.0))
    whole = fit.data.bins.count.sum()
    assert whole / fit.solution.count.sum() == pytest.approx(6.54, abs=4 * 0.17)
    low, high = fit["N"].interval
    assert low < 0.1 < high


@pytest.mark.slow
def test_a_strong_change_comes_first_and_makes_nothing_else_significant():
    rng = np.random.default_rng(4)
    x = rng.standard_normal(20_000)
    x[11_000:12_000] *= 7.0
    check = al.parse_model("N+B+K").fit(al.Recording(x, rate=100.0)).check()
    assert check.significant[0].kind == "noise_level_change"
    assert {s.kind for s in check.significant} <= {"noise_level_change", "noise_levels"}
    assert check.fit.add(check.significant[0]).check().adequate


def test_a_column_that_hardly_leaves_one_code_has_a_bound_and_no_fit():
    """Such columns once had outliers, 46 changes of level and a period; the result must be an upper limit of N."""
    single = np.zeros(8000)
    single[np.random.default_rng(2).integers(0, 8000, 40)] = 0.01
    rng = np.random.default_rng(0)
    runs = np.zeros(10_000)
    for at in rng.integers(200, 9800, 9):
        runs[at : at + rng.integers(1, 4)] = -0.0981
    for x in (single, runs):
        recording = al.Recording(x, rate=50.0, unit="m/s^2", columns=("acc_y",))
        with pytest.raises(al.TooShortError, match="one code"):
            al.fit_model(recording, "N+B+K")


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_a_change_of_level_that_steadies_nothing_is_not_offered_again(seed):
    """If all noise stops for a while, the level of the white noise does not explain what remains: one change, not seven."""
    rng = np.random.default_rng(seed)
    n, rate = 2000, 100.0
    time = np.arange(n) / rate
    moving = (time < 6.0) | (time > 14.0)
    x = 0.003 * rng.standard_normal(n)
    x += moving * (g.gauss_markov(rng, n, rate, 0.8, 0.3) + g.white(rng, n, rate, 0.02))
    study = al.improve(al.Recording(x, rate=rate, unit="rad/s"), "N+B+K")
    levels = [
        e
        for e in study.fit.model
        if isinstance(e, al.effects.NoiseLevelChange | al.effects.NoiseLevels)
    ]
    assert len(levels) == 1


@pytest.mark.long
def test_a_pulse_that_comes_back_is_no_level_of_noise():
    """The pulses are equal. A periodic level once came before the lines, the first of which explains half."""
    rng = np.random.default_rng(3)
    n, rate = 60_000, 100.0
    x = g.white(rng, n, rate, 0.0126)
    x[::100] += 0.6
    check = al.fit_model(al.Recording(x, rate=rate, unit="rad/s"), "N+B").check()
    assert check.suggestions[0].kind == "sinusoid"
    assert "periodic_noise_level" not in {s.kind for s in check.suggestions}


@pytest.mark.parametrize("design", ["digital", "sampled", "moving_average"])
def test_a_level_scales_the_whole_of_what_a_bandwidth_leaves(design):
    # A quiet stretch behind a filter made the density negative: its white term alone was scaled.
    white, band = al.parse_model(f"N(N=1)+BW(cutoff=3.5,order=1,design={design})").effects
    level = al.effects.NoiseLevels(times=(20.0, 900.0), factors=(0.2, 0.1))
    rate, span = 10.0, (0.0, 1000.0)
    w = np.linspace(0.01, np.pi, 200)
    whole = sum(t.spectrum(w) for t in al.Model((white, band)).terms(rate))
    for effects in ((white, band, level), (white, level, band)):
        terms = al.Model(effects).terms(rate, span)
        share = level.mean_power(*span)
        np.testing.assert_allclose(
            sum(t.spectrum(w) for t in terms), share * whole, rtol=1e-9, atol=1e-12
        )


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 3, 4, 5])
def test_a_level_that_wanders_is_one_effect(seed):
    """A phone's recording ended with four: several levels, two intervals and a cycle."""
    rng, n, rate = np.random.default_rng(seed), 36_000, 5.0
    walk = np.cumsum(rng.standard_normal(n // 1800 + 1))
    level = np.exp(0.15 * np.interp(np.arange(n) / 1800, np.arange(walk.size), walk))
    x = g.white(rng, n, rate, 5e-4) * level + g.walk(rng, n, rate, 4e-6)
    hit = rng.choice(n, 25, replace=False)
    x[hit] += 6e-4 * rng.choice([-1.0, 1.0], 25) * rng.uniform(8.0, 20.0, 25)
    study = al.improve(al.Recording(x, rate=rate, unit="rad/s"))
    assert [e.short for e in study.fit.model if e.short != "OUT"] == ["N", "B", "K", "LEVELS"]
    assert len(study.ladder) <= 4
    assert study.adequate
    [(times, factors)] = [e.switches for e in study.fit.model if e.short == "LEVELS"]
    found = np.array([1.0, *factors])[np.searchsorted(times, np.arange(n) / rate, side="right")]
    # The steps follow the level: what is left of its logarithm is less than half of what there was.
    left, there = np.std(np.log(found / level)), np.std(np.log(level))
    assert left < 0.5 * there, (left, there)


@pytest.mark.parametrize(("period", "share"), [(400.0, 0.4), (373.3, 0.37), (52.4, 0.13)])
def test_a_gate_is_refined_beyond_the_phases_of_its_search(period, share):
    """A gate of 1.5 times the noise in 20 000 samples, searched at 64 phases and at periods of 1/32 cycle."""
    n, rng = 20_000, np.random.default_rng(int(period))
    phase = (np.arange(n) - 11.0) / period % 1.0
    square = (np.where(phase < share, 1.5, 1.0) * rng.standard_normal(n)) ** 2
    coarse = n / (np.round(32.0 * n / period) / 32.0)
    found, first, width = refined_gate(square, coarse, 11.0, np.ceil(64.0 * share) / 64.0)
    # Each edge is passed n/period times, and by 5.5/4D samples of each side it is known with 95 %; four edges in all.
    apart = 0.5 * np.log((1.0 + 1.5**2) / (2.0 * 1.5))
    edge = 2.0 * (5.5 / (4.0 * apart)) / (n / period) + period / 512.0
    assert abs(found - period) * n / period < 2.0 * edge
    assert abs((first - 11.0 + 0.5 * period) % period - 0.5 * period) < 2.0 * edge
    assert abs(width - share) * period < 2.0 * edge


def test_a_periodic_level_has_its_factor():
    """If the ends of loud intervals are right, the factor is 1.5 within three standard errors."""
    n, rate = 20_000, 10.0
    time = np.arange(n) / rate
    x = g.white(np.random.default_rng(3), n, rate, 0.01)
    x *= np.where((time / 37.3 + 0.21) % 1.0 < 0.37, 1.5, 1.0)
    study = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N")
    assert [e.kind for e in study.fit.model][1:] == ["periodic_noise_level"], study
    error = np.sqrt(0.5 / (0.37 * n) + 0.5 / (0.63 * n))
    assert study.fit["CYCLE.factor"].value == pytest.approx(1.5, rel=3.0 * error)
    assert study.fit["N"].value == pytest.approx(0.01, rel=3.0 * np.sqrt(0.5 / (0.63 * n)))


@pytest.mark.parametrize("seed", [1, 3, 4, 5])
def test_a_level_that_returns_after_about_the_same_time_has_no_period(seed):
    """The logarithm of the level is noise between 0.21 and 0.22 Hz, so the level has no period."""
    rng, n, rate = np.random.default_rng(seed), 60_000, 10.0
    frequency = np.fft.rfftfreq(n, 1.0 / rate)
    band = np.exp(-0.5 * ((frequency - 0.2163) / 0.006) ** 2)
    log_level = np.fft.irfft(band * (rng.standard_normal((2, band.size)).T @ [1.0, 1.0j]), n)
    x = g.white(rng, n, rate, 3e-4) * np.exp(0.12 * log_level / log_level.std())
    check = al.fit_model(al.Recording(x, rate=rate, unit="rad/s"), "N").check()
    assert "periodic_noise_level" not in {s.kind for s in check.significant}


EXCLUDED = (0.0, 310.0)


@pytest.fixture(scope="module")
def quiet_start():
    """White noise whose first 300 s have a third of the amplitude."""
    samples = np.random.default_rng(1).standard_normal(4400)
    samples[:300] *= 0.3
    return al.Recording(samples, rate=1.0, unit="deg/s")


@pytest.mark.parametrize(
    "level", ["LEVEL(start=0,end=299,factor=0.3)", "LEVEL(start=299,end=4400,factor=3)"]
)
def test_a_level_does_not_change_samples_that_are_excluded(quiet_start, level):
    """Excluded samples are completed with the mean power of the record, whatever the level at their times."""
    fit = al.fit_model(quiet_start, f"N+{level}+DIST(start=0,end=310)")
    assert "noise_level_change" not in [s.kind for s in fit.check().significant]
    power = whiten(fit.solution, fit.data).samples[5:300] ** 2
    assert power.mean() == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / power.size))


def test_normal_scores_of_a_rounded_record_change_sign_with_it(quiet_start):
    samples = np.round(quiet_start.samples.ravel() / 0.5) * 0.5
    scores = []
    for signed in (samples, -samples):
        fit = al.fit_model(al.Recording(signed, rate=1.0, unit="deg/s"), "N")
        whitened = whiten(fit.solution, fit.data)
        assert whitened.step > 0.0
        scores.append(whitened.with_normal_tails.samples)
    np.testing.assert_allclose(scores[1], -scores[0], rtol=1e-9)


def test_a_level_leaves_with_the_segment_that_has_its_changes(quiet_start):
    base = al.fit_model(quiet_start, "N")
    for quiet, leaves in (((0, 299), True), ((299, 4400), True), ((100, 2000), False)):
        level = al.effects.NoiseLevelChange(start=quiet[0], end=quiet[1], factor=0.3)
        assert lies_mostly_within(level, EXCLUDED, base) == leaves, quiet
        band = al.effects.BandLevelChange(
            low=0.1, high=0.2, start=quiet[0], end=quiet[1], factor=0.3
        )
        assert lies_mostly_within(band, EXCLUDED, base) == leaves, quiet


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_weak_level_joins_a_level_that_switches_between_two_values(seed):
    """Ten louder intervals, a quieter one, and outliers: checks once suggested the quieter one, and steps refused it."""
    n, rate = 37_904, 5.0
    rng, t = np.random.default_rng([seed, 77]), np.arange(n) / rate
    edges = [117, 179, 484, 828, 970, 1091, 1273, 1567, 1910, 1986, 3019, 3088, 3136, 3222, 3623]
    edges += [3760, 4136, 4478, 4922, 5041]
    level = np.where(np.searchsorted(edges, t, side="right") % 2, 1.43, 1.0)
    level[(t >= 5321) & (t < 7030)] = 0.88
    x = 0.0012 * level * rng.standard_normal(n)
    x[rng.choice(n, 16, replace=False)] += 0.02 * rng.choice([-1, 1], 16)
    study = al.improve(al.Recording(x, rate=rate, unit="rad/s"), "N")
    assert study.adequate
    assert sorted(e.kind for e in study.fit.model)[1:] == ["noise_levels", "outliers"]
    (levels,) = (e for e in study.fit.model if e.kind == "noise_levels")
    assert np.allclose(levels.times[-2:], [5321, 7030], atol=200)
    assert len(levels.times) == 22
