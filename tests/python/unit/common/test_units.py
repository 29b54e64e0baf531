"""The table of units against pint, the slips it must make impossible, and its errors."""

import math
import time

import numpy as np
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

import allanite as al
from allanite.common.units import coefficient_unit, conversion, parse_unit, rate_unit

REGISTRY = pint.UnitRegistry()
# pint knows g as gram and has no milli-g: the accelerations are spelled out for it.
PINT_SPELLING = {
    "g": "standard_gravity",
    "mg": "1e-3*standard_gravity",
    "ug": "1e-6*standard_gravity",
    "deg/h": "deg/hour",
    "1": "dimensionless",
}


@pytest.mark.parametrize(
    "unit",
    [
        "rad/s",
        "mrad/s",
        "deg/s",
        "deg/h",
        "deg/min",
        "arcsec/s",
        "rpm",
        "m/s^2",
        "g",
        "mg",
        "ug",
        "1",
        "ppm",
    ],
)
def test_scale_agrees_with_pint(unit):
    expected = REGISTRY(PINT_SPELLING.get(unit, unit))
    si = {"angular rate": "rad/s", "acceleration": "m/s^2", "fractional frequency": "dimensionless"}
    parsed = parse_unit(unit)
    value = REGISTRY.Quantity(1.0, "dimensionless") * expected
    assert parsed.scale == pytest.approx(value.to(si[parsed.kind]).magnitude, rel=1e-12)


@pytest.mark.parametrize(
    ("ours_from", "ours_to", "pint_from", "pint_to"),
    [
        ("deg/s·s^½", "deg/sqrt(h)", "deg/s*s^0.5", "deg/hour^0.5"),
        ("rad/s·s^½", "deg/h/sqrt(Hz)", "rad/s*s^0.5", "deg/hour/hertz^0.5"),
        ("m/s^2·s^½", "µg/√Hz", "m/s^2*s^0.5", "1e-6*standard_gravity/hertz^0.5"),
        ("g·s^½", "m/s/sqrt(h)", "standard_gravity*s^0.5", "m/s/hour^0.5"),
        ("deg/s/s^½", "deg/h^1.5", "deg/s/s^0.5", "deg/hour^1.5"),
        ("deg/s/s^½", "deg/h/sqrt(h)", "deg/s/s^0.5", "deg/hour^1.5"),
        ("deg/s/s", "deg/h^2", "deg/s^2", "deg/hour^2"),
        ("mg/s", "m/s^3", "1e-3*standard_gravity/s", "m/s^3"),
        ("deg/s·s", "arcsec", "deg", "arcsec"),
        ("rad/s·s", "deg", "rad", "deg"),
        ("g·s", "m/s", "standard_gravity*s", "m/s"),
    ],
)
def test_conversion_agrees_with_pint(ours_from, ours_to, pint_from, pint_to):
    a, b = (1.0 * REGISTRY(text) for text in (pint_from, pint_to))
    assert conversion(ours_from, ours_to) == pytest.approx(
        (a / b).to("dimensionless").magnitude, rel=1e-12
    )


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("°/s", "deg/s"), ("º/s", "deg/s"), ("dps", "deg/s"), ("deg/sec", "deg/s"),
        ("Deg/s", "deg/s"),
        ("deg·s⁻¹", "deg/s"), ("deg s^-1", "deg/s"), ("°/h", "deg/h"), ("deg/hr", "deg/h"),
        ("mdps", "mdeg/s"), ("m/s²", "m/s^2"), ("m/s**2", "m/s^2"), ("m s^-2", "m/s^2"),
        ("µg", "ug"),
        ("μg", "ug"), ("radians/second", "rad/s"), (" rad / s ", "rad/s"), ("1", "1"),
    ],
)  # fmt: skip
def test_spellings(text, name):
    assert parse_unit(text).name == name


