"""What a file says of its numbers is true of those that are in it; no slow process stands for fast noise."""

import json
import re

import numpy as np
import pytest
from scipy.signal import fftconvolve

import allanite as al
from allanite.effects.files import model_to_dict
from allanite.exports import axes_of, axis_for_export
from allanite.exports._choice import choose

TAU = np.unique(np.round(np.geomspace(1, 10_000, 60))) / 100.0


def document(column, text, unit="rad/s"):
    found = model_to_dict(al.parse_model(text))
    found["recording"] = {"column": column, "unit": unit, "rate_hz": 100.0, "duration_s": 1000.0}
    return found


def walk_of(text):
    return float(re.search(r"^gyroscope_random_walk: (\S+)", text, re.MULTILINE).group(1))


def unwrapped(text):
    """Text of a file with each wrapped comment on one line."""
    return re.sub(r"\n(#|//|%|  ) {5,}", " ", text)


def worst_of(text):
    """The ratio that the verdict of a file names, and its τ."""
    found = re.search(
        r"up to \S+ s: (?:at \w+ )?([0-9.]+[0-9]) times the model's, at ([0-9.]*[0-9]) s",
        unwrapped(text),
    )
    return float(found.group(1)), float(found.group(2))


def ratio(written, model, tau=TAU):
    """Smallest and largest ratio of the Allan deviations of two models."""
    over, under = (al.parse_model(one).allan_variance(tau, 100.0) for one in (written, model))
    found = np.sqrt(over / under)
    return [found.min(), found.max()]


def matlab_of(text, key):
    return [float(v) for v in re.search(rf"'{key}', \[(.*?)\]", text).group(1).split()]


FAST = ["Q(Q=2e-4)", "PL(exponent=0.7,level=3e-4)"]


@pytest.mark.parametrize("fast", FAST)
@pytest.mark.parametrize("rest", ["N(N=1e-3)", "N(N=1e-3)+B(B=1e-4)"])
def test_no_random_walk_stands_for_what_averages_out_faster_than_white_noise(fast, rest):
    alone, both = (
        walk_of(al.export(axes_of([document("gyro_x", text)]), "kalibr"))
        for text in (rest, f"{rest}+{fast}")
    )
    assert both <= 1.05 * alone


@pytest.mark.parametrize("fast", FAST)
def test_no_lag_stands_for_it_either(fast):
    tags = ("dynamic_bias_stddev", "dynamic_bias_correlation_time")
    found = []
    for text in ("N(N=1e-3)+K(K=1e-5)", f"N(N=1e-3)+{fast}+K(K=1e-5)"):
        made = al.export(axes_of([document("gyro_x", text)]), "gazebo")
        found.append([float(re.search(f"<{tag}>(.*?)</{tag}>", made).group(1)) for tag in tags])
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_no_random_walk_stands_for_a_resonance_that_is_all_there_is():
    band = "RES(frequency=9,damping=0.01,rms=0.1)"
    text = al.export(axes_of([document("gyro_x", band)]), "kalibr")
    white = float(re.search(r"noise_density: (\S+)", text).group(1))
    # The walk adds less than the white noise to the error after 100 s.
    assert walk_of(text) * 100.0 < 0.2 * white
    assert "RandomWalk" not in al.export(axes_of([document("gyro_x", band)]), "matlab")


def test_quantization_alone_has_numbers_that_a_filter_accepts():
    text = al.export(axes_of([document("gyro_x", "Q(Q=2e-4)")]), "kalibr")
    white = float(re.search(r"noise_density: (\S+)", text).group(1))
    assert white > 0.0
    assert walk_of(text) > 0.0
    assert "at shorter times due to fast noise" in text


