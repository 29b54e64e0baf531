"""Limits on the numbers of a model: declared, written and read, kept by a fit, and told."""

import json

import numpy as np
import pytest

import allanite as al
from allanite.effects.files import model_from_dict, model_to_dict
from allanite.fit import engine
from allanite.fit.table import fit_table
from generators import sinusoid, walk, white

RATE, N = 10.0, 20_000


@pytest.fixture(scope="module")
def wandering():
    """N = 0.1, K = 0.01 and a lag of 20 s."""
    truth = al.parse_model("N(N=0.1)+K(K=0.002)+GM(q_c=0.05,T=20)")
    return truth.simulate(duration=N / RATE, rate=RATE, seed=3, unit="deg/s")


def numbers(fit):
    return {
        (place, name): float(value)
        for place, values in enumerate(fit.estimates)
        for name, value in values.items()
        if isinstance(value, float)
    }


# -- declared, written, read ------------------------------------------------------------------------


def test_limits_are_part_of_an_effect_its_string_and_its_file():
    lag = al.GaussMarkov(correlation_time=30.0, limits={"correlation_time": (10, 100)})
    assert dict(lag.limits) == {"correlation_time": (10.0, 100.0)}
    assert str(lag) == "GM(correlation_time=30[10,100])"
    model = al.parse_model("N(N=[,0.2])+GM(T=30[10, 100],q_c=[0.1,])+K(K=1!)")
    assert str(model) == "N(N=[,0.2])+GM(q_c=[0.1,], correlation_time=30[10,100])+K(K=1!)"
    assert al.parse_model(str(model)) == model
    assert hash(al.parse_model(str(model))) == hash(model)
    document = json.loads(json.dumps(model_to_dict(model), allow_nan=False))
    assert document["effects"][0]["limits"] == {"N": [None, 0.2]}
    assert "limits" not in document["effects"][2]
    assert model_from_dict(document, "x") == model


def test_open_ends_and_those_beyond_the_range_of_the_number_limit_nothing():
    assert not al.AngleRandomWalk(limits={"N": (None, None)}).limits
    assert not al.AngleRandomWalk(limits={"N": (-1.0, np.inf)}).limits
    assert dict(al.AngleRandomWalk(limits={"N": (-1.0, 2.0)}).limits) == {"N": (-np.inf, 2.0)}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("N(N=[2,1])", "angle_random_walk: the lower limit of N, 2, is above the upper one, 1"),
        ("N(N=[2,2])", "angle_random_walk: both limits of N are 2; hold it there"),
        ("N(N=[,-1])", "angle_random_walk: the limits of N, -inf … -1, are outside its range 0 … inf"),
        ("N(N=3![,2])", "angle_random_walk: N is held at 3, outside its limits -inf … 2"),
        ("N(N=1[1;2])", "expected ,"),
        ("N(N=1[1,2)", "expected ]"),
        ("N+DRES(course=[10,9,8])", "course of drifting_resonance is one number in a model string"),
        ("N+DRES(course=10)", "course must be at least two frequencies above 0"),
        ("BW(order=[1,2])", "bandwidth: order cannot have limits"),
        ("SIN(phase=[1,2])", "sinusoid: phase cannot have limits"),
    ],
)  # fmt: skip
def test_limits_that_contradict_are_one_clear_line(text, said):
    with pytest.raises(al.InputError) as caught:
        al.parse_model(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "limits",
    [{"N": 3}, {"N": (1,)}, {"N": "12"}, {"N": ("a", 2)}, {"x": (1, 2)}, 7, {"N": (np.nan, 1)}],
)
def test_what_are_no_limits_is_refused(limits):
    with pytest.raises(al.InputError):
        al.AngleRandomWalk(limits=limits)


# -- fitted -----------------------------------------------------------------------------------------


