"""The simulated twin of a characterised sensor."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

import allanite as al
from allanite.axes import twin
from command_line import refused
from six_axes import NAMES, six_axes, write_csv

STEP = 0.05


@pytest.fixture(scope="module")
def sensor():
    """Two axes with a mean, a step, a range and a temperature."""
    n = 20_000
    log = six_axes(n, seed=8)
    warm = 20.0 + 5.0 * np.sin(np.linspace(0.0, 3.0, n))
    x = log["gyro_x"].samples + 0.4 + 0.2 * (warm - warm.mean())
    cut = np.clip(log["gyro_z"].samples, -0.3, 0.3)
    samples = np.column_stack([np.round(x / STEP) * STEP, cut])
    recording = al.Recording(
        samples, 100, unit="deg/s", columns=("gyro_x", "gyro_z"), covariates={"temperature": warm}
    )
    found = al.characterize(recording)
    return recording, json.loads(json.dumps(found.to_dict()))


@pytest.mark.long
def test_it_is_rounded_cut_and_about_the_mean_of_the_record(sensor):
    recording, document = sensor
    assert document["samples"]["gyro_x"]["step"] == pytest.approx(STEP)
    made = twin(document, seed=3, covariates=recording.covariates)
    x, z = made.recording.samples.T
    assert made.recording.columns == recording.columns
    assert made.recording.n == recording.n
    assert np.allclose(x / STEP, np.round(x / STEP), atol=1e-6)
    assert abs(x.mean() - recording["gyro_x"].samples.mean()) < 0.1
    assert np.abs(z).max() <= 0.3
    assert np.corrcoef(x, made.recording.covariates["temperature"])[0, 1] > 0.5
    # The white level is that of the record: N is known to 1/√(2n), 0.5 %, of each, and the step adds 4 % of variance.
    ratio = np.diff(x).std() / np.diff(recording["gyro_x"].samples).std()
    assert abs(ratio - 1.0) < 0.02


# As long as the other one of this sensor, so that it is characterised once.
@pytest.mark.long
def test_what_is_left_out_is_said(sensor):
    _, document = sensor
    made = twin(document, n=1000, seed=3)
    assert made.recording.n == 1000
    assert any("misalignment" in text for text in made.left_out)
    assert "gyro_x: the effect of temperature: no values of this column are given" in made.left_out


@pytest.mark.long
def test_noise_that_axes_share_is_said_to_be_left_out():
    rng, n = np.random.default_rng(2), 20_000
    own, both = rng.standard_normal((n, 2)), rng.standard_normal(n)
    x = own + 0.8 * both[:, None]
    log = al.Recording(x, 100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    made = twin(al.characterize(log, "N").to_dict(), seed=3)
    (said,) = [text for text in made.left_out if "share" in text]
    assert said.startswith("noise that gyro_x, gyro_y share at ")
    assert said.endswith("the axes are simulated independently")
    # 1/√n is 0.007.
    assert abs(np.corrcoef(made.recording.samples.T)[0, 1]) < 0.03


@pytest.mark.long
def test_rounding_behind_a_filter_is_not_added_twice():
    rng, n = np.random.default_rng(8), 30_000
    low = lfilter([0.4], [1.0, -0.6], rng.standard_normal(n + 100))[100:]
    x = np.column_stack([0.2 * low + 3.03, 0.14 * rng.standard_normal(n) + 1.013])
    log = al.Recording(np.round(x / 0.1) * 0.1, 50, unit="deg/s", columns=["gyro_x", "gyro_y"])
    made = twin(al.characterize(log).to_dict(), seed=3)
    assert any("gyro_x: rounding to 0.1 deg/s" in text for text in made.left_out)
    assert np.allclose(
        made.recording.samples[:, 1] * 10, np.round(made.recording.samples[:, 1] * 10)
    )
    for column in (0, 1):
        curves = [
            al.oadev(one.samples[:, column], rate=50, factors=[1, 2, 4]).deviation
            for one in (log, made.recording)
        ]
        # Of 30 000 samples a deviation at 4 is known to some 0.8 %, of two records to 1.1 %.
        np.testing.assert_allclose(curves[1] / curves[0], 1.0, atol=4 * 0.011)


@pytest.mark.slow
def test_the_same_seed_is_the_same_twin_and_axes_are_independent():
    found = al.characterize(six_axes(2000, models=("N(N=0.01)",) * 3 + ("N(N=0.001)",) * 3), "N")
    one, same, other = (found.simulate(seed=s) for s in (1, 1, 2))
    assert np.array_equal(one.samples, same.samples)
    assert not np.array_equal(one.samples, other.samples)
    # Correlations of 5000 independent values have a standard deviation of 1/√5000; 15 pairs.
    assert np.abs(np.corrcoef(one.samples.T) - np.eye(6)).max() < 4 / np.sqrt(5000)


def test_another_document_is_refused():
    with pytest.raises(al.InputError, match="characterize"):
        twin({"schema": "allanite/fit/1"})


@pytest.mark.long
def test_command(run, tmp_path):
    log = write_csv(six_axes(3000), tmp_path / "six.csv", temperature=20 + np.arange(3000) * 1e-3)
    models = tmp_path / "six.json"
    assert run("characterize", log, "--model", "N", "--save", models, "--quiet")[0] == 0
    made = tmp_path / "twin.npz"
    code, _, err = run(
        "simulate", models, "--all-axes", "--covariates", log, "--seed", "4", "-o", made
    )
    assert code == 0
    assert "not simulated" in err
    recording = al.read(made)
    assert recording.columns == NAMES
    assert recording.n == 3000
    refused(run("simulate", models, "-n", "10"), 2, "--all-axes")
    refused(run("simulate", "N(N=1)", "-n", "10", "--covariates", log), 2, "--all-axes")
    refused(run("simulate", log, "--all-axes"), 2, "characterize --save")
