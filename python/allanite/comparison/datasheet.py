"""Data sheets: a sensor's figures in their own units, and what a measurement says to them.

A sheet is a small TOML or JSON file::

    name = "MEMS gyroscope"
    [figures]
    noise_density = "0.03 deg/s/sqrt(Hz)"        # one-sided unless it says "two-sided"
    angle_random_walk = "1.27 deg/sqrt(h)"
    bias_instability = "18 deg/h"                # the coefficient B of IEEE 952
    in_run_bias_stability = "12 deg/h"           # the minimum of the Allan deviation
    rate_random_walk = { value = 1.0, unit = "deg/h^1.5" }
    bandwidth = "330 Hz"                         # −3 dB; tells a log whose samples were skipped
    sample_rate = "2000 Hz"                      # of the sensor itself, not of the log
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from allanite.common.errors import InputError, about
from allanite.common.parameters import Estimate
from allanite.common.units import coefficient_unit, conversion, parse_unit
from allanite.comparison.slips import slip
from allanite.effects import CATALOGUE

__all__ = ["Comparison", "DataSheet", "Quoted", "compare_datasheet", "read_datasheet"]

MINIMUM = "minimum"
SOLID = 10  # degrees of freedom from which a point of the Allan curve may be its minimum

# What is read off the Allan curve itself, with other spellings.
OF_THE_CURVE = {"in_run_bias_stability": ("bias_stability", "allan_minimum")}
# What the sensor gives before a log takes its samples, Hz.
FREQUENCIES = ("bandwidth", "sample_rate")


def known_figures() -> dict[str, tuple[str, float | str]]:
    """What each figure is of (a coefficient, or the Allan curve's minimum) and its unit: a power of s, or itself."""
    ours = {
        figure: (p.name if p.name == e.short else f"{e.short}.{p.name}", p.unit)
        for e in CATALOGUE
        for p in e.parameters
        for figure in p.figures
    }
    return {**ours, **dict.fromkeys(OF_THE_CURVE, (MINIMUM, 0.0))}


def _spellings() -> dict[str, str]:
    """The figure of each of its other spellings."""
    ours = (p.figures for e in CATALOGUE for p in e.parameters)
    return {
        other: figure
        for figures in (*ours, OF_THE_CURVE)
        for figure, others in figures.items()
        for other in others
    }


@dataclass(frozen=True, slots=True)
class Quoted:
    """One line of a data sheet.

    Attributes
    ----------
    name : str
        One of `known_figures`.
    value : float
        The number as printed.
    unit : str
        Its unit as printed, with "one-sided" where that applies.
    """

    name: str
    value: float
    unit: str

    @property
    def coefficient(self) -> str:
        """What the figure speaks of: Q, N, B, K, R, or the minimum of the Allan deviation."""
        return known_figures()[self.name][0]

    def in_unit(self, unit: str) -> float:
        """Return the coefficient in its canonical unit for samples in `unit`.

        Raises
        ------
        InputError
            The figure is of another kind of sensor or another quantity; both units are named.
        """
        _, power = known_figures()[self.name]
        own = power if isinstance(power, str) else coefficient_unit(unit, power)
        try:
            return self.value * conversion(self.unit, own)
        except InputError as error:
            raise InputError(f"{self.name} = {self.value:g} {self.unit}: {error}") from None


@dataclass(frozen=True, slots=True)
class DataSheet:
    """Name and figures of a sensor's data sheet; its −3 dB bandwidth and its own rate, Hz, where given.

    Examples
    --------
    >>> sheet = al.DataSheet("MEMS", (), bandwidth=100.0)
    >>> print(*np.round(sheet.folded(50.0), 3), sheet.remarks())  # 200 to 314 Hz of noise in 50 Hz
    2.0 2.507 []
    """

    name: str
    figures: tuple[Quoted, ...]
    bandwidth: float | None = None
    sample_rate: float | None = None

    def folded(self, rate: float) -> tuple[float, float] | None:
        """By how much N rises, at least and at most, where samples at `rate` Hz are taken without averaging.

        All noise of the sensor's band is folded below half the rate: N rises by √(band/rate), the band being 2·bandwidth
        (a sharp filter) to π·bandwidth (first order), and no more than the sensor's own rate. None where the sheet does
        not say, or where nothing to speak of is folded.
        """
        most = math.inf if self.sample_rate is None else self.sample_rate
        band = math.inf if self.bandwidth is None else self.bandwidth
        low, high = min(2.0 * band, most), min(math.pi * band, most)
        if not 2.0 * rate <= low < math.inf:
            return None
        return math.sqrt(low / rate), math.sqrt(high / rate)

    def remarks(self) -> list[str]:
        """Contradictions inside the sheet: a density and a random walk that are not the same N."""
        found = [figure for figure in self.figures if figure.coefficient == "N"]
        remarks = []
        for other in found[1:]:
            first = found[0]
            ratio = other.value * conversion(other.unit, first.unit) / first.value
            said = slip("N", ratio, 0.02)
            if said:
                remarks.append(
                    f"the sheet contradicts itself: {first.value:g} {first.unit} is not"
                    f" {other.value:g} {other.unit} (ratio {ratio:.3g}): {said}"
                )
        return remarks


@dataclass(frozen=True, slots=True)
class Row:
    """A figure beside its measurement, both in the canonical unit of the coefficient."""

    figure: Quoted
    sheet: float
    measured: Estimate
    ratio: Estimate
    remark: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """Measured coefficients over a data sheet's figures."""

    sheet: DataSheet
    column: str
    rows: tuple[Row, ...]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """``allanite/datasheet/1``."""
        return {
            "schema": "allanite/datasheet/1",
            "name": self.sheet.name,
            "column": self.column,
            "figures": [
                {
                    "figure": row.figure.name,
                    "value": row.figure.value,
                    "unit": row.figure.unit,
                    "coefficient": row.figure.coefficient,
                    "sheet": {"value": row.sheet, "unit": row.measured.unit},
                    "measured": row.measured.to_dict(),
                    "ratio": row.ratio.to_dict(),
                    "remark": row.remark or None,
                }
                for row in self.rows
            ],
            "remarks": list(self.remarks),
        }

    def __str__(self) -> str:
        cells = [("figure", "data sheet", "measured", "measured / sheet")]
        cells += [
            (
                row.figure.name,
                f"{row.figure.value:g} {row.figure.unit}",
                f"{_in_its_unit(row):.4g}" if row.measured.detected else "not detected",
                _ratio(row.ratio),
            )
            for row in self.rows
        ]
        widths = [max(len(row[i]) for row in cells) for i in range(4)]
        lines = [f"{self.column} against {self.sheet.name}"]
        lines += ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in cells]
        remarks = [f"! {row.figure.name}: {row.remark}" for row in self.rows if row.remark]
        return "\n".join([*lines, *remarks, *(f"! {remark}" for remark in self.remarks)])


