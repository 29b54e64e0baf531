"""Populations of a fleet: the distribution of each parameter over all units, and the units that deviate."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from allanite.axes.turn_on import TurnOn, turn_on_bias
from allanite.common.arrays import Array
from allanite.common.documents import (
    MAX_DOCUMENT_BYTES,
    fields_dict,
    invalid_as_input_error,
    text_of,
)
from allanite.common.errors import InputError, TooShortError, about
from allanite.common.isolation import call_isolated
from allanite.common.numbers import number
from allanite.common.showing import aligned_lines, brief
from allanite.readers import limits_of, refused_as
from allanite.scale.logs import without_quote

#: Standard deviation of a normal distribution divided by its median absolute deviation: 1/Φ⁻¹(¾).
SIGMA_OVER_MAD = 1.4826
#: False discovery rate: maximum expected share of false alarms among the units that are named.
FALSE_DISCOVERY_RATE = 0.01
#: Minimum number of units of a population. Chosen by judgment; not measured.
MIN_UNITS = 8
#: An effect that at least this share of the units has is no deviation of a unit. Chosen by judgment; not measured.
MIN_COMMON_SHARE = 0.2
#: Coefficients that a table lists first.
FIRST_NAMES = ("N", "B", "K")
#: Maximum processor time per megabyte of a Parquet table, s: three times the 0.16 s that 200 000 rows of short texts take
#: with pyarrow 26; rows with ten numbers take 0.024 s.
SECONDS_PER_MEGABYTE = 0.5
#: Confidence of the limits of a population, and share of all units below its maximum.
CONFIDENCE, COVERED_SHARE = 0.95, 0.95


@dataclass(frozen=True, slots=True)
class Population:
    """Distribution of one parameter of one axis over all units.

    `spread` is the robust standard deviation relative to the median (absolute for a mean), without the scatter of the
    estimates. `median_interval` is a 95 % interval from order statistics, `typical` the range of the middle half of the
    units. Below `maximum` lie 95 % of all units, with 95 % confidence; None with fewer than 59 units, which are too few.
    """

    column: str
    name: str
    units: int
    median: float
    spread: float
    median_interval: tuple[float, float]
    typical: tuple[float, float]
    maximum: float | None

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: all attributes by name."""
        return fields_dict(self)


