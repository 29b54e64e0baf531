"""What is said of several axes together: agreement, shared noise, and the numbers of whole sensors."""

import json

import numpy as np
import pytest
from scipy.stats import binom, kstest

import allanite as al
from allanite.axes.coherence import cross_spectra
from allanite.axes.forms import common_form
from six_axes import NAMES, UNITS, six_axes

pytestmark = pytest.mark.statistical


def fits_of(seed, models, n=4000, form="N+K"):
    records = (
        al.parse_model(text).simulate(n=n, rate=10, seed=seed, unit="deg/s", axis=i)
        for i, text in enumerate(models)
    )
    return {f"gyro_{c}": al.fit_model(r, form) for c, r in zip("xyz", records, strict=True)}


def test_axes_of_one_level_agree_as_often_as_they_should_and_share_nothing():
    p_values = {"N": [], "K": []}
    alarms = 0
    for seed in range(100):
        fits = fits_of(seed, ["N(N=0.01)+K(K=3e-3)"] * 3)
        form = common_form(fits)
        assert form is not None
        for number in form.numbers:
            p_values[number.pooled.name].append(number.pooled.p_value)
        alarms += any(cross.significant for cross in cross_spectra(fits))
    for values in p_values.values():
        assert len(values) == 100
        # One test in 1000 would fail by chance.
        assert kstest(values, "uniform").pvalue > 1e-3
    # 1 % false alarms of each triad.
    assert alarms <= binom.isf(1e-3, 100, 0.01)


def test_axes_that_differ_are_told_apart():
    # 5 % apart; each is known to 1/√(2·4000) = 1.1 %, the difference of one from two others to 1.4 %: 3.6 σ.
    models = ["N(N=0.01)+K(K=3e-3)"] * 2 + ["N(N=0.0105)+K(K=3e-3)"]
    found = 0
    for seed in range(40):
        form = common_form(fits_of(seed, models))
        found += next(n for n in form.numbers if n.pooled.name == "N").pooled.p_value < 0.05
    # Power of a χ² of 2 degrees of freedom at 3.6² = 13 is 0.91.
    assert found >= binom.ppf(1e-3, 40, 0.91)


def test_what_is_common_to_two_sensors_is_found_and_nothing_else():
    """White noise of six axes at 100 Hz; a fifth of the variance of one axis of each sensor is the same noise."""
    alarms = found = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x, common = rng.standard_normal((2000, 6)), rng.standard_normal(2000)
        for shared in (0.0, 0.2):
            for i in (0, 4):
                x[:, i] = np.sqrt(1.0 - shared) * x[:, i] + np.sqrt(shared) * common
            log = al.Recording(x, 100.0, unit=UNITS, columns=NAMES)
            cross = cross_spectra({c.columns[0]: al.fit_model(c, "N") for c in log})
            pairs = [c.columns for c in cross if c.significant]
            alarms += bool(set(pairs) - {(NAMES[0], NAMES[4])} or (pairs and not shared))
            found += shared > 0.0 and (NAMES[0], NAMES[4]) in pairs
    # 1 % over all pairs of each record.
    assert alarms <= binom.isf(1e-3, 120, 0.01)
    # A coherence of 0.04 of 500 ordinates is 20 of an exponential law's mean; chance asks for ln(15·7/0.01) = 9.3.
    assert found >= binom.ppf(1e-3, 60, 0.9)


def test_a_form_has_what_all_axes_have_and_not_what_one_lacks():
    """A record of this length shows K about every other time; two of three axes have seven times as much."""
    weak, strong = "N(N=0.01)+K(K=3e-4)", "N(N=0.01)+K(K=2e-3)"
    left_out = kept = 0
    for seed in range(40):
        left_out += common_form(fits_of(seed, [weak] * 3)).model != "N+K"
        kept += common_form(fits_of(seed, [strong, strong, "N(N=0.01)"])).model != "N"
    # The lower end of one 95 % interval against the upper of another, of up to three pairs: 4 of 580 other records.
    assert left_out <= binom.isf(1e-3, 40, 0.03)
    # At 2e-3 the lower end of K is above what an axis without it allows in all but 3 of 160 other records.
    assert kept <= binom.isf(1e-3, 40, 0.04)


def test_numbers_of_six_axis_sensors_are_in_their_intervals():
    models = (
        "N(N=0.01)+K(K=3e-3)", "N(N=0.02)+K(K=2e-3)", "N(N=0.015)",
        "N(N=0.001)+GM(q_c=3e-3,T=2)", "N(N=0.002)+K(K=1e-3)", "N(N=0.003)",
    )  # fmt: skip
    truth = [al.parse_model(text) for text in models]
    inside = total = 0
    for seed in range(2):
        found = al.characterize(six_axes(3000, seed, 20.0, models), "N+K")
        exported = json.loads(found.export("json"))
        assert [axis["name"] for axis in exported["axes"]] == list(NAMES)
        for axis, model in zip(exported["axes"], truth, strict=True):
            scale = axis["effects_unit_si"]
            for effect in model:
                if effect.standard is None:
                    continue
                name = effect.standard.name
                if name in axis["coefficients"]:
                    low, high = axis["coefficients"][name]["interval"]
                    inside += low <= effect.values[name] * scale <= high
                    total += 1
    assert total >= 12
    # 95 % each; a share that chance falls below once in 1000.
    assert inside >= binom.ppf(1e-3, total, 0.95)


def test_curves_of_the_twin_lie_in_the_band_of_the_log():
    found = al.characterize(six_axes(4000, 5, 20.0), "N+K")
    outside = 0
    for seed in range(5):
        made = found.simulate(seed=seed)
        for name, study in found.studies.items():
            curve, band = study.fit.curve, study.fit.band
            measured = al.oadev(made[name], factors=curve.factors).deviation
            outside += not np.all(
                (band.low_everywhere <= measured) & (measured <= band.high_everywhere)
            )
    # 30 curves, 95 % of which are inside at all τ together.
    assert outside <= binom.isf(1e-3, 30, 0.05)