def _in_its_unit(row: Row) -> float:
    """Return the measured value as the sheet would print it."""
    return row.measured.value * row.figure.value / row.sheet if row.sheet else math.nan


def _ratio(ratio: Estimate) -> str:
    if not ratio.detected:
        return f"< {ratio.interval[1]:.3g}" if ratio.interval else "?"
    if ratio.interval is None:
        return f"{ratio.value:.3g}"
    return f"{ratio.value:.3g} ({ratio.interval[0]:.3g} … {ratio.interval[1]:.3g})"


def read_datasheet(path: str | Path) -> DataSheet:
    r"""Read a sheet in TOML or JSON.

    Parameters
    ----------
    path : str or Path

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
        return _read(path)


def _read(path: Path) -> DataSheet:
    try:
        text = path.read_text(encoding="utf-8")
        parsed = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except FileNotFoundError:
        raise InputError("no such file") from None
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror or error})") from None
    except ValueError as error:
        raise InputError(f"not a data sheet in TOML or JSON ({error})") from None
    figures = parsed.get("figures") if isinstance(parsed, dict) else None
    known = ", ".join(known_figures())
    if not isinstance(figures, Mapping) or not figures:
        raise InputError(f"a data sheet needs a table [figures], with {known}")
    found = [_figure(str(name), given) for name, given in figures.items()]
    hertz = {f.name: f.value * conversion(f.unit, "Hz") for f in found if f.name in FREQUENCIES}
    noise = tuple(f for f in found if f.name not in FREQUENCIES)
    if not noise:
        raise InputError(f"no figure to compare: add one of {known}")
    return DataSheet(str(parsed.get("name", path.stem)), noise, **hertz)


def _figure(name: str, given: object) -> Quoted:
    key = name.strip().lower().replace(" ", "_").replace("-", "_")
    key = _spellings().get(key, key)
    if key not in known_figures() and key not in FREQUENCIES:
        known = ", ".join((*known_figures(), *FREQUENCIES))
        raise InputError(f"unknown figure {name!r}: one of {known}")
    if isinstance(given, Mapping):
        value, unit = given.get("value"), given.get("unit")
    else:
        match = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S.*)", str(given))
        value, unit = (match.group(1), match.group(2)) if match else (given, None)
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(f"{name} = {given!r}: give a number and a unit") from None
    if not unit:
        raise InputError(f'{name} = {given!r} has no unit: write e.g. "{number:g} deg/h"')
    if not (math.isfinite(number) and number > 0):
        raise InputError(f"{name} = {number:g}: a figure must be positive")
    unit = str(unit).strip()
    if key == "noise_density" and "sided" not in unit:
        unit += " one-sided"
    conversion(unit, unit)
    return Quoted(key, number, unit)


def compare_datasheet(fit: Any, sheet: DataSheet) -> Comparison:
    r"""Compare a fit with a sheet: the ratio of each figure, and the suspicious ones named.

    Parameters
    ----------
    fit : Fit
        Of a model that has the sheet's coefficients.
    sheet : DataSheet

    Raises
    ------
    InputError
        A figure of another kind of sensor.

    Examples
    --------
    >>> with open("sheet.toml", "w", encoding="utf-8") as file:
    ...     _ = file.write("[figures]\nnoise_density = '0.03 deg/s/sqrt(Hz)'\n")
    >>> log = al.AngleRandomWalk(N=0.03 / 2**0.5).simulate(duration=600, rate=50, seed=1, unit="deg/s")
    >>> found = al.compare_datasheet(al.AngleRandomWalk().fit(log), al.read_datasheet("sheet.toml"))
    >>> low, high = found.rows[0].ratio.interval
    >>> bool(low < 1.0 < high)
    True
    """
    unit = parse_unit(fit.recording.unit).name
    rows = []
    missing = []
    for figure in sheet.figures:
        expected = figure.in_unit(unit)
        try:
            minimal = figure.coefficient == MINIMUM
            measured = _minimum(fit.recording) if minimal else fit[figure.coefficient]
        except KeyError:
            missing.append(figure.name)
            continue
        ratio = Estimate(
            measured.value / expected,
            None if measured.std_error is None else measured.std_error / expected,
            _scaled(measured.interval, 1 / expected),
            "1",
            measured.detected,
            f"{figure.name} ratio",
        )
        remark = _remark(figure, ratio) or _skipped(figure, ratio, sheet, fit.recording)
        rows.append(Row(figure, expected, measured, ratio, remark))
    remarks = sheet.remarks()
    if missing:
        remarks.append(f"the model has no coefficient for {', '.join(missing)}: fit one that does")
    if not getattr(fit, "adequate", True):
        remarks.append(
            f"{fit.model.name} does not describe this record (see allanite check): B and K may"
            " stand for what it lacks"
        )
    return Comparison(sheet, fit.recording.columns[0], tuple(rows), tuple(remarks))


def _scaled(interval: tuple[float, float] | None, factor: float) -> tuple[float, float] | None:
    return None if interval is None else (interval[0] * factor, interval[1] * factor)


def _minimum(recording: Any) -> Estimate:
    """Lowest point of the Allan deviation among those that are well known."""
    from allanite.deviation import oadev

    curve = oadev(recording, taus=12)
    at = min(
        (i for i in range(len(curve.tau)) if curve.edf[i] >= SOLID),
        key=lambda i: curve.deviation[i],
        default=0,
    )
    low, high = float(curve.low[at]), float(curve.high[at])
    value = float(curve.deviation[at])
    return Estimate(value, (high - low) / 4, (low, high), recording.unit, name=MINIMUM)


def _remark(figure: Quoted, ratio: Estimate) -> str:
    if not ratio.detected:
        return ""
    return slip(figure.coefficient, ratio.value, _tolerance(ratio))


def _tolerance(ratio: Estimate) -> float:
    width = 3 * (ratio.std_error or 0.0) / ratio.value if ratio.value > 0 else 0.0
    return max(width, 0.05)


def _skipped(figure: Quoted, ratio: Estimate, sheet: DataSheet, recording: Any) -> str:
    """Whether the white level is that of samples thinned by skipping: alone it cannot be seen, white stays white."""
    if (
        figure.coefficient != "N"
        or not ratio.detected
        or not (sheet.bandwidth or sheet.sample_rate)
    ):
        return ""
    folded = sheet.folded(recording.rate)
    slack = math.exp(min(_tolerance(ratio), 0.1))
    if folded is None or not folded[0] / slack <= ratio.value <= folded[1] * slack:
        return ""
    return (
        f"looks as if samples were skipped on the way to {recording.rate:g} Hz: the noise above half of that is folded"
        f" down and raises N by {folded[0]:.3g}"
        + (f" to {folded[1]:.3g}" if folded[1] > 1.001 * folded[0] else "")
        + "; log faster and average"
    )
