"""Frequencies, times and phases of what is not detected: none is the right one, and none is a limit."""

import numpy as np
import pytest

import allanite as al


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
