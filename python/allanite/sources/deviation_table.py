"""Tables of Allan deviations from other tools: averaging times and deviations, fitted as curves.

The fit is generalized least squares with the covariance that the fitted noise itself implies
(`allanite.fit.classical.gls`). It needs the length of the record, which no table states.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY, parse_unit
from allanite.effects import CATALOGUE, Stochastic
from allanite.fit.classical.gls import fit_gls
from allanite.readers.sensor_names import sensor_kind
from allanite.sources.documents import model_document

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["curves_of_table", "documents_of_table", "is_deviation_table"]

#: Points of a decade that are fitted: neighboring points of an overlapping estimate are nearly the same number.
PER_DECADE = 8
#: Coefficients that are fitted.
NAMES = ("Q", "N", "B", "K")
#: Shortest table: as many points as coefficients.
FEWEST = len(NAMES) + 1
#: Rows of the largest table that is read. A log is longer.
LONGEST = 100_000


def is_deviation_table(path: Path) -> bool:
    """Whether a text file is a table of deviations: its first column is named tau, or it has no other explanation.

    A log may have a time column first as well. Only a header with ``tau`` decides without doubt; a table without a
    header counts if times grow, all values are positive and the curve is smooth: neighbors differ by less than 30 %
    in the median.
    """
    try:
        header, numbers = _read(path)
    except InputError:
        return False
    tau, values = numbers[:, 0], numbers[:, 1:]
    grows = tau.size >= FEWEST and bool((np.diff(tau) > 0.0).all() and tau[0] > 0.0)
    if not grows or not values.size or not bool((values > 0.0).all()):
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
    """Model documents of a table: Q, N, B, K of each column with intervals.

    Parameters
    ----------
    path : Path
        First column τ in s, then one or more overlapping Allan deviations.
    unit : str or None
        Unit of the samples behind the deviations: one for all columns, or one for each, separated by commas.
    rate : float or None
        Sampling rate of the record, Hz; one over the first τ if left out.
    record_length : float or None
        Length of the record in s: it decides how well each point is known.

    Raises
    ------
    InputError
        No such table, no unit, no record length, or one shorter than the longest τ.
    """
    header, numbers = _read(path)
    tau, deviations = numbers[:, 0], numbers[:, 1:]
    if not ((np.diff(tau) > 0.0).all() and tau[0] > 0.0 and (deviations > 0.0).all()):
        raise InputError(
            f"{path}: not a table of Allan deviations (growing tau, positive deviations):"
            " of a log, run allanite characterize"
        )
    names = header[1:] if header else [f"deviation {i + 1}" for i in range(deviations.shape[1])]
    units = _units(unit, names, str(path))
    if record_length is None:
        raise InputError(
            f"{path}: a table of deviations does not state how long the record was",
            missing="record_length",
            remedy=": give it in seconds with {record_length}",
        )
    if record_length < 2.0 * tau[-1]:
        raise InputError(
            f"{path}: tau reaches {tau[-1]:g} s, the record must be at least twice as long"
            f" (record length {record_length:g} s)"
        )
    fs = 1.0 / tau[0] if rate is None else rate
    factors, rows = _factors(tau, fs, str(path))
    n = round(record_length * fs)
    assumptions = [
        "fitted to a table of Allan deviations, taken as overlapping estimates, not to samples",
        f"record of {record_length:g} s at {fs:g} Hz"
        + ("" if rate is not None else " (one over the first tau)"),
    ]
    effects = [e for e in CATALOGUE if issubclass(e, Stochastic) and e.short in NAMES]
    found = []
    for name, own, column in zip(names, units, deviations.T, strict=True):
        terms = [effect().unit_terms(fs) for effect in effects]
        fit = fit_gls(column[rows] ** 2, factors, n, terms)
        low, high, _ = fit.intervals()
        values = {e.short: float(c) for e, c in zip(effects, fit.coefficients, strict=True)}
        ends = {e.short: (float(a), float(b)) for e, a, b in zip(effects, low, high, strict=True)}
        said = [*assumptions]
        if fit.chi2 > fit.dof + 4.0 * np.sqrt(2.0 * fit.dof):
            said.append(f"Q+N+B+K does not describe the curve: chi2/dof = {fit.chi2 / fit.dof:.1f}")
        found.append(model_document(name, own, values, str(path), fs, said, ends))
    return found


def curves_of_table(
    path: Path, unit: str | None
) -> list[tuple[str, str, NDArray[np.float64], NDArray[np.float64]]]:
    """Name, unit, averaging times and deviations of each column of a table."""
    header, numbers = _read(path)
    names = header[1:] if header else [f"deviation {i + 1}" for i in range(numbers.shape[1] - 1)]
    units = _units(unit, names, str(path))
    columns = zip(names, units, numbers[:, 1:].T, strict=True)
    return [(name, own, numbers[:, 0], column) for name, own, column in columns]


def _factors(
    tau: NDArray[np.float64], rate: float, source: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Averaging factors of the points that are fitted, eight a decade, and their rows."""
    m = np.round(tau * rate).astype(np.int64)
    if m[0] < 1 or np.abs(m / (tau * rate) - 1.0).max() > 0.05:
        raise InputError(
            f"{source}: tau = {tau[0]:g} s and more are no multiples of 1/{rate:g} s",
            missing="rate",
            remedy=": give the rate of the record with {rate}",
        )
    wanted = np.geomspace(tau[0], tau[-1], int(PER_DECADE * np.log10(tau[-1] / tau[0])) + 2)
    rows = np.unique(np.abs(np.log(tau[:, None] / wanted[None, :])).argmin(axis=0))
    kept = np.unique(m[rows], return_index=True)[1]
    return m[rows][kept], rows[kept]


def _units(unit: str | None, names: list[str], source: str) -> list[str]:
    if unit is None:
        raise InputError(
            f"{source}: the unit of the samples behind the deviations is not known",
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
        f"{source}: {len(given)} units for {len(names)} columns whose names do not tell {kinds_text}:"
        " give one unit for each column, separated by commas"
    )


def _read(path: Path) -> tuple[list[str], NDArray[np.float64]]:
    """Names of the columns (empty if there is no header) and the numbers, shape (points, columns)."""
    header: list[str] = []
    rows: list[list[float]] = []
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if number > LONGEST:
                raise InputError(
                    f"{path}: more than {LONGEST} rows: a log, not a table of deviations"
                )
            words = [w for w in re.split(r"[,;\s]+", line.strip().lstrip("#").strip()) if w]
            if not words:
                continue
            try:
                row = [float(word) for word in words]
            except ValueError:
                if rows:
                    raise InputError(
                        f"{path}, row {number}: {line.strip()[:60]!r} is no number"
                    ) from None
                header = _names(line)
                continue
            if rows and len(row) != len(rows[0]):
                raise InputError(
                    f"{path}, row {number}: {len(row)} columns, the rows before have {len(rows[0])}"
                )
            rows.append(row)
    if len(rows) < FEWEST or len(rows[0]) < 2:
        raise InputError(f"{path}: no table of tau and deviations with at least {FEWEST} rows")
    numbers = np.array(rows, dtype=np.float64)
    return (header if len(header) == numbers.shape[1] else []), numbers


def _names(line: str) -> list[str]:
    line = line.strip().lstrip("#").strip()
    split = re.split(r"[,;\t]", line) if re.search(r"[,;\t]", line) else line.split()
    return [name.strip() for name in split if name.strip()]
