"""Logs are read in a child process: a damaged log, or one larger than the memory, ends the child and not the page."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import AllaniteError
from allanite.common.isolation import Limits, call_isolated
from allanite.recording.findings import Finding
from allanite.recording.log_column import LogColumn
from allanite.recording.recording import recording_of_fields
from allanite.recording.timebase import Stamps

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from allanite.common.read_options import ReadOptions
    from allanite.readers import Table
    from allanite.recording import Recording

#: Number of segments of a spark line.
SPARK = 60
#: Limit of the processor time in s: a constant and an amount per byte. The slowest reader needs 1.4 s per megabyte on a
#: fast machine, and an inspection reads a log up to three times.
SECONDS, SECONDS_PER_BYTE = 60.0, 40e-6
#: Limit of the elapsed time as a multiple of that of the processor time, for busy machines and slow disks.
PATIENCE = 12.0


def read_in_child(
    path: Path,
    options: ReadOptions,
    units: Mapping[str, str],
    watch: Callable[[], None] | None = None,
) -> Recording:
    """`Recording` of a log, read in a child process; `units` maps single columns to their units.

    `watch` is called every 20 ms; an exception that it raises ends the reading. Raises `InputError` if the log cannot
    be used, or its reader crashed or reached a limit.
    """
    return _recording_of_fields(_call_in_child("read_log", path, options, watch, units=dict(units)))


def inspect_in_child(path: Path, options: ReadOptions) -> dict[str, Any]:
    """Dict of `inspect_log`, called in a child process; the errors are those of `read_in_child`."""
    found: dict[str, Any] = _call_in_child("inspect_log", path, options, None)
    return found


def _call_in_child(
    function: str,
    path: Path,
    options: ReadOptions,
    watch: Callable[[], None] | None,
    **more: Any,
) -> Any:
    """Return value of ``function(path, options, **more)``, called in a child process with the options as a dict.

    `watch`, if given, is called every 20 ms; an exception that it raises ends the call. Raises `InputError` if the log
    cannot be used, or if the child process crashes or reaches a limit of time or memory.
    """
    try:
        seconds = SECONDS + SECONDS_PER_BYTE * path.stat().st_size
    except OSError:
        seconds = SECONDS  # the reader reports the error of the file
    return call_isolated(
        f"{__name__}:{function}",
        {"path": str(path), "options": asdict(options), **more},
        Limits(cpu=seconds, wall=PATIENCE * seconds),
        worker="the reader",
        libraries=["allanite.readers.inspection"],
        watch=watch,
    )


def read_log(path: str, options: dict[str, Any], units: dict[str, str]) -> dict[str, Any]:
    """Fields of the `Recording` of a log, with samples in `units`, and objects as dicts; runs in the child process."""
    from allanite.readers import read

    recording = read(Path(path), **options)
    own = dict(zip(recording.columns, recording.units, strict=True))
    recording = recording.in_units(
        {k: u for k, u in units.items() if u and own.get(k) not in (None, u)}
    )
    return {
        **{name: getattr(recording, name) for name in KEPT},
        "covariates": dict(recording.covariates),
        "covariate_units": dict(recording.covariate_units),
        "stamps": None if recording.stamps is None else _fields_of_dataclass(recording.stamps),
        "added_findings": [
            {**_fields_of_dataclass(one), "values": dict(one.values)}
            for one in recording.added_findings
        ],
        "log_columns": [
            {**_fields_of_dataclass(one), "sources": dict(one.sources)}
            for one in recording.log_columns
        ],
    }


#: Fields of a recording that are transferred as they are.
KEPT = ("samples", "rate", "units", "quantity", "columns", "path", "epoch", "times")


def _fields_of_dataclass(record: Any) -> dict[str, Any]:
    """Dict from name to value of the fields of a dataclass instance."""
    return {field.name: getattr(record, field.name) for field in fields(record)}


def _recording_of_fields(found: dict[str, Any]) -> Recording:
    """`Recording` made of the fields that `read_log` returns, without another check of their values."""
    stamps = found["stamps"]
    return recording_of_fields(
        {
            **found,
            "units": tuple(found["units"]),
            "columns": tuple(found["columns"]),
            "stamps": None
            if stamps is None
            else Stamps(**{k: _lists_as_tuples(v) for k, v in stamps.items()}),
            "added_findings": tuple(Finding(**one) for one in found["added_findings"]),
            "log_columns": tuple(LogColumn(**one) for one in found["log_columns"]),
        }
    )


def _lists_as_tuples(value: Any) -> Any:
    """Tuple of the elements of a list, with nested lists as tuples, too; any other value unchanged."""
    return tuple(map(_lists_as_tuples, value)) if isinstance(value, list) else value


def inspect_log(path: str, options: dict[str, Any]) -> dict[str, Any]:
    """Dict of `Inspection.to_dict` for a log; runs in the child process.

    Each column has under ``spark`` the data of a small curve, unless the columns cannot be read. Messages of findings
    name the controls of the page.
    """
    from allanite.page.words import WORDS
    from allanite.readers import read_table
    from allanite.readers.inspection import inspect
    from allanite.readers.text import all_numbers

    seen = inspect(Path(path), **options)
    found = seen.to_dict()
    for shown, finding in zip(found["findings"], seen.findings, strict=True):
        shown["message"] = finding.worded(WORDS)

    try:
        table = read_table(Path(path), all_numbers)
    except AllaniteError:
        return found
    sparks = {name: _sparkline(table, i) for i, name in enumerate(table.names)}
    for column in found["columns"]:
        column["spark"] = sparks.get(column["name"])
    return found


def _sparkline(table: Table, at: int) -> list[list[float | None]] | None:
    """[minimum, maximum] of each of up to 60 equal segments of a column, scaled to 0 … 1; None if it has no numbers.

    Both are None for a segment without finite values.
    """
    if table.columns[at] is None:
        return None
    x = np.asarray(table[at], dtype=np.float64)
    x = np.where(np.isfinite(x), x, np.nan)
    if not x.size or np.isnan(x).all():
        return None
    edges = np.arange(min(SPARK, x.size)) * x.size // min(SPARK, x.size)
    low, high = np.fmin.reduceat(x, edges), np.fmax.reduceat(x, edges)
    bottom, span = float(np.nanmin(x)), float(np.nanmax(x) - np.nanmin(x)) or 1.0
    return [
        [round(float(v - bottom) / span, 3) if np.isfinite(v) else None for v in pair]
        for pair in zip(low, high, strict=True)
    ]
