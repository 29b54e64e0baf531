"""Arguments, results and messages of the deviations."""

import json
import re
from dataclasses import FrozenInstanceError
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import allanite as al
from allanite import _kernels, deviation
from allanite.deviation.confidence import degrees_of_freedom

X = np.random.default_rng(0).normal(size=1000)


def test_grids():
    assert al.oadev(X).factors.tolist() == [1, 2, 4, 8, 16, 32, 64, 128, 256]
    assert al.oadev(X, taus="decade").factors.tolist() == [1, 2, 4, 10, 20, 40, 100, 200, 400]
    assert al.oadev(X, taus="all").factors.tolist() == list(range(1, 501))
    assert al.oadev(X, taus=3).factors.tolist() == [1, 2, 5, 10, 22, 46, 100, 215, 464]
    curve = al.oadev(X, rate=10, taus=[0.1, 0.5, 0.52])
    assert curve.factors.tolist() == [1, 5]
    assert len(curve.diagnostics) == 2
    np.testing.assert_array_equal(curve.tau, [0.1, 0.5])
    assert "were not used" in al.oadev(X, factors=[1, 600]).diagnostics[0]


def test_quantities():
    rate = 50.0
    curve = al.oadev(X, rate)
    np.testing.assert_allclose(
        al.oadev(X / rate, rate, quantity="increment").deviation, curve.deviation, rtol=1e-12
    )
    angle = np.concatenate([[0.0], np.cumsum(X)]) / rate
    np.testing.assert_allclose(
        al.oadev(angle, rate, quantity="angle").deviation, curve.deviation, rtol=1e-11
    )


def test_array_likes():
    expected = al.oadev(X).deviation
    assert (al.oadev(list(X)).deviation == expected).all()
    assert (al.oadev(pd.Series(X)).deviation == expected).all()
    log = SimpleNamespace(samples=X, rate=4.0, quantity="rate", unit="deg/s")
    curve = al.oadev(log)
    assert curve.unit == "deg/s"
    assert curve.tau[0] == 0.25
    masked = np.ma.masked_array(X, mask=np.arange(1000) == 500)
    assert al.oadev(masked).n[0] == 997
    assert "1 of 1000 samples are missing" in al.oadev(masked).diagnostics


def test_gaps_are_counted_at_every_averaging_time():
    x = X.copy()
    x[[300, 301, 700]] = np.nan
    angle = np.concatenate([[0.0], np.cumsum(X)])
    angle[[300, 700]] = np.nan
    for name in deviation.ESTIMATORS.keys() - {"theo1", "theoh"}:
        kind = getattr(deviation, name)
        for samples, quantity in ((x, "rate"), (angle, "angle")):
            with_gaps = kind(samples, quantity=quantity)
            without = kind(np.nan_to_num(samples), quantity=quantity)
            assert (with_gaps.lost == without.n - with_gaps.n).all()
            assert (with_gaps.lost > 0).any()
            assert (without.lost == 0).all()
            assert "not used" in " ".join(with_gaps.diagnostics)
    assert (al.theo1(x).lost == al.theo1(np.nan_to_num(x)).n - al.theo1(x).n).all()
    assert (al.oadev(x).lost[:3] == [2 + 3, 4 + 4 + 1, 8 + 8 + 1]).all()
    # Scattered: every 50th sample. A remedy is named, and works.
    x = X.copy()
    x[::50] = np.nan
    assert "decimate" in al.oadev(x).diagnostics[-1]
    assert np.isnan(al.oadev(x).deviation[-1])
    log = al.Recording(x, rate=1.0)
    assert any("decimate" in finding.message for finding in log.audit)
    averaged = log.decimate(10)
    assert not np.isnan(averaged.samples).any()
    assert averaged.samples[5] == pytest.approx(np.nanmean(x[50:60]), rel=1e-14)
    assert np.isnan(
        al.Recording(np.where(np.arange(1000) < 6, np.nan, X), rate=1.0).decimate(10).samples[0]
    )


def test_memory_map(tmp_path):
    np.save(tmp_path / "x.npy", X)
    assert (
        al.oadev(np.load(tmp_path / "x.npy", mmap_mode="r")).deviation == al.oadev(X).deviation
    ).all()


def test_result():
    curve = al.oadev(X, 10.0)
    with pytest.raises(FrozenInstanceError):
        curve.kind = "x"
    with pytest.raises(ValueError, match="read-only"):
        curve.deviation[0] = 1
    assert len(str(curve).splitlines()) == 2 + len(curve)
    assert "<table>" in curve._repr_html_()
    assert "9 averaging times" in repr(curve)
    points = json.loads(json.dumps(curve.to_dict(), allow_nan=False))["points"]
    assert list(points[0]) == ["tau_s", "m", "n", "deviation", "low", "high", "edf"]
    assert (curve.low < curve.deviation).all()
    assert (curve.deviation < curve.high).all()
    gap = X[:20].copy()
    gap[10] = np.nan
    assert al.oadev(gap, taus="all").to_dict()["points"][-1]["deviation"] is None


