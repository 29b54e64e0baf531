"""Frequencies, times and phases of what is not detected: none is the right one, and none is a limit."""

import numpy as np
import pytest

import allanite as al
from allanite.fit.rivals.alternatives import is_detected


@pytest.fixture(scope="module")
def recording():
    x = np.random.default_rng(4).standard_normal(8000)
    return al.Recording(x, rate=100, unit="deg/s")


@pytest.mark.parametrize(
    ("model", "shapes", "size"),
    [
        ("N+SIN(f=7.3)", ("frequency", "phase"), "amplitude"),
        ("N+CHIRP(f=7.3,drift=1e-3)", ("frequency", "drift", "phase"), "amplitude"),
        ("N+EXC(start=20,end=22)", ("start", "end"), "height"),
        ("N+RES(f=7.3,damping=0.01)", ("frequency", "damping"), "rms"),
        ("N+GM(T=1)", ("correlation_time",), "q_c"),
    ],
)
def test_they_have_no_interval(recording, model, shapes, size):
    fit = al.fit_model(recording, model)
    numbers = fit.to_dict()["effects"][1]["parameters"]
    assert not numbers[size]["detected"]
    assert numbers[size]["interval"] is not None
    for name in shapes:
        assert (numbers[name]["interval"], numbers[name]["std_error"]) == (None, None)
        line = next(line for line in str(fit).splitlines() if f" {name} " in line)
        assert "not present" in line
    assert not fit[f"{shapes[0]}"].detected


@pytest.mark.parametrize("gap", [0, 600])
@pytest.mark.parametrize(
    "model", ["N+B+K+GM", "N+RES(f=7.3,damping=0.001)", "N+STEP(time=30)+SIN(f=1)+R", "N+B(B=0.1!)"]
)
def test_an_effect_is_detected_if_its_estimates_are(gap, model):
    """Half of the effects are in the record; the estimates also have intervals, which take most of their time."""
    rng = np.random.default_rng(5)
    x = rng.standard_normal(8000) + 0.03 * np.cumsum(rng.standard_normal(8000))
    x += 0.3 * np.sin(2 * np.pi * np.arange(8000) / 100)
    x[2000 : 2000 + gap] = np.nan
    fit = al.fit_model(al.Recording(x, rate=100, unit="deg/s"), model)
    found = [is_detected(fit, place) for place in range(len(fit.model))]
    names = [[p.name for p in e.parameters if p.role == "coefficient"] for e in fit.model]
    assert found == [
        all(values[name].detected for name in own)
        for own, values in zip(names, fit.estimates, strict=True)
    ]


@pytest.mark.parametrize("model", ["N+R", "N+K+R", "N+B+STEP(time=1000)", "N+WARM(T=300)"])
@pytest.mark.parametrize("seed", [3, 5, 9, 10])
def test_a_value_is_detected_only_if_its_interval_excludes_0(model, seed):
    """A walk that the model may lack widens the interval of a slow function, which has no value in these records."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(4000) + 0.02 * np.cumsum(rng.standard_normal(4000))
    fit = al.fit_model(al.Recording(x, rate=1, unit="deg/s"), model)
    size = next(p.name for p in fit.model.effects[-1].parameters if p.role == "coefficient")
    found = fit.estimates[-1][size]
    low, high = found.interval
    assert found.detected == (low > 0.0 or high < 0.0)
    assert found.detected == is_detected(fit, len(fit.model) - 1)
    assert found.limit == max(-low, high)


def test_the_interval_of_a_drift_does_not_depend_on_the_unit():
    """The drift of a good clock is 1e-16 1/s, below any absolute tolerance."""
    rng = np.random.default_rng(7)
    time = np.arange(6000) * 10.0
    y = (
        np.cumsum(rng.standard_normal(6000)) * 2e-15
        + 3e-12 * rng.standard_normal(6000)
        + 2e-16 * time
    )
    clock = al.Recording(np.cumsum(y) * 10.0, rate=0.1, unit="s", quantity="angle")
    scaled = al.Recording(np.cumsum(y) * 1e13, rate=0.1, unit="s", quantity="angle")
    one, other = (al.fit_model(r, "Q+N+K+R")["R"].interval for r in (clock, scaled))
    assert np.allclose(np.multiply(one, 1e12), other, rtol=1e-3)
    assert 0.0 < one[0] < 2e-16 < one[1]


@pytest.mark.parametrize("time_constant", [300.0, 1e6, 1e9])
def test_a_drift_exists_even_if_its_shape_is_unknown(time_constant):
    """The amplitude of a warm-up much longer than the record is not known, but its sign is."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal(4000) + 5e-3 * np.arange(4000)
    fit = al.fit_model(al.Recording(x, rate=1, unit="deg/s"), f"N+WARM(T={time_constant})")
    amplitude = fit.estimates[-1]["amplitude"]
    low, high = amplitude.interval
    assert amplitude.detected
    assert low <= amplitude <= high < 0.0


def test_two_functions_of_time_that_overlap_are_both_detected_if_both_are_needed():
    rng = np.random.default_rng(2)
    t = np.arange(6000.0)
    x = rng.standard_normal(6000) + 10.0 * np.exp(-t / 60.0) + 5.0 * np.clip((t - 60) / 120, 0, 1)
    record = al.Recording(x, rate=1, unit="deg/s")
    fit = al.fit_model(record, "N+WARM(T=60)+RISE(begin=60, end=180)")
    without = al.fit_model(record, "N+WARM(T=60)")
    assert fit.solution.log_likelihood - without.solution.log_likelihood > 20.0
    for effect, name in ((1, "amplitude"), (2, "height")):
        found = fit.estimates[effect][name]
        assert found.detected
        assert found.interval[0] > 0.0
