"""Recordings: what they accept, refuse, keep and count."""

import pickle

import numpy as np
import pandas as pd
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

import allanite as al
from allanite.cli import words as cli
from allanite.page import words as page


def make(n=1000, **options):
    x = np.random.default_rng(1).standard_normal((n, 2))
    return al.Recording(
        x,
        100,
        unit=("deg/s", "g"),
        columns=("gyro", "acc"),
        covariates={"temp": np.arange(n)},
        **options,
    )


def test_basic_facts():
    r = make()
    assert (r.n, r.rate, r.tau0, r.duration) == (1000, 100.0, 0.01, 10.0)
    assert r.columns == ("gyro", "acc")
    assert r.units == ("deg/s", "g")
    assert r.unit == "deg/s, g"
    assert r.quantity == "rate"
    assert r.gaps == 0
    assert [c.unit for c in r] == ["deg/s", "g"]
    assert r.column("acc").samples.shape == (1000,)
    assert r.column("1").columns == ("acc",)
    assert r.column("acc").covariates["temp"][3] == 3


def test_one_column_is_flat():
    assert al.Recording([[1.0], [2.0], [3.0]], 1).samples.shape == (3,)
    assert al.Recording([1.0, 2.0], 1).columns == ("x",)


def test_immutable_and_owning():
    x = np.zeros(10)
    r = al.Recording(x, 1, covariates={"t": x})
    x[3] = 7
    assert r.samples[3] == 0
    assert r.covariates["t"][3] == 0
    with pytest.raises(ValueError, match="read-only"):
        r.samples[0] = 1
    with pytest.raises(AttributeError):
        r.rate = 3
    with pytest.raises(TypeError):
        r.covariates["t"] = x


def test_a_read_only_array_is_not_copied():
    x = np.arange(10.0)
    x.flags.writeable = False
    assert np.shares_memory(al.Recording(x, 1).samples, x)


def test_pickle():
    r = pickle.loads(pickle.dumps(make(path="a.csv")))
    assert r.describe() == make(path="a.csv").describe()
    assert not r.samples.flags.writeable
    assert dict(r.covariates)["temp"][5] == 5


def test_integers_stay_integers():
    r = al.Recording(np.array([1, 2, 3], dtype=np.int16), 10)
    assert r.samples.dtype == np.int16
    assert r.rate_samples().dtype == np.int64


def test_quantities():
    rate = np.array([1.0, 3.0, 2.0, 5.0])
    increments = al.Recording(rate / 4, 4, quantity="increment", unit="deg")
    angles = al.Recording(
        np.concatenate(([0], np.cumsum(rate / 4))), 4, quantity="angle", unit="deg"
    )
    assert increments.unit == angles.unit == "deg/s"
    np.testing.assert_allclose(increments.rate_samples(), rate)
    np.testing.assert_allclose(angles.rate_samples(), rate)


def test_pandas_and_pint():
    frame = pd.DataFrame({"wx": [1.0, 2.0], "wy": [3.0, 4.0]})
    assert al.Recording(frame, 1).columns == ("wx", "wy")
    assert al.Recording(frame["wx"], 1).n == 2
    registry = pint.UnitRegistry()
    r = al.Recording([1.0, 2.0] * registry.degree / registry.second, 1)
    assert r.unit == "deg/s"
    r = al.Recording([180.0] * registry.degree / registry.second, 1, unit="rad/s")
    assert r.samples[0] == pytest.approx(np.pi)


def test_nan_is_kept_and_counted():
    x = np.ones(100)
    x[[3, 4, 50]] = np.nan
    r = al.Recording(x, 1)
    assert (r.gaps, r.missing) == (2, 3)
    assert r.describe()["gaps"] == 2


def test_describe_is_the_contract():
    d = make(path="log.csv").column("gyro").describe()
    assert set(d) == {"path", "column", "n", "rate_hz", "duration_s", "unit", "gaps", "audit"}
    assert (d["path"], d["column"], d["unit"]) == ("log.csv", "gyro", "deg/s")


@pytest.mark.parametrize(
    ("arguments", "options", "error", "text"),
    [
        (([1.0, 2.0],), {}, al.InputError, "no sampling rate"),
        (([1.0, 2.0], 0), {}, al.InputError, "positive"),
        (([1.0, 2.0], -5), {}, al.InputError, "positive"),
        (([1.0, 2.0], float("nan")), {}, al.InputError, "positive"),
        (([1.0, np.inf], 1), {}, al.InputError, "column x: sample 2, counted from 1, is inf"),
        (([], 1), {}, al.TooShortError, "no samples"),
        (([np.nan, np.nan], 1), {}, al.TooShortError, "every sample is NaN"),
        (([1j, 2j], 1), {}, al.InputError, "real numbers"),
        ((["a", "b"], 1), {}, al.InputError, "real numbers"),
        ((np.zeros((2, 2, 2)), 1), {}, al.InputError, "shape"),
        (([1.0], 1), {"unit": "furlong"}, al.InputError, "furlong"),
        (([1.0], 1), {"quantity": "speed"}, al.InputError, "rate, increment, angle"),
        (([1.0], 1), {"columns": ["a", "b"]}, al.InputError, "2 column names for 1 columns"),
        (([1.0], 1), {"covariates": {"t": [1, 2]}}, al.InputError, "covariate 't'"),
        (([1.0, 2.0], 1), {"time": [0, 1, 2]}, al.InputError, "3 time stamps for 2 samples"),
        (([1.0, 2.0],), {"time": [1, 1]}, al.InputError, "does not advance"),
        (([1.0, 2.0],), {"time": [1, np.nan]}, al.InputError, "time column holds nan"),
    ],
)
def test_refusals_are_one_line_and_name_the_thing(arguments, options, error, text):
    with pytest.raises(error, match=text) as caught:
        al.Recording(*arguments, **options)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, al.AllaniteError)


