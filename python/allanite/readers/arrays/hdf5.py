"""Read HDF5 and netCDF 4 with h5py and netCDF 3 with scipy: the arrays of one length, with units from attributes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.unit_kinds import time_unit
from allanite.readers._format import LogFormat
from allanite.readers._isolated import isolated, refused_as
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.arrays._hdf5_datasets import SECONDS_PER_MEGABYTE, datasets, numbers
from allanite.readers.arrays.matlab import RATES, assemble


@isolated("the HDF5 library", SECONDS_PER_MEGABYTE, ["h5py"])
def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the numeric arrays of the largest length in an HDF5 or netCDF file, also in groups.

    An attribute ``units`` is the unit; ``scale_factor`` and ``add_offset`` are applied. An attribute or scalar named
    rate, fs, … is the sampling rate. Raises `InputError` for a damaged file, and without a numeric array.
    """
    is_netcdf3 = head_of(path).startswith(b"CDF")
    found, attributes = (_arrays_of_netcdf3 if is_netcdf3 else _arrays_of_hdf5)(path)
    units = {}
    for name, own in attributes.items():
        for key, value in own.items():
            if key.lower() in RATES and name not in found and np.size(value) == 1:
                found[key] = np.asarray(value, dtype=np.float64)
        unit = own.get("units", own.get("unit"))
        if isinstance(unit, bytes):
            unit = unit.decode("utf-8", "replace")
        if isinstance(unit, str) and unit.strip() and name in found:
            word, _, since = unit.strip().partition(" since ")
            # "milliseconds since 2026-01-01"
            units[name] = (time_unit(word) or unit) if since else unit.strip()
        for key in ("scale_factor", "add_offset"):
            if key in own and name in found:
                value = float(np.asarray(own[key]).reshape(-1)[0])
                found[name] = found[name] * value if key == "scale_factor" else found[name] + value
    return assemble(found, units)


def _arrays_of_hdf5(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, dict[str, Any]]]:
    """Numeric arrays of an HDF5 file, and attributes of each object, both by name with dots.

    Fields of a table are arrays of their own. The key ``""`` has the attributes of the file. Scales of dimensions
    without values are left out.
    """
    import h5py

    found: dict[str, NDArray[Any]] = {}
    attributes: dict[str, dict[str, Any]] = {}

    def note_attributes(name: str, item: Any) -> None:
        """Put the attributes of an object into `attributes`, under its name with dots instead of slashes."""
        attributes[name.replace("/", ".")] = dict(item.attrs)

    with refused_as("an HDF5 file"), h5py.File(path, "r") as file:
        every = datasets(file)
        attributes[""] = dict(file.attrs)
        file.visititems(note_attributes)
        for name, item in every:
            key = name.replace("/", ".")
            scale_name = attributes[key].get("NAME")
            if isinstance(scale_name, bytes) and scale_name.startswith(b"This is a netCDF dim"):
                continue
            values = numbers(item)
            if values.dtype.names is None:
                found[key] = np.squeeze(values)
            elif values.ndim == 1:  # a table, whose fields are columns
                found |= {
                    f"{key}.{f}": values[f] for f in values.dtype.names if values[f].ndim == 1
                }
    return found, attributes


def _arrays_of_netcdf3(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, dict[str, Any]]]:
    """Numeric arrays of a netCDF 3 file, and attributes of each variable, by name; ``""`` has those of the file."""
    from scipy.io import netcdf_file

    with refused_as("a netCDF file"), netcdf_file(str(path), "r", mmap=False) as file:
        found = {
            name: np.array(var.data, dtype=var.data.dtype.newbyteorder("="))
            for name, var in file.variables.items()
            if var.data.dtype.kind in "iuf"
        }
        attributes = {
            name: dict(getattr(var, "_attributes", {})) for name, var in file.variables.items()
        }
        attributes[""] = dict(getattr(file, "_attributes", {}))
    return found, attributes


FORMAT = LogFormat(
    "HDF5 and netCDF",
    read,
    suffixes=(".h5", ".hdf5", ".hdf", ".nc", ".nc4", ".cdf"),
    reads="the datasets of one length",
)