@dataclass(frozen=True, slots=True)
class Deviating:
    """Unit that deviates from the population `by` an effect that most others lack, or by a parameter.

    `value` is that of the parameter; None for an effect. `p_value` is the probability of a deviation at least this large if
    the unit belongs to the population.
    """

    file: str
    column: str
    by: str
    value: float | None
    p_value: float

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: all attributes by name."""
        return fields_dict(self)


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """Populations of all parameters, the units that deviate, and the logs that could not be read.

    Attributes
    ----------
    files, axes : int
        Logs, and axes with a model.
    population : tuple of Population
    deviating : tuple of Deviating
    failed : dict of str to str
        Reason by log, or by log and column.
    biases : dict of str to TurnOn
        Spread of the bias between logs by column. If the logs are of one sensor, this is the bias at switch-on.

    Examples
    --------
    >>> import json
    >>> fixed = {"column": "gx", "status": "done", "effects": "{}"}
    >>> numbers = [json.dumps({"N": [0.01 + 1e-4 * k, None, None, 1e-5]}) for k in range(10)]
    >>> found = al.fleet([{**fixed, "file": f"{k}.csv", "numbers": n} for k, n in enumerate(numbers)])
    >>> found.to_dict()["axes"], round(found["N"].median, 6)
    (10, 0.01045)
    """

    files: int
    axes: int
    population: tuple[Population, ...]
    deviating: tuple[Deviating, ...]
    failed: dict[str, str]
    biases: dict[str, TurnOn] = field(default_factory=dict)

    __repr__ = brief

    @property
    def too_few(self) -> str:
        """Sentence that more logs are needed for the distribution of a parameter; empty if there is a distribution."""
        if self.population:
            return ""
        return (
            f"too few units: a population needs {MIN_UNITS} logs with the same axis, found"
            f" {self.files - len(self.failed)} logs and {self.axes} axes with a model"
        )

    def _unit_text(self, one: Deviating) -> str:
        """Text of a deviating unit: ``unit4.csv, gx: N × 1.6 (p = 1e-5)``; 1.6 is the ratio to the median of all units.

        Without a positive median, the value itself; without a value, only what deviates.
        """
        by = one.by.replace("_", " ")
        if one.value is None:
            return f"{one.file}, {one.column}: {by} (p = {one.p_value:.1g})"
        medians = {(p.column, p.name): p.median for p in self.population}
        median = medians.get((one.column, one.by), 0.0)
        size = f"× {one.value / median:.2g}" if median > 0.0 else f"= {one.value:.4g}"
        return f"{one.file}, {one.column}: {by} {size} (p = {one.p_value:.1g})"

    def __getitem__(self, name: str) -> Population:
        """`Population` named ``column.parameter``, or the first one with this parameter name; `KeyError` if none."""
        for one in self.population:
            if name in (f"{one.column}.{one.name}", one.name):
                return one
        raise KeyError(f"no {name!r} in the fleet")

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/fleet/1``: files, axes, population, deviating, failed and turn_on."""
        return {"schema": "allanite/fleet/1"} | fields_dict(self, biases="turn_on")

    def __str__(self) -> str:
        lines = [f"{self.files} logs, {self.axes} axes, {len(self.failed)} failed", ""]
        table = [
            ["axis", "parameter", "units", "median", "95 %", "spread", "middle half", "95 % below"]
        ]
        for p in sorted(self.population, key=lambda p: _sort_key(p.name)):
            spread = f"{p.spread:.2g}" if p.name == "mean" else f"{number(100 * p.spread, 2)} %"
            median, typical = (f"{a:.4g} … {b:.4g}" for a, b in (p.median_interval, p.typical))
            top = "–" if p.maximum is None else f"{p.maximum:.4g}"
            middle = (str(p.units), f"{p.median:.4g}", median, spread, typical, top)
            table.append([p.column, p.name, *middle])
        lines += aligned_lines(table) if self.population else [self.too_few]
        if self.biases:
            lines += ["", "bias between logs (of one sensor: the bias at switch-on):"]
            lines += [f"  {name}: {bias}" for name, bias in self.biases.items()]
        if self.population or self.deviating:
            share = 100 * FALSE_DISCOVERY_RATE
            lines += [
                "",
                f"deviating units (at most {share:g} % of them are false alarms): {len(self.deviating)}",
            ]
            lines += [
                f"  {self._unit_text(d)}"
                for d in sorted(self.deviating, key=lambda d: _sort_key(d.by))
            ]
        if self.failed:
            lines += ["", "failed logs:"]
            lines += [
                f"  {path}: {why.removeprefix(f'{path}: ')}" for path, why in self.failed.items()
            ]
        return "\n".join(lines)


def _sort_key(name: str) -> int:
    """Integer sort key of a parameter name: 0 for N, 1 for B, 2 for K, 3 for all others."""
    return FIRST_NAMES.index(name) if name in FIRST_NAMES else len(FIRST_NAMES)


def fleet(table: str | Path | Sequence[dict[str, Any]]) -> Fleet:
    """`Fleet`: populations and deviating units from the rows that `run_fleet` (``allanite fleet``) wrote.

    Parameters
    ----------
    table : str, Path or sequence of dict
        Parquet or CSV table, or its rows.

    Returns
    -------
    Fleet

    Raises
    ------
    InputError
        No such table, or not one of `allanite fleet`.
    TooShortError
        No row with values.

    References
    ----------
    Benjamini, Y. & Hochberg, Y. (1995). Controlling the false discovery rate. J. R. Stat. Soc. B 57, 289.

    Examples
    --------
    The last of eleven units has five times the noise (value, 95 % interval, standard error):

    >>> import json
    >>> fixed = {"column": "gx", "status": "done", "effects": "{}"}
    >>> levels = [*(0.01 + 1e-4 * k for k in range(10)), 0.05]
    >>> numbers = [json.dumps({"N": [level, None, None, 1e-5]}) for level in levels]
    >>> found = al.fleet([{**fixed, "file": f"{k}.csv", "numbers": n} for k, n in enumerate(numbers)])
    >>> [unit.file for unit in found.deviating]
    ['10.csv']
    """
    rows = read_table(Path(table)) if isinstance(table, (str, Path)) else list(table)
    good = [row for row in rows if row.get("status") == "done" and row.get("numbers")]
    if not good:
        raise TooShortError("no axis was characterized: the table has no values")
    found: list[Deviating] = []
    biases: dict[str, TurnOn] = {}
    population = []
    for column in dict.fromkeys(str(row["column"]) for row in good):
        axis = [row for row in good if row["column"] == column]
        numbers = [json.loads(row["numbers"]) for row in axis]
        if (bias := _bias_between_logs(axis, numbers)) is not None:
            biases[column] = bias
        for name in dict.fromkeys(name for one in numbers for name in one):
            known = [(i, one[name]) for i, one in enumerate(numbers) if name in one]
            if len(known) < MIN_UNITS:
                continue
            one, chances = _population(column, name, [value for _, value in known])
            population.append(one)
            for (i, value), p in zip(known, chances, strict=True):
                by = name if name != "mean" else "mean (bias)"
                found.append(Deviating(axis[i]["file"], column, by, value[0], float(p)))
        effects = [json.loads(row["effects"]) for row in axis]
        for kind in dict.fromkeys(kind for one in effects for kind in one):
            # An effect that a single one of several units has is a deviation, however few the units are.
            least = max(MIN_COMMON_SHARE * len(axis), 2)
            if sum(kind in one for one in effects) < least <= len(axis):
                found += [
                    Deviating(row["file"], column, kind, None, one.get(kind, 1.0))
                    for row, one in zip(axis, effects, strict=True)
                ]
    failed = {
        f"{row['file']}{' · ' if row['column'] else ''}{row['column']}": str(row["remarks"])
        for row in rows
        if row.get("status") == "failed"
    }
    files = len({row["file"] for row in rows})
    deviating = _significant_deviations(found)
    return Fleet(files, len(good), tuple(population), deviating, failed, biases)


