"""HDF5 files are first read by a process that may die of them: on damaged ones libhdf5 ends its own, or never ends."""

from __future__ import annotations

import signal
import subprocess
import sys
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.memory import budget

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["tried"]

ENDLESS = "damaged: the HDF5 library does not end reading it"
#: Seconds of processor time for any file, and bytes for which it is given another second.
SECONDS, BYTES = 5, 2_000_000

#: Everything that a damaged file can make the library stumble over, in a process that may die of it. Its processor time is
#: limited, not the time of the clock: a busy machine or a slow disk is no damage; without the parent it holds, too.
TRIAL = """
import sys, h5py
left = float(sys.argv[3])
try:
    import resource
    most = [int(sys.argv[2]), *(n for n in resource.getrlimit(resource.RLIMIT_CPU) if n >= 0)]
    resource.setrlimit(resource.RLIMIT_CPU, (min(most), resource.getrlimit(resource.RLIMIT_CPU)[1]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
except ImportError:  # Windows
    pass
def visit(name, item):
    global left
    dict(item.attrs)
    if isinstance(item, h5py.Dataset):
        left -= item.size * item.dtype.itemsize
        if left < 0:  # the reading itself ends here as well
            raise MemoryError
        for part in item.iter_chunks() if item.chunks else ():
            item[part]
with h5py.File(sys.argv[1], "r") as file:
    dict(file.attrs)
    file.visititems(visit)
"""


def tried(path: Path) -> None:
    """Refuse a file by which the library dies or never ends; only a process of its own (a third of a second) is lost then.

    Raises
    ------
    InputError
        A signal, or its like on Windows, ended the trial, or its time was over.
    """
    if not sys.executable:  # embedded: nothing to start
        return
    # -P: a file of the working folder is no library. What merely raises is told by the reading itself.
    seconds = SECONDS + path.stat().st_size // BYTES
    command = [sys.executable, "-P", "-c", TRIAL, str(path), str(seconds), str(budget())]
    # Windows knows no limit of processor time: there it is that of the clock, and much of it.
    limit = 12 * seconds if sys.platform == "win32" else None
    try:
        ended = subprocess.run(command, capture_output=True, check=False, timeout=limit).returncode
    except subprocess.TimeoutExpired:
        raise InputError(ENDLESS) from None
    if sys.platform != "win32" and ended == -signal.SIGXCPU:
        raise InputError(ENDLESS)
    if ended < 0 or ended > 255:
        raise InputError("damaged: the HDF5 library crashes on this file")
