"""Data sheets: ratios, and the mistakes of REFERENCE's student simulator made loud."""

import json
import math
import sys
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from allanite.datasheet import compare_datasheet, read_datasheet
from allanite.errors import InputError
from allanite.parameters import Estimate


@dataclass
class FakeFit:
    """What `compare_datasheet` uses of a fit."""

    unit: str = "deg/s"
    estimates: dict = field(default_factory=dict)

    @property
    def recording(self):
        return SimpleNamespace(unit=self.unit, columns=("gyro_x",))

    def __getitem__(self, name):
        return self.estimates[name]


def sheet(tmp_path, text, name="sheet.toml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return read_datasheet(path)


def fit(n, error=0.005):
    """N given in deg/√h, known to 0.5 %."""
    value = n / 60
    return FakeFit(
        estimates={
            "N": Estimate(
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
        compare_datasheet(
            fit(1.2728), sheet(tmp_path, '[figures]\nnoise_density = "0.03 deg/s/√Hz"')
        )
    )
    assert row.ratio == pytest.approx(1, rel=1e-4)
    assert row.remark == ""
    row = only(
        compare_datasheet(
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
    comparison = compare_datasheet(fit(measured), sheet(tmp_path, f"[figures]\n{figure}"))
    assert words in only(comparison).remark
    assert f"! {only(comparison).figure.name}: looks as if" in str(comparison)


@pytest.mark.parametrize("factor", [0.8, 0.95, 1.0, 1.1, 1.25, 2.0, 5.0, 20.0])
def test_ordinary_disagreement_is_not_called_a_slip(tmp_path, factor):
    row = only(compare_datasheet(fit(factor), sheet(tmp_path, '[figures]\narw = "1 deg/√h"')))
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


def test_in_run_stability_is_the_minimum_of_the_allan_deviation(tmp_path, monkeypatch):
    curve = SimpleNamespace(
        tau=[1, 2, 4, 8],
        deviation=[3.0, 2.0, 2.5, 1.0],
        edf=[90, 40, 20, 3],
        low=[2.9, 1.8, 2, 0.2],
        high=[3.1, 2.2, 3, 9],
    )
    module = SimpleNamespace(oadev=lambda recording, taus: curve)
    monkeypatch.setitem(sys.modules, "allanite.deviation", module)
    s = sheet(tmp_path, '[figures]\nin_run_bias_stability = "2 deg/s"')
    row = only(compare_datasheet(fit(1.0), s))
    # The lowest point at 3 degrees of freedom is chance.
    assert row.measured == 2.0
    assert row.ratio.interval == pytest.approx((0.9, 1.1))


def test_json_and_undetected(tmp_path):
    s = sheet(tmp_path, json.dumps({"figures": {"rrw": "1 deg/h^1.5"}}), "sheet.json")
    assert s.name == "sheet"
    k = Estimate(0.0, 1e-6, (0.0, 2e-6), "deg/s/s^½", detected=False, name="K")
    comparison = compare_datasheet(FakeFit(estimates={"K": k}), s)
    text = str(comparison)
    assert "not detected" in text
    assert "< 0.432" in text
    document = json.loads(json.dumps(comparison.to_dict(), allow_nan=False))
    assert document["schema"] == "allanite/datasheet/1"
    assert document["figures"][0]["ratio"]["detected"] is False


def test_a_missing_coefficient_is_said(tmp_path):
    s = sheet(tmp_path, '[figures]\narw = "1 deg/√h"\nrrw = "1 deg/h^1.5"')
    comparison = compare_datasheet(fit(1.0), s)
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
    with pytest.raises(InputError, match=words) as caught:
        sheet(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_figures_of_another_sensor_are_refused(tmp_path):
    with pytest.raises(InputError, match="different quantities"):
        compare_datasheet(fit(1.0), sheet(tmp_path, '[figures]\nvrw = "1 m/s/√h"'))
    with pytest.raises(InputError, match="no such file"):
        read_datasheet(tmp_path / "absent.toml")
