"""Data sheets: ratios, and the mistakes of REFERENCE's student simulator made loud."""

import json
import math
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

import allanite as al


@dataclass
class FakeFit:
    """What `compare_datasheet` uses of a fit."""

    unit: str = "deg/s"
    rate: float = 100.0
    estimates: dict = field(default_factory=dict)

    @property
    def recording(self):
        return SimpleNamespace(unit=self.unit, columns=("gyro_x",), rate=self.rate)

    def __getitem__(self, name):
        return self.estimates[name]


def sheet(tmp_path, text, name="sheet.toml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return al.read_datasheet(path)


def fit(n, error=0.005):
    """N given in deg/√h, known to 0.5 %."""
    value = n / 60
    return FakeFit(
        estimates={
            "N": al.Estimate(
                value,
                value * error,
                (value * (1 - 2 * error), value * (1 + 2 * error)),
                "deg/s·s^½",
                name="N",
            )
        }
    )


def only(comparison):
    (row,) = comparison.rows
    return row


def test_a_density_is_one_sided_unless_it_says_otherwise(tmp_path):
    # 0.03 deg/s/√Hz is 1.8 deg/√h two-sided, 1.27 one-sided (REFERENCE 5.6).
    row = only(
        al.compare_datasheet(
            fit(1.2728), sheet(tmp_path, '[figures]\nnoise_density = "0.03 deg/s/√Hz"')
        )
    )
    assert row.ratio == pytest.approx(1, rel=1e-4)
    assert row.remark == ""
    row = only(
        al.compare_datasheet(
            fit(1.8), sheet(tmp_path, '[figures]\nnoise_density = "0.03 deg/s/√Hz two-sided"')
        )
    )
    assert row.ratio == pytest.approx(1, rel=1e-4)


@pytest.mark.parametrize(
    ("measured", "figure", "words"),
    [
        (
            1.8,
            'angle_random_walk = "0.03 deg/√h"',
            "density in deg/s/√Hz was read as a random walk",
        ),
        (1.2728, 'angle_random_walk = "0.03 deg/√h"', "one-sided density in deg/s/√Hz was read"),
        (1.8, 'noise_density = "0.03 deg/s/√Hz"', "two-sided density was read as one-sided"),
        (
            1.2728,
            'noise_density = "0.03 deg/s/√Hz two-sided"',
            "one-sided density was read as two-sided",
        ),
        (0.03, 'noise_density = "0.03 deg/s/√Hz two-sided"', "60 times smaller"),
        (math.pi / 180, 'angle_random_walk = "1 deg/√h"', "degrees were taken for radians"),
    ],
)
def test_slips_are_named(tmp_path, measured, figure, words):
    comparison = al.compare_datasheet(fit(measured), sheet(tmp_path, f"[figures]\n{figure}"))
    assert words in only(comparison).remark
    assert f"! {only(comparison).figure.name}: looks as if" in str(comparison)


@pytest.mark.parametrize("factor", [0.8, 0.95, 1.0, 1.1, 1.25, 2.0, 5.0, 20.0])
def test_ordinary_disagreement_is_not_called_a_slip(tmp_path, factor):
    row = only(al.compare_datasheet(fit(factor), sheet(tmp_path, '[figures]\narw = "1 deg/√h"')))
    assert row.remark == ""
    assert row.ratio == pytest.approx(factor)
    assert row.ratio.interval == pytest.approx((0.99 * factor, 1.01 * factor))


def test_a_sheet_that_contradicts_itself(tmp_path):
    remarks = sheet(
        tmp_path, '[figures]\nnoise_density = "0.03 deg/s/√Hz"\nangle_random_walk = "0.03 deg/√h"'
    ).remarks()
    assert len(remarks) == 1
    assert "contradicts itself" in remarks[0]
    assert not sheet(
        tmp_path, '[figures]\nnoise_density = "0.03 deg/s/√Hz"\nangle_random_walk = "1.273 deg/√h"'
    ).remarks()


def test_every_figure_in_its_own_unit(tmp_path):
    s = sheet(
        tmp_path,
        """
        name = "Table 2"
        [figures]
        quantization = "2e-4 deg"
        angle_random_walk = { value = 8e-3, unit = "deg/√h" }
        bias_instability = "0.1 deg/h"
        rate_random_walk = "1 deg/h^1.5"
        rate_ramp = "5 deg/h^2"
        """,
    )
    values = [figure.in_unit("deg/s") for figure in s.figures]
    expected = [2e-4, 8e-3 / 60, 0.1 / 3600, 1 / 3600**1.5, 5 / 3600**2]
    assert values == pytest.approx(expected, rel=1e-3)
    assert s.name == "Table 2"


@pytest.mark.slow
def test_in_run_stability_is_the_minimum_of_the_allan_deviation(tmp_path):
    """White noise and a random walk: the minimum, sqrt(2 N K / sqrt(3)), is inside its interval."""
    truth = al.parse_model("N(N=0.1)+K(K=0.01)")
    lowest = math.sqrt(2 * 0.1 * 0.01 / math.sqrt(3))
    s = sheet(tmp_path, f'[figures]\nin_run_bias_stability = "{lowest} deg/s"')
    inside = 0
    for seed in range(8):
        log = truth.simulate(duration=4000, rate=5, seed=seed, unit="deg/s")
        row = only(al.compare_datasheet(al.fit_model(log, "N+K"), s))
        assert row.measured.detected
        low, high = row.ratio.interval
        inside += low < 1.0 < high
    # Of 8 intervals of at least 95 %, fewer than 6 contain the truth with a probability of 0.006.
    assert inside >= 6


def test_json_and_undetected(tmp_path):
    s = sheet(tmp_path, json.dumps({"figures": {"rrw": "1 deg/h^1.5"}}), "sheet.json")
    assert s.name == "sheet"
    k = al.Estimate(0.0, 1e-6, (0.0, 2e-6), "deg/s/s^½", detected=False, name="K")
    comparison = al.compare_datasheet(FakeFit(estimates={"K": k}), s)
    text = str(comparison)
    assert "not detected" in text
    assert "< 0.432" in text
    document = json.loads(json.dumps(comparison.to_dict(), allow_nan=False))
    assert document["schema"] == "allanite/datasheet/1"
    assert document["figures"][0]["ratio"]["detected"] is False


def test_a_missing_coefficient_is_said(tmp_path):
    s = sheet(tmp_path, '[figures]\narw = "1 deg/√h"\nrrw = "1 deg/h^1.5"')
    comparison = al.compare_datasheet(fit(1.0), s)
    assert len(comparison.rows) == 1
    assert "no coefficient for rate_random_walk" in comparison.remarks[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "needs a table"),
        ("[figures", "not a data sheet"),
        ('[figures]\nspeed = "3 m/s"', "unknown figure 'speed'"),
        ("[figures]\narw = 3", "has no unit"),
        ('[figures]\narw = "many deg/√h"', "number and a unit"),
        ('[figures]\narw = "-1 deg/√h"', "positive"),
        ('[figures]\narw = "1 furlong"', "furlong"),
    ],
)
def test_bad_sheets(tmp_path, text, words):
    with pytest.raises(al.InputError, match=words) as caught:
        sheet(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_figures_of_another_sensor_are_refused(tmp_path):
    with pytest.raises(al.InputError, match="different quantities"):
        al.compare_datasheet(fit(1.0), sheet(tmp_path, '[figures]\nvrw = "1 m/s/√h"'))
    with pytest.raises(al.InputError, match="no such file"):
        al.read_datasheet(tmp_path / "absent.toml")


SENSOR = '[figures]\nnoise_density = "0.1 deg/s/√Hz two-sided"\n'


def thinned(k, cutoff=None):
    """White noise, N = 0.1 deg/s/√Hz, at 1000 Hz, filtered (first order) if asked: every k-th sample, and means of k."""
    from scipy.signal import lfilter

    x = 0.1 * np.sqrt(1000.0) * np.random.default_rng(8).standard_normal(20_000 * k)
    if cutoff is not None:
        phi = math.exp(-2 * math.pi * cutoff / 1000.0)
        x = lfilter([1 - phi], [1, -phi], x)
    whole = al.Recording(x, rate=1000.0, unit="deg/s")
    return al.Recording(x[::k], rate=1000.0 / k, unit="deg/s"), whole.decimate(k)


@pytest.mark.parametrize("k", [2, 10])
def test_samples_that_were_skipped_raise_n_by_the_root(tmp_path, k):
    s = sheet(tmp_path, SENSOR + 'sample_rate = "1000 Hz"')
    skipped, averaged = (only(al.compare_datasheet(al.fit_model(r, "N"), s)) for r in thinned(k))
    # N of 20 000 samples is known to 1/√40 000 = 0.5 %; three of these.
    assert skipped.ratio == pytest.approx(math.sqrt(k), rel=0.015)
    assert averaged.ratio == pytest.approx(1.0, rel=0.015)
    assert averaged.remark == ""
    # A factor √2 is also that of a density read with the wrong number of sides: the commoner slip is named.
    assert ("samples were skipped" if k > 2 else "read as one-sided") in skipped.remark
    plain = sheet(tmp_path, SENSOR)
    assert only(al.compare_datasheet(al.fit_model(thinned(k)[1], "N"), plain)).remark == ""


def test_a_bandwidth_above_half_the_rate_is_folded(tmp_path):
    # First order at 80 Hz into 25 Hz: √(π·80/25) = 3.17, a sharp filter √(2·80/25) = 2.53.
    s = sheet(tmp_path, SENSOR + 'bandwidth = "80 Hz"')
    assert s.folded(25.0) == pytest.approx((2.530, 3.171), rel=1e-3)
    skipped, averaged = (
        only(al.compare_datasheet(al.fit_model(r, "N"), s)) for r in thinned(40, 80.0)
    )
    assert 2.530 < skipped.ratio < 3.171 * 1.1
    assert "samples were skipped to reach 25 Hz" in skipped.remark
    assert "2.53 to 3.17" in skipped.remark
    assert averaged.remark == ""
    assert s.folded(100.0) is None
    both = sheet(tmp_path, SENSOR + 'bandwidth = "80 Hz"\nsample_rate = "100 Hz"')
    assert both.folded(25.0) == (2.0, 2.0)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.2, 2.0, 5.0])
def test_another_ratio_is_no_skipping(tmp_path, ratio):
    s = sheet(tmp_path, '[figures]\narw = "1 deg/√h"\nsample_rate = "1000 Hz"')
    # √10 = 3.16 would be.
    assert only(al.compare_datasheet(fit(ratio), s)).remark == ""


def test_a_sheet_of_frequencies_alone_is_refused(tmp_path):
    with pytest.raises(al.InputError, match="no figure to compare"):
        sheet(tmp_path, '[figures]\nbandwidth = "80 Hz"')
    with pytest.raises(al.InputError, match="Hz"):
        sheet(tmp_path, SENSOR + 'bandwidth = "80 deg"')