def test_constant_is_zero():
    for x in (np.full(100, 9.81), np.full(100, 7), np.full(100, 1e300), [5, 5, 5]):
        curve = al.oadev(x)
        assert (curve.deviation == 0).all()
        assert (curve.low == 0).all()


def test_white_noise_has_the_exact_freedom():
    assert degrees_of_freedom(0.0, 1, 999) == pytest.approx(999 / (1.5 - 0.5 / 999), rel=1e-12)
    # against 4000 simulated records (2.2 % standard error of an edf): 141.8, 13.06 and 809
    assert degrees_of_freedom(0.0, 10, 981) == pytest.approx(141.8, rel=0.06)
    assert degrees_of_freedom(0.0, 100, 801) == pytest.approx(13.06, rel=0.06)
    assert degrees_of_freedom(-1.0, 1, 999) == pytest.approx(809, rel=0.06)
    # Greenhall & Riley where their formula holds
    assert degrees_of_freedom(2.0, 1, 999) == pytest.approx(514.04, rel=1e-4)
    assert degrees_of_freedom(2.0, 100, 801) == pytest.approx(440.21, rel=1e-4)
    assert degrees_of_freedom(2.0, 10, 972, summed=True) == pytest.approx(123.94, rel=1e-4)
    assert degrees_of_freedom(2.0, 10, 971, order=3) == pytest.approx(423.18, rel=1e-4)


@pytest.mark.parametrize(
    ("alpha", "m", "count"),
    [(0, 7, 300), (-1, 50, 4000), (-2, 3, 90), (1, 20, 5000), (0.3, 9, 900)],
)
def test_sum_over_nodes_is_the_sum_over_lags(alpha, m, count, monkeypatch):
    from allanite.deviation import confidence

    quick = degrees_of_freedom(alpha, m, count)
    monkeypatch.setattr(
        confidence, "_lag_nodes", lambda m, count, order: np.arange(count, dtype=float)
    )
    assert quick == pytest.approx(degrees_of_freedom(alpha, m, count), rel=3e-3)


@pytest.mark.parametrize(
    ("samples", "exponent"),
    [
        (np.diff(np.random.default_rng(1).normal(size=40001)), 2),
        (np.random.default_rng(2).normal(size=40000), 0),
        (np.cumsum(np.random.default_rng(3).normal(size=40000)), -2),
    ],
)
def test_noise_is_identified(samples, exponent):
    curve = al.oadev(samples)
    # white FM of τ0 reads as it is; a random walk of rate looks whiter at m = 1 only in its lag-1
    # Too long to be identified (fewer than 90 averages): white FM is carried on as halfway to flicker FM.
    unknown = curve.factors > samples.size / 90
    assert (curve.alpha[~unknown] == exponent).all()
    assert (curve.alpha[unknown] == (exponent or -0.5)).all()


BAD = [
    (lambda: al.oadev(X, rate=0), "rate must be a positive"),
    (lambda: al.oadev(X, rate=-1), "rate must be a positive"),
    (lambda: al.oadev(X, rate=np.nan), "rate must be a positive"),
    (lambda: al.oadev(X, rate="fast"), "rate must be a number"),
    (lambda: al.oadev([1, 2, np.inf, 4]), "sample 2 is inf"),
    (lambda: al.oadev([[1, 2, 3], [1, 2, 3]]), "one column"),
    (lambda: al.oadev(["a", "b", "c"]), "real numbers"),
    (lambda: al.oadev(X + 1j), "real numbers"),
    (lambda: al.oadev(X, taus="often"), "unknown taus"),
    (lambda: al.oadev(X, taus=0), "give at least 1"),
    (lambda: al.oadev(X, taus=[np.nan]), "finite"),
    (lambda: al.oadev(X, taus=[]), "list of finite"),
    (lambda: al.oadev(X, factors=[1.5]), "whole numbers"),
    (lambda: al.oadev(X, quantity="speed"), "unknown quantity"),
]


@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_input(call, message):
    with pytest.raises(al.InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: al.oadev([1, 2]),
        lambda: al.oadev([]),
        lambda: al.oadev(np.full(10, np.nan)),
        lambda: al.adev(X, taus=[1e6]),
    ],
)
def test_too_short(call):
    with pytest.raises(al.TooShortError) as caught:
        call()
    assert re.search("at least|all|hold", str(caught.value))


def test_threads_do_not_change_a_bit():
    x = np.random.default_rng(5).normal(size=300_000) + 9.81
    m = np.array([1, 2, 3, 7, 64, 1000, 2048, 2049, 9000, 100_000])
    one = _kernels.overlapping_allan(x, m, False, 1)
    for threads in (2, 3, 7):
        for a, b in zip(one, _kernels.overlapping_allan(x, m, False, threads), strict=True):
            np.testing.assert_array_equal(a, b)


def test_an_unknown_deviation_is_an_error():
    with pytest.raises(al.InputError, match="unknown deviation 'xdev': one of oadev, adev, "):
        deviation.estimator_named("xdev")