@pytest.mark.parametrize(
    "model",
    [
        "N(N=1e-3)+B(B=2e-4)+GM(q_c=5e-4,T=20)",
        "N(N=1e-3)+PL(exponent=-1.4,level=1e-4)",
        "N(N=1e-3)+B(B=2e-4)+K(K=1e-6)+GM(q_c=5e-4,T=20)",
    ],
)
def test_the_random_walk_of_matlab_covers_what_its_other_numbers_do_not(model):
    text = al.export(axes_of([document("gyro_x", model)]), "matlab")
    white, walk = (matlab_of(text, key)[0] for key in ("NoiseDensity", "RandomWalk"))
    flicker = matlab_of(text, "BiasInstability")[0] if "B(" in model else 0.0
    written = f"N(N={white})+B(B={flicker})+K(K={walk})"
    found = ratio(written, model)
    # τ of use are a grid, eight a decade; between them a little less.
    assert 0.97 < found[0] < 0.99
    assert "the smallest K with which N, B and K reach 98 %" in text


@pytest.mark.parametrize(
    "model", ["N(N=1e-3)+B(B=2e-4)", "N(N=1e-3)+Q(Q=2e-4)", "N(N=1e-3)+RES(f=9,damping=0.01,rms=1)"]
)
def test_matlab_needs_no_random_walk_where_nothing_slow_is_left(model):
    text = al.export(axes_of([document("gyro_x", model)]), "matlab")
    assert "RandomWalk" not in text
    assert worst_of(text)[0] > 0.0


def test_a_comment_on_three_numbers_names_the_axes_that_it_is_true_of():
    documents = []
    for letter in "xyz":
        values = {
            "angle_random_walk": (
                "N",
                al.Estimate(1e-3, 1e-5, (9e-4, 1.1e-3), "rad/s·s^½", True, "N"),
            ),
            "bias_instability": (
                "B",
                al.Estimate(0.0, 1e-5, (0.0, 2e-5), "rad/s", letter == "z", "B"),
            ),
            "rate_random_walk": ("K", al.Estimate(0.0, 1e-7, (0.0, 3e-7), "rad/s/s^½", False, "K")),
        }
        effects = [{"kind": k, "parameters": {n: e.to_dict()}} for k, (n, e) in values.items()]
        recording = {"column": f"gyro_{letter}", "unit": "rad/s", "rate_hz": 100.0}
        documents.append({"schema": "allanite/fit/1", "recording": recording, "effects": effects})
    lines = al.export(axes_of(documents), "matlab").splitlines()
    (flicker,) = (line for line in lines if line.startswith("% Gyroscope BiasInstability"))
    assert flicker.endswith("; gyro_x, gyro_y: not detected, this is the 95 % upper limit")
    (walk,) = (line for line in lines if line.startswith("% Gyroscope RandomWalk"))
    assert walk.endswith("*sqrt(Hz); not detected, this is the 95 % upper limit")


AXES = {
    "gyro_x": "N(N=8e-4)+K(K=1e-5)",
    "gyro_y": "N(N=2e-3)+GM(q_c=5e-5,T=20)",
    "gyro_z": "N(N=7e-4)+K(K=2e-4)",
}
ONE_FOR_THREE = [
    "kalibr", "vins", "gtsam", "orbslam3", "liosam", "fastlio", "px4", "ardupilot", "airsim",
]  # fmt: skip


@pytest.mark.parametrize("target", ONE_FOR_THREE)
def test_one_number_for_three_axes_is_compared_with_each(target):
    own = [document(name, text) for name, text in AXES.items()]
    own += [document("acc_x", "N(N=1e-3)+K(K=1e-5)", "m/s^2")]
    text = unwrapped(al.export(axes_of(own), target))
    # gyro_x has neither its own N nor its own K: at 100 s their deviation is too large by 6.
    tau = TAU if target == "airsim" else TAU[TAU >= 1.0]
    expected = ratio("N(N=2e-3)+K(K=2e-4)", AXES["gyro_x"], tau)[1]
    assert "(gyro_x)" in text.split("NEES")[0].split("two-sided")[0]
    assert worst_of(text)[0] == pytest.approx(expected, rel=0.1)
    assert (
        "N+K; in this file: numbers that cover N, K (the largest of the axes: N of gyro_y, K of gyro_z)"
        in text
    )
    assert (
        "N+K; in this file: numbers that cover N, K (the largest of the axes: N of gyro_y)" in text
    )


