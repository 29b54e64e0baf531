"""Units, numbers and durations as figures print them."""

import pytest

from allanite.common.numbers import duration_text
from allanite.plots.words import density_unit, label_in_unit, number, unit_text


@pytest.mark.parametrize(
    ("unit", "printed"),
    [
        ("rad/s", "rad/s"),
        ("deg/s", "°/s"),
        ("deg/h", "°/h"),
        ("m/s^2", "m/s²"),
        ("ug", "µg"),
        ("mdeg/s", "m°/s"),
        ("rad/s·s^½", "rad/√s"),
        ("rad/s/s^½", "rad/s/√s"),
        ("deg/s·s", "°"),
        ("rad/s/s", "rad/s²"),
        ("m/s^2·s^½", "m/s/√s"),
        ("mg·s^½", "mg·√s"),
        ("deg/h·s^½", "°/h·√s"),
        ("deg/h/s^½", "°/h/√s"),
    ],
)
def test_units_as_printed(unit, printed):
    assert unit_text(unit) == printed
    # What is printed means the same: the parser of units reads it back.
    from allanite.common.units import conversion

    assert conversion(unit, printed) == pytest.approx(1.0)


def test_densities_and_axis_labels():
    assert density_unit("deg/s") == "(°/s)²/Hz"
    assert density_unit("mg") == "mg²/Hz"
    assert density_unit("1") == "1/Hz"
    assert label_in_unit("Allan deviation", "1") == "Allan deviation"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0126, "0.0126"), (1.9e-5, "1.9·10⁻⁵"), (12345.0, "12300"), (-2.0, "−2"), (1e-7, "10⁻⁷")],
)
def test_numbers(value, text):
    assert number(value) == text


def test_durations():
    assert [duration_text(s) for s in (40.0, 600.0, 7200.0, 3 * 86400.0)] == [
        "40 s",
        "10 min",
        "2 h",
        "3 d",
    ]
