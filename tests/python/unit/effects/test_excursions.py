"""A bias that leaves and comes back several times is one effect, found at once."""

import numpy as np
import pytest

import allanite as al
import generators as g

RATE, N = 10.0, 40_000
VISITS = [(300.0, 340.0, 0.02), (1210.0, 1235.0, -0.03), (2500.0, 2580.0, 0.015)]


def away(seed, visits):
    """White noise and a random walk, and a bias that changes temporarily."""
    rng = np.random.default_rng(seed)
    x = g.white(rng, N, RATE, 0.01) + g.walk(rng, N, RATE, 1e-5)
    time = np.arange(N) / RATE
    for start, end, height in visits:
        x[(time >= start) & (time < end)] += height
    return al.Recording(x, rate=RATE, unit="deg/s")


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_several_excursions_are_one_effect_found_at_once(seed):
    study = al.improve(away(seed, VISITS), "N+K")
    added = [rung.added.kind for rung in study.ladder[1:]]
    assert added == ["excursions"]
    assert study.stopped_because == "adequate"
    effect, values = study.fit.model.effects[-1], study.fit.estimates[-1]
    for (start, end, height), one in zip(VISITS, effect.singly, strict=True):
        # Twice the 95 % of an edge, 11 N²/h²: 18 of them are looked at. And a cell of the search.
        edge = 22.0 * (0.01 / height) ** 2 + 1.0
        assert abs(one.start - start) < edge
        assert abs(one.end - end) < edge
        # Four standard errors of a mean over so long, beside the walk's of 1e-5 √l.
        assert abs(one.height - height) < 4.0 * 0.01 / np.sqrt(end - start) + 1e-3
    assert values["count"] == 3
    assert values["count"].interval is None
    low, high = values["largest"].interval
    assert low < effect.largest < high


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_excursions_that_are_weak_one_by_one_are_found_together(seed):
    """Each raises logL by about 14, as chance does in a search of all times; flicker noise takes their power."""
    rng, rate, n = np.random.default_rng([seed, 3]), 100.0, 30_000
    starts = (30.0, 95.0, 170.0, 241.0)
    x = g.white(rng, n, rate, 0.01) + g.flicker(rng, n, rate, 2e-3)
    for start in starts:
        x += g.step(n, rate, start, 0.03) - g.step(n, rate, start + 6.0, 0.03)
    study = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N+B")
    [found] = [e for e in study.fit.model if e.kind == "excursions"]
    # 11 N²/h² holds 95 % of the errors of an edge, three times that all eight.
    near = [min(abs(np.array(found.starts) - start)) < 3.7 for start in starts]
    assert sum(near) >= 3, found


@pytest.mark.parametrize("count", [1, 2, 3, 4, 8])
def test_the_chance_of_several_amplitudes_is_that_of_chi_square(count):
    """The error of its logarithm is of the order of ((1 + a)/x)², a = count/2."""
    from scipy.stats import chi2

    from allanite.suggestion.p_values import log_chi2_tail

    for gain in (10.0, 20.0, 50.0):
        true = chi2.logsf(2.0 * gain, count)
        assert log_chi2_tail(gain, count) == pytest.approx(
            true, abs=((1.0 + 0.5 * count) / gain) ** 2
        )
    assert log_chi2_tail(0.1, 8) == 0.0


def test_one_excursion_stays_one():
    study = al.improve(away(4, VISITS[1:2]), "N+K")
    assert [rung.added.kind for rung in study.ladder[1:]] == ["excursion"]


@pytest.mark.long
def test_a_further_one_joins_those_that_are_known():
    start = "N+K"
    first = al.improve(away(5, VISITS), start, limit=1)
    assert first.fit.model.effects[-1].count == 3
    # The same by hand: two that the start asks for stay its own.
    model = al.parse_model(start) + al.effects.Excursions(
        starts=(300.0, 1210.0), ends=(340.0, 1235.0), heights=(0.02, -0.03)
    )
    study = al.improve(away(5, VISITS), model)
    assert [e.kind for e in study.fit.model][2:] == ["excursions", "excursion"]


@pytest.mark.parametrize(
    "bad",
    [{"starts": (1.0,), "ends": (2.0, 3.0)}, {"starts": (2.0,), "ends": (1.0,), "heights": (1.0,)}],
)
def test_lists_that_do_not_match_are_refused(bad):
    with pytest.raises(al.InputError, match="excursions:"):
        al.effects.Excursions(**bad)


def test_several_excursions_are_written_and_read(tmp_path):
    model = al.parse_model("N(N=0.01)") + al.effects.Excursions(
        starts=(1.0, 5.0), ends=(2.0, 9.0), heights=(0.1, -0.2)
    )
    path = tmp_path / "model.json"
    model.save(path)
    assert al.parse_model(str(path)) == model
    record = al.Recording(np.random.default_rng(1).normal(size=2000), rate=100.0)
    assert al.fit_model(record, path).model.name == model.name  # a path, or its text


def test_one_within_another_that_takes_it_back_is_two():
    long, within = (
        al.effects.Excursion(start=a, end=b, height=h)
        for a, b, h in ((12.0, 15.6, 0.06), (12.3, 15.0, -0.061))
    )
    both = al.effects.Excursions.together([long, within])
    assert both.starts == (12.0, 15.0)
    assert both.ends == (12.3, 15.6)
    assert both.heights == (0.06, 0.06)
    shallower = al.effects.Excursion(start=12.3, end=15.0, height=-0.03)
    stairs = al.effects.Excursions.together([long, shallower])
    assert stairs.heights == (0.06, 0.03, 0.06)
    assert stairs.numbers == 7


@pytest.mark.parametrize("seed", [15, 38, 44, 56])
def test_a_few_samples_of_a_heavy_tail_are_none(seed):
    """In these four of sixty records, the mean of 18 to 56 samples of t(5) was once called one."""
    samples = np.random.default_rng([seed, 77]).standard_t(5, 20_000)
    check = al.parse_model("N").fit(al.Recording(samples, rate=50.0)).check()
    assert "excursion" not in {s.kind for s in check.significant}
