"""Units of tables: a data sheet's, or relatives of the unit that was asked for; every spelling of it."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

import allanite as al
from allanite.cli import cli
from allanite.cli.output import wrapped_to_terminal
from allanite.common.numbers import (
    harmonics_text,
    log10_probability_text,
    numbers_text,
    p_text,
    trials_text,
)
from allanite.common.printing import REQUESTED_UNITS, printed, sample_unit, table_unit
from allanite.common.units import conversion, parse_unit
from allanite.fit.table import misfit_line, parameter_rows


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("deg/sqrt(h)", "deg/h"), ("°/√h", "deg/h"), ("deg/√hr", "deg/h"), ("°/h/√h", "deg/h"),
        ("deg/s/√Hz", "deg/s"), ("dps/√Hz", "deg/s"), ("mdps/sqrt(Hz)", "mdeg/s"),
        ("rad/s/sqrt(Hz)", "rad/s"), ("ug/sqrt(Hz)", "ug"), ("µg/√Hz", "ug"), ("m/s/√h", "m/s^2"),
        ("m/s/sqrt(h)", "m/s^2"), ("deg/h^2", "deg/h"), ("deg/h", "deg/h"), ("mg", "mg"), ("1", "1"),
        ("mm/s/√s", "mm/s^2"), ("mm/s²/√Hz", "mm/s^2"), ("mgal/√Hz", "m/s^2"), ("µrad/√s", "urad/s"),
        ("dph/√Hz", "deg/h"), ("√s", "1"), ("ppb", "ppb"),
    ],
)  # fmt: skip
def test_units_of_coefficients_lead_to_those_of_samples(text, expected):
    assert sample_unit(text) == expected


def test_what_is_no_unit_is_refused():
    for text in ("parsec", "deg/m", "m/s/sqrt"):
        with pytest.raises(al.InputError, match=r"unit"):
            sample_unit(text)


@pytest.mark.parametrize("sample", ["deg/h", "deg/s", "rad/s", "mg", "m/s^2", "ug"])
@pytest.mark.parametrize("power", [1.0, 0.5, 0.0, -0.5, -1.0])
def test_relatives_have_the_dimension(sample, power):
    token = REQUESTED_UNITS.set({parse_unit(sample).kind: sample})
    try:
        unit = table_unit(sample, power, {})
    finally:
        REQUESTED_UNITS.reset(token)
    root = {1.0: "s", 0.5: "sqrt(s)", 0.0: "1", -0.5: "1/sqrt(s)", -1.0: "1/s"}[power]
    factor = conversion(f"({sample})*{root}", unit)
    # Per hour instead of per second: 60^(2·power); the number is the same where no hour is in it.
    assert factor == pytest.approx(3600.0**-power if sample == "deg/h" and power else 1.0)
    assert parse_unit(sample)


def test_printed():
    assert printed("deg/sqrt(h)") == "°/√h"
    assert printed("ug/sqrt(Hz)") == "µg/√Hz"
    assert printed("deg/h^2") == "°/h²"
    assert printed("rad/s/sqrt(s)") == "rad/s/√s"
    assert printed("s^(1/2)") == "√s"


@pytest.fixture
def log(tmp_path):
    recording = al.parse_model("N(N=0.01)+K(K=1e-3)").simulate(
        n=20_000, rate=10.0, seed=1, unit="deg/s"
    )
    path = tmp_path / "gyro.csv"
    np.savetxt(path, recording.samples, header="gyro_x", comments="")
    return [str(path), "--rate", "10", "--unit", "deg/s", "--model", "N+K"]


def run(*arguments):
    return CliRunner().invoke(cli, ["fit", *arguments], catch_exceptions=False).output


def test_data_sheet_units_are_the_default_and_others_are_asked_for(log):
    # 0.01 deg/s·√s = 0.6 °/√h; 10⁻³ deg/s/√s = 216 °/h/√h.
    table = run(*log)
    assert " °/√h" in table
    assert " °/h/√h" in table
    assert float(table.split("  N  ")[1].split()[0]) == pytest.approx(0.6, rel=0.05)
    for unit in ("deg/h", "deg/sqrt(h)", "°/√h"):
        assert " °/√h" in run(*log, "--output-unit", unit)
    assert " rad/s/√Hz" in run(*log, "--output-unit", "rad/s")
    assert " °/s/√Hz" in run(*log, "--output-unit", "dps/√Hz")
    assert not REQUESTED_UNITS.get()


@pytest.mark.parametrize(
    ("asked", "shown", "factor"),
    [
        ("m/s/√h", "m/s/√h", 60.0), ("m/s/sqrt(hr)", "m/s/√hr", 60.0), ("mm/s/√s", "mm/s²/√Hz", 1e3),
        ("mm/s²/√Hz", "mm/s²/√Hz", 1e3), ("mgal/√Hz", "mgal/√Hz", 1e5), ("µg/√Hz", "µg/√Hz", 1e6 / 9.80665),
        ("m/s²/√Hz one-sided", "m/s²/√Hz one-sided", 2**0.5),
    ],
)  # fmt: skip
def test_a_unit_of_a_coefficient_is_the_one_it_is_shown_in(asked, shown, factor):
    """N was once shown in a unit derived from that of the samples, whatever unit was requested."""
    found = table_row(shown_rows("N(N=2e-3)+K(K=1e-5)", "m/s^2", asked), "N")
    assert found.endswith(f" {shown}")
    assert float(found.split()[0]) == pytest.approx(2e-3 * factor, rel=0.05)


def shown_rows(model, unit, asked):
    """Parameter, value and interval of a fit to a simulated record, as the tables of a command show them."""
    record = al.parse_model(model).simulate(n=4000, rate=10.0, seed=1, unit=unit)
    record = record.to(sample_unit(asked))
    token = REQUESTED_UNITS.set({parse_unit(record.unit).kind: asked})
    try:
        return parameter_rows(al.parse_model("N+K").fit(record))
    finally:
        REQUESTED_UNITS.reset(token)


def table_row(rows, name):
    return next(value for _, own, value, _ in rows if own == name)


@pytest.mark.parametrize(
    ("asked", "unit", "scale"),
    [
        ("ppb", "ppb·√s", 1e9),
        ("1e-12", "1e-12·√s", 1e12),
        ("1", "√s", 1.0),
        ("ns/√s", "ns/√s", 1e9),
    ],
)
def test_a_unit_asked_for_of_a_clock(asked, unit, scale):
    found = table_row(shown_rows("N(N=1e-9)", "1", asked), "N")
    value, shown = found.split(" ", 1)
    assert shown == unit
    plain = value.replace("·10", "e").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    assert float(plain) == pytest.approx(1e-9 * scale, rel=0.05)


def test_a_unit_of_one_kind_leaves_that_of_the_other():
    six = ("rad/s", "m/s^2")
    for asked, expected in (
        ("m/s/√h", ("rad/s", "m/s^2")),
        ("ug", ("rad/s", "ug")),
        ("deg/h,ug", ("deg/h", "ug")),
    ):
        samples = ",".join(map(sample_unit, asked.split(",")))
        record = al.Recording(np.ones((20, 2)), rate=1, unit=six).to(samples)
        assert record.units == expected
    token = REQUESTED_UNITS.set({"acceleration": "ug"})
    try:
        assert table_unit("rad/s", 0.5, {"angular rate": "deg/sqrt(h)"}) == "deg/sqrt(h)"
        assert table_unit("ug", 0.5, {"acceleration": "m/s/sqrt(h)"}) == "ug/sqrt(Hz)"
    finally:
        REQUESTED_UNITS.reset(token)


def test_each_kind_of_sensor_in_a_log_has_the_unit_asked_for_it(tmp_path):
    rng = np.random.default_rng(5)
    path = tmp_path / "two.csv"
    np.savetxt(
        path,
        rng.standard_normal((4000, 2)),
        header="gx [rad/s],ax [m/s^2]",
        delimiter=",",
        comments="",
    )
    log = [str(path), "--rate", "10", "--model", "N+B"]
    for asked, gyroscope, accelerometer in (
        ("m/s/√h", "°/√h", "m/s/√h"),
        ("µg/√Hz,rad/s", "rad/s/√Hz", "µg/√Hz"),
        ("deg/h", "°/√h", "m/s/√h"),
    ):
        rows = [line for line in run(*log, "--output-unit", asked).splitlines() if "  N  " in line]
        assert [row.split()[5] for row in rows] == [gyroscope, accelerometer]
    for asked, words in (
        ("ppb", "cannot express rad/s, m/s"),
        ("deg/h,deg/s", "two units of one kind"),
    ):
        with pytest.raises(al.InputError, match=words):
            run(*log, "--output-unit", asked)


@pytest.mark.slow
def test_json_keeps_the_unit_of_the_samples(log):
    document = json.loads(run(*log, "--json"))
    assert document["effects"][0]["parameters"]["N"]["unit"] == "deg/s·s^½"
    document = json.loads(run(*log, "--json", "--output-unit", "deg/sqrt(h)"))
    assert document["recording"]["unit"] == "deg/h"


def test_clocks_have_names_and_units_of_their_own():
    recording = al.parse_model("N(N=1e-9)+K(K=1e-12)").simulate(n=4000, rate=1.0, seed=1, unit="1")
    table = str(al.parse_model("N+B+K").fit(recording))
    assert "white FM" in table
    assert "flicker FM" in table
    assert "random-walk FM" in table
    assert " √s" in table


def test_small_chances_and_many_trials():
    assert log10_probability_text(-2.0) == "0.01"
    assert log10_probability_text(-4.7) == "2·10⁻⁵"
    assert log10_probability_text(-345.2) == "< 10⁻⁶"
    assert p_text(0.00017) == "p = 0.00017"
    assert p_text(1.8e-27) == "p < 10⁻⁶"
    assert trials_text(1.0) == "a single trial"
    assert trials_text(190_000.0) == "190000 trials"
    assert trials_text(3e9) == "3·10⁹ trials"
    assert trials_text(1e304) == "more than 10¹⁵ trials"


def test_a_harmonic_is_a_frequency_and_an_amplitude():
    assert harmonics_text(17.3, (2.0, 0.00795, 0.961), "°/s") == "34.6 Hz 0.00795 °/s (harmonic 2)"
    assert harmonics_text(1.0, (2.0, 1.0, 0.0, 3.0, 2.0, 0.0), "") == (
        "2 Hz 1 (harmonic 2), 3 Hz 2 (harmonic 3)"
    )


def test_a_coefficient_of_a_column_without_a_unit_is_per_unit_of_it():
    assert printed("deg/s/Temp", "Temp") == "°/s per unit of Temp"
    assert printed("deg/s/Temp²", "Temp") == "°/s per unit² of Temp"
    assert printed("1/Temp", "Temp") == "per unit of Temp"
    assert printed("deg/s/°C", "Temp") == "°/s/°C"


def test_the_ends_of_an_interval_are_different_numbers():
    line = al.Sinusoid(frequency=17.3, amplitude=0.02, phase=0.0, overtones=(2.0, 0.008, 1.0))
    record = (al.AngleRandomWalk(N=0.005) + line).simulate(
        duration=60, rate=100, seed=1, unit="deg/s"
    )
    start = al.AngleRandomWalk() + al.Sinusoid(frequency=17.3, overtones=(2.0, 0.0, 0.0))
    rows = {name: (value, ends) for _, name, value, ends in parameter_rows(start.fit(record))}
    low, high = rows["frequency"][1].split(" … ")
    assert float(low) < 17.3 < float(high)
    assert rows["overtones"][0].startswith("34.6 Hz 2")
    assert rows["overtones"][0].endswith(" °/h (harmonic 2)")


def test_sentences_are_wrapped_and_tables_are_not(monkeypatch):
    row = "  angle random walk  N  " + "1" * 80
    text = f"{row}\n  2. {'word ' * 30}"
    monkeypatch.setenv("COLUMNS", "70")
    assert wrapped_to_terminal(text) == text  # no terminal: another program reads it
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    lines = wrapped_to_terminal(text).splitlines()
    assert lines[0] == row
    assert max(map(len, lines[1:])) <= 70
    assert all(line.startswith("     word") for line in lines[2:])


def test_many_numbers_of_what_happens_in_time_are_told_by_their_ends():
    assert numbers_text([299.05], times=True) == "299.05"
    assert numbers_text([2.0, 1.0, 3.0], times=True) == "2 1 3"
    assert numbers_text([8794.64, 2153.7, 5776.1, -0.5], times=True) == "4: −0.5 … 8794.6"
    assert numbers_text([1.0, 2.0, 3.0, 4.0], times=False) == "1 2 3 4"
    assert numbers_text(np.linspace(18.0, 20.0, 64), times=False) == "64: 18 … 20"


def test_a_table_says_when_and_in_which_unit():
    away = al.effects.Excursions(starts=(20.0, 70.0), ends=(30.0, 90.0), heights=(0.2, -0.1))
    fit = al.AngleRandomWalk().fit(
        (al.AngleRandomWalk(N=0.01) + away).simulate(duration=100, rate=10, seed=1, unit="deg/s")
    )
    text = str(fit.add(away))
    assert "20 70 s" in text
    (heights,) = re.findall(r"heights +(\S+) (\S+) °/h", text)
    # 0.2 and -0.1 °/s are 720 and -360 °/h; a mean of 100 samples has a standard error of 3.6 °/h.
    assert [float(h.replace("−", "-")) for h in heights] == pytest.approx([720, -360], abs=20)


def test_an_agreement_is_worded_alike_and_without_powers_of_ten():
    from allanite.report import make_report

    record = al.parse_model("N(N=1)+K(K=0.3)").simulate(n=4000, rate=1.0, seed=1)
    wrong = al.parse_model("N").fit(record)
    line = misfit_line(wrong)
    assert wrong.error.adev_rms_percent > 100.0
    assert "e+" not in line
    right = al.parse_model("N+K").fit(record)
    assert "adequate" in misfit_line(right)
    assert ": not rejected by χ² alone; Allan deviation: residual" in misfit_line(
        right, whole=False
    )
    scatter = re.search(r"\(expected scatter[^)]*\)", misfit_line(right))[0]
    largest = re.search(r"largest error at .*?model/measured = [\d.]+", misfit_line(right))[0]
    report = make_report(record, "N+K").to_markdown()
    assert scatter in report
    assert largest in report
