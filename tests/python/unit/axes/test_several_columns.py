"""Several columns in one object: a mapping from the name of a column to its result."""

import json
import re

import numpy as np
import pytest

import allanite as al
from six_axes import NAMES, six_axes


@pytest.fixture(scope="module")
def log():
    return six_axes(4000, models=("N(N=0.01)", "N(N=0.01)", "N(N=0.02)") + ("N(N=0.001)",) * 3)


def test_columns_are_taken_by_name(log):
    assert log["gyro_x"].columns == ("gyro_x",)
    assert np.array_equal(log["gyro_x"].samples, log.column("gyro_x").samples)
    two = log[["acc_z", "gyro_x"]]
    assert two.columns == ("acc_z", "gyro_x")
    assert two.units == ("m/s^2", "deg/s")
    assert np.array_equal(two.samples, log.samples[:, [5, 0]])
    assert not two.samples.flags.writeable
    assert log[["gyro_y"]].samples.ndim == 1
    for wrong in ("gyro", ["gyro_x", "nothing"], []):
        with pytest.raises(al.InputError, match="column"):
            log[wrong]


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["oadev", "mdev", "totdev"])
def test_deviations_of_all_columns(log, estimator, tmp_path):
    compute = getattr(al, estimator)
    found = al.deviations(log, estimator, taus="decade")
    assert tuple(found) == NAMES
    for name in NAMES:
        alone = compute(log[name], taus="decade")
        assert np.array_equal(found[name].deviation, alone.deviation)
        assert found[name].unit == alone.unit
    document = json.loads(json.dumps(found.to_dict()))
    assert document["schema"] == "allanite/adev/1"
    assert [d["recording"]["column"] for d in document["columns"]] == list(NAMES)
    assert all(name in str(found) for name in NAMES)
    assert len(found.plot(tmp_path / "all.svg").panels) == 2


@pytest.mark.slow
def test_fits_of_all_columns(log, tmp_path):
    fits = al.fit_columns(log, "N")
    assert tuple(fits) == NAMES
    assert float(fits["gyro_z"]["N"]) == float(al.AngleRandomWalk().fit(log["gyro_z"])["N"])
    document = fits.to_dict()
    assert [d["recording"]["column"] for d in document["columns"]] == list(NAMES)
    gyroscope, accelerometer = document["pooled"]
    assert not gyroscope["agree"]
    assert accelerometer["agree"]
    assert "the columns differ: N (" in str(fits)
    assert "mean over columns" in str(fits)
    assert "between columns" in str(fits)
    assert "recordings" not in str(fits)
    fits.save(tmp_path / "six.json")
    saved = json.loads((tmp_path / "six.json").read_text())
    assert [d["recording"]["column"] for d in saved["columns"]] == list(NAMES)
    checks = fits["gyro_x"].check(), fits.check()["gyro_x"]
    assert checks[0].to_dict() == checks[1].to_dict()


@pytest.mark.slow
def test_improve_of_two_columns(log):
    two = log[["gyro_x", "acc_x"]]
    studies = al.improve_columns(two, "N")
    assert tuple(studies) == ("gyro_x", "acc_x")
    assert studies["acc_x"].fit.model == al.improve(log["acc_x"], "N").fit.model
    document = studies.to_dict()
    assert document["schema"] == "allanite/improve/2"
    assert len(document["columns"]) == 2
    assert "<h4>gyro_x</h4>" in studies._repr_html_()
    stuck = al.Recording(np.zeros((100, 2)), 1, columns=("a", "b"))
    with pytest.raises(al.TooShortError, match="constant"):
        al.improve_columns(stuck, "N")


@pytest.mark.parametrize(
    ("one", "now"),
    [
        (lambda log: al.mdev(log), "al.deviations(recording, kind)"),
        (lambda log: log.oadev(), "al.deviations(recording, kind)"),
        (lambda log: al.fit_model(log, "N"), "al.fit_columns(recording, model)"),
        (lambda log: al.improve(log, "N"), "al.improve_columns(recording, model)"),
        (lambda log: al.trend(log, model="N"), "al.trend_columns(recording)"),
    ],
)
def test_functions_of_one_column_refuse_several_and_name_the_other(log, one, now):
    with pytest.raises(al.InputError, match=re.escape(f"2 columns: use {now}")):
        one(log[["gyro_x", "acc_x"]])


def test_an_estimate_of_several_columns_says_how_to_ask_for_it():
    x = np.random.default_rng(3).standard_normal((500, 6))
    names = ["gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"]
    fit = al.fit_columns(al.Recording(x, rate=100, columns=names), "N")
    with pytest.raises(KeyError) as caught:
        fit["N"]
    assert str(caught.value) == "6 columns were fitted; use fit['gyro_x']['N']"
    with pytest.raises(KeyError, match="no column 'gyro_w': choose one of gyro_x"):
        fit["gyro_w"]
    assert "gyro_w" not in fit


@pytest.mark.slow
def test_a_channel_with_three_codes_is_never_simply_adequate():
    x = np.round(np.random.default_rng(4).standard_normal(6000) * 0.33)
    assert np.unique(x).size == 3
    study = al.improve(al.Recording(x * 0.01, rate=100, unit="deg/s"), "N")
    assert study.verdict == study.check.verdict == "limited by quantization"
    assert "adequate, limited by quantization" in str(study.fit)
    assert study.ending == "limited by quantization"
    # Documents do not call it adequate either, and a filter file says why not to use it.
    for document in (study.to_dict(), study.check.to_dict(), study.fit.to_dict()):
        assert document["adequate"] is False
    assert study.to_dict()["stopped_because"] == "limited by quantization"
