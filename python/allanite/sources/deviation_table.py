"""Tables of Allan deviations from other tools: averaging times and deviations, fitted as curves.

The fit is generalized least squares with the covariance that follows from the fitted noise
(`allanite.fit.classical.gls`). It needs the length of the record, because tables do not contain it.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError, about
from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY, parse_unit
from allanite.effects import CATALOG, Stochastic
from allanite.fit.classical.gls import fit_gls
from allanite.readers import Table, read_table, text
from allanite.recording.sensor_names import sensor_kind
from allanite.sources.documents import model_document

#: Points per decade of τ that are fitted. Neighboring points of an overlapping estimate are nearly equal, so that more
#: points add no information. Chosen by judgment; not measured.
POINTS_PER_DECADE = 8
#: Short names of the coefficients that are fitted.
NAMES = ("Q", "N", "B", "K")
#: Minimum number of rows of a table: one more than coefficients.
MIN_ROWS = len(NAMES) + 1


def is_deviation_table(path: Path) -> bool:
    """True if a text file is a table of Allan deviations over averaging times; False also if it cannot be read as numbers.

    The table must have 5 rows or more, growing times, and only positive values. A header must have ``tau`` or
    ``averaging…`` in the first column. Without a header, each column must fall from its first value by a third or more, and
    neighboring values must differ by less than 30 % in the median.
    """
    try:
        header, tau, values = _header_and_columns(text.first_rows_of(path)[0])
    except InputError:
        return False
    if not _can_be_deviations(tau, values):
        return False
    if header:
        return bool(re.match(r"tau|averaging", header[0].strip().lower()))
    change = np.abs(np.diff(np.log(values), axis=0))
    return bool(np.median(change) < 0.3 and (values[0] > 1.5 * values.min(axis=0)).all())


def documents_of_table(
    path: Path,
    unit: str | None,
    rate: float | None,
    record_length: float | None,
) -> list[dict[str, Any]]:
    """List of model documents (dicts), one per column of a table of deviations: fitted Q, N, B, K with 95 % intervals.

    The first column is τ in s, the others are overlapping Allan deviations. `unit` is that of the samples: one for all
    columns, or one for each, separated by commas. `rate`, Hz, is by default the reciprocal of the first τ. The
    uncertainty of each point depends on `record_length`, s, which must be at least twice the longest τ. Raises
    `InputError` if the file is no such table, or if the unit or the record length is missing.
    """
    names, tau, deviations = _read_table(path)
    if not _can_be_deviations(tau, deviations):
        raise InputError(
            "not a table of Allan deviations (tau must grow, deviations must be positive):"
            " if this is a log, use allanite characterize"
        )
    if record_length is None:
        raise InputError(
            "a table of deviations does not state the length of the record"
            + (" and the unit of its samples" if unit is None else ""),
            missing="record_length",
            remedy=": give {record_length}" + (" and {unit}" if unit is None else ""),
        )
    units = _column_units(unit, names)
    if record_length < 2.0 * tau[-1]:
        raise InputError(
            f"the record must be at least twice as long as the largest tau, {tau[-1]:g} s"
            f" (given record length: {record_length:g} s)"
        )
    fs = 1.0 / tau[0] if rate is None else rate
    factors, rows = _fitted_factors(tau, fs)
    n = round(record_length * fs)
    assumptions = [
        "fitted to a table of Allan deviations, assumed to be overlapping estimates; not fitted to samples",
        f"record of {record_length:g} s at {fs:g} Hz"
        + ("" if rate is not None else " (rate = 1 / first tau)"),
    ]
    effects = [e for e in CATALOG if issubclass(e, Stochastic) and e.short in NAMES]
    found = []
    for name, own, column in zip(names, units, deviations.T, strict=True):
        terms = [effect().unit_terms(fs) for effect in effects]
        fit = fit_gls(column[rows] ** 2, factors, n, terms)
        low, high, _ = fit.intervals()
        values = {e.short: float(c) for e, c in zip(effects, fit.coefficients, strict=True)}
        ends = {e.short: (float(a), float(b)) for e, a, b in zip(effects, low, high, strict=True)}
        remarks = [*assumptions]
        if fit.chi2 > fit.dof + 4.0 * np.sqrt(2.0 * fit.dof):
            remarks.append(f"Q+N+B+K does not fit the curve: chi2/dof = {fit.chi2 / fit.dof:.1f}")
        found.append(model_document(name, own, values, str(path), fs, remarks, ends))
    return found


def curves_of_table(path: Path, unit: str | None) -> list[tuple[str, str, Array, Array]]:
    """List of (name, unit, averaging times in s, deviations), one per column of a table of deviations.

    Raises `InputError` if the file is not a table, or if the unit is missing.
    """
    with about(path):
        names, tau, deviations = _read_table(path)
        columns = zip(names, _column_units(unit, names), deviations.T, strict=True)
        return [(name, own, tau, column) for name, own, column in columns]


def _fitted_factors(tau: Array, rate: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Tuple (averaging factors to fit, about eight per decade; row in the table of each) for a table with the times `tau`.

    `InputError` unless each τ is within 5 % of a multiple of the sampling interval.
    """
    m = np.round(tau * rate).astype(np.int64)
    if m[0] < 1 or np.abs(m / (tau * rate) - 1.0).max() > 0.05:
        raise InputError(
            f"the values of tau, from {tau[0]:g} s on, are not multiples of the sampling interval 1/{rate:g} s",
            missing="rate",
            remedy=": give the rate of the record with {rate}",
        )
    wanted = np.geomspace(tau[0], tau[-1], int(POINTS_PER_DECADE * np.log10(tau[-1] / tau[0])) + 2)
    rows = np.unique(np.abs(np.log(tau[:, None] / wanted[None, :])).argmin(axis=0))
    kept = np.unique(m[rows], return_index=True)[1]
    return m[rows][kept], rows[kept]


