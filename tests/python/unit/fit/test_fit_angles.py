"""Samples that are angles: one rate fewer than samples, outliers included."""

import numpy as np
import pytest

import allanite as al


def test_outliers_of_angle_samples():
    """A rate with three spikes, integrated to an angle: N is that of the noise once the spikes are named."""
    rng = np.random.default_rng(8)
    rate, n = 10.0, 4001
    increments = 0.1 * np.sqrt(rate) * rng.standard_normal(n - 1) / rate
    increments[[700, 1500, 3000]] += 1.0
    angle = np.concatenate([[0.0], np.cumsum(increments)])
    recording = al.Recording(angle, rate=rate, unit="deg", quantity="angle")
    spikes = al.effects.Outliers(times=(70.0, 150.0, 300.0))
    with_spikes = al.AngleRandomWalk().fit(recording)["N"]
    without = (al.AngleRandomWalk() + spikes).fit(recording)["N"]
    # 4000 ordinates know N to 1.1 %; 4 σ.
    assert without.value == pytest.approx(0.1, rel=0.045)
    assert with_spikes.value > 0.12


@pytest.mark.parametrize(
    ("quantity", "unit", "rate_unit"),
    [
        ("angle", "arcsec", "deg/h"), ("angle", "°", "deg/s"), ("angle", "µrad", "urad/s"), ("angle", "rad/s", "rad/s"),
        ("increment", "deg", "deg/s"), ("increment", "m/s", "m/s^2"), ("angle", "s", "1"),
    ],
)  # fmt: skip
def test_the_unit_given_for_integrals_may_be_their_own(tmp_path, quantity, unit, rate_unit):
    path = tmp_path / "log.csv"
    path.write_text("x\n" + "".join(f"{k % 7}\n" for k in range(50)))
    assert al.read(path, rate=10, unit=unit, quantity=quantity).unit == rate_unit
    two = tmp_path / "two.csv"
    two.write_text("gx,ax\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(50)))
    assert al.read(two, rate=10, unit="deg,m/s", quantity="increment").units == ("deg/s", "m/s^2")


def test_a_counter_in_hz_says_which_unit_to_give(tmp_path):
    path = tmp_path / "clock.csv"
    path.write_text("frequency [Hz]\n" + "".join(f"{1e7 + k % 7}\n" for k in range(50)))
    with pytest.raises(al.InputError, match=r"frequency \(Hz\).* unit=.* counter Hz/10MHz"):
        al.read(path, rate=1)
    clock = al.read(path, rate=1, column="frequency", unit="Hz/10MHz").to("1")
    np.testing.assert_allclose(clock.samples[:3] - 1, [0, 1e-7, 2e-7], atol=1e-15)