@pytest.mark.parametrize("time", [[1, 1], [1j, 2j]])
def test_a_time_column_of_no_use_names_the_rate_as_it_is_given(time):
    with pytest.raises(al.InputError, match="give rate= and leave the column out") as caught:
        al.Recording([1.0, 2.0], time=time)
    assert "give --rate HZ and" in caught.value.worded(cli.WORDS)
    assert "give the rate and" in caught.value.worded(page.WORDS)


def test_unknown_column_lists_the_known():
    with pytest.raises(al.InputError, match=r"'gyrox'.*gyro, acc"):
        make().column("gyrox")


# -- time stamps ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("scale", "unit"), [(1, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
@pytest.mark.parametrize("rate", [5, 100, 1000])
def test_the_unit_of_time_is_guessed(scale, unit, start, rate):
    if (start, unit, rate) == (0.0, "ms", 1000):
        with pytest.raises(al.InputError, match="row numbers"):
            al.Recording(np.arange(500.0), time=np.arange(500))
        return
    t = np.round((start + np.arange(500) / rate) * scale * 1e3) / 1e3
    if scale >= 1e3:
        t = t.astype(np.int64)
    r = al.Recording(np.arange(500.0), time=t)
    assert r.stamps.unit == unit
    assert r.rate == pytest.approx(rate, rel=1e-4)


def test_gaps_become_nan_rows():
    keep = np.ones(1000, dtype=bool)
    keep[[100, 101, 102, 500]] = False
    t = np.arange(1000) / 50.0
    x = np.arange(1000.0)
    r = al.Recording(x[keep], time=t[keep], covariates={"temp": x[keep]})
    assert (r.n, r.gaps, r.missing) == (1000, 2, 4)
    np.testing.assert_array_equal(r.samples[keep], x[keep])
    assert np.isnan(r.samples[~keep]).all()
    assert np.isnan(r.covariates["temp"][500])
    assert r.rate == pytest.approx(50)


@pytest.mark.slow
@given(
    seed=st.integers(0, 10_000),
    rate=st.sampled_from([1.0, 9.862, 100.0, 1000.0]),
    jitter=st.floats(0, 0.15),
)
def test_jitter_invents_no_gap_and_gaps_are_found_under_jitter(seed, rate, jitter):
    rng = np.random.default_rng(seed)
    n = 400
    t = (np.arange(n) + jitter * rng.uniform(-1, 1, n)) / rate
    assert al.Recording(np.arange(n), time=t, time_unit="s").gaps == 0
    keep = np.ones(n, dtype=bool)
    start = int(rng.integers(10, n - 30))
    keep[start : start + int(rng.integers(2, 15))] = False
    r = al.Recording(np.arange(n)[keep], time=t[keep], time_unit="s")
    assert r.n == n
    np.testing.assert_array_equal(np.isnan(r.samples), ~keep)
    # Both ends carry the jitter, so the rate is off by at most 2·jitter steps over n.
    assert r.rate == pytest.approx(rate, rel=2.5 * jitter / n + 1e-9)


# -- parts ---------------------------------------------------------------------------------------


def test_trim_and_half():
    r = make()
    assert r.trim(1, 3).n == 200
    assert r.trim(1).samples[0, 0] == r.samples[100, 0]
    assert r.trim(None, 3).covariates["temp"][-1] == 299
    assert r.half(0).n + r.half(1).n == r.n
    with pytest.raises(al.InputError, match="there are no samples"):
        r.trim(20)


def test_decimation_averages():
    r = make().decimate(10)
    assert (r.n, r.rate) == (100, 10.0)
    np.testing.assert_allclose(r.samples[0], make().samples[:10].mean(axis=0))
    assert r.covariates["temp"][0] == 4.5
    with pytest.raises(al.InputError):
        make().decimate(0)


def test_decimation_keeps_the_white_level():
    # Skipping samples would double N for a factor of 4; averaging keeps it. σ² τ of 1e5 averaged
    # samples has a relative standard deviation √(2/1e5) = 0.45 %; five of those.
    x = np.random.default_rng(3).standard_normal(400_000)
    r = al.Recording(x, 400).decimate(4)
    assert np.var(r.samples) / r.rate == pytest.approx(1 / 400, rel=0.023)


def test_decimated_increments_and_angles_are_of_the_same_rate():
    x = np.random.default_rng(4).standard_normal(100)
    expected = al.Recording(x, 10).decimate(5).rate_samples()
    increments = al.Recording(x / 10, 10, quantity="increment").decimate(5).rate_samples()
    angles = al.Recording(np.concatenate(([0], np.cumsum(x) / 10)), 10, quantity="angle").decimate(
        5
    )
    np.testing.assert_allclose(increments, expected)
    np.testing.assert_allclose(angles.rate_samples(), expected[: angles.n - 1])


def test_to_another_unit():
    r = make().to("rad/s")
    np.testing.assert_allclose(r.samples[:, 0], np.deg2rad(make().samples[:, 0]))
    np.testing.assert_allclose(r.samples[:, 1], make().samples[:, 1])
    assert r.units == ("rad/s", "g")
    with pytest.raises(al.InputError, match="deg/s"):
        make().column("gyro").to("mg")


def test_only_date_times_have_an_epoch():
    texts = np.array([f"{k / 10}" for k in range(20)])
    dates = np.datetime64("2026-05-04", "ms") + 100 * np.arange(20)
    for time, epoch in ((texts, None), (dates, 1777852800.0), (dates.astype(str), 1777852800.0)):
        assert al.Recording(np.arange(20), time=time).epoch == epoch
    assert al.Recording(np.arange(20), time=dates - dates[0]).epoch is None
