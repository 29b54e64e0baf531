"""Arrays of samples: conversion, checks, names and units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError
from allanite.common.plain import plain
from allanite.common.units import conversion, parse_unit, rate_unit, units_by_kind

#: Rows checked at a time, so that they stay in the cache.
CHUNK = 1 << 18


def private_array(samples: object, columns: Sequence[str] | None) -> NDArray[Any]:
    """Samples as a numeric array of one or two dimensions that no other code can change; booleans become 0 and 1.

    Raises `InputError` for other values and infinities, and `TooShortError` without samples or if all are NaN.
    """
    array = np.asarray(samples)
    if array.dtype.kind == "b":
        array = array.astype(np.int64)
    if array.dtype.kind not in "iuf":
        raise InputError(f"samples must be real numbers, found {array.dtype}")
    if array.ndim not in (1, 2):
        raise InputError(f"samples must have shape (n,) or (n, columns), found {array.shape}")
    if array.size == 0:
        raise TooShortError("no samples")
    if array.dtype.kind == "f":
        require_finite(array, columns)
    if array.flags.writeable:
        # A view, or an array of the caller, could change during a computation.
        array = array.copy()
    return array


def require_finite(array: NDArray[Any], columns: Sequence[str] | None) -> None:
    """Raise `InputError` for infinite samples (count and first place), and `TooShortError` if all samples are NaN."""
    count, first, present = 0, "", False
    for at in range(0, len(array), CHUNK):
        piece = array[at : at + CHUNK]
        # A finite sum has only finite terms, so details are checked only if the sum is not finite.
        with np.errstate(invalid="ignore", over="ignore"):
            total = np.sum(piece, dtype=np.float64)
        if np.isfinite(total):
            present = True
            continue
        bad = np.isinf(piece)
        present = present or not np.isnan(piece).all()
        if bad.any():
            first = first or _infinity_text(piece, bad, at, columns)
            count += int(np.count_nonzero(bad))
    if count:
        raise InputError(f"{count} infinite samples, {first}: mark missing samples with NaN")
    if not present:
        raise TooShortError("every sample is NaN")


def _infinity_text(
    piece: NDArray[Any], bad: NDArray[np.bool_], at: int, columns: Sequence[str] | None
) -> str:
    """Position of the first infinity: ``the first in column gx: sample 3, counted from 1, is inf``.

    `bad` is True at infinities of either sign. The first row of `piece` is sample `at` of the record, counted from 0.
    """
    row, *rest = (int(i) for i in np.argwhere(bad)[0])
    k = 1 if piece.ndim == 1 else piece.shape[1]
    names = columns if columns is not None and len(columns) == k else column_names(None, piece)
    name = names[rest[0] if rest else 0]
    return f"the first in column {name}: sample {at + row + 1}, counted from 1, is {piece[bad][0]}"


def column_names(columns: Sequence[str] | None, array: NDArray[Any]) -> tuple[str, ...]:
    """Printable, distinct names of the columns of an array: those given, or x, or x0, x1, ….

    Raises `InputError` for another number of names than columns.
    """
    k = 1 if array.ndim == 1 else array.shape[1]
    if columns is None:
        return default_names(k)
    if len(columns) != k:
        raise InputError(f"{len(columns)} column names for {k} columns")
    return distinct_names(plain(name) for name in columns)


def default_names(k: int) -> tuple[str, ...]:
    """Tuple of the names of k columns without names: ``x`` for a single one, else ``x0``, ``x1``, …."""
    return ("x",) if k == 1 else tuple(f"x{i}" for i in range(k))


def distinct_names(names: Iterable[str]) -> tuple[str, ...]:
    """Tuple of column names in which repeated names get a number: ``g``, ``g [2]``, ``g [3]``."""
    counts: dict[str, int] = {}
    found: dict[str, None] = {}
    for name in names:
        one, k = name, counts.get(name, 0)
        while k == 0 or one in found:
            k += 1
            one = name if k == 1 else f"{name} [{k}]"
        counts[name] = k
        found[one] = None
    return tuple(found)


def covariate_of(name: str, values: ArrayLike, n: int) -> Array:
    """Array of the values of a covariate as doubles, shape (n,). Raises `InputError` for another shape."""
    array = np.array(values, dtype=np.float64)
    if array.shape != (n,):
        raise InputError(f"covariate {name!r} has shape {array.shape}, the samples have {n} rows")
    return array


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, after its writeable flag is cleared."""
    array.flags.writeable = False
    return array


