"""The steps of a study lead from the first to the last model without detours, and no error rises beyond its scatter."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.common.threads import stop_if_unwanted
from allanite.study.judgement import no_error_rises
from allanite.study.ladder import Rung
from allanite.study.search import Search
from allanite.study.story import without_rises

RATE, LENGTH = 50.0, 12_000
TIME = np.arange(LENGTH) / RATE


def _loud_beside_a_lag(seed):
    """White noise that is loud for 20 s, and a lag of 1 s: the level is found first and raises the Allan error."""
    rng = np.random.default_rng([seed, 71])
    gain = np.where((TIME > 60.0) & (TIME < 80.0), 3.0, 1.0)
    x = gain * g.white(rng, LENGTH, RATE, 0.01)
    return x + g.gauss_markov(rng, LENGTH, RATE, 3e-2, 1.0)


def _wandering_line(seed):
    """A band that drifts over half its frequency and is first described by resonances."""
    rng = np.random.default_rng([seed, 72])
    x = g.white(rng, LENGTH, RATE, 0.01)
    return x + g.moving_band(rng, LENGTH, RATE, 6.0 + 3.0 * TIME / TIME[-1], 0.1, 2e-2)


@pytest.mark.long
@pytest.mark.parametrize("make", [_loud_beside_a_lag, _wandering_line])
def test_steps_never_go_back(make):
    study = al.improve(al.Recording(make(1), RATE, unit="deg/s"), "N+B+K")
    ladder = study.ladder
    assert len(ladder) > 1
    start = {"angle_random_walk", "bias_instability", "rate_random_walk"}
    for before, rung in itertools.pairwise(ladder):
        assert set(rung.removed) <= start
        assert no_error_rises(before.fit, rung.fit), rung
        kinds = [e.kind for e in before.fit.model if e.kind not in rung.removed]
        assert sorted([*kinds, *(e.kind for e in rung.new)]) == sorted(
            e.kind for e in rung.fit.model
        )
    assert np.all(np.diff(study.misfit_left) <= 1e-9)
    there = {e.kind for e in study.fit.model}
    assert not there & {e.kind for e in study.tried}
    assert study.to_dict()["tried"] == [e.kind for e in study.tried]


def test_steps_stay_in_the_order_of_the_search_if_the_time_ends(monkeypatch):
    now = [0.0]

    def endless(_):
        """Use up the time, as steps with many effects do."""
        now[0] = 2.0
        while True:
            stop_if_unwanted()

    monkeypatch.setattr("allanite.study.search.story", endless)
    log = al.parse_model("N(N=0.1)+K(K=0.02)").simulate(rate=10.0, duration=600.0, seed=1)
    search = Search([Rung(al.fit_model(log, "N"))], 8, None, 1.0, lambda: now[0])
    stop = search.run()
    study = search.study(stop)
    assert now == [2.0]
    assert study.ladder == tuple(search.ladder)
    assert study.fit.model.name == "N+K"
    assert study.stopped_because == stop == "adequate"


@pytest.mark.parametrize("seed", [1, 4])
def test_no_step_drops_an_effect_that_the_last_model_has(seed):
    """A ramp beside a weak walk: the search takes the walk of the start for the ramp, and adds it again."""
    rng = np.random.default_rng([seed, 73])
    n, rate = 28_000, 10.0
    x = g.white(rng, n, rate, 0.0136) + g.walk(rng, n, rate, 1.2e-4)
    study = al.improve(al.Recording(x - 1.1e-5 * np.arange(n) / rate, rate), "N+B+K")
    last = {e.kind for e in study.fit.model}
    assert last == {"angle_random_walk", "rate_ramp", "rate_random_walk"}
    assert not any(last & set(rung.removed) for rung in study.ladder)


def _steps(*errors):
    """Steps whose Allan errors are `errors`, %, with an expected scatter of 7 %; each adds a line and raises logL by 9."""
    fits = [
        SimpleNamespace(
            curve=SimpleNamespace(rms_percent=error, expected_scatter_percent=7.0),
            solution=SimpleNamespace(log_likelihood=9.0 * at),
        )
        for at, error in enumerate(errors)
    ]
    return [Rung(fits[0]), *(Rung(f, al.Sinusoid(frequency=k)) for k, f in enumerate(fits[1:], 1))]


@pytest.mark.parametrize(
    ("errors", "shown"),
    [
        ((15.0, 9.0, 12.0, 2.0), (15.0, 9.0, 2.0)),  # joined with the next step
        ((15.0, 9.0, 12.0), (15.0, 12.0)),  # the last is joined with the previous
        ((9.0, 12.0), (9.0, 12.0)),  # the first model stays
        ((15.0, 4.0, 5.0), (15.0, 4.0, 5.0)),  # within the scatter
        ((15.0, 8.0, 9.0, 10.0, 9.0), (15.0, 8.0, 9.0, 9.0)),  # both together raise it, too
    ],
)
def test_a_step_that_raises_the_allan_error_is_joined_with_another(errors, shown):
    steps = _steps(*errors)
    found = without_rises(steps)
    assert tuple(rung.fit.curve.rms_percent for rung in found) == shown
    assert [e for rung in found for e in rung.new] == [e for rung in steps for e in rung.new]
    pairs = itertools.pairwise(found)
    assert [rung.risen_since(before) for before, rung in pairs] == [
        9.0 * len(rung.new) for rung in found[1:]
    ]


@pytest.mark.parametrize("sigma", [0.0, 0.02])
def test_an_adequate_model_leaves_nothing_unexplained(sigma):
    rng = np.random.default_rng(4)
    x = g.white(rng, 6000, RATE, 0.05) + g.gauss_markov(rng, 6000, RATE, sigma, 5.0)
    study = al.improve(al.Recording(x, RATE, unit="deg/s"), "N")
    assert study.adequate
    assert len(study.ladder) == 1 + (sigma > 0.0)
    assert study.misfit_left[-1] == 0.0
    assert study.to_dict()["ladder"][-1]["error"]["misfit_left_percent"] == 0.0