def test_both_numbers_of_one_axis_are_named_together():
    own = [document("gyro_x", "N(N=1e-3)+K(K=1e-5)"), document("gyro_y", "N(N=2e-3)+K(K=2e-5)")]
    text = al.export(axes_of(own), "kalibr")
    assert "numbers that cover N, K (the largest of the axes: N and K of gyro_y)\n" in text
    assert "numbers that cover N, K\n" in text


def test_numbers_of_their_own_are_compared_with_their_own_axis():
    own = axes_of([document(name, text) for name, text in AXES.items() if name != "gyro_y"])
    text = al.export(own, "c-header")
    assert worst_of(text)[0] == 1.0
    assert "largest" not in text


def test_an_overbound_of_three_axes_is_compared_with_each():
    own = axes_of([document(name, text) for name, text in AXES.items()])
    text = unwrapped(al.export(own, "kalibr", overbound=True))
    assert worst_of(text)[0] > 2.0
    assert "of all its effects (the largest of the axes: N of gyro_y, K of gyro_z)" in text


def test_a_state_space_has_the_fitted_value_of_what_is_not_detected():
    values = {
        "angle_random_walk": al.Estimate(1e-3, 1e-5, (9e-4, 1.1e-3), "rad/s·s^½", True, "N"),
        "rate_random_walk": al.Estimate(1e-6, 1e-6, (0.0, 3e-6), "rad/s/s^½", False, "K"),
    }
    effects = [{"kind": k, "parameters": {e.name: e.to_dict()}} for k, e in values.items()]
    recording = {"column": "gyro_x", "unit": "rad/s", "rate_hz": 100.0}
    whole = axes_of([{"schema": "allanite/fit/1", "recording": recording, "effects": effects}])
    for overbound, walk in ((False, 1e-6), (True, 3e-6)):
        (axis,) = json.loads(al.export(whole, "statespace", overbound=overbound))["axes"]
        assert np.array(axis["Q"])[0, 0] == pytest.approx(walk**2 / 100.0)


def fitted(model, **rivals):
    """Document of a model with intervals of 10 %, and `rivals` as the intervals over other models."""
    found = document("gyro_x", model)
    found["schema"] = "allanite/fit/1"
    for effect in found["effects"]:
        for name, one in effect["parameters"].items():
            if isinstance(one.get("value"), float):
                one["interval"] = [0.9 * one["value"], 1.1 * one["value"]]
            if name in rivals:
                effect["over_rivals"] = {name: list(rivals[name])}
                effect["rivals"] = ["gauss_markov"]
    return found


def test_a_head_shows_what_other_models_say_of_a_number():
    text = al.export(axes_of([fitted("N(N=1e-3)+K(K=1e-5)", K=(0.0, 3e-5))]), "kalibr")
    (line,) = (
        one for one in text.splitlines() if "if alternatives are counted: gauss_markov" in one
    )
    assert re.search(
        r"K 0?\S+ \(\S+ \.\.\. \S+\) .*; 0 \.\.\. \S+ if alternatives are counted: gauss_markov",
        line,
    )


def test_an_overbound_covers_what_other_models_say():
    alone, both = (
        walk_of(al.export(axes_of([one]), "kalibr", overbound=True))
        for one in (
            fitted("N(N=1e-3)+K(K=1e-5)"),
            fitted("N(N=1e-3)+K(K=1e-5)", K=(0.0, 3e-5)),
        )
    )
    assert alone == pytest.approx(1.1e-5, rel=0.02)
    assert both == pytest.approx(3e-5, rel=0.02)


def test_an_overbound_covers_the_loudest_stretch():
    text = al.export(
        axes_of([fitted("N(N=1e-3)+K(K=1e-5)+LEVEL(start=600,end=800,factor=4)")]),
        "kalibr",
        overbound=True,
    )
    white = float(re.search(r"noise_density: (\S+)", text).group(1))
    assert white >= 0.99 * 4 * 1.1e-3
    # Within 1.3 of the tightest, at the upper end of the interval of the factor too.
    assert white < 1.3 * 4 * 1.1**2 * 1e-3
    assert "N covers the loudest segment of the log" in text


