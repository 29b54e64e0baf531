"""The audit finds what was put in, nothing in clean noise, and on real logs what is visible."""

import re

import numpy as np
import pytest
from scipy.signal import lfilter

import allanite as al
from allanite.recording.findings import merged


def kinds(recording):
    return [finding.kind for finding in recording.audit]


def the(recording, kind):
    (finding,) = [f for f in recording.audit if f.kind == kind]
    return finding


def noise(n=20_000, seed=0):
    return np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize("seed", range(20))
def test_clean_noise_has_no_findings(seed):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(50_000) + 0.05 * np.cumsum(rng.standard_normal(50_000))
    assert kinds(al.Recording(x, 100)) == []
    assert kinds(al.Recording(x.astype(np.float32), 100)) == []
    assert kinds(al.Recording(np.cumsum(x), 100, quantity="angle")) == []


def test_rate_against_the_time_column():
    t = np.round(np.arange(5000) / 9.862, 2)
    finding = the(al.Recording(noise(5000), 10, time=t), "rate")
    assert finding.severity == "warning"
    assert finding.message.startswith("the time column says 9.862 Hz, not 10 Hz")
    assert finding.values["measured_hz"] == pytest.approx(9.862, rel=1e-5)
    assert kinds(al.Recording(noise(5000), time=t)) == []


def test_stamps_out_of_order_duplicated_and_jittering():
    t = np.arange(5000) / 100
    t[[10, 11]] = t[[11, 10]]
    t[100] = t[99]
    r = al.Recording(noise(5000), 100, time=t)
    assert "row 11" in the(r, "out_of_order").message
    assert the(r, "duplicate_stamps").values["count"] == 1
    t = (np.arange(5000) + np.random.default_rng(2).uniform(-0.4, 0.4, 5000)) / 100
    assert the(al.Recording(noise(5000), time=t), "jitter").values["rms_s"] == pytest.approx(
        3.27e-3, rel=0.05
    )


def test_coarse_stamps_and_guessed_units():
    r = al.Recording(noise(5000), 5, time=np.floor(np.arange(5000) / 5))
    assert "1 s" in the(r, "coarse_time").message
    assert r.gaps == 0
    r = al.Recording(noise(5000), time=np.arange(5000) * 10)
    assert "ms" in the(r, "time_unit").message


def test_gaps():
    keep = np.ones(5000, dtype=bool)
    keep[200:260] = False
    t = np.arange(5000)[keep] / 100
    r = al.Recording(noise(5000)[keep], time=t)
    assert the(r, "gaps").values == {"count": 1, "missing": 60, "longest": 60, "row": 199}
    assert the(r, "missing").values["count"] == 60


@pytest.mark.parametrize("step", [0.05, 0.00333, 1.0])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("offset", [0.0, -1.0156])
def test_the_step_of_the_samples(step, kind, offset):
    x = (np.round(noise() * 3) * step + offset).astype(kind)
    assert the(al.Recording(x, 100), "quantisation").values["step"] == pytest.approx(step, rel=1e-4)


def test_integers_and_coarse_rounding():
    r = al.Recording(np.round(noise() * 0.5).astype(np.int32) * 7, 100)
    finding = the(r, "quantisation")
    assert finding.values["step"] == 7
    # Rounding contributes 1/12 of a step²; the samples have 1/4 + 1/12.
    assert finding.values["share"] == pytest.approx(0.25, abs=0.03)