def _column_units(unit: str | None, names: list[str]) -> list[str]:
    """List of unit names, one for each column in `names`, from the comma-separated text `unit`.

    The text has one unit for all columns, one per column, or one per kind of sensor. The kind of a column (angular
    rate, acceleration or frequency) follows from its name. Raises `InputError` for None, for an unknown unit, and if a
    column gets no unit.
    """
    if unit is None:
        raise InputError(
            "a table of deviations does not state the unit of the samples",
            missing="unit",
            remedy=": give {unit}, one for all columns or one for each",
        )
    given = [parse_unit(one.strip()).name for one in unit.split(",")]
    if len(given) == 1:
        return given * len(names)
    if len(given) == len(names):
        return given
    by_kind = {parse_unit(one).kind: one for one in given}
    kinds = [sensor_kind(name) for name in names]
    if all(kind in by_kind for kind in kinds):
        return [by_kind[kind] for kind in kinds if kind is not None]
    kinds_text = f"{ANGULAR_RATE}, {ACCELERATION} or {FREQUENCY}"
    raise InputError(
        f"{len(given)} units for {len(names)} columns, and the names do not show {kinds_text}:"
        " give one unit for each column, separated by commas"
    )


def _read_table(path: Path) -> tuple[list[str], Array, Array]:
    """Tuple (name of each column of deviations, first column τ, deviations of shape (rows, columns)) of a table.

    Without a header, the names are ``deviation 1``, …. Raises `InputError` as `_header_and_columns`.
    """
    header, tau, deviations = _header_and_columns(read_table(path, text.all_numbers))
    return header[1:] or [f"deviation {i + 1}" for i in range(deviations.shape[1])], tau, deviations


def _header_and_columns(table: Table) -> tuple[list[str], Array, Array]:
    """Tuple (header, first column of numbers, all further ones as array of shape (rows, columns)) of a table.

    The header is empty if the table has none. Raises `InputError` for fewer than two columns of numbers or five rows.
    """
    columns = text.all_numbers(table)
    if table.n < MIN_ROWS or len(columns) < 2:
        raise InputError(
            f"a table of tau and deviations needs two columns and at least {MIN_ROWS} rows"
        )
    header = [table.names[i] for i in columns] if table.named else []
    numbers = np.column_stack([table[i] for i in columns])
    return header, numbers[:, 0], numbers[:, 1:]


def _can_be_deviations(tau: Array, deviations: Array) -> bool:
    """True if the averaging times are positive and increase, and all deviations are positive."""
    return bool((np.diff(tau) > 0.0).all() and tau[0] > 0.0 and (deviations > 0.0).all())
