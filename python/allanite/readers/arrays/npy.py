"""NPY: one array, no names, no units."""

from __future__ import annotations

import math
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import AllaniteError, InputError
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table, check_shape, columns_of
from allanite.recording.samples import default_names

#: Size above which a file is memory-mapped instead of read, bytes.
MAX_READ_BYTES = 1 << 26


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of an NPY file (NumPy array) of shape (n,) or (n, columns), without units and rate."""
    return table_of(load(path))


def table_of(data: NDArray[Any]) -> Table:
    """`Table` of an array of shape (n, columns): names ``x``, or ``x0``, ``x1`` … for several columns, without units."""
    k = data.shape[1]
    return Table(default_names(k), columns_of(data), (None,) * k, named=False)


def load(path: Path, largest_read: int = MAX_READ_BYTES) -> NDArray[Any]:
    """Array of shape (n, columns) from an NPY file, memory-mapped if it has more than `largest_read` bytes.

    Raises `InputError` if the file is damaged or holds something else, and `TooShortError` without samples.
    """
    try:
        with path.open("rb") as stream:
            shape, dtype = _read_header(stream)
            there = path.stat().st_size - stream.tell()
            _check_header(shape, dtype, there)
            # A large array stays in its file, and need not fit into memory.
            if there <= largest_read:
                stream.seek(0)
                data = np.load(stream, allow_pickle=False)
            else:
                data = np.load(path, mmap_mode="r", allow_pickle=False)
    except (AllaniteError, MemoryError, OSError):
        raise
    except Exception as error:  # damaged heads make the library raise all kinds of errors
        raise InputError(
            f"damaged or truncated NPY file, or pickled objects, which are never loaded ({error}):"
            " save a plain array"
        ) from None
    return data if data.ndim == 2 else data[:, np.newaxis]


def _read_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and dtype of the array that follows in an open NPY file; the stream is then at its first byte.

    Raises `ValueError` for another version than 1.0 or 2.0.
    """
    version = np.lib.format.read_magic(stream)
    # Version 3 is only needed for field names, which an array of numbers does not have.
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise ValueError(f"version {version[0]}.{version[1]} of the format")
    shape, _, dtype = readers[version](stream)
    return shape, dtype


def _check_header(shape: tuple[int, ...], dtype: np.dtype[Any], there: int) -> None:
    """Raise an error if the array is not one of samples, or needs more than the `there` bytes after the header.

    `InputError` for a wrong shape or dtype, `ValueError` for a file that is too short, `TooShortError` without samples.
    """
    if len(shape) not in (1, 2) or dtype.kind not in "iufb":
        pickled = (
            ": pickled objects are never loaded, save a plain array" if dtype.hasobject else ""
        )
        raise InputError(
            f"samples must be numbers of shape (n,) or (n, columns), found {dtype} of shape {shape}{pickled}"
        )
    needed = math.prod(shape) * dtype.itemsize
    if needed > there:
        raise ValueError(f"shape {shape} of {dtype} needs {needed} bytes, the file has {there}")
    check_shape(shape)


FORMAT = LogFormat(
    "NumPy array",
    read,
    suffixes=(".npy",),
    magic=((b"\x93NUMPY", ".npy"),),
    reads="the columns of the array",
)
