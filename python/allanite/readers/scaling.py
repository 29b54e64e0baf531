"""Factors on columns of a log, which convert raw counts with the scale of the data sheet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from allanite.common.errors import InputError
from allanite.recording import find_column


def parse_scales(texts: Sequence[str]) -> dict[str, float]:
    """Dict from column name to factor, from texts such as ``gx=1/131`` or ``gx=0.00763``.

    Raises
    ------
    InputError
        A text has no name or no number, or the factor is 0 or not finite.
    """
    found: dict[str, float] = {}
    for text in texts:
        name, equals, factor = text.rpartition("=")
        value = _number_or_fraction(factor)
        if not (equals and name.strip()) or value is None or not math.isfinite(value) or not value:
            raise InputError(f"scale {text!r}: write NAME=FACTOR, e.g. gx=1/131")
        found[name.strip()] = value
    return found


def _number_or_fraction(text: str) -> float | None:
    """Value of a text with a number or a fraction of two numbers; None for any other text or a denominator of 0."""
    top, slash, bottom = text.partition("/")
    try:
        return float(top) / float(bottom) if slash else float(top)
    except (ValueError, ZeroDivisionError):
        return None


def factors_of(
    scales: Mapping[str, float], names: Sequence[str], samples: Sequence[int]
) -> dict[int, float]:
    """Dict from the index of a column to its factor, from `scales` by column name.

    `names` are those of all columns, `samples` the indices of the columns that are read as samples.

    Raises
    ------
    InputError
        A column is not in the log, or is not used.
    """
    found = {}
    for name, factor in scales.items():
        at = find_column(name, names)
        if at not in samples:
            raise InputError(
                f"scale of column {names[at]}: the column is not used",
                remedy="; omit its scale, or select the column with {column}",
            )
        found[at] = factor
    return found
