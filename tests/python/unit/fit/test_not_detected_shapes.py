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
