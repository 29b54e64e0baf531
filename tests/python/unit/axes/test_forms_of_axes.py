"""What the models of the axes of a sensor share, and which of their numbers agree."""

import re

import numpy as np
import pytest

import allanite as al
from allanite.axes.characterization import Sensor
from allanite.axes.forms import Form, common_form
from allanite.axes.words import common_form_sentences

NAMES = ("gyro_x", "gyro_y", "gyro_z")


def fits_of(truths, models, units=("deg/s",) * 3, n=8000, rate=10.0, seed=3):
    """Fits of three axes by name; truths are in deg/s."""
    fits = {}
    told = zip(NAMES, truths, models, units, strict=True)
    for axis, (name, truth, model, unit) in enumerate(told):
        record = al.parse_model(truth).simulate(n=n, rate=rate, seed=seed, unit="deg/s", axis=axis)
        one = {"deg/s": 1.0, "rad/s": np.pi / 180.0, "deg/h": 3600.0}[unit]
        fits[name] = al.fit_model(al.Recording(record.samples * one, rate, unit=unit), model)
    return fits


def sentences(fits):
    return common_form_sentences(Sensor("gyroscope", tuple(fits), common_form(fits), ()))


def test_axes_in_different_units_are_compared_in_the_first():
    truths, models = ["N(N=0.01)+K(K=3e-3)"] * 3, ["N+K"] * 3
    alike = common_form(fits_of(truths, models))
    mixed = common_form(fits_of(truths, models, ("rad/s", "deg/s", "deg/h")))
    for one, other in zip(alike.numbers, mixed.numbers, strict=True):
        assert other.pooled.unit == one.pooled.unit.replace("deg", "rad")
        assert np.degrees(other.pooled.value) == pytest.approx(one.pooled.value, rel=1e-4)
        assert other.pooled.p_value == pytest.approx(one.pooled.p_value, rel=0.01)
        assert one.pooled.agree
    said = sentences(fits_of(truths, models, ("rad/s", "deg/s", "deg/h")))
    assert said == sentences(fits_of(truths, models))
    assert "°/√h" in said[1]


def test_changes_with_a_column_share_a_row_in_the_unit_of_samples():
    time = np.arange(1000) / 10.0
    temperature = 25.0 + np.sin(0.1 * time)
    x = np.random.default_rng(1).normal(0.0, 0.1, (1000, 2)) + 0.2 * temperature[:, None]
    log = al.Recording(
        x * [1.0, np.pi / 180.0],
        10.0,
        unit=("deg/s", "rad/s"),
        columns=NAMES[:2],
        covariates={"temperature": temperature},
    )
    found = al.characterize(log, "N+COV(column=temperature)", limit=0)
    lines = found.table().splitlines()
    (row,) = (line for line in lines if line.startswith("COV c"))
    label, values = row.split(" per unit of temperature ")
    assert label.endswith("°/s")
    # 1000 samples of 0.1 over a swing of 0.7 tell it to 0.1/(0.7·√1000).
    for value in re.findall(r"([\d.]+) \(", values):
        assert float(value) == pytest.approx(0.2, abs=4 * 0.0045)


def test_what_one_axis_alone_has_is_not_said_of_all():
    """A resonance and a line of one axis each: the others' records exclude the resonance."""
    truths = [
        "N(N=0.01)+K(K=1e-3)+SIN(f=0.7,A=0.01,phase=1)",
        "N(N=0.01)+K(K=1e-3)",
        "N(N=0.01)+K(K=1e-3)+RES(f=2.2,damping=0.02,rms=0.02)",
    ]
    fits = fits_of(truths, ["N+K+SIN(f=0.7)", "N+K", "N+K+RES(f=2.2,damping=0.02)"])
    form = common_form(fits)
    assert form.model == "N+K"
    assert form.besides == {"gyro_x": ("SIN",), "gyro_y": (), "gyro_z": ("RES",)}
    said = sentences(fits)
    assert said[0] == "N+K is common to all axes; gyro_x also has SIN, gyro_z also has RES"
    assert not any("RES." in text for text in said)
    # The line and the resonance leave N and K as they are.
    assert [n.pooled.name for n in form.numbers] == ["N", "K"]
    assert form.agree


def test_a_weak_axis_does_not_contradict():
    """The third axis, ten times as noisy, cannot show the K of the other two, which must agree with each other."""
    truths = ["N(N=0.01)+K(K=5e-4)"] * 2 + ["N(N=0.1)+K(K=5e-4)"]
    fits = fits_of(truths, ["N+K"] * 3)
    assert [fit["K"].detected for fit in fits.values()] == [True, True, False]
    form = common_form(fits)
    assert form.model == "N+K"
    assert [n.columns for n in form.numbers] == [NAMES, NAMES[:2]]
    assert form.to_dict()["parameters"][1]["columns"] == list(NAMES[:2])
    assert " over gyro_x and gyro_y" in sentences(fits)[1]
    # The same where its model has no K at all.
    fits["gyro_z"] = al.fit_model(fits["gyro_z"].recording, "N")
    assert common_form(fits).model == "N+K"


def test_an_axis_with_a_limit_below_the_others_contradicts():
    truths = ["N(N=0.01)+K(K=5e-3)"] * 2 + ["N(N=0.01)"]
    for third in ("N+K", "N"):
        form = common_form(fits_of(truths, ["N+K", "N+K", third]))
        assert form.model == "N"
        assert form.besides == {"gyro_x": ("K",), "gyro_y": ("K",), "gyro_z": ()}


def test_a_filter_is_of_all_axes_where_none_contradicts():
    """The model of the third axis has no filter, because the axis has none or because a walk hides it."""
    passed = "N(N=0.01)+BW(f=1.5,order=1)"
    form = common_form(fits_of([passed] * 2 + ["N(N=0.01)"], ["N+BW", "N+BW", "N"]))
    assert form.model == "N"
    assert form.besides["gyro_x"] == ("BW",)
    truths = [passed, passed, f"{passed}+K(K=0.1)"]
    form = common_form(fits_of(truths, ["N+BW", "N+BW", "N+K"], n=4000))
    assert form.model == "N+BW"
    assert [(n.pooled.name, n.columns) for n in form.numbers][-1] == ("BW.cutoff", NAMES[:2])


def test_an_axis_that_is_not_explained_vouches_for_nothing():
    """The third axis has a filter, but its model has none and fails."""
    passed = "N(N=0.01)+BW(f=1.5,order=1)"
    fits = fits_of([passed] * 3, ["N+BW", "N+BW", "N"])
    assert not fits["gyro_z"].adequate
    assert common_form(fits).model == "N"
    # The form says what the axes share, not that their models fit.
    assert sentences(fits)[0] == "N is common to all axes; gyro_x also has BW, gyro_y also has BW"


def test_axes_of_different_noise_have_no_common_form():
    fits = fits_of(["N(N=0.01)", "K(K=0.01)", "N(N=0.01)"], ["N", "K", "N"], n=2000)
    assert common_form(fits) is None
    assert sentences(fits)[0] == "no noise model is common to all axes"


def test_what_an_axis_has_beside_the_common_form_is_said():
    form = Form("N", {"gx": (), "gy": ("SIN", "OUT")}, ())
    sensor = Sensor("gyroscope", ("gx", "gy"), form, ())
    assert common_form_sentences(sensor)[0] == "N is common to all axes; gy also has SIN+OUT"