def _bias_between_logs(
    rows: list[dict[str, Any]], numbers: list[dict[str, list[float]]]
) -> TurnOn | None:
    """`TurnOn`: mean and spread of the bias of one column over all logs, from their rows and the `numbers` of these.

    None for fewer than two logs, for several units, or without a finite mean in each log.
    """
    units = {str(row.get("unit") or "") for row in rows}
    if len(rows) < 2 or len(units) > 1 or not all("mean" in one for one in numbers):
        return None
    means = [float(one["mean"][0]) for one in numbers]
    temperatures = [json.loads(row.get("temperatures") or "{}") for row in rows]
    return turn_on_bias(means, temperatures, units.pop()) if np.isfinite(means).all() else None


def _significant_deviations(found: list[Deviating]) -> tuple[Deviating, ...]:
    """Tuple of the significant ones in `found` at a false discovery rate of 1 % (Benjamini & Hochberg 1995).

    `found` has all tests of a fleet, also those that show nothing. One per axis of a unit is kept: its clearest effect if
    any is significant, else its clearest parameter.
    """
    found = sorted(found, key=lambda one: one.p_value)
    last = 0
    for rank, one in enumerate(found, start=1):
        if one.p_value <= FALSE_DISCOVERY_RATE * rank / len(found):
            last = rank
    best: dict[tuple[str, str], Deviating] = {}
    for one in found[:last]:
        key = one.file, one.column
        # An effect takes precedence over the parameters that it changes.
        if key not in best or (best[key].value is not None and one.value is None):
            best[key] = one
    return tuple(best.values())