def test_the_figures_every_datasheet_mixes_up():
    # A density of 1 deg/h/√Hz is 1/60 deg/√h; 0.03 deg/s/√Hz is 1.8 deg/√h, not 0.03.
    assert conversion("deg/sqrt(h)", "deg/h/√Hz") == pytest.approx(60)
    assert 0.03 * conversion("deg/s/√Hz", "deg/√h") == pytest.approx(1.8)
    assert 0.03 * conversion("deg/s/√Hz one-sided", "deg/√h") == pytest.approx(1.8 / math.sqrt(2))
    assert conversion("deg/s·s^½", "deg/s/sqrt(Hz) one-sided") == pytest.approx(math.sqrt(2))
    assert conversion("deg/s·s^½", "deg/s/sqrt(Hz) (single-sided)") == pytest.approx(math.sqrt(2))
    assert conversion("deg/s·s^½", "deg/s/sqrt(Hz) two-sided") == pytest.approx(1)


@pytest.mark.parametrize("unit", ["rad/s", "deg/h", "m/s^2", "ug", "1"])
@pytest.mark.parametrize("power", [1, 0.5, 0, -0.5, -1])
def test_canonical_coefficient_units_are_understood(unit, power):
    spelled = coefficient_unit(unit, power)
    assert conversion(spelled, spelled) == 1.0
    seconds = {1: "·s", 0.5: "·s^½", 0: "", -0.5: "/s^½", -1: "/s"}[power]
    assert spelled == unit + seconds


@pytest.mark.parametrize(
    ("source", "target"),
    [
        ("m/s^2·s^½", "deg/sqrt(h)"),
        ("m/s^2", "deg/s"),
        ("deg/s·s^½", "deg/h"),
        ("deg/s·s^½", "deg"),
        ("deg/s", "1"),
    ],
)
def test_mixing_is_refused_and_both_are_named(source, target):
    with pytest.raises(al.InputError, match="different quantities") as caught:
        conversion(source, target)
    assert source in str(caught.value)
    assert target in str(caught.value)


@pytest.mark.parametrize(
    "text", ["MHz", "furlong", "", "deg", "deg/", "Mg", "deg/s)", "(deg/s", "s", "K", "m/s", "1/0"]
)
def test_what_is_no_unit_of_samples(text):
    with pytest.raises(al.InputError, match="unit"):
        parse_unit(text)


@pytest.mark.parametrize(
    "text", ["0 g", "150 0 µg/√Hz", "1e-200 m/s^2*1e-200", "1e999 g", "g^1e9999999", "g^1e-9999999",
             "g^" + "9" * 5000, "(" * 100_000, "sqrt" * 50_000, "g^" + "-" * 100_000],
)  # fmt: skip
def test_a_unit_is_a_number_and_read_at_once(text):
    """A scale of 0 was once divided by; other units took minutes, or as much stack as they had brackets."""
    start = time.process_time()
    for read in (parse_unit, lambda unit: conversion(unit, unit)):
        with pytest.raises(al.InputError, match="unknown unit"):
            read(text)
    assert time.process_time() - start < 1.0


def test_an_unknown_unit_is_named_once():
    with pytest.raises(al.InputError) as said:
        parse_unit("furlong")
    assert str(said.value).startswith("unknown unit 'furlong'; use one of rad/s")


def test_one_sided_is_for_densities():
    with pytest.raises(al.InputError, match="density"):
        conversion("deg/s", "deg/h one-sided")


def test_increments_and_angles_name_the_unit_of_their_rate():
    assert rate_unit("deg", "increment").name == "deg/s"
    assert rate_unit("rad", "angle").name == "rad/s"
    assert rate_unit("m/s", "increment").name == "m/s^2"
    assert rate_unit("s", "angle").name == "1"
    assert rate_unit("1", "angle").name == "1"


UNITS = st.sampled_from(
    ["rad", "mrad", "deg", "arcsec", "m", "g", "mg", "ug", "s", "ms", "h", "Hz"]
)
TERMS = st.lists(
    st.tuples(UNITS, st.sampled_from([-2, -1.5, -1, -0.5, 0.5, 1, 2])), min_size=1, max_size=4
)