@pytest.mark.parametrize("mean", [0.0, 0.13, 0.25, 0.37, 0.5])
def test_what_rounding_adds_is_said_while_it_is_true(mean):
    """In units of the step. The standard error of the variance of 20 000 samples is 1 %; four of these are allowed."""
    for ratio in (1.0, 2.0, 2.5, 3.0, 4.0, 8.0):
        x = np.round(mean + noise() / ratio)
        if x.std() == 0.0:
            continue
        found = [f for f in al.Recording(x, 100).audit if f.kind in ("quantisation", "locked")]
        if ratio <= 2.0:
            assert x.var() == pytest.approx(1 / ratio**2 + 1 / 12, rel=0.03 + 0.04)
            assert "adds" in found[0].message
        else:
            # A few samples of another code are outliers, not a step.
            words = ("deformed", "hides the noise")
            assert all(f.severity == "warning" for f in found)
            assert all(any(word in f.message for word in words) for f in found)
            assert found or ratio == 8.0


@pytest.mark.parametrize(
    ("mean", "sigma", "offset"), [(0.4, 0.03, 0.0), (0.45, 0.1, 2.0), (0.5, 0.1, 0.013)]
)
def test_two_codes_are_a_resolution_too(mean, sigma, offset):
    x = np.round(mean + sigma * noise()) * 0.0981 + offset
    assert np.unique(x).size == 2
    few = max(x.mean() - offset, 0.0981 - x.mean() + offset) > 0.95 * 0.0981
    finding = the(al.Recording(x, 50), "locked" if few else "quantisation")
    assert finding.values["step"] == pytest.approx(0.0981, rel=1e-6)
    assert finding.severity == "warning"
    assert ("hides the noise" if few else "deformed") in finding.message


@pytest.mark.parametrize("value", [7.0, 0.0, -999.0])
@pytest.mark.parametrize("rows", [[500], [77, 5000], range(400, 19_000, 1500)])
def test_odd_samples_of_a_dead_column_are_no_resolution(value, rows):
    x = np.full(20_000, 0.24)
    x[list(rows)] = value
    several = value == 7.0 and len(rows) > 2  # they may be flips of a coarse sensor
    assert ("locked" in kinds(al.Recording(x, 50))) == several


def test_a_status_is_no_resolution():
    x = np.repeat(np.random.default_rng(2).integers(0, 2, 100), 200).astype(float)
    assert "quantisation" not in kinds(al.Recording(x, 50))


def test_two_codes_of_a_real_accelerometer(data):
    log = data("logs/static.csv")
    audit = al.read(log, rate=50, unit="deg/s,g").audit
    coarse = [
        f.column for f in audit if f.kind in ("quantisation", "locked") and f.severity == "warning"
    ]
    assert coarse == ["acc_x", "acc_y", "acc_z"]


def test_clipping():
    finding = the(al.Recording(np.minimum(noise(), 1.5), 100), "clipping")
    assert finding.values["value"] == 1.5
    assert (
        kinds(al.Recording(np.clip(np.round(noise() * 20), -40, 1000), 100)).count("clipping") == 1
    )


def test_held_and_stuck():
    finding = the(al.Recording(np.repeat(noise(5000), 4), 400), "repeats")
    assert finding.values["share"] == 0.75
    assert "100 Hz" in finding.message
    x = noise()
    x[5000:5100] = x[5000]
    finding = the(al.Recording(x, 100), "stuck")
    assert (finding.values["start_s"], finding.values["count"]) == (50.0, 100)
    assert kinds(al.Recording(np.ones(1000), 100)) == ["constant"]


def test_outliers():
    x = noise()
    x[[77, 5000]] += [30, -25]
    finding = the(al.Recording(x, 100), "outliers")
    assert finding.values["count"] == 2
    assert finding.values["time_s"] == 0.77
    assert "2 outliers" in finding.message


def test_a_stretch_that_is_not_static():
    x = noise(100_000)
    x[30_000:33_000] *= 10
    finding = the(al.Recording(x, 100), "not_static")
    assert finding.values["start_s"] == pytest.approx(300, abs=5)
    assert finding.values["end_s"] == pytest.approx(330, abs=5)