def _population(
    column: str, name: str, values: list[list[float | None]]
) -> tuple[Population, Array]:
    """Tuple (`Population` of a parameter over all units, p-value of each unit's deviation, shape (units,)).

    `values` are [value, low, high, standard error], one per unit. Logarithms are compared if all values are positive, but
    not for ``mean``. The p-value is two-sided, for (value − median) / width. The width is a robust standard deviation: that
    of all units or that of the units on the same side of the median, the larger. A unit with a larger standard error than
    the median one can have a larger width. The distribution is Student's t with half as many degrees of freedom as units
    (at least 2), or normal from 200 units on.
    """
    from scipy.special import ndtr, stdtr

    x = np.array([float(v[0] or 0.0) for v in values])
    error = np.array([float(v[3]) if v[3] is not None else 0.0 for v in values])
    relative = name != "mean" and bool((x > 0.0).all())
    y = np.log(x) if relative else x
    if relative:
        error = error / x
    middle = float(np.median(y))
    scatter = SIGMA_OVER_MAD * float(np.median(np.abs(y - middle)))
    # Scatter between units without the standard errors of the estimates.
    own = float(np.sqrt(max(scatter**2 - float(np.median(error)) ** 2, 0.0)))
    width = np.sqrt(np.maximum(own**2 + error**2, (1e-9 * max(abs(middle), 1e-300)) ** 2))
    width = np.maximum(width, scatter)
    # Populations are skew, so each side has its own width.
    for side in (y > middle, y < middle):
        if side.any():
            one = SIGMA_OVER_MAD * float(np.median(np.abs(y[side] - middle)))
            width[side] = np.maximum(width[side], one)
    # If most units have the value 0, the width is 0, and these units do not deviate.
    z = np.divide(y - middle, width, out=np.zeros_like(y), where=width > 0.0)
    # The width is estimated from the units: Student's distribution with half their number.
    below = stdtr(max(len(values) // 2, 2), -np.abs(z)) if len(values) < 200 else ndtr(-np.abs(z))
    chance = 2.0 * below
    order = np.sort(x)
    low, high = _median_ranks(len(values))
    quarter = np.quantile(x, [0.25, 0.75])
    spread = own if relative or name == "mean" else scatter / max(abs(middle), 1e-300)
    interval = float(order[low]), float(order[high])
    typical = float(quarter[0]), float(quarter[1])
    count, median, limit = len(values), float(np.median(x)), _upper_limit(order)
    return Population(column, name, count, median, spread, interval, typical, limit), chance


def _upper_limit(order: Array) -> float | None:
    """Upper tolerance limit: value of the sorted `order` that 95 % of all units stay below, with 95 % confidence.

    None for too few units (fewer than 59).
    """
    from scipy.special import bdtr

    enough = np.flatnonzero(bdtr(np.arange(order.size), order.size, COVERED_SHARE) >= CONFIDENCE)
    return float(order[enough[0]]) if enough.size else None


def _median_ranks(n: int) -> tuple[int, int]:
    """Tuple of two indices into n sorted values: the values there enclose the median with 95 % confidence."""
    from scipy.special import bdtr

    low = int(sum(bdtr(k, n, 0.5) <= (1.0 - CONFIDENCE) / 2.0 for k in range(n // 2)))
    return max(low - 1, 0), min(n - low, n - 1)


def read_table(path: Path) -> list[dict[str, Any]]:
    """List of dicts: checked rows of a CSV or Parquet table. Raises `InputError` unless it is one of `allanite fleet`."""
    if not path.is_file():
        raise InputError(f"{path}: no such table")
    with about(path), invalid_as_input_error("not a table of `allanite fleet`"):
        rows = _csv_rows(path) if path.suffix.lower() == ".csv" else _parquet_rows(path)
        for row in rows:
            _check_row(row)
    return rows


def _csv_rows(path: Path) -> list[dict[str, Any]]:
    """List of the rows of a CSV table, each a dict from column name to text; `ValueError` for a damaged table."""
    import csv

    # Cells of a sensor with many effects are longer than the limit of the library.
    csv.field_size_limit(MAX_DOCUMENT_BYTES)
    try:
        return [
            {
                name: without_quote(text) if isinstance(text, str) else text
                for name, text in row.items()
            }
            for row in csv.DictReader(io.StringIO(text_of(path), newline=""))
        ]
    except csv.Error as error:
        raise ValueError(error) from None


def _parquet_rows(path: Path) -> list[dict[str, Any]]:
    """List of dicts: rows of a Parquet table; entries other than texts and numbers, also nulls, have no key.

    A child process reads them: a damaged table may crash or fill the memory. `InputError` then.
    """
    rows: list[dict[str, Any]] = call_isolated(
        f"{__name__}:serve_parquet_rows",
        {"path": str(path)},
        limits_of(path, SECONDS_PER_MEGABYTE),
        worker="the Parquet library",
        libraries=["pyarrow.parquet"],
    )
    return rows


def serve_parquet_rows(path: str) -> list[dict[str, Any]]:
    """List of dicts: rows of a Parquet table; entries other than texts and numbers are omitted.

    `_parquet_rows` runs this in a child process.
    """
    from pyarrow import parquet

    with refused_as("a Parquet table"):
        rows = parquet.read_table(path).to_pylist()
    return [{k: v for k, v in row.items() if isinstance(v, (str, int, float))} for row in rows]


def _check_row(row: dict[str, Any]) -> None:
    """Raise `TypeError`, `KeyError` or `ValueError` unless a row can be one of `allanite fleet`.

    File, column and status must be texts. If a row is ``done`` and has ``numbers``, its numbers, effects and
    temperatures must be finite; only ``numbers`` may contain None.
    """
    for name in ("file", "column", "status"):
        if not isinstance(row[name], str):
            raise TypeError(f"{name} is no text")
    if row["status"] != "done" or not row.get("numbers"):
        return
    for name, (value, low, high, error) in json.loads(row["numbers"]).items():
        if not all(x is None or math.isfinite(x) for x in (value, low, high, error)):
            raise ValueError(f"{name} is not finite")
    effects = json.loads(row["effects"]).values()
    temperatures = json.loads(row.get("temperatures") or "{}").values()
    if not all(math.isfinite(x) for x in (*effects, *temperatures)):
        raise ValueError("a number is not finite")
