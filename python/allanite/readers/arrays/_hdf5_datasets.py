"""Numeric datasets of an HDF5 file. Datasets and links that would read another file are refused."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.memory import require_memory
from allanite.common.plain import plain

#: Processor time per megabyte of a file with chunks of one sample, the slowest kind, s (measured with h5py 3.16).
SECONDS_PER_MEGABYTE = 0.2

Dataset = Any  # h5py.Dataset; h5py is imported in the child process only


def datasets(file: Any) -> list[tuple[str, Dataset]]:
    """Name (``group/name``) and dataset of all numeric or partly numeric datasets of an open HDF5 file, without reading.

    Raises `InputError` for a virtual dataset, external storage or an external link, all of which read another file, and
    if the numbers exceed the memory budget.
    """
    import h5py

    def name_if_external(name: bytes, info: Any) -> bytes | None:
        """Name of a link if it leads to another file, which ends the search; None for hard and soft links."""
        return None if info.type in (h5py.h5l.TYPE_HARD, h5py.h5l.TYPE_SOFT) else name

    # `visit` examines links without following them. The library would swallow an error raised inside.
    external = file.id.links.visit(name_if_external, info=True)
    if external is not None:
        name = plain(external.decode("utf-8", "replace"), 60)
        raise _external_data_error(f"link {name} is external")
    found: list[tuple[str, Dataset]] = []

    def check_object(name: str, item: Any) -> None:
        """Add a numeric dataset to `found`; raise `InputError` for a dataset that reads another file."""
        if isinstance(item, h5py.Dataset):
            layout = item.id.get_create_plist()
            if layout.get_layout() == h5py.h5d.VIRTUAL:
                raise _external_data_error(f"dataset {plain(name, 60)} is virtual")
            if layout.get_external_count() > 0:
                raise _external_data_error(f"dataset {plain(name, 60)} has external storage")
            if item.shape is not None and _numeric_fields(item.dtype) is not None:
                found.append((name, item))

    file.visititems(check_object)
    require_memory(
        sum(item.size * _bytes_per_item(item.dtype) for _, item in found), "the unpacked file"
    )
    return found


def numbers(item: Dataset) -> NDArray[Any]:
    """Array of the values of a dataset; for a compound type, a structured array of its numeric fields."""
    fields = _numeric_fields(item.dtype)
    values: NDArray[Any] = item.fields(fields)[()] if fields else item[()]
    return values


def _external_data_error(found: str) -> InputError:
    """`InputError` (not raised) that data are in another file; `found` is the problem (``dataset x is virtual``)."""
    return InputError(
        f"{found} and would read another file: copy the samples into one file without such links (with h5py)"
    )


def _numeric_fields(dtype: Any) -> list[str] | None:
    """Numeric fields of a compound type; empty for a plain numeric type, None if nothing is numeric."""
    if dtype.names is None:
        return [] if dtype.kind in "iufb" else None
    return [name for name in dtype.names if dtype[name].kind in "iufb"] or None


def _bytes_per_item(dtype: Any) -> int:
    """Bytes of memory that one item of a dataset needs: those of its numeric fields, or of the plain number."""
    fields = _numeric_fields(dtype)
    if not fields:
        return int(dtype.itemsize)
    return sum(int(dtype[name].itemsize) for name in fields)
