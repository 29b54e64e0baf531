"""Arrays of samples: taken over, checked, made read-only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.errors import InputError, TooShortError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

__all__ = ["column_names", "covariate", "locked", "own"]


def own(samples: object, where: str) -> NDArray[Any]:
    """Array of one or two dimensions that nobody else can write to."""
    array = np.asarray(samples)
    if array.dtype.kind == "b":
        array = array.astype(np.int64)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{where}samples must be real numbers, found {array.dtype}")
    if array.ndim not in (1, 2):
        raise InputError(
            f"{where}samples must have shape (n,) or (n, columns), found {array.shape}"
        )
    if array.size == 0:
        raise TooShortError(f"{where}no samples")
    if array.dtype.kind == "f":
        bad = np.isinf(array)
        if bad.any():
            row = int(np.argwhere(bad)[0][0])
            raise InputError(
                f"{where}{np.count_nonzero(bad)} infinite samples, the first in row {row}:"
                " mark missing samples with NaN"
            )
        if np.isnan(array).all():
            raise TooShortError(f"{where}every sample is NaN")
    if array.flags.writeable:
        # A view, or an array someone else holds, could change under a running computation.
        array = array.copy()
    return array


def column_names(columns: Sequence[str] | None, array: NDArray[Any]) -> tuple[str, ...]:
    """Check the names given, or make them up: x, or x0 and so on."""
    k = 1 if array.ndim == 1 else array.shape[1]
    if columns is None:
        return ("x",) if k == 1 else tuple(f"x{i}" for i in range(k))
    if len(columns) != k:
        raise InputError(f"{len(columns)} column names for {k} columns")
    return tuple(columns)


def covariate(name: str, values: ArrayLike, n: int, where: str) -> NDArray[np.float64]:
    """Take over a covariate of n rows."""
    array = np.array(values, dtype=np.float64)
    if array.shape != (n,):
        raise InputError(
            f"{where}covariate {name!r} has shape {array.shape}, the samples have {n} rows"
        )
    return array


def locked(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only and return it."""
    array.flags.writeable = False
    return array