@pytest.mark.parametrize("share", [0.5, 0.51, 0.525, 0.6])
def test_blocks_in_a_gap_have_no_activity(share):
    x = noise(12_000)
    x[3000 : 3000 + int(share * x.size)] = np.nan
    assert "not_static" not in kinds(al.Recording(x, 100))
    # Motion is found beside the gap, and the gap is no quiet segment.
    x[11_000:11_500] *= 5
    finding = the(al.Recording(x, 100), "not_static")
    assert finding.values["start_s"] == pytest.approx(110, abs=4)
    assert ".trim(0:" in finding.message


@pytest.mark.parametrize(
    ("loud", "kept"),
    [
        ([(0, 10_050)], (100.5, 1000)),
        ([(90_000, 100_000)], (0, 900)),
        ([(30_000, 33_000), (90_000, 91_000)], (330, 900)),
    ],
)
def test_the_remedy_for_motion_is_the_longest_stretch_without(loud, kept):
    x = noise(100_000)
    for first, last in loud:
        x[first:last] *= 100
    recording = al.Recording(x, 100)
    remedy = re.search(r"\.trim\(([\d.]+):([\d.]+)\)", the(recording, "not_static").message)
    start, end = map(float, remedy.groups())
    assert kept[0] <= start <= kept[0] + 6
    assert kept[1] - 6 <= end <= kept[1]
    left = recording.trim(start, end)
    assert "not_static" not in kinds(left)
    # Nothing of the motion is left at the ends.
    assert np.abs(left.samples).max() < 6


def test_a_remedy_that_would_be_refused_is_not_given():
    x = noise(190_000)
    x[1000:189_000] = np.nan
    told = the(al.Recording(x, 100), "missing").message
    assert "loses more than half of its differences" in told
    assert "decimate" not in told


def test_it_is_found_once():
    r = al.Recording(np.minimum(noise(), 1.5), 100)
    assert r.audit[0] is r.audit[0]


def test_findings_are_json():
    d = the(al.Recording(np.minimum(noise(), 1.5), 100, columns=["wx"]), "clipping").to_dict()
    assert d["kind"] == "clipping"
    assert d["column"] == "wx"
    assert d["value"] == 1.5


# -- real recordings -----------------------------------------------------------------------------


@pytest.mark.data
def test_real_time_column_of_a_10_hz_log(data):
    assert "9.862 Hz, not 10" in the(al.read(data("hfi_10hz.npz")), "rate").message


@pytest.mark.data
def test_real_print_step_of_a_phone(data):
    steps = [f for f in al.read(data("phone_gyro_b.npz")).audit if f.kind == "quantisation"]
    assert [f.values["step"] for f in steps] == pytest.approx([0.001] * 3, rel=1e-4)


@pytest.mark.slow
@pytest.mark.data
def test_real_steps_of_an_adis16405(data):
    steps = [f for f in al.read(data("adis16405_imu1.npz")).audit if f.kind == "quantisation"]
    assert [f.values["step"] for f in steps] == pytest.approx([0.05] * 3 + [0.00333] * 3, rel=1e-3)


@pytest.mark.data
def test_real_outliers_of_an_mtig(data):
    finding = the(al.read(data("mtig_gyrox_contaminated.npz")), "outliers")
    assert finding.severity == "warning"
    assert finding.values["count"] > 100


def test_heavy_tails_are_no_outliers():
    rng = np.random.default_rng(0)
    for samples in (rng.standard_t(3, 50_000), rng.laplace(size=50_000)):
        findings = {f.kind: f for f in al.Recording(samples, 100).audit}
        assert "outliers" not in findings
        assert "heavy_tails" in findings
    assert "heavy_tails" not in {
        f.kind for f in al.Recording(rng.standard_normal(50_000), 100).audit
    }


def dropped(columns=1):
    """Three samples in a thousand are missing at random, as on a serial link."""
    rng = np.random.default_rng(3)
    there = np.sort(rng.permutation(40_000)[:-120])
    x = rng.standard_normal((there.size, columns))
    names = [f"g{letter}" for letter in "xyz"[:columns]]
    return al.Recording(x, time=there / 200.0, unit="deg/s", columns=names)


