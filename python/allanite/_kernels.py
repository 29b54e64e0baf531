"""Functions and classes of the compiled core, with their types, and the release of its memory.

Only this module imports the core, so that the import layers know who uses it.
"""

from __future__ import annotations

from allanite import _core
from allanite._core import *  # noqa: F403  # a new function of the core needs no line here
from allanite.common.memory import clear_caches


def free_buffers() -> int:
    """Return to the operating system the memory that allanite keeps between calls; return the freed bytes.

    The core keeps at most two arrays for the next call: the last simulated record and the last phase. Each array has at
    most 256 MiB. The core also keeps the plans of the transforms of the last four lengths, and the package keeps spectra
    of the effects of fitted models. Keeping them is faster than allocating and computing them again. Results that you hold
    stay valid; they compute their cached values again when needed.

    Returns
    -------
    int
        Number of bytes of the freed arrays and plans. Spectra of effects are freed too, but not counted.

    Raises nothing.

    Examples
    --------
    >>> freed = al.free_buffers()
    >>> al.free_buffers()
    0
    """
    clear_caches()
    return _core.release()
