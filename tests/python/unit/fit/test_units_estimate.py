"""Estimates: floats that carry their doubts."""

import copy
import json
import math
import pickle

import numpy as np
import pytest

import allanite as al
from allanite.fit.estimates import widened


def make():
    return al.Estimate(0.0126, 0.0001, (0.0124, 0.0128), "rad/s·s^½", True, "N")


def test_is_a_float():
    x = make()
    assert x * 2 == 0.0252
    assert isinstance(x, float)
    assert np.asarray([x, x]).dtype == np.float64
    assert x.value == 0.0126
    assert type(x.value) is float
    assert f"{x:.3e}" == "1.260e-02"


def test_survives_pickle_and_copy():
    x = make()
    for y in (pickle.loads(pickle.dumps(x)), copy.deepcopy(x)):
        assert y == x
        assert (y.std_error, y.interval, y.unit, y.detected, y.name) == (
            x.std_error, x.interval, x.unit, x.detected, x.name,
        )  # fmt: skip


def test_is_immutable():
    with pytest.raises(AttributeError):
        make().unit = "deg"


def test_other_units_scale_everything():
    y = make().to("deg/sqrt(h)")
    factor = 180 / math.pi * 60
    assert y == pytest.approx(0.0126 * factor)
    assert y.std_error == pytest.approx(0.0001 * factor)
    assert y.interval == pytest.approx((0.0124 * factor, 0.0128 * factor))
    assert y.unit == "deg/sqrt(h)"
    assert y.to("rad/s·s^½") == pytest.approx(0.0126)
    with pytest.raises(al.InputError, match="different quantities"):
        make().to("mg/sqrt(Hz)")


def test_json_has_no_nan():
    d = al.Estimate(math.nan, math.nan, (0.0, math.inf), "rad/s").to_dict()
    assert json.loads(json.dumps(d, allow_nan=False)) == {
        "value": None, "std_error": None, "interval": [0.0, None], "unit": "rad/s",
        "detected": True,
    }  # fmt: skip
    assert set(make().to_dict()) == {"value", "std_error", "interval", "unit", "detected"}


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        (make(), "0.0126 ± 0.0001 rad/s·s^½"),
        (al.Estimate(0.012634, 0.00012, unit="rad/s"), "0.01263 ± 0.00012 rad/s"),
        (al.Estimate(9.0679e-5, 2.3e-6, unit="rad/s/s^½"), "(9.07 ± 0.23)e-05 rad/s/s^½"),
        (al.Estimate(1234.5, 12, unit="s"), "1234 ± 12 s"),
        (al.Estimate(3.0, None, unit="s"), "3 s"),
        (
            al.Estimate(0.0, 1.0, (0.0, 0.31), "deg/s", False),
            "< 0.31 deg/s (not detected, 95 % limit)",
        ),
    ],
)
def test_text(estimate, text):
    assert repr(estimate) == text
    assert str(estimate) == text


def test_what_is_as_good_as_unknown_has_a_wide_interval_and_no_overflow():
    assert widened(2.0, (1.0, 4.0), 3.0) == pytest.approx((0.25, 16.0))
    assert widened(2.0, (0.0, 4.0), 2.0) == pytest.approx((0.0, 8.0))
    low, high = widened(2.0, (1.9, 2.1), 1e6)
    assert 0.0 < low < 1e-20
    assert 1e20 < high < np.inf
