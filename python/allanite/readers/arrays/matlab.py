"""Read MATLAB files: up to version 7.2 with SciPy, version 7.3 (HDF5) with h5py."""

from __future__ import annotations

import math
import re
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.common.memory import require_memory
from allanite.readers import text
from allanite.readers._format import LogFormat
from allanite.readers._isolated import isolated, refused_as
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.arrays._hdf5_datasets import SECONDS_PER_MEGABYTE, datasets, numbers

#: Names of scalars that are the sampling rate, in lower case.
RATES = (
    "fs",
    "rate",
    "rate_hz",
    "sample_rate",
    "samplerate",
    "sampling_rate",
    "f_s",
    "sampling_frequency",
)
#: Bytes of a number of each class of MATLAB.
_BYTES = {"double": 8, "single": 4, "logical": 1} | {
    f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)
}


def read(path: Path, pick: Picker) -> Table:
    """`Table` of the longest numeric arrays in a MATLAB file, also in structures (see `assemble`).

    A file written by ``save -ascii`` is read as text.
    """
    begin = head_of(path)
    if re.match(rb"\s*[-+\d]", begin):
        return text.read(path, pick)  # written by save -ascii
    # The signature of HDF5 is at the start, or after MATLAB's header of 512 bytes.
    is_hdf5 = b"\x89HDF" in (begin[:4], begin[512:516])
    return read_v73(path, pick) if is_hdf5 else read_up_to_v72(path, pick)


def assemble(found: Mapping[str, NDArray[Any]], units: Mapping[str, str] | None = None) -> Table:
    """`Table` of the longest arrays, in the order of `found`; each array is one or several columns.

    An array with more columns than rows is transposed first. Arrays of more than two dimensions and shorter arrays are
    left out. A scalar named Fs, rate, … is the sampling rate. Names keep only their last part if it is unique. Raises
    `InputError` without a numeric array. The columns of an array with three get the endings ``_x``, ``_y``, ``_z``;
    those of other arrays ``_0``, ``_1``, ….
    """
    rate = next(
        (
            float(a.reshape(()))
            for name, a in found.items()
            if a.size == 1 and name.split(".")[-1].lower() in RATES
        ),
        None,
    )
    tall = {name: _one_sample_per_row(a) for name, a in found.items() if a.size > 1 and a.ndim <= 2}
    if not tall:
        raise InputError(f"no numeric array among {', '.join(found) or 'no variables'}")
    n = max(len(a) for a in tall.values())
    last_parts = Counter(name.split(".")[-1] for name in tall)
    columns: list[tuple[str, NDArray[Any], str | None]] = []
    for name, a in tall.items():
        if len(a) != n:
            continue
        last = name.split(".")[-1]
        short = last if last_parts[last] == 1 else name
        k = a.shape[1]
        suffixes = (
            [""] if k == 1 else [f"_{c}" for c in "xyz"] if k == 3 else [f"_{i}" for i in range(k)]
        )
        unit = (units or {}).get(name)
        columns += [(short + suffix, x, unit) for suffix, x in zip(suffixes, a.T, strict=True)]
    return Table.of(columns, rate=rate)


def _one_sample_per_row(array: NDArray[Any]) -> NDArray[Any]:
    """Array of shape (n, columns) with one sample per row: transposed if it has more columns than rows."""
    a = array.reshape(-1, 1) if array.ndim < 2 else array
    return a.T if a.shape[0] < a.shape[1] else a


@isolated("the MATLAB reader of SciPy", SECONDS_PER_MEGABYTE, ["scipy.io"])
def read_up_to_v72(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the longest real numeric arrays in a file of version 4 to 7.2, also in structures (see `assemble`).

    Complex and sparse arrays, texts, cells and arrays of structures are left out.
    """
    from scipy.io import loadmat, whosmat

    with refused_as("a MATLAB file"):
        sizes = [math.prod(shape) * _BYTES.get(kind, 0) for _, shape, kind in whosmat(path)]
        require_memory(sum(sizes), "the unpacked file")
        load = partial(loadmat, path, squeeze_me=True, struct_as_record=False)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", np.exceptions.ComplexWarning)
                content = load(mat_dtype=True)
        except np.exceptions.ComplexWarning:
            # With MATLAB's types, SciPy makes complex arrays real; without them, doubles may be stored as integers.
            content = load(mat_dtype=False)
        found = {
            name: array
            for key, value in content.items()
            if not key.startswith("__")
            for name, array in _numeric_arrays(key, value)
        }
    return assemble(found)


def _numeric_arrays(name: str, value: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield (name, array) of a real numeric array, or of each one inside a structure, named ``structure.field``."""
    from scipy.io.matlab import mat_struct

    if isinstance(value, mat_struct):
        for field, inner in vars(value).items():
            yield from _numeric_arrays(f"{name}.{field}", inner)
    elif isinstance(value, np.ndarray | int | float) and np.asarray(value).dtype.kind in "iufb":
        yield name, np.asarray(value)


@isolated("the HDF5 library", SECONDS_PER_MEGABYTE, ["h5py"])
def read_v73(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the longest numeric arrays in a file of version 7.3, which is HDF5 (see `assemble`).

    Names contain the groups with dots. Compound datasets and contents of cells are left out.
    """
    import h5py

    with refused_as("a MATLAB 7.3 file"), h5py.File(path, "r") as file:
        # HDF5 stores MATLAB's columns as rows. The contents of cells are in #refs#.
        found = {
            name.replace("/", "."): np.squeeze(numbers(item)).T
            for name, item in datasets(file)
            if item.dtype.names is None and "#refs#" not in name
        }
    return assemble(found)


FORMAT = LogFormat(
    "MATLAB",
    read,
    suffixes=(".mat",),
    reads="the variables of one length",
)
