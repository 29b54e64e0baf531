"""Recordings of real sensors, measured and in part analysed by others (skipped where they are not at hand)."""

import numpy as np
import pytest

import allanite as al

pytestmark = pytest.mark.data


@pytest.fixture
def record(data):
    """One column of a recording by file and column name."""

    def read(name, column=None, **options):
        return al.read(data(name), column=column, **options)

    return read


def test_published_curve_of_adis16405(data, record):
    """The published Allan variance of this very log: every τ to 1e-5."""
    with np.load(data("avar_curves.npz"), allow_pickle=False) as curves:
        tau, published = curves["adis_tau"], curves["adis_adev"]
    worst = 0.0
    for i in range(published.shape[1]):  # in the order of the columns
        recording = record("adis16405_imu1.npz", i)
        factors = np.round(tau * recording.rate).astype(int)
        found = al.oadev(recording.samples, rate=recording.rate, factors=factors)
        np.testing.assert_allclose(found.tau, tau, rtol=1e-9)
        worst = max(worst, np.abs(found.deviation / published[:, i] - 1).max())
    assert worst < 1e-5


def test_stable32_values_of_a_caesium_clock(record):
    """Stable32 OADEV of a Cs 5071A against a maser, phase in s at 1 Hz, five digits."""
    clock = record("clock_cs5071a_phase.npz", quantity="angle", unit="1")
    found = clock.oadev(factors=[1, 10, 100, 1000, 10000])
    for value, text in zip(
        found.deviation,
        ["3.3171e-10", "3.2118e-11", "3.4040e-12", "4.7341e-13", "1.0126e-13"],
        strict=True,
    ):
        assert f"{value:.4e}" == text


def test_stable32_values_of_a_gps_receiver(record):
    clock = record("clock_gps1pps_phase.npz", quantity="angle", unit="1")
    found = clock.oadev(factors=[1, 512]).deviation
    assert f"{found[0]:.4e}" == "6.1244e-09"
    assert f"{found[1]:.4e}" == "2.2819e-11"


def test_counter_noise_is_one_slope(record):
    """The noise floor of a counter: slope −1 over four decades."""
    clock = record("clock_tic_noisefloor_phase.npz", quantity="angle", unit="1")
    factors = np.array([1, 10, 100, 1000])
    found = clock.oadev(factors=factors).deviation
    slope = np.diff(np.log10(found))
    # The last points have few degrees of freedom.
    np.testing.assert_allclose(slope, -1.0, atol=0.1)


def test_mtig_hides_a_lag(record):
    """A Gauss-Markov process of 1.5…4 s beside N+B+K; reduced χ² falls from above 2 to below 1.3."""
    study = al.improve(record("mtig_gyrox_contaminated.npz", "gyro_x"), "N+B+K")
    kinds = [r.added.kind for r in study.ladder[1:]]
    reduced = [r.fit.misfit.reduced for r in study.ladder]
    assert "gauss_markov" in kinds, kinds
    assert 1.5 < study.fit["GM.correlation_time"].value < 4.0
    assert reduced[0] > 2.0
    assert reduced[-1] < 1.3, reduced
    held_out = [r.fit.error.held_out for r in study.ladder]
    assert (np.diff(held_out) < 0.0).all(), held_out


def test_hfi_is_white(record):
    """Nothing but white noise, N within 3 % of what a Whittle estimate by hand gave."""
    fit = al.AngleRandomWalk().fit(record("hfi_10hz.npz", "gyro_x"))
    check = fit.check()
    assert [s.kind for s in check.significant] == []
    assert fit["N"].value == pytest.approx(4.8e-4, rel=0.03)


def test_adis_accelerometer_hears_a_line(record):
    """A line at 0.564 Hz of a third of a milli-g stands among the suggestions."""
    check = (al.AngleRandomWalk() + al.BiasInstability() + al.RateRandomWalk()).fit(
        record("adis16405_imu1.npz", "acc_x")
    )
    lines = [s for s in check.check().significant if s.kind == "sinusoid"]
    assert lines
    found = [s.effect.values["frequency"] for s in lines]
    assert any(abs(f - 0.564) < 0.003 for f in found), found
