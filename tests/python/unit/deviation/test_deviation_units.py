"""In which unit a deviation is told: that of the samples, or of their integral."""

import numpy as np
import pytest

import allanite as al
from allanite.common.printing import printed

KINDS = [
    "oadev",
    "adev",
    "mdev",
    "hdev",
    "ohdev",
    "pdev",
    "totdev",
    "mtotdev",
    "htotdev",
    "theo1",
    "theoh",
]
OF_THE_PHASE = ["tdev", "ttotdev", "tierms", "mtie"]


def record(unit):
    x = np.random.default_rng(3).standard_normal(500)
    return al.Recording(x, rate=10.0, unit=unit)


@pytest.mark.parametrize(
    ("unit", "integral"),
    [
        ("deg/s", "deg"),
        ("rad/s", "rad"),
        ("m/s^2", "m/s"),
        ("deg/h", "deg/h·s"),
        ("1", "s"),
        ("g", "g·s"),
    ],
)
@pytest.mark.parametrize("kind", OF_THE_PHASE)
def test_deviations_of_the_phase_are_in_the_integral_of_the_rate(kind, unit, integral):
    curve = getattr(al, kind)(record(unit))
    assert curve.unit == unit
    assert curve.deviation_unit == integral
    assert f"{kind} ({printed(integral)})" in str(curve).splitlines()[0]
    assert repr(curve).endswith(f"in {integral})")
    assert curve.to_dict()["unit"] == integral


@pytest.mark.parametrize("kind", KINDS)
def test_the_others_are_in_the_unit_of_the_samples(kind):
    curve = getattr(al, kind)(record("deg/s"))
    assert curve.deviation_unit == "deg/s"
    assert curve.to_dict()["unit"] == "deg/s"


@pytest.mark.parametrize("kind", ["oadev", "tdev", "tierms", "mtie"])
def test_an_interval_is_only_spoken_of_where_there_is_one(kind, tmp_path):
    pytest.importorskip("matplotlib")
    curve = getattr(al, kind)(record("deg/s"))
    known = kind in ("oadev", "tdev")
    assert curve.has_interval == known
    assert ("95 % interval" in str(curve)) == known
    assert ("no interval is known" in str(curve)) != known
    figure = curve.plot(tmp_path / "figure.svg")
    svg = (tmp_path / "figure.svg").read_text()
    assert ("± 95 %" in svg) == known
    assert figure.panels[0].y.label.endswith("(°/h)" if kind == "oadev" else "(°)")


@pytest.mark.parametrize("kind", [*KINDS, *OF_THE_PHASE])
def test_docstrings_say_unit_errors_and_source(kind):
    told = getattr(al, kind).__doc__
    assert "Returns\n" in told
    assert "Raises\n" in told
    assert "InputError" in told
    assert "TooShortError" in told
    assert any(source in told for source in ("NIST SP 1065 eq", "ITU-T G.810", "et al. 2016 eq"))
    unit = (
        "the unit of the rate times s (deg of deg/s"
        if kind in OF_THE_PHASE
        else "the unit of the rate"
    )
    assert unit in told


def test_the_table_lists_the_deviation_first_in_plain_numbers():
    lines = str(al.oadev(record("deg/h"))).splitlines()
    assert lines[1].split() == ["tau", "(s)", "oadev", "low", "high", "edf", "n"]
    curve = al.oadev(record("deg/h"))
    tau, deviation, low, high, _, n = lines[2].split()
    assert float(tau) == curve.tau[0]
    assert int(n) == curve.n[0]
    for text, value in (
        (deviation, curve.deviation[0]),
        (low, curve.low[0]),
        (high, curve.high[0]),
    ):
        assert float(text) == pytest.approx(value, rel=5e-3)
    assert not any("e+" in line or "e-" in line for line in lines)
