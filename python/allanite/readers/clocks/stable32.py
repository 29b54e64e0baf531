"""Stable32's text files: phase (.phd) in s or fractional frequency (.frd), an interval in the comments."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.readers import text

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker, Table

__all__ = ["read"]

_TAU = re.compile(r"\btau0?\b\s*[:=]?\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)", re.IGNORECASE)


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - names come after the columns
    """Read one column of values, or time tags in days (MJD) before them.

    A comment such as ``# Tau: 1.0`` gives the interval, s; else ``--rate`` does.
    """
    table = text.read(path, text.all_numbers)
    with path.open(encoding="latin-1") as stream:
        head = stream.read(4096)
    found = _TAU.search("\n".join(line for line in head.splitlines() if not line[:1].isdigit()))
    phase = path.suffix.lower() == ".phd"
    names, units = ["phase" if phase else "frequency"], ["s" if phase else "1"]
    if len(table.columns) == 2:
        names, units = ["mjd", *names], ["d", *units]
    if len(table.columns) > 2 or table.named:
        return table
    rate = 1.0 / float(found[1]) if found and float(found[1]) > 0 else None
    return replace(table, names=tuple(names), units=tuple(units), rate=rate, named=True)