@pytest.mark.slow
@given(TERMS, st.sampled_from(["·", "*", " "]))
def test_conversions_are_reciprocal_and_spelling_does_not_matter(terms, times):
    first = times.join(f"{u}^({p})" for u, p in terms)
    other = "·".join(f"{u}^{p}" for u, p in reversed(terms))
    assert conversion(first, other) == pytest.approx(1.0, rel=1e-12)
    thousand = other.replace("rad", "mrad").replace("mmrad", "mrad")
    assert conversion(first, thousand) * conversion(thousand, first) == pytest.approx(
        1.0, rel=1e-12
    )


@pytest.mark.parametrize(
    "text",
    ["m/s2", "m/s**2", "m/s/s", "m s^-2", "m s-2", "m·s⁻²", "m/sec2", "m/s²", "mps2", "mpss"],
)
def test_an_acceleration_as_headers_write_it(text):
    assert parse_unit(text).name == "m/s^2"


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("°/s/rt(Hz)", "deg/s/sqrt(Hz)"), ("deg/rt-hr", "deg/sqrt(h)"), ("deg/root-hour", "deg/sqrt(h)"),
        ("deg/rtHz", "deg/sqrt(Hz)"), ("deg/s/square root Hz", "deg/s/sqrt(Hz)"), ("ft/s²", "ft/s^2"),
        ("micro-g/√Hz", "ug/sqrt(Hz)"), ("milli-g", "mg"), ("microrad/s", "urad/s"), ("Hz/10 MHz", "1e-7"),
        ("Hz/10MHz", "1e-7"), ("Hz/1e7", "1e-7"), ("Hz/(1e7 Hz)", "1e-7"), ("1/65.5 deg/s", "deg/s/65.5"),
    ],
)  # fmt: skip
def test_data_sheets_and_counters_as_they_write_it(text, plain):
    assert conversion(text, plain) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "what"), [("arcsec", "angle"), ("m/s", "velocity"), ("s", "time")]
)
def test_what_is_an_integral_says_so(text, what):
    with pytest.raises(
        al.InputError, match=f"unit of an? {what}.* add quantity=angle or quantity="
    ):
        parse_unit(text)
    with pytest.raises(al.InputError, match="for a counter in Hz write Hz/10MHz"):
        parse_unit("Hz")


@pytest.mark.parametrize("text", ["dps", "deg/sec", "degps", "°/s", "deg s^-1", "deg s-1"])
def test_a_rate_as_headers_write_it(text):
    assert parse_unit(text).name == "deg/s"


@pytest.mark.parametrize(
    ("text", "name", "tesla"),
    [("uT", "uT", 1e-6), ("µT", "uT", 1e-6), ("nT", "nT", 1e-9), ("mgauss", "mgauss", 1e-7)],
)
def test_units_of_magnetometers(text, name, tesla):
    unit = parse_unit(text)
    assert (unit.name, unit.kind) == (name, "magnetic field")
    assert unit.scale == pytest.approx(tesla, rel=1e-12)


def test_a_magnetic_field_is_no_acceleration():
    assert parse_unit("G").kind == "acceleration"  # written for standard gravity, never for gauss
    assert conversion("nT/sqrt(Hz)", "uT/sqrt(Hz)") == pytest.approx(1e-3)
    with pytest.raises(al.InputError, match="different quantities"):
        conversion("uT", "g")


def test_a_magnetometer_is_fitted():
    """A column of a magnetometer in µT has noise coefficients in µT."""
    x = 0.1 * np.random.default_rng(1).standard_normal((2000, 2))
    log = al.Recording(x, rate=10.0, unit="µT", columns=["mag_x", "mag_y"])
    text = str(al.characterize(log, "N"))
    assert "magnetometer" in text
    assert "µT/√Hz" in text
    fit = al.fit_model(log["mag_x"], "N")
    assert fit["N"].value == pytest.approx(0.1 / np.sqrt(10.0), rel=0.1)