def test_dropped_samples_are_one_remark_of_all_axes_with_what_to_do():
    recording = dropped(3)
    (told,) = [f for f in merged(recording.audit) if f.kind == "missing"]
    assert told.message.startswith(
        "gx, gy, gz: 120 samples are NaN (0.30 %). The fit uses all other"
    )
    assert "loses more than half of its differences beyond" in told.message
    assert told.message.endswith("; for its curve use .decimate(20)")
    assert len([f for f in recording.audit if f.kind == "missing"]) == 3


def test_a_gap_of_a_phase_counts_samples_not_differences():
    x = np.cumsum(np.random.default_rng(3).standard_normal(2400)) * 1e-9
    there = np.r_[:1000, 1400:2400]
    found = al.Recording(x[there], time=there.astype(float), time_unit="s", quantity="angle").audit
    (gap,) = [f for f in found if f.kind == "gaps"]
    (missing,) = [f for f in found if f.kind == "missing"]
    assert "400 samples missing" in gap.message
    assert "400 samples are NaN (16.67 %)" in missing.message
    assert missing.values["count"] == 400


def test_averaged_samples_have_no_doubts_of_the_rate_or_of_averaging():
    coarse = dropped().decimate(20)
    assert coarse.rate == 10
    assert {f.kind for f in coarse.audit} == {"gaps"}
    assert "decimate" not in str(coarse.oadev())
    assert "decimate" in str(dropped().oadev())


def test_one_long_gap_needs_no_averaging():
    t = np.arange(20_000) / 100.0
    t = np.concatenate([t[:9000], t[9000:] + 3.0])
    told = al.Recording(noise(t.size), time=t, unit="deg/s")
    assert "decimate" not in str(told.oadev())


@pytest.mark.parametrize("share", [0.003, 0.02, 0.2])
def test_remarks_on_gaps_agree(share):
    """The audit and the deviation say the same about the curve."""
    rng = np.random.default_rng(int(1000 * share))
    there = np.sort(rng.permutation(20_000)[: round(20_000 * (1 - share))])
    recording = al.Recording(rng.standard_normal(there.size), time=there / 100.0, unit="deg/s")
    message = the(recording, "missing").message
    beyond = float(message.split("differences beyond ")[1].split(" s")[0])
    curve = recording.oadev(taus="all")
    lost = curve.lost / (curve.n + curve.lost)
    first = float(curve.tau[np.flatnonzero(lost > 0.5)[0]])
    # Printed to three figures.
    assert beyond == pytest.approx(first - 0.01, rel=0.005, abs=1e-9)
    assert any(f"from τ = {first:g} s on" in note for note in curve.diagnostics)


@pytest.mark.parametrize("at", [1, 777, 262_143, 262_144, 299_000])
def test_one_event_that_makes_most_of_the_allan_variance_is_told(at):
    rng = np.random.default_rng(1)
    x = rng.standard_normal(300_000)
    x[at] += 2000.0
    found = the(al.Recording(x, 100.0, unit="deg/s"), "dominated")
    assert found.severity == "warning"
    # Of an event in the first or the last average one change is seen.
    assert found.values["time_s"] == pytest.approx(at / 100.0, abs=2 * found.values["tau_s"])
    assert found.values["share"] > 0.9


def test_a_step_makes_the_allan_variance_at_long_times():
    x = np.random.default_rng(1).standard_normal(50_000)
    x[23_456:] += 0.5
    found = the(al.Recording(x, 100.0, unit="deg/s"), "dominated")
    assert found.values["tau_s"] > 1.0
    assert "dominated" not in {f.kind for f in al.Recording(x[:20_000], 100.0).audit}


