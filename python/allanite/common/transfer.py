"""Write a value with its arrays to a file and read it back. Unlike a pickle, the file cannot run code."""

from __future__ import annotations

import json
import math
import mmap
import struct
from typing import IO, TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAGIC = b"allanite"
#: Last bytes of the file: length of the JSON text before them, and the magic bytes.
TRAILER = struct.Struct("<Q8s")
#: Arrays begin at multiples of this many bytes: the size of a cache line, which is enough for every dtype.
ALIGNMENT = 64
#: Size of a file from which it is memory-mapped instead of read, bytes. Smaller files are read faster than mapped.
MAPPED = 1 << 22
#: Number of elements per write, so that a strided column is copied in blocks and not as a whole.
BLOCK = 1 << 18
#: Kinds of dtype that can be transferred: numbers, booleans, date-times and text, but no objects.
KINDS = "biufcmMSU"


def write_value(value: Any, file: IO[bytes]) -> None:
    """Write a value to a file. Allowed are None, bool, int, float, str, list, tuple, dict (keys: str) and arrays.

    NumPy scalars become plain numbers. The file is flushed, not closed.

    Raises
    ------
    TypeError
        The value holds something else, for example an array of objects.
    """
    text = json.dumps(_to_json(value, file)).encode("ascii")
    file.write(text)
    file.write(TRAILER.pack(len(text), MAGIC))
    file.flush()


def read_value(file: IO[bytes]) -> Any:
    """Value that `write_value` wrote. Tuples become lists; arrays in files above 4 MiB are memory-mapped.

    Raises
    ------
    ValueError
        The file is incomplete or damaged.
    """
    size = file.seek(0, 2)
    if size < TRAILER.size:
        raise ValueError("the file is incomplete")
    file.seek(size - TRAILER.size)
    length, magic = TRAILER.unpack(file.read(TRAILER.size))
    if magic != MAGIC or length > size - TRAILER.size:
        raise ValueError("the file is incomplete")
    file.seek(size - TRAILER.size - length)
    document = json.loads(file.read(length))
    return _from_json(document, _array_bytes(file, size - TRAILER.size - length))


def _array_bytes(file: IO[bytes], size: int) -> Any:
    """First `size` bytes of a file, which contain the arrays: a uint8 array, or above 4 MiB an `mmap.mmap` object.

    Changes of the map stay in this process.
    """
    if size > MAPPED:
        return mmap.mmap(file.fileno(), size, access=mmap.ACCESS_COPY)
    file.seek(0)
    # The memory of a NumPy array is aligned, the memory of a bytes object may not be.
    content = np.empty(size, dtype=np.uint8)
    content[:] = np.frombuffer(file.read(size), dtype=np.uint8)
    return content


def _to_json(value: Any, file: IO[bytes]) -> Any:
    """JSON form of a value: a plain value, or a list that begins with ``"array"``, ``"dict"`` or ``"list"`` (also tuples).

    The elements of its arrays are written to `file`; NumPy scalars become plain. Raises `TypeError` for a value that
    cannot be transferred, such as a dict with keys that are no texts.
    """
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in KINDS:
            raise TypeError(f"an array of {value.dtype} cannot be transferred")
        return ["array", value.dtype.str, list(value.shape), _write_array(value, file)]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, dict):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"a dict with a key of {type(key).__name__} cannot be transferred")
        return ["dict", [[key, _to_json(item, file)] for key, item in value.items()]]
    if isinstance(value, (list, tuple)):
        return ["list", [_to_json(item, file) for item in value]]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"a {type(value).__name__} cannot be transferred")


def _write_array(array: NDArray[Any], file: IO[bytes]) -> int:
    """Write the elements of an array to the file in C order, after padding; return their offset, a multiple of 64."""
    begin = file.tell()
    file.write(bytes(-begin % ALIGNMENT))
    begin = file.tell()
    if array.size == 0:
        return begin
    if array.ndim == 0:
        array = array.reshape(1)
    rows = max(1, BLOCK // max(1, math.prod(array.shape[1:])))
    for first in range(0, len(array), rows):
        # Date-times do not support the buffer protocol, so the block is viewed as bytes.
        block = np.ascontiguousarray(array[first : first + rows])
        file.write(block.reshape(-1).view(np.uint8).data)
    return begin


def _from_json(value: Any, content: Any) -> Any:
    """Value whose JSON form `_to_json` made; its arrays are views of `content`, empty ones new arrays, and tuples lists.

    Raises `ValueError` for arrays of objects and unknown forms.
    """
    if not isinstance(value, list):
        return value
    kind, *rest = value
    if kind == "array":
        text, shape, begin = rest
        dtype = np.dtype(text)
        if dtype.kind not in KINDS:
            raise ValueError(f"arrays of {dtype} are not allowed")
        count = math.prod(shape)
        if count == 0 or dtype.itemsize == 0:
            return np.zeros(shape, dtype)
        return np.frombuffer(content, dtype, count, begin).reshape(shape)
    if kind == "dict":
        return {key: _from_json(item, content) for key, item in rest[0]}
    if kind == "list":
        return [_from_json(item, content) for item in rest[0]]
    raise ValueError(f"unknown kind of value: {kind}")
