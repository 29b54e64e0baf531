"""Numeric arrays and structures in MATLAB files up to version 7.2.

Every length is compared with the size of the file before it is used, so that a damaged file is an error and not a crash.
Cells, texts, sparse matrices and objects are skipped. Source: "MAT-File Format", The MathWorks, R2023a; chapter 2 for
version 4.
"""

from __future__ import annotations

import math
import struct
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.memory import require_memory

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

# miINT8 … miUINT64: types of numbers as stored in the file.
STORED = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
# miMATRIX and miCOMPRESSED: type codes of elements that hold an array or packed bytes.
MATRIX, COMPRESSED = 14, 15
# mxDOUBLE … mxUINT64: types of the arrays in MATLAB.
CLASSES = {
    6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8",
}  # fmt: skip
# mxSTRUCT_CLASS.
STRUCT = 2
#: Maximum depth of nested structures that are read.
MAX_DEPTH = 16
# Types of numbers in version 4, by the tens digit of the type code.
VERSION_4 = {0: "f8", 1: "f4", 2: "i4", 3: "i2", 4: "u2", 5: "u1"}

Named = tuple[str, "NDArray[Any]"]


def arrays(content: bytes) -> Iterator[Named]:
    """Yield (name, array) for each real numeric array in the bytes of a MATLAB file of version 4 to 7.2, squeezed.

    A field of a structure is named ``structure.field``. Complex arrays, texts, cells and arrays of structures yield
    nothing.

    Raises
    ------
    ValueError
        The file is damaged.
    """
    if len(content) >= 128 and content[126:128] in (b"IM", b"MI"):
        order = "<" if content[126:128] == b"IM" else ">"
        yield from _elements(memoryview(content)[128:], order)
    else:
        yield from _version_4(memoryview(content))


class _Reader:
    """Sequential reader of data elements; the attribute `at` is the position in bytes."""

    def __init__(self, content: memoryview, order: str) -> None:
        self.content, self.order, self.at = content, order, 0

    def more(self) -> bool:
        """True if at least one more element follows."""
        return self.at + 8 <= len(self.content)

    def take(self, count: int) -> memoryview:
        """Next `count` bytes; advances the position. Raises `ValueError` if fewer bytes are left."""
        if count < 0 or self.at + count > len(self.content):
            raise ValueError(f"{count} bytes are missing")
        self.at += count
        return self.content[self.at - count : self.at]

    def element(self) -> tuple[int, memoryview]:
        """Tuple (type code, contents) of the next element; advances the position past its padding.

        Raises `ValueError` if it is truncated or damaged. A compressed element stays compressed.
        """
        first, size = struct.unpack(f"{self.order}II", self.take(8))
        if first >> 16:  # a small element: up to four bytes in its tag
            kind, size = first & 0xFFFF, first >> 16
            if size > 4:
                raise ValueError("a small element of more than 4 bytes")
            return kind, self.content[self.at - 4 : self.at - 4 + size]
        data = self.take(size)
        if first != COMPRESSED:
            self.at = min(self.at + -size % 8, len(self.content))
        return first, data

    def numbers(self) -> NDArray[Any]:
        """Array of the numbers in the next element, shape (n,); advances the position.

        Raises `ValueError` if the element holds no numbers.
        """
        kind, data = self.element()
        if kind not in STORED:
            raise ValueError(f"numbers of unknown type {kind}")
        dtype = np.dtype(self.order + STORED[kind])
        return np.frombuffer(data, dtype, len(data) // dtype.itemsize)


def _elements(content: memoryview, order: str) -> Iterator[Named]:
    """Yield (name, array) for each real numeric array in a file of version 5 to 7.2; `order` is the byte order."""
    reader = _Reader(content, order)
    while reader.more():
        kind, data = reader.element()
        if kind == COMPRESSED:
            data = _unpacked(data, order)
            kind, data = _Reader(data, order).element()
        if kind == MATRIX:
            yield from _matrix(data, order, None, 0)


def _unpacked(data: memoryview, order: str) -> memoryview:
    """Bytes of a compressed element after decompression.

    Raises `InputError` if they exceed the memory budget, and `ValueError` if they are damaged.
    """
    unpacker = zlib.decompressobj()
    try:
        head = unpacker.decompress(data, 8)
        size = max(struct.unpack(f"{order}II", head)[1], 8) if len(head) == 8 else 8
        size = min(size, 1032 * len(data))  # zlib cannot compress by a larger factor
        require_memory(2.0 * size, "a packed array")
        return memoryview(head + unpacker.decompress(unpacker.unconsumed_tail, size))
    except zlib.error as error:
        raise ValueError(str(error)) from None


def _matrix(data: memoryview, order: str, name: str | None, depth: int) -> Iterator[Named]:
    """Yield (name, array) of a real numeric matrix element, or of every such array in the fields of a structure.

    `name` replaces the name in the element unless it is None. Other elements, and structures nested over 16 deep, yield
    nothing. Raises `ValueError` for damaged elements.
    """
    if len(data) == 0:
        return
    reader = _Reader(data, order)
    flags = reader.numbers()
    if flags.size < 1:
        raise ValueError("an array without flags")
    kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & 0x800)
    shape = tuple(int(length) for length in reader.numbers())
    if len(shape) > 32 or any(length < 0 for length in shape):
        raise ValueError(f"an array of shape {shape[:4]}")
    own = bytes(reader.element()[1]).decode("utf-8", "replace")
    name = own if name is None else name
    if kind == STRUCT and math.prod(shape) == 1 and depth < MAX_DEPTH:
        yield from _fields(reader, name, depth)
    elif kind in CLASSES and not is_complex:
        found = reader.numbers()
        if found.size != math.prod(shape):
            raise ValueError(f"{found.size} numbers for an array of shape {shape[:4]}")
        values = found.astype(CLASSES[kind], copy=False).reshape(shape, order="F")
        yield name, np.squeeze(values)


