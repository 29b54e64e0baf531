"""HDF5 files are first read by a process that may die of them: libhdf5 ends its own on some damaged ones."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["tried"]

#: Everything that a damaged file can make the library stumble over, in a process that may die of it.
TRIAL = """
import sys, h5py
def visit(name, item):
    dict(item.attrs)
    if isinstance(item, h5py.Dataset):
        item.dtype
        for part in item.iter_chunks() if item.chunks else ():
            item[part]
with h5py.File(sys.argv[1], "r") as file:
    dict(file.attrs)
    file.visititems(visit)
"""


def tried(path: Path) -> None:
    """Refuse a file by which the library dies; it then takes only a process of its own with it (a third of a second).

    Raises
    ------
    InputError
        A signal, or its like on Windows, ended the trial.
    """
    if not sys.executable:  # embedded: nothing to start
        return
    # -P: a file of the working folder is no library. What merely raises is told by the reading itself.
    command = [sys.executable, "-P", "-c", TRIAL, str(path)]
    ended = subprocess.run(command, capture_output=True, check=False).returncode
    if ended < 0 or ended > 255:
        raise InputError("damaged: the HDF5 library dies of it")
