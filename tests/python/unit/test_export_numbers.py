"""What a file says of its numbers is true of those that are in it; no slow process stands for fast noise."""

import re

import numpy as np
import pytest

from allanite.effects.files import model_to_dict, parse_model
from allanite.export import export
from allanite.export._axis import axes_of

TAU = np.unique(np.round(np.geomspace(1, 10_000, 60))) / 100.0


def document(column, text, unit="rad/s"):
    found = model_to_dict(parse_model(text))
    found["recording"] = {"column": column, "unit": unit, "rate_hz": 100.0, "duration_s": 1000.0}
    return found


def walk_of(text):
    return float(re.search(r"^gyroscope_random_walk: (\S+)", text, re.MULTILINE).group(1))


def ratio_of(text, column):
    """Smallest and largest of the line that is printed for an axis."""
    after = text.split(f"{column}: ", 1)[1]
    found = re.search(r"of what is written .*?: (\S+) \(at .*?\) to (\S+) \(at", after)
    return [float(one) for one in found.groups()]


def ratio(written, model):
    """The same, from models."""
    over, under = (parse_model(one).allan_variance(TAU, 100.0) for one in (written, model))
    found = np.sqrt(over / under)
    return [found.min(), found.max()]


def matlab_of(text, key):
    return [float(v) for v in re.search(rf"'{key}', \[(.*?)\]", text).group(1).split()]


FAST = ["Q(Q=2e-4)", "PL(exponent=0.7,level=3e-4)"]


@pytest.mark.parametrize("fast", FAST)
@pytest.mark.parametrize("rest", ["N(N=1e-3)", "N(N=1e-3)+B(B=1e-4)"])
def test_no_random_walk_stands_for_what_averages_out_faster_than_white_noise(fast, rest):
    alone, both = (
        walk_of(export(axes_of([document("gyro_x", text)]), "kalibr"))
        for text in (rest, f"{rest}+{fast}")
    )
    assert both == pytest.approx(alone, rel=1e-6)


@pytest.mark.parametrize("fast", FAST)
def test_no_lag_stands_for_it_either(fast):
    tags = ("dynamic_bias_stddev", "dynamic_bias_correlation_time")
    found = []
    for text in ("N(N=1e-3)+K(K=1e-5)", f"N(N=1e-3)+{fast}+K(K=1e-5)"):
        made = export(axes_of([document("gyro_x", text)]), "gazebo")
        found.append([float(re.search(f"<{tag}>(.*?)</{tag}>", made).group(1)) for tag in tags])
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_quantization_alone_has_the_white_noise_of_one_sample_and_hardly_a_walk():
    text = export(axes_of([document("gyro_x", "Q(Q=2e-4)")]), "kalibr")
    white = np.sqrt(3.0) * 2e-4 * 10.0  # √3 Q/τ0 over √rate
    assert f"gyroscope_noise_density: {white:.6e}" in text
    assert walk_of(text) == pytest.approx(np.sqrt(3.0) * white / 100.0, rel=1e-3)