def stamps_of_index(samples: Any) -> NDArray[Any] | None:
    """Time stamps from the index of a pandas or xarray object, shape (n,); None without such an index.

    Date-times, time differences and floats are stamps. An index of whole numbers or of one stamp gives None.
    """
    index: Any = getattr(samples, "index", None)
    if not hasattr(index, "dtype"):
        coords: Any = getattr(samples, "coords", None)
        if not hasattr(coords, "values"):
            return None
        # The first dimension of an array; of a data set, whatever coordinate is a time.
        found = list(coords.values())
        if not hasattr(samples, "data_vars"):
            found = [coord for coord in found if coord.dims == samples.dims[:1]]
        index = next((coord for coord in found if coord.dtype.kind in "mMf"), None)
        if index is None:
            return None
    if getattr(index, "tz", None) is not None:
        index = index.tz_convert(None)
    stamps = np.asarray(index)
    return stamps if stamps.ndim == 1 and stamps.dtype.kind in "mMf" and stamps.size > 1 else None


def find_column(name: str | int, columns: Sequence[str]) -> int:
    """0-based index of a column that is given by its name, or by its index (an int or a text of digits).

    A column whose name is the text takes precedence over the index. Raises `InputError` for an unknown column.
    """
    if isinstance(name, str) and name in columns:
        return list(columns).index(name)
    if (isinstance(name, int) or name.isdecimal()) and 0 <= int(name) < len(columns):
        return int(name)
    near = get_close_matches(str(name), columns, 1)
    # The question comes first: a long list is cut.
    meant = f"did you mean {near[0]}? " if near else ""
    raise InputError(f"unknown column {name!r}: {meant}the columns are {', '.join(columns)}")


def group_means(values: NDArray[Any], k: int) -> NDArray[Any]:
    """Means of groups of k consecutive rows, shape (n // k, …); up to k − 1 last rows are omitted.

    Missing samples are ignored; a group that lacks more than half of its samples is NaN.
    """
    groups = values[: len(values) // k * k].reshape(-1, k, *values.shape[1:])
    found: NDArray[Any] = groups.mean(axis=1, dtype=np.float64)
    if np.isnan(found).any():
        there = np.count_nonzero(~np.isnan(groups), axis=1)
        total = np.nansum(groups, axis=1, dtype=np.float64)
        found = np.where(2 * there >= k, total / np.maximum(there, 1), np.nan)
    return found


def averaged(samples: NDArray[Any], k: int, quantity: str) -> NDArray[Any]:
    """Samples at 1/k of the rate, shape (n // k, …): means of k rates, sums of k increments, or every k-th angle.

    Missing samples are treated as in `group_means`; a sum with NaN is k times the mean of the others. The last n mod k
    samples are dropped.
    """
    m = len(samples) // k
    if quantity == "angle":
        return samples[: m * k : k]
    if quantity == "increment":
        sums: NDArray[Any] = samples[: m * k].reshape(m, k, *samples.shape[1:]).sum(axis=1)
        return group_means(samples, k) * k if np.isnan(sums).any() else sums
    return group_means(samples, k)


def unit_names(unit: Any, quantity: str, count: int) -> tuple[str, ...]:
    """Names of the units of the rates of `count` columns, from one text for all columns or one for each.

    The texts are units of samples of this `quantity`, as in `rate_unit`. Raises `InputError` for anything else.
    """
    try:
        units = (unit,) * count if isinstance(unit, str) else tuple(unit)
    except TypeError:
        units = (unit,)
    if not all(isinstance(name, str) for name in units):
        raise InputError(
            f"unit = {str(unit)[:40]!r}: give a name such as 'deg/s', or one for each column"
        )
    if len(units) != count:
        raise InputError(f"{len(units)} units for {count} columns")
    return tuple(rate_unit(name, quantity).name for name in units)


def factors_to(unit: str, units: tuple[str, ...]) -> tuple[Array, tuple[str, ...]]:
    """Factor that converts each column to `unit`, shape (columns,), and the unit of each.

    Columns of another kind of sensor keep their unit, with factor 1. Raises `InputError` if all columns do.
    """
    targets = {kind: parse_unit(one) for kind, one in units_by_kind(unit).items()}
    pairs = [(own, targets.get(parse_unit(own).kind)) for own in units]
    if not any(target for _, target in pairs):
        names, kind = ", ".join(dict.fromkeys(units)), parse_unit(units[0]).kind
        wanted = " or ".join(f"{target.name} ({target.kind})" for target in targets.values())
        raise InputError(f"cannot express {names} ({kind}) in {wanted}")
    factors = np.array([conversion(own, t.name) if t else 1.0 for own, t in pairs])
    return factors, tuple(t.name if t else own for own, t in pairs)


def from_pint(samples: Any, unit: str | Sequence[str]) -> tuple[Any, str | Sequence[str]]:
    """Tuple (numbers, unit) of a pint quantity: in its own unit if `unit` is ``"1"``, else converted to `unit`."""
    if unit == "1":
        return samples.magnitude, f"{samples.units:~C}".replace("**", "^")
    return samples.to(str(unit).replace("^", "**").replace("°", "deg")).magnitude, unit
