"""Read Parquet and Arrow (Feather) files with pyarrow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from allanite.common.errors import InputError
from allanite.common.memory import require_memory
from allanite.readers._format import LogFormat
from allanite.readers._isolated import isolated
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table, split_unit
from allanite.readers.frame import table_of
from allanite.recording.sensor_names import role_of


@isolated("pyarrow", 0.02, ["pyarrow.parquet", "pyarrow.feather"])
def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the numeric columns of a Parquet, Arrow or Feather file; a column of date-times is the time.

    Columns of text and of lists are not read, except text named like a time.
    """
    import pyarrow as pa
    from pyarrow import feather

    try:
        first = head_of(path)
        if first.startswith(b"PAR1"):
            table = _parquet_table(path)
        elif first.startswith(b"ARROW1"):
            table = _arrow_table(path)
        else:  # Feather version 1 is never compressed, so the memory budget is not checked
            table = feather.read_table(str(path), use_threads=False)
        # Offsets of a damaged column may point anywhere.
        table.validate(full=True)
    except MemoryError:  # ArrowMemoryError is also an ArrowException
        raise
    except (pa.ArrowException, OSError) as error:
        text = " ".join(str(error).split())[:200]
        raise InputError(f"damaged or not a Parquet or Arrow file ({text})") from None
    return table_of(table)


def _wanted_columns(schema: Any) -> list[int]:
    """Indices, ascending, of columns of numbers, Booleans or times, and of text columns named like a time.

    Raises `InputError` without a column of numbers or Booleans.
    """
    import pyarrow as pa

    types = pa.types
    number = (types.is_integer, types.is_floating, types.is_boolean)
    moment = (types.is_timestamp, types.is_date, types.is_time, types.is_duration)
    found, numbers = [], 0
    for place, field in enumerate(schema):
        kind = field.type.value_type if types.is_dictionary(field.type) else field.type
        is_number = any(is_a(kind) for is_a in number)
        numbers += is_number
        is_time = any(is_a(kind) for is_a in moment)
        is_text = types.is_string(kind) or types.is_large_string(kind)
        if is_number or is_time or (is_text and role_of(*split_unit(field.name)) == "time"):
            found.append(place)
    if not numbers:
        raise InputError(f"no column of numbers among {', '.join(schema.names) or 'none at all'}")
    return found


def _parquet_table(path: Path) -> Any:
    """Arrow table with the wanted columns of a Parquet file; the memory budget is checked before reading.

    Raises `InputError` for two columns of the same name.
    """
    import pyarrow as pa
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
        names = [schema.names[place] for place in _wanted_columns(schema)]
        if len(set(schema.names)) < len(schema.names):
            raise InputError("two of its columns have the same name: rename one of them")
        kinds = [schema.field(name).type for name in names]
        # A text has an offset of 32 bits; its length is not known.
        is_text = (pa.types.is_string, pa.types.is_large_string)
        bits = sum(32 if any(is_a(k) for is_a in is_text) else k.bit_width for k in kinds)
        require_memory(file.metadata.num_rows * bits / 8.0, "the unpacked file")
        # A name with a dot would otherwise be taken for the path of a nested column.
        leaves = [file.schema.column(k) for k in range(len(file.schema))]
        return file.read(
            columns=[leaf.path for leaf in leaves if leaf.name in names], use_threads=False
        )


def _arrow_table(path: Path) -> Any:
    """Arrow table with the wanted columns of an Arrow file; the memory budget is checked after each batch."""
    import pyarrow as pa

    size, batches = 0, []
    with pa.OSFile(str(path)) as stream, pa.ipc.open_file(stream) as file:
        wanted = _wanted_columns(file.schema)
    options = pa.ipc.IpcReadOptions(included_fields=wanted, use_threads=False)
    with pa.OSFile(str(path)) as stream, pa.ipc.open_file(stream, options=options) as file:
        for number in range(file.num_record_batches):
            batches.append(file.get_batch(number))
            size += batches[-1].nbytes
            require_memory(size, "the unpacked file")
        return pa.Table.from_batches(batches, file.schema)


FORMAT = LogFormat(
    "Parquet and Arrow",
    read,
    suffixes=(".parquet", ".feather", ".arrow"),
    reads="the columns of the table",
)