def test_an_overbound_of_a_power_law_is_near_its_density():
    """When the interval of the exponent reached the end of its range, -2.95, the overbound was 85 times too large.

    Level and exponent at their common limits give less than three times the deviation at the horizon.
    """
    rng, n, rate, density, level, exponent = np.random.default_rng(5), 12_000, 10.0, 0.01, 4e-3, 1.4
    k = np.arange(1, 4 * n)
    response = np.cumprod(np.concatenate([[1.0], (0.5 * exponent + k - 1.0) / k]))
    slow = level * fftconvolve(rng.standard_normal(4 * n), response)[3 * n : 4 * n]
    white = density * np.sqrt(rate) * rng.standard_normal(n)
    fit = al.fit_model(al.Recording(white + slow, rate=rate, unit="rad/s"), "N+PL")
    found = fit["PL.exponent"]
    low, high = found.interval
    assert -2.0 < low < -exponent < high
    assert found.std_error is not None
    f = rate / n * 10.0
    true = density**2 + level**2 / rate * (2.0 * np.sin(np.pi * f / rate)) ** -exponent
    chosen = choose(axis_for_export(axes_of([fit.to_dict()])[0], None, None), overbound=True)
    bound = chosen.N**2 + (chosen.K / (2.0 * np.pi * f)) ** 2
    assert 1.0 < np.sqrt(bound / true) < 3.0

    # Level and exponent err together: the bound is within 1.3 of the tightest N and K, on average over the times of use.
    def above(document):
        return choose(axis_for_export(axes_of([document])[0], None, None), overbound=True).model

    document = fit.to_dict()
    noise, law = fit.model.effects
    law = law.with_values(exponent=-exponent)
    at = np.array([0.1])
    power = level**2 / rate * (2.0 * np.sin(np.pi * at / rate)) ** -exponent
    law = law.with_values(level=law.level * float(np.sqrt(power / law.psd(at, rate))[0]))
    known = model_to_dict(al.Model((noise.with_values(N=density), law)))
    tightest = above({**known, "recording": fit.recording.describe()})
    tau = axis_for_export(axes_of([document])[0], None, None).taus
    own, apart = (
        np.sqrt(bound.allan_variance(tau, rate) / tightest.allan_variance(tau, rate))
        for bound in (above(document), above({**document, "correlations": None}))
    )
    assert 1.0 < own.mean() < 1.3
    assert own[-1] < 0.85 * apart[-1]


def test_an_improved_model_has_the_correlations_of_its_parameters():
    log = al.parse_model("N(N=0.01)+GM(q_c=0.01,T=3)").simulate(
        rate=10.0, n=6000, seed=1, unit="rad/s"
    )
    ladder = al.improve(log, "N+GM", limit=0).to_dict()["ladder"]
    assert set(ladder[-1]["correlations"]["names"]) == {"N", "GM.q_c", "GM.correlation_time"}


def test_joint_limits_need_detected_parameters():
    """Without correlations, or with a larger coefficient by another model, the ends of all intervals are combined."""
    log = al.parse_model("N(N=0.01)+GM(q_c=0.01,T=3)").simulate(
        rate=10.0, n=6000, seed=1, unit="rad/s"
    )
    document = al.fit_model(log, "N+GM").to_dict()

    def forms(document):
        (_, lag) = axes_of([document])[0].corners
        return len(lag)

    assert forms(document) == 16
    damaged = (
        {"names": ["N"], "matrix": [[1.0, 0.5]]},
        {"names": 3, "matrix": "x"},
        {"matrix": [[None]]},
        [1],
    )
    for correlations in (None, *damaged):
        assert forms({**document, "correlations": correlations}) == 3
    effects = [dict(one) for one in document["effects"]]
    high = effects[1]["parameters"]["q_c"]["interval"][1]
    effects[1]["over_rivals"] = {"q_c": [0.0, 2.0 * high]}
    assert forms({**document, "effects": effects}) == 3