def _fields(reader: _Reader, name: str, depth: int) -> Iterator[Named]:
    """Yield (``name.field``, array) for each numeric array in the fields of one structure, in their order.

    Advances `reader`. Raises `ValueError` if the structure is damaged.
    """
    length = reader.numbers()
    names = bytes(reader.element()[1])
    each = int(length[0]) if length.size == 1 else 0
    if each < 1:
        raise ValueError("a structure without the length of its names")
    for at in range(0, len(names) // each * each, each):
        field = names[at : at + each].split(b"\0")[0].decode("utf-8", "replace")
        kind, data = reader.element()
        if kind != MATRIX:
            raise ValueError("a field is not an array")
        yield from _matrix(data, reader.order, f"{name}.{field}", depth + 1)


def _version_4(content: memoryview) -> Iterator[Named]:
    """Yield (name, array) for each real numeric array in the bytes of a file of version 4.

    Text, sparse and complex arrays are skipped. Raises `ValueError` for a damaged header.
    """
    order = "<"
    if len(content) >= 4 and not 0 <= struct.unpack("<i", content[:4])[0] < 5000:
        order = ">"
    reader = _Reader(content, order)
    while reader.at < len(content):
        kind, rows, columns, is_complex, length = struct.unpack(f"{order}5i", reader.take(20))
        thousands, number, form = kind // 1000, kind // 10 % 10, kind % 10
        if thousands not in (0, 1) or number not in VERSION_4 or min(rows, columns, length) < 0:
            raise ValueError("not the header of an array")
        name = bytes(reader.take(length)).split(b"\0")[0].decode("latin-1")
        dtype = np.dtype(order + VERSION_4[number])
        data = reader.take(rows * columns * dtype.itemsize * (2 if is_complex else 1))
        if form == 0 and not is_complex:
            values = np.frombuffer(data, dtype).reshape((rows, columns), order="F")
            yield name, np.squeeze(values.astype(VERSION_4[number], copy=False))
