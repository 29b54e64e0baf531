"""Recordings of real sensors, measured and in part analysed by others (skipped where they are not at hand)."""

import itertools

import numpy as np
import pytest

import allanite as al
from allanite.fit.prediction import compare

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


@pytest.mark.long
def test_mtig_hides_a_lag_and_spikes(record):
    """Outliers and a Gauss-Markov process of 1.5…4 s beside N+B+K; reduced χ² falls from above 2 to below 1.3."""
    recording = record("mtig_gyrox_contaminated.npz", "gyro_x")
    study = al.improve(recording, "N+B+K")
    kinds = [e.kind for r in study.ladder[1:] for e in r.new]
    assert kinds[0] == "gauss_markov"
    reduced = [r.fit.misfit.reduced for r in study.ladder]
    assert {"outliers", "gauss_markov"} <= set(kinds), kinds
    # N is that of the samples without spikes: the histogram ends at 0.03 rad/s, what is beyond stands alone, up to
    # 0.3 rad/s. First differences know N of 5e5 samples to 0.15 %; the spikes are worth 5.6 % of it.
    x = recording.samples
    spread = np.diff(x[np.abs(x - np.median(x)) < 0.03]).std() / np.sqrt(2.0 * recording.rate)
    assert study.fit["N"].value == pytest.approx(spread, rel=0.01)
    assert study.ladder[0].fit["N"].value > 1.04 * spread
    assert 1.5 < study.fit["GM.correlation_time"].value < 4.0
    assert reduced[0] > 2.0
    assert reduced[-1] < 1.3, reduced
    scores = [r.fit.error.predictive.score for r in study.ladder]
    assert (np.diff(scores) < 0.0).all(), scores


@pytest.mark.slow
@pytest.mark.parametrize("file", ["a", "b"])
def test_temperature_predicts_the_whale_tag(record, file):
    """The coefficient differs between the halves (0.38, 0.56 in gyro_y), but it still predicts unseen blocks far better."""
    for column in ("gyro_y", "acc_y"):
        recording = record(f"cats_thermal_{file}.npz", column)
        models = ("N+B+K", "N+B+K+COV(column=temperature)")
        before, after = (al.fit_model(recording, m).error.predictive for m in models)
        difference, error = compare(before, after)
        assert difference < -2.0 * error, (column, difference, error)


@pytest.mark.slow
def test_hfi_is_white(record):
    """Only white noise; N is within 3 % of a Whittle estimate made by hand."""
    fit = al.AngleRandomWalk().fit(record("hfi_10hz.npz", "gyro_x"))
    check = fit.check()
    assert [s.kind for s in check.significant] == []
    assert fit["N"].value == pytest.approx(4.8e-4, rel=0.03)


@pytest.mark.long
def test_adis_accelerometer_hears_a_line(record):
    """A line at 0.564 Hz of a third of a milli-g with its third harmonic; its frequency is not constant."""
    check = al.fit_model(record("adis16405_imu1.npz", "acc_x"), "N+B+K").check()
    lines = [s for s in check.significant if s.kind == "sinusoid"]
    found = next((s for s in lines if abs(s.effect.values["frequency"] - 0.564) < 0.003), None)
    assert found is not None, [s.effect.values["frequency"] for s in lines]
    assert [m for m, _, _ in found.effect.lines] == [1, 3]
    # It wanders by half a millihertz: narrow-band noise explains it better, and that is said, with the numbers.
    assert "harmonics 3" in found.explanation
    assert "It is not a pure line: it wanders by ±0.000" in found.explanation
    assert "A narrow resonance at 0.564" in found.explanation


@pytest.mark.slow
def test_adis_gyroscope_is_low_passed(record):
    """The density is 30 % lower at 47 Hz. There N+B+K fails most, and the suggestion must name the filter."""
    check = al.fit_model(record("adis16405_imu1.npz", "gyro_x"), "N+B+K").check()
    assert check.suggestions[0].kind in ("bandwidth", "resonance")
    assert check.suggestions[0].significant
    worst = max(check.where.frequency, key=lambda row: abs(row["z"]))
    assert worst["low_hz"] > 9.0
    assert worst["z"] < -10.0


