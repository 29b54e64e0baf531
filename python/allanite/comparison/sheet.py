"""Data sheets: a sensor's figures in their own units.

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

from allanite.common.errors import InputError, about
from allanite.common.units import coefficient_unit, conversion
from allanite.comparison.slips import slip
from allanite.effects import CATALOGUE

__all__ = ["MINIMUM", "DataSheet", "Quoted", "known_figures", "read_datasheet"]

MINIMUM = "minimum"

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


def read_datasheet(path: str | Path) -> DataSheet:
    r"""Read a sheet in TOML or JSON.

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