def test_a_truth_inside_is_fitted_as_without_limits(wandering):
    free = al.fit_model(wandering, "N+K+GM")
    held = al.fit_model(wandering, "N(N=[0.05,0.2])+K(K=[,0.1])+GM(q_c=[0.01,1])")
    assert numbers(held) == numbers(free)
    assert held.misfit == free.misfit
    shaped = al.fit_model(wandering, "N+K+GM(T=[2,200])")
    for key, value in numbers(free).items():
        assert numbers(shaped)[key] == pytest.approx(value, rel=5e-3), key
    assert "at its limit" not in fit_table(shaped)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limited", "held", "place", "name"),
    [
        ("N+K(K=[0.01,])+GM", "N+K(K=0.01!)+GM", 1, "K"),
        ("N(N=[,0.09])+K+GM", "N(N=0.09!)+K+GM", 0, "N"),
        ("N+K+GM(T=[60,600])", "N+K+GM(T=60!)", 2, "correlation_time"),
    ],
)
def test_a_truth_outside_is_at_the_limit_and_the_rest_as_with_that_value_held(
    wandering, limited, held, place, name
):
    fit, other = al.fit_model(wandering, limited), al.fit_model(wandering, held)
    assert numbers(fit) == pytest.approx(numbers(other), rel=1e-9)
    assert fit.misfit == other.misfit
    assert fit.model.effects[place].at_limit == (name,)
    assert not fit.model.effects[place].hold
    value = fit.estimates[place][name]
    assert value.interval is None
    assert value.std_error is None
    assert "at its limit" in fit_table(fit)
    assert "held" not in fit_table(fit)
    entry = fit.to_dict()["effects"][place]
    assert entry["at_limit"] == [name]
    assert "held" not in entry
    assert name in entry["limits"]


def test_one_of_two_that_were_beyond_is_let_go_where_the_other_one_needs_it():
    """With a loud line and N at its limit, K must be inside of its limits, although both were beyond before."""
    truth = al.parse_model("N(N=0.1)+K(K=0.01)")
    log = truth.simulate(duration=4000, rate=RATE, seed=5, unit="deg/s")
    fit = al.fit_model(log, "N(N=[0.2,])+K(K=[,0.1])+B(B=[0.001,])")
    best = max(
        (
            al.fit_model(log, f"N(N=0.2!)+K{k}+B{b}")
            for k in ("", "(K=0.1!)")
            for b in ("", "(B=0.001!)")
        ),
        key=lambda f: f.solution.log_likelihood if _inside(fit.model, f.model) else -np.inf,
    )
    assert fit.solution.log_likelihood == pytest.approx(best.solution.log_likelihood, abs=0.01)
    assert _inside(fit.model, fit.model)


def _inside(limited, model):
    for effect, other in zip(limited, model, strict=True):
        for name, (low, high) in effect.limits.items():
            if not low * (1 - 1e-9) <= other.values[name] <= high * (1 + 1e-9):
                return False
    return True


def test_a_line_is_looked_for_within_its_limits_alone():
    rng = np.random.default_rng(2)
    x = white(rng, N, RATE, 0.1) + sinusoid(N, RATE, 1.3, 0.2) + sinusoid(N, RATE, 2.9, 0.05)
    log = al.Recording(x, RATE, unit="deg/s")
    fit = al.fit_model(log, "N+SIN(f=[2,4])")
    assert fit["frequency"] == pytest.approx(2.9, abs=1e-3)
    assert fit["frequency"].interval[0] > 2.0
    loud = al.fit_model(log, "N+SIN(f=1.3,A=[,0.1])")
    assert loud["amplitude"] == pytest.approx(0.1)
    assert loud.model.effects[1].at_limit == ("amplitude",)
    low, high = al.fit_model(log, "N+SIN(f=1.3,A=[0.19999,0.20001])")["amplitude"].interval or (
        0.2,
        0.2,
    )
    assert 0.19999 <= low <= high <= 0.20001


