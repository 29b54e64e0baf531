"""Write a value with its arrays to a file and read it back. Unlike a pickle, the file cannot run code."""

from __future__ import annotations

import json
import math
import mmap
from collections.abc import Callable
from functools import partial
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

#: Length of the last line of the file, bytes: the place of the JSON text, so that an incomplete file is recognized.
TRAILER_LENGTH = 21
#: Arrays begin at multiples of this many bytes: the size of a cache line, which is enough for every dtype.
ALIGNMENT = 64
#: Number of elements per write, so that a strided column is copied in blocks and not as a whole.
BLOCK = 1 << 18
#: Kinds of dtype that can be transferred: numbers, booleans, date-times and text, but no objects.
KINDS = "biufcmMSU"


def write_value(value: Any, file: IO[bytes]) -> None:
    """Write a value to a file. Allowed are None, bool, int, float, str, list, tuple, dict (keys: str) and arrays.

    NumPy scalars become plain numbers. Raises `TypeError` for anything else. The file is flushed, not closed.
    """
    text = json.dumps(without_arrays(value, partial(_write_array, file)), default=np.generic.item)
    begin = file.tell()
    file.write(f"{text}\n{begin:0{TRAILER_LENGTH - 1}}\n".encode("ascii"))
    file.flush()


def read_value(file: IO[bytes]) -> Any:
    """Value that `write_value` wrote. Tuples become lists; arrays are memory-mapped. Raises `ValueError` if damaged."""
    content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
    document = json.loads(content[int(content[-TRAILER_LENGTH:]) : -TRAILER_LENGTH])
    return with_arrays(document, partial(_read_array, content))


def _write_array(file: IO[bytes], array: NDArray[Any]) -> tuple[str, tuple[int, ...], int]:
    """Write an array to a file in C order; returns (dtype as text, shape, offset in the file in bytes).

    Raises `TypeError` for a dtype that cannot be transferred.
    """
    if array.dtype.kind not in KINDS:
        raise TypeError(f"an array of {array.dtype} cannot be transferred")
    file.write(bytes(-file.tell() % ALIGNMENT))
    begin, rows = file.tell(), np.atleast_1d(array)
    step = max(1, BLOCK // max(1, math.prod(rows.shape[1:])))
    for first in range(0, len(rows), step):
        # Date-times do not support the buffer protocol, so the block is viewed as bytes.
        block = np.ascontiguousarray(rows[first : first + step])
        file.write(block.reshape(-1).view(np.uint8).data)
    return array.dtype.str, array.shape, begin


def _read_array(content: mmap.mmap, place: tuple[str, list[int], int]) -> NDArray[Any]:
    """Array at a `place` as `_write_array` returned it; raises `ValueError` for a place or dtype that is not allowed."""
    dtype, shape, begin = np.dtype(place[0]), place[1], place[2]
    if dtype.kind not in KINDS:
        raise ValueError(f"arrays of {dtype} are not allowed")
    count = math.prod(shape)
    if count == 0 or dtype.itemsize == 0:
        return np.zeros(shape, dtype)
    return np.frombuffer(content, dtype, count, begin).reshape(shape)


def without_arrays(value: Any, put: Callable[[NDArray[Any]], Any]) -> Any:
    """Copy of a value in which each array is replaced by the dict ``{"array": put(array)}``; tuples become lists."""
    if isinstance(value, np.ndarray):
        return {"array": put(value)}
    if isinstance(value, dict):
        return {key: without_arrays(item, put) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_arrays(item, put) for item in value]
    return value


def with_arrays(value: Any, get: Callable[[Any], NDArray[Any]]) -> Any:
    """Copy of a value in which each dict ``{"array": x}`` is replaced by ``get(x)``; inverse of `without_arrays`."""
    if isinstance(value, dict):
        if value.keys() == {"array"}:
            return get(value["array"])
        return {key: with_arrays(item, get) for key, item in value.items()}
    return [with_arrays(item, get) for item in value] if isinstance(value, list) else value