@pytest.mark.slow
def test_adis_gyroscope_has_a_band(record):
    """A band 3 Hz wide at 20 Hz with eight times the density of the noise floor. It moves by ±0.7 Hz within a minute."""
    check = al.fit_model(record("adis16405_imu1.npz", "gyro_z"), "N+B+K").check()
    first, second = check.suggestions[:2]
    assert [first.kind, second.kind] == ["drifting_resonance", "resonance"]
    assert first.significant
    low, high = first.effect.occupies
    assert 15.0 < low < 20.0 < high < 25.0
    values = second.effect.values
    assert values["frequency"] == pytest.approx(20.0, abs=1.0)
    # Full width at half the power, 2ζf.
    assert 0.5 < 2.0 * values["damping"] * values["frequency"] < 5.0
    worst = max(check.where.frequency, key=lambda row: abs(row["z"]))
    assert 18.0 < worst["low_hz"] < worst["high_hz"] < 22.0


@pytest.mark.long
@pytest.mark.parametrize("which", ["a", "b"])
@pytest.mark.parametrize(
    ("column", "low", "high"), [("acc_y", -0.026, -0.017), ("gyro_y", 0.25, 0.50)]
)
def test_a_whale_tag_feels_the_temperature(record, which, column, low, high):
    """Temperature comes first. The ranges are those of least squares on levels and on differences over 15 minutes."""
    fit = al.fit_model(record(f"cats_thermal_{which}.npz", column), "N+K")
    first = fit.check().suggestions[0]
    assert first.kind == "covariate"
    assert first.significant
    assert first.effect.values["column"] == "temperature"
    assert low <= first.effect.values["coefficient"] <= high
    if column == "acc_y":
        curves = fit.curve, fit.add(first).curve
        before, after = (np.abs(c.ratio[c.tau > 1e3] - 1.0).mean() for c in curves)
        assert after < 0.5 * before


@pytest.mark.long
@pytest.mark.parametrize("which", ["a", "b"])
def test_a_whale_tag_whose_drift_is_not_the_temperature(record, which):
    """The sign of the slope of gyro_x against temperature changes with the time scale."""
    check = al.fit_model(record(f"cats_thermal_{which}.npz", "gyro_x"), "N+K").check()
    assert "covariate" not in [s.kind for s in check.significant]


@pytest.mark.long
def test_the_line_of_the_accelerometer_is_a_narrow_band_with_its_harmonic(record):
    """Half of its power is within ±0.4 mHz; the third harmonic wanders at least three times as far."""
    step = al.improve(record("adis16405_imu1.npz", "acc_x"), "N+B+K", limit=1).ladder[1]
    first, third = (e for e in step.fit.model if e.kind == "resonance")
    assert [e.kind for e in step.brought] == ["resonance"]
    assert first.frequency == pytest.approx(0.5641, abs=2e-4)
    assert third.frequency == pytest.approx(3.0 * first.frequency, abs=3e-3)
    widths = [e.damping * e.frequency for e in (first, third)]
    assert 2e-4 < widths[0] < 8e-4
    assert widths[1] > 3.0 * widths[0]


@pytest.mark.long
def test_neither_misfit_nor_discrepancy_of_the_gyroscope_rises(record):
    """A hump at 20 Hz and a filter: either alone leaves a larger discrepancy."""
    study = al.improve(record("adis16405_imu1.npz", "gyro_z"), "N+B+K")
    assert {study.ladder[1].added.kind, *(e.kind for e in study.ladder[1].brought)} == {
        "resonance",
        "bandwidth",
    }
    for left in (study.misfit_left, [r.fit.discrepancy.percent for r in study.ladder]):
        assert all(after <= before for before, after in itertools.pairwise(left)), left


@pytest.mark.long
def test_a_summary_of_adis_tells_what_the_record_does(record):
    """The summary shows a band that moves, and vibrations narrower than a bin with side bands, as the record does."""
    for column, kinds in (
        ("gyro_z", ["bandwidth", "drifting_resonance", "resonance"]),
        ("acc_x", ["bandwidth", "drifting_resonance", "modulated_vibration"]),
    ):
        summary = al.summarize(record("adis16405_imu1.npz", column))
        assert not summary.keeps_all_samples
        study = al.improve(summary)
        found = {e.kind for e in study.fit.model}
        assert set(kinds) <= found, study
        assert study.misfit_left[-1] < 5.0