def test_an_interval_ends_where_the_limits_do(wandering):
    free = al.fit_model(wandering, "N+K+GM")["N"]
    low, high = free.interval
    assert low < free < high
    near = 0.5 * (float(free) + high)
    fit = al.fit_model(wandering, f"N(N=[,{near!r}])+K+GM")
    assert fit["N"] == free
    assert fit["N"].interval == (low, near)


def test_a_known_function_of_time_is_limited_too():
    log = (al.AngleRandomWalk(N=0.1) + al.RateRamp(R=1e-3)).simulate(
        duration=2000, rate=RATE, seed=1, unit="deg/s"
    )
    assert al.fit_model(log, "N+R(R=[-1,1])")["R"] == al.fit_model(log, "N+R")["R"]
    fit = al.fit_model(log, "N+R(R=[,5e-4])")
    assert fit["R"] == 5e-4
    assert fit["N"] == pytest.approx(float(al.fit_model(log, "N+R(R=5e-4!)")["N"]), rel=1e-9)


def test_a_number_at_its_limit_is_free_in_the_next_fit(wandering):
    fit = al.fit_model(wandering, "N+K(K=[0.05,])")
    assert fit.model.effects[1].at_limit == ("K",)
    wide = fit.model.effects[1].with_values(limits={})
    again = al.fit_model(wandering, al.Model((fit.model.effects[0], wide)))
    assert again.model.effects[1].at_limit == ()
    more = fit.add(al.GaussMarkov())
    assert more["K"] == pytest.approx(0.05)
    assert more.model.effects[1].limits == fit.model.effects[1].limits


@pytest.mark.slow
def test_missing_samples_and_other_methods():
    truth = al.parse_model("N(N=0.1)+K(K=0.01)")
    log = truth.simulate(duration=1000, rate=RATE, seed=1, unit="deg/s")
    x = log.samples.astype(float).copy()
    x[3000:3500] = np.nan
    fit = al.fit_model(al.Recording(x, RATE, unit="deg/s"), "N(N=[,0.08])+K")
    assert fit["N"] == 0.08
    with pytest.raises(al.InputError, match="limits"):
        al.fit_model(log, "N(N=[,0.08])+K", method="gls")


def test_limits_between_which_a_record_tells_nothing_are_refused(wandering):
    for model in ("N+GM(T=[1e5,1e6])", "N+BW(f=[1e-6,1e-5])", "N+SIN(f=[6,7])"):
        with pytest.raises(
            al.InputError, match="are outside the range that this record can resolve"
        ):
            al.fit_model(wandering, model)
    assert al.fit_model(wandering, "N+GM(T=[1500,1e9])")["correlation_time"] >= 1500


@pytest.mark.long
def test_check_and_study_keep_to_limits(wandering):
    study = al.improve(wandering, "N(N=[0.05,0.2])+K(K=[0.004,])")
    for rung in study.ladder:
        assert rung.fit["K"] >= 0.004


def test_a_walk_below_its_least_value_is_where_it_says(wandering):
    rng = np.random.default_rng(4)
    log = al.Recording(white(rng, N, RATE, 0.1) + walk(rng, N, RATE, 1e-9), RATE, unit="deg/s")
    fit = al.fit_model(log, "N+K(K=[1e-3,1])")
    assert fit["K"] == 1e-3
    assert fit.model.effects[1].at_limit == ("K",)


def test_a_shape_that_a_fit_finds_at_the_end_of_its_range_needs_no_second_fit(monkeypatch):
    fits = []
    inner = engine._fit
    monkeypatch.setattr(engine, "_fit", lambda *given: fits.append(1) or inner(*given))
    # The density of quantization rises with f²; the steepest power law of the catalog is the nearest.
    log = al.parse_model("N(N=0.01)+Q(Q=0.1)").simulate(rate=10.0, duration=1000.0, seed=1)
    law = al.fit_model(log, "N+PL").model.effects[1]
    assert law.at_limit == ("exponent",)
    assert law.exponent == law.parameter("exponent").high
    assert len(fits) == 1