@pytest.mark.slow
def test_no_event_dominates_noise():
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x = rng.standard_t(4, 5000) if seed % 3 == 0 else rng.standard_normal(5000)
        recording = al.Recording(np.cumsum(x) if seed % 3 == 1 else x, 100.0)
        assert "dominated" not in {f.kind for f in recording.audit}


@pytest.mark.parametrize("k", [2, 3, 5, 10])
def test_values_that_were_smoothed(k):
    x = np.convolve(np.random.default_rng(k).standard_normal(20_000), np.ones(k) / k, "valid")
    found = the(al.Recording(x, 100.0, unit="deg/s"), "smoothed")
    assert found.severity == "info"
    assert found.values["share"] < 0.2


def test_values_that_were_not_smoothed():
    for seed in range(40):
        rng = np.random.default_rng(seed)
        x = rng.standard_normal(8000) + rng.uniform(0, 1) * np.cumsum(rng.standard_normal(8000))
        if seed % 4 == 1:
            x = np.cumsum(rng.standard_normal(8000))
        elif seed % 4 == 2:
            x = np.round(x)
        elif seed % 4 == 3:
            # A line, and a resonance of the mounting.
            x = rng.standard_normal(8000)
            x = x + lfilter([0.5], [1, -1.2, 0.9], rng.standard_normal(8000))
            x = x + 3 * np.sin(np.arange(8000) * rng.uniform(0.3, 2.5))
        assert "smoothed" not in {f.kind for f in al.Recording(x, 100.0).audit}, seed


@pytest.mark.parametrize("step", [0.0, 1e-3])
def test_a_dead_zone_is_no_heavy_tail(step):
    """Values below the zone are written as 0: 38 % of the samples."""
    white = 0.02 * np.random.default_rng(5).standard_normal(20_000)
    samples = np.sign(white) * np.maximum(np.abs(white) - 0.01, 0.0)
    samples = np.round(samples / step) * step if step else samples
    [finding] = al.Recording(samples, 10.0, unit="deg/s").audit
    assert (finding.kind, finding.severity) == ("dead_zone", "warning")
    assert str(finding.values["value"]) == "0.0"
    assert finding.values["share"] == pytest.approx(0.383, abs=0.02)


def test_a_log_with_a_dead_band_is_no_slow_sensor():
    """Every second sample repeats the one before, because the change is below the dead band."""
    white = 0.02 * np.random.default_rng(6).standard_normal(8000)
    written = [0.0]
    for value in white[1:]:
        written.append(value if abs(value - written[-1]) > 0.02 else written[-1])
    record = al.Recording(np.array(written), 10.0, unit="deg/s")
    [finding] = record.audit
    assert (finding.kind, finding.severity) == ("dead_band", "warning")
    assert finding.values["band"] == pytest.approx(0.02, rel=0.01)
    fit = al.fit_model(record, "N")
    assert fit.recording.n == 8000
    assert not fit.adequate
    assert "dead band" in fit.distortion
    assert "a dead zone or dead band distorts the samples" in str(al.export(fit, "kalibr"))


@pytest.mark.parametrize("law", ["laplace", "coarse", "walk", "polled", "square"])
def test_other_values_are_not_distorted(law):
    rng, n = np.random.default_rng(7), 20_000
    samples = {
        "laplace": lambda: np.round(rng.laplace(size=n), 1),
        "coarse": lambda: np.round(rng.normal(0.0, 0.6, n)),
        "walk": lambda: np.round(np.cumsum(rng.normal(0.0, 0.01, n)) + rng.normal(0.0, 0.4, n)),
        "polled": lambda: np.round(rng.normal(size=n), 2)[(0.3 * np.arange(n)).astype(int)],
        "square": lambda: np.sign(np.sin(0.07 * np.arange(n))) + rng.normal(0.0, 0.01, n).round(3),
    }[law]()
    kinds = {finding.kind for finding in al.Recording(samples, 10.0, unit="deg/s").audit}
    assert not kinds & {"dead_zone", "dead_band"}
