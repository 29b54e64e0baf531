"""NPY: one array, no names, no units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._table import Table, columns_of

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker

__all__ = ["read"]

MAPPED = 1 << 26  # bytes above which a file is mapped, not read


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read an array of shape (n,) or (n, columns); pickled objects are never loaded."""
    try:
        # A large array stays in its file, and need not fit into memory.
        if path.stat().st_size > MAPPED:
            data = np.load(path, mmap_mode="r", allow_pickle=False)
        else:
            with path.open("rb") as stream:
                data = np.load(stream, allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise InputError(
            f"damaged or truncated NPY file, or pickled objects, which are never loaded ({error}):"
            " save a plain array"
        ) from None
    if data.ndim == 1:
        data = data[:, np.newaxis]
    if data.ndim != 2 or data.dtype.kind not in "iufb":
        raise InputError(
            f"samples must be numbers of shape (n,) or (n, columns), found {data.dtype} of"
            f" shape {data.shape}"
        )
    k = data.shape[1]
    names = ("x",) if k == 1 else tuple(f"x{i}" for i in range(k))
    return Table(names, columns_of(data), (None,) * k, named=False)
