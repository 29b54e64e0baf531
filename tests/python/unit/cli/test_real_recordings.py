"""The commands on real recordings, against what was published of them."""

import numpy as np
import pytest

from command_line import strict


@pytest.mark.slow
@pytest.mark.data
def test_adev_agrees_with_the_published_curve_of_an_adis16405(run, data):
    with np.load(data("avar_curves.npz")) as curves:
        tau, published = curves["adis_tau"], curves["adis_adev"]
    document = strict(run("adev", data("adis16405_imu1.npz"), "--json")[1])
    for i, column in enumerate(document["columns"]):
        points = {round(p["tau_s"], 6): p["deviation"] for p in column["points"]}
        found = [points[round(t, 6)] for t in tau]
        np.testing.assert_allclose(found, published[:, i], rtol=1e-5)


@pytest.mark.data
def test_adev_agrees_with_stable32_on_a_caesium_clock(run, data):
    log = data("clock_cs5071a_phase.npz")
    options = ["--quantity", "angle", "--unit", "1", "--taus", "decade", "--json"]
    points = {p["tau_s"]: p["deviation"] for p in strict(run("adev", log, *options)[1])["points"]}
    # Printed to five digits.
    stable32 = {
        1: 3.3171e-10,
        10: 3.2118e-11,
        100: 3.4040e-12,
        1000: 4.7341e-13,
        10_000: 1.0126e-13,
    }
    for tau, value in stable32.items():
        assert points[tau] == pytest.approx(value, rel=1.5e-5)


@pytest.mark.data
def test_published_white_level_of_a_10_hz_log(run, data):
    document = strict(
        run("fit", data("hfi_10hz.npz"), "--column", "gyro_x", "--model", "N", "--json")[1]
    )
    (effect,) = document["effects"]
    assert effect["parameters"]["N"]["value"] == pytest.approx(4.8e-4, rel=0.03)
    assert any("9.862 Hz" in finding["message"] for finding in document["recording"]["audit"])
