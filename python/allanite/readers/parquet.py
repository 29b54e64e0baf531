"""Parquet and Arrow (Feather) files, by pyarrow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.memory import require
from allanite.readers._isolated import isolated
from allanite.readers.frame import table_of

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.readers._table import Picker, Table

__all__ = ["read"]


@isolated("pyarrow", 0.02, ["pyarrow.parquet", "pyarrow.feather"])
def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """Read the numeric columns; one of date-times is the time.

    Raises
    ------
    InputError
        A damaged or truncated file, or no numeric column in it.
    """
    import pyarrow as pa

    try:
        with path.open("rb") as stream:
            first = stream.read(6)
        read = _parquet if first[:4] == b"PAR1" else _arrow if first == b"ARROW1" else _feather
        table = read(path)
        # Offsets of a damaged column of text may ask for gigabytes.
        table.validate(full=True)
    except (pa.ArrowException, OSError) as error:
        text = " ".join(str(error).split())[:200]
        raise InputError(f"damaged or not a Parquet or Arrow file ({text})") from None
    return table_of(table)


def _parquet(path: Path) -> Any:
    """A packed file can be a thousandth of what it holds: its rows are counted before they are read."""
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        widths = [_bits(column.type) for column in file.schema_arrow]
        require(file.metadata.num_rows * sum(widths) / 8, "it unpacked")
    return parquet.read_table(path)


def _bits(kind: Any) -> int:
    """Bits of a value; of text and lists those of its place alone."""
    try:
        return int(kind.bit_width)
    except ValueError:
        return 32


def _arrow(path: Path) -> Any:
    """One piece after the other: none says how large it is before it is unpacked."""
    import pyarrow as pa

    size, pieces = 0, []
    with pa.OSFile(str(path)) as stream, pa.ipc.open_file(stream) as file:
        for number in range(file.num_record_batches):
            pieces.append(file.get_batch(number))
            size += pieces[-1].nbytes
            require(size, "it unpacked")
        return pa.Table.from_batches(pieces, file.schema)


def _feather(path: Path) -> Any:
    """The first version of the format, which packs nothing."""
    from pyarrow import feather

    return feather.read_table(str(path))
