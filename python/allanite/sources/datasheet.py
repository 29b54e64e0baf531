"""Data sheets: a sensor's figures in their own units.

A sheet is a small TOML or JSON file. The figures of one sensor stand in ``[figures]``, those of an IMU in
``[gyroscope]`` and ``[accelerometer]``::

    name = "MEMS gyroscope"
    temperature = "25 degC"                      # temperature for which the figures are stated
    [figures]
    noise_density = "0.03 deg/s/sqrt(Hz)"        # one-sided unless it says "two-sided"
    angle_random_walk = "1.27 deg/sqrt(h)"       # velocity_random_walk of an accelerometer
    bias_instability = "18 deg/h"                # the coefficient B of IEEE 952
    in_run_bias_stability = "12 deg/h"           # the minimum of the Allan deviation
    rate_random_walk = { value = 1.0, unit = "deg/h^1.5" }
    bandwidth = "330 Hz"                         # -3 dB; used to detect logs in which samples were skipped
    sample_rate = "2000 Hz"                      # rate of the sensor itself, not of the log
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from allanite.common.documents import invalid_as_input_error, text_of
from allanite.common.errors import InputError, about
from allanite.common.plain import plain
from allanite.common.units import (
    ACCELERATION,
    ANGULAR_RATE,
    FREQUENCY,
    coefficient_unit,
    conversion,
)
from allanite.effects import CATALOG
from allanite.sources.documents import PLATEAU, model_document
from allanite.sources.slips import mistake_text

#: Value of `Quoted.coefficient` for a figure that is the minimum of the Allan deviation.
MINIMUM = "minimum"
#: Table of a sheet → kind of sensor that it describes; None: the unit of each figure decides.
TABLES = {
    "figures": None,
    "gyroscope": ANGULAR_RATE,
    "accelerometer": ACCELERATION,
    "clock": FREQUENCY,
}
#: Kind of sensor → SI unit of its samples.
SI_OF_KIND = {ANGULAR_RATE: "rad/s", ACCELERATION: "m/s^2", FREQUENCY: "1"}

#: Figure that states the minimum of the Allan deviation, not a coefficient → its other spellings.
CURVE_FIGURES = {"in_run_bias_stability": ("bias_stability", "allan_minimum")}
#: Figures that are frequencies of the sensor, in Hz, and not noise.
FREQUENCY_FIGURES = ("bandwidth", "sample_rate")


def known_figures() -> dict[str, tuple[str, float | str]]:
    """Dict: name of a figure → (coefficient or `MINIMUM`, power of seconds in its unit U·s^power or the unit as text)."""
    ours = {
        figure: (p.name if p.name == e.short else f"{e.short}.{p.name}", p.unit)
        for e in CATALOG
        for p in e.parameters
        for figure in p.figures
    }
    return {**ours, **dict.fromkeys(CURVE_FIGURES, (MINIMUM, 0.0))}


def _names_by_spelling() -> dict[str, str]:
    """Dict: alternative spelling of a figure → its name."""
    ours = (p.figures for e in CATALOG for p in e.parameters)
    return {
        other: figure
        for figures in (*ours, CURVE_FIGURES)
        for figure, others in figures.items()
        for other in others
    }


@dataclass(frozen=True, slots=True)
class Quoted:
    """One figure of a data sheet as printed: name, value and unit.

    Attributes
    ----------
    name : str
        One of `known_figures`.
    value : float
        The number as printed.
    unit : str
        Its unit as printed, with "one-sided" where that applies.

    Examples
    --------
    >>> walk = al.Quoted("angle_random_walk", 0.3, "deg/sqrt(h)")
    >>> walk.kind, walk.coefficient, round(walk.in_unit("deg/s"), 6)
    ('angular rate', 'N', 0.005)
    """

    name: str
    value: float
    unit: str

    @property
    def kind(self) -> str:
        """Kind of sensor that the figure's unit belongs to.

        Raises
        ------
        InputError
            The unit belongs to no kind of sensor.
        """
        problem: InputError | None = None
        for kind, unit in SI_OF_KIND.items():
            try:
                self.in_unit(unit)
            except InputError as error:
                problem = problem or error
            else:
                return kind
        assert problem is not None
        raise problem

    @property
    def coefficient(self) -> str:
        """Name of the coefficient that the figure states: ``"N"``, ``"K"``, …, or ``"minimum"`` of the Allan deviation."""
        return known_figures()[self.name][0]

    def in_unit(self, unit: str) -> float:
        """Value of the coefficient (N: two-sided) in its canonical unit U·s^power, for samples in the unit U (`unit`).

        Raises
        ------
        InputError
            The figure belongs to another kind of sensor or quantity. The message names both units.
        """
        _, power = known_figures()[self.name]
        own = power if isinstance(power, str) else coefficient_unit(unit, power)
        try:
            return self.value * conversion(self.unit, own)
        except InputError as error:
            raise InputError(f"{self.name} = {self.value:g} {self.unit}: {error}") from None


@dataclass(frozen=True, slots=True)
class DataSheet:
    """Name and figures of a sensor's data sheet, and its −3 dB bandwidth and sampling rate in Hz if the sheet has them.

    Examples
    --------
    >>> sheet = al.DataSheet("MEMS", (), bandwidth=100.0)
    >>> print(*np.round(sheet.folded(50.0), 3), sheet.remarks())  # 200 to 314 Hz of noise in 50 Hz
    2.0 2.507 []
    >>> len(sheet.of_kind("acceleration").figures)
    0
    """

    name: str
    figures: tuple[Quoted, ...]
    bandwidth: float | None = None
    sample_rate: float | None = None
    temperature: str = ""

    def of_kind(self, kind: str) -> DataSheet:
        """Copy of the sheet with only the figures of one kind of sensor (``"angular rate"``, …), perhaps none."""
        return replace(self, figures=tuple(f for f in self.figures if f.kind == kind))

    def folded(self, rate: float) -> tuple[float, float] | None:
        """Tuple (smallest, largest factor) by which aliasing raises N if samples are skipped down to `rate` Hz.

        Skipping samples without averaging folds all noise of the sensor's band below half the rate, so N rises by
        √(band/rate). The band is 2·bandwidth for a sharp filter and π·bandwidth for a filter of first order, but at most
        the sensor's sampling rate. None if the sheet states neither frequency, or if the smaller band is below twice the
        rate.
        """
        most = math.inf if self.sample_rate is None else self.sample_rate
        band = math.inf if self.bandwidth is None else self.bandwidth
        low, high = min(2.0 * band, most), min(math.pi * band, most)
        if not 2.0 * rate <= low < math.inf:
            return None
        return math.sqrt(low / rate), math.sqrt(high / rate)

    def remarks(self) -> list[str]:
        """List of texts: one remark for each figure of N that contradicts the first one of its kind of sensor.

        Only contradictions that a typical mistake explains (`slips`) are listed.
        """
        remarks = []
        density = [figure for figure in self.figures if figure.coefficient == "N"]
        first_of = {figure.kind: figure for figure in reversed(density)}
        for other in density:
            first = first_of[other.kind]
            if other is first:
                continue
            ratio = other.value * conversion(other.unit, first.unit) / first.value
            mistake = mistake_text("N", ratio, 0.02)
            if mistake:
                remarks.append(
                    f"the sheet contradicts itself: {first.value:g} {first.unit} is not"
                    f" {other.value:g} {other.unit} (ratio {ratio:.3g}): {mistake}"
                )
        return remarks


def read_datasheet(path: str | Path) -> DataSheet:
    r"""`DataSheet` read from a TOML or JSON file; its name defaults to that of the file without suffix.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    DataSheet
        Figures as printed; bandwidth and sample rate in Hz.

    Raises
    ------
    InputError
        No such file, bad syntax, an unknown figure, a value without a unit.

    Examples
    --------
    >>> with open("sheet.toml", "w", encoding="utf-8") as file:
    ...     _ = file.write("[figures]\nnoise_density = '0.03 deg/s/sqrt(Hz)'\n")
    >>> quoted = al.read_datasheet("sheet.toml").figures[0]
    >>> quoted.name, round(quoted.in_unit("deg/s"), 4)  # one-sided 0.03 is N = 0.03/√2
    ('noise_density', 0.0212)
    """
    path = Path(path)
    with about(path):
        text = text_of(path)
        with invalid_as_input_error("not a data sheet in TOML or JSON"):
            parsed = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
            return datasheet_of(parsed, path.stem)


def datasheet_of(parsed: object, name: str) -> DataSheet:
    """`DataSheet` from a parsed TOML or JSON document; `name` is used if the document states no name.

    `InputError` without a figure, for an unknown one, and for one in the table of another kind of sensor.
    """
    tables = parsed if isinstance(parsed, dict) else {}
    given = {t: tables[t] for t in TABLES if isinstance(tables.get(t), Mapping) and tables[t]}
    known = ", ".join(known_figures())
    if not given:
        raise InputError(f"a data sheet needs a table [figures], with {known}")
    found: list[Quoted] = []
    for table, figures in given.items():
        for key, value in figures.items():
            figure = _quoted_figure(str(key), value)
            kind = TABLES[table]
            if kind is not None and figure.name not in FREQUENCY_FIGURES and figure.kind != kind:
                raise InputError(
                    f"[{table}] {figure.name} = {figure.value:g} {figure.unit}: this is a unit of"
                    f" {figure.kind}, but the table is for {kind}"
                )
            found.append(figure)
    hertz = {
        f.name: f.value * conversion(f.unit, "Hz") for f in found if f.name in FREQUENCY_FIGURES
    }
    noise = tuple(f for f in found if f.name not in FREQUENCY_FIGURES)
    if not noise:
        raise InputError(f"no figure to compare: add one of {known}")
    return DataSheet(
        str(tables.get("name", name)),
        noise,
        **hertz,
        temperature=str(tables.get("temperature", "")),
    )


def _quoted_figure(name: str, given: object) -> Quoted:
    """`Quoted` from the name and the value of a figure: a text such as "18 deg/h", or a mapping with value and unit.

    "one-sided" is appended to the unit of a noise density, unless it says one-sided or two-sided. Raises `InputError`
    for an unknown name, a value that is not positive, and a missing or unknown unit.
    """
    key = name.strip().lower().replace(" ", "_").replace("-", "_")
    key = _names_by_spelling().get(key, key)
    if key not in known_figures() and key not in FREQUENCY_FIGURES:
        known = ", ".join((*known_figures(), *FREQUENCY_FIGURES))
        raise InputError(f"unknown figure {name!r}; known figures: {known}")
    if isinstance(given, Mapping):
        value, unit = given.get("value"), given.get("unit")
    else:
        match = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([^\s\d.].*)", str(given))
        value, unit = (match.group(1), match.group(2)) if match else (given, None)
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {plain(given, 60)}: give a number and a unit") from None
    if not unit:
        raise InputError(
            f'{name} = {given!r} has no unit: append that of the sheet, as in "0.3 deg/sqrt(h)" or "5 deg/h"'
        )
    if not (math.isfinite(number) and number > 0):
        raise InputError(f"{name} = {number:g}: a figure must be positive")
    unit = str(unit).strip()
    if key == "noise_density" and "sided" not in unit:
        unit += " one-sided"
    try:
        conversion(unit, unit)
    except InputError as error:
        raise InputError(f"{name}: {error.found}") from None
    return Quoted(key, number, unit)


def documents_of_sheet(sheet: DataSheet, source: str) -> list[dict[str, Any]]:
    """List of model documents (dicts) of a data sheet, one for each kind of sensor, with the assumptions.

    They have no intervals, and units of rad/s, m/s^2 or 1. `source` is the name of the file, for messages. `InputError` if
    a sensor has neither a noise density nor an angle or velocity random walk.
    """
    return [
        _sheet_document(sheet.of_kind(kind), kind, source)
        for kind in dict.fromkeys(figure.kind for figure in sheet.figures)
    ]


def _sheet_document(sheet: DataSheet, kind: str, source: str) -> dict[str, Any]:
    """Model document of one kind of sensor; if two figures state the same coefficient, the larger is used.

    Raises `InputError` without a figure for N.
    """
    unit = SI_OF_KIND[kind]
    table = next(t for t, k in TABLES.items() if k == kind)
    by_coefficient: dict[str, Quoted] = {}
    for figure in sorted(sheet.figures, key=lambda f: f.in_unit(unit)):
        by_coefficient[figure.coefficient] = figure
    values = {name: figure.in_unit(unit) for name, figure in by_coefficient.items()}
    if "N" not in values:
        raise InputError(
            f"the {table} has neither a noise density nor an angle or velocity random walk: add"
            ' e.g. noise_density = "0.01 deg/s/sqrt(Hz)"'
        )
    assumptions = [f"data sheet {sheet.name}, {table}: figures as printed, not measured"]
    density = by_coefficient["N"]
    if density.name == "noise_density":
        side = "two-sided" if "two" in density.unit or "double" in density.unit else "one-sided"
        rule = "N = value" if side == "two-sided" else "N = value / sqrt(2)"
        assumptions.append(
            f"noise density {density.value:g} {_without_side(density.unit)} is {side}: {rule}"
        )
    others = [f for f in sheet.figures if f.coefficient == "N" and f is not density]
    for other in others:
        ratio = other.in_unit(unit) / values["N"]
        if ratio < 0.98:
            assumptions.append(
                f"N is taken from {density.name}; {other.name} gives only {ratio:.2f} times this value"
            )
    assumptions.append(
        f"the figures are valid at {sheet.temperature}"
        if sheet.temperature
        else "the figures are valid at one temperature that the sheet does not state (usually 25 degC)"
    )
    minimum = values.pop(MINIMUM, None)
    if "B" not in values and minimum is not None:
        values["B"] = minimum / PLATEAU
        assumptions.append(
            "in-run bias stability is the minimum of the Allan deviation: B = value / 0.664"
        )
    if "K" not in values:
        assumptions.append(_assumption_on_walk(values, unit))
    assumptions += sheet.remarks()
    return model_document(table, unit, values, source, sheet.sample_rate, assumptions)


def _assumption_on_walk(values: Mapping[str, float], unit: str) -> str:
    """Sentence on the rate random walk K that the sheet does not state: the largest K that agrees with B.

    The Allan deviation of N and K alone has its minimum at tau = sqrt(3) N/K; the square of this minimum is 2 N K/sqrt(3).
    A measured minimum s therefore allows K up to sqrt(3) s^2/(2 N), reached if no other noise contributes to the minimum.
    """
    if "B" not in values:
        return "the sheet states neither a bias instability nor a rate random walk: the slow noise in this file is a guess"
    floor = PLATEAU * values["B"]
    largest = math.sqrt(3.0) * floor**2 / (2.0 * values["N"])
    return (
        "the sheet has no rate random walk K: a random walk in this file covers the bias instability B too; any K from 0"
        f" to {largest:.2g} {coefficient_unit(unit, -0.5).replace('½', '0.5')} agrees with the sheet (sqrt(3)"
        " sigma_min^2 / (2 N))"
    )


def _without_side(unit: str) -> str:
    """Text of a unit without the words "one-sided", "two-sided", "single-sided" or "double-sided"."""
    return re.sub(r"\s*\b(one|two|single|double)[\s-]?sided\b", "", unit)
