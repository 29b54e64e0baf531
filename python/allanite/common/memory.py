"""Memory budget, checked before large arrays are allocated, and caches that can be emptied."""

from __future__ import annotations

import math
import os
from functools import _lru_cache_wrapper
from pathlib import Path
from typing import Any, TypeVar

from allanite.common.errors import InputError

Kept = TypeVar("Kept", bound="_lru_cache_wrapper[Any]")

#: Environment variable that sets the budget: a number of bytes, also with K, M, G or T.
VARIABLE = "ALLANITE_MEMORY"
#: Default budget as a fraction of the free memory. Chosen by judgment; not measured.
FREE_MEMORY_SHARE = 0.5
_CACHES: list[_lru_cache_wrapper[Any]] = []


def free_memory() -> float:
    """Memory that is available without swapping, bytes, as a float; infinite if ``/proc/meminfo`` does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        return next(1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvail"))
    except (OSError, StopIteration, ValueError, IndexError):
        return math.inf


def address_space() -> float:
    """Size of the address space that this process may use (``ulimit -v``), bytes; infinite if unlimited or on Windows."""
    try:
        import resource
    except ImportError:  # Windows has none
        return math.inf
    soft = resource.getrlimit(resource.RLIMIT_AS)[0]
    return math.inf if soft == resource.RLIM_INFINITY else float(soft)


def cleared_by_free_buffers(kept: Kept) -> Kept:
    """Decorator above `lru_cache`: `allanite.free_buffers` and `clear_caches` then empty the cache of this function."""
    _CACHES.append(kept)
    return kept


def clear_caches() -> None:
    """Empty the caches of all functions that are decorated with `cleared_by_free_buffers`."""
    for kept in _CACHES:
        kept.cache_clear()


def budget() -> float:
    """Maximum memory for one computation, bytes: half of the free memory, or the value of ``ALLANITE_MEMORY``.

    Infinite if the free memory is unknown. Raises `InputError` if the variable is no number of bytes.
    """
    setting = os.environ.get(VARIABLE)
    return FREE_MEMORY_SHARE * free_memory() if setting is None else _bytes_of_text(setting)


def require_memory(size: float, what: str) -> None:
    """Raise `InputError` if `what` needs more memory (`size` in bytes) than the budget."""
    most = budget()
    if size > most:
        raise InputError(
            f"{what} needs {bytes_text(size)} of memory, more than {bytes_text(most)} ({source_of_budget()}):"
            f" set {VARIABLE}={math.ceil(size / 1e9)}G to allow it"
        )


def source_of_budget() -> str:
    """Text that says what limits the memory: ``"half of the free memory"``, or the setting ``"ALLANITE_MEMORY=8G"``."""
    setting = os.environ.get(VARIABLE)
    return "half of the free memory" if setting is None else f"{VARIABLE}={setting}"


def out_of_memory_error(what: str) -> InputError:
    """`InputError` (not raised) for `what`, a computation of unknown size, that ran out of memory."""
    most = budget()
    twice = f", or set {VARIABLE}={math.ceil(2 * most / 1e9)}G" if math.isfinite(most) else ""
    return InputError(
        f"{what} needs more memory than {bytes_text(most)} ({source_of_budget()}): take fewer columns{twice}"
    )


def _bytes_of_text(text: str) -> float:
    """Number of bytes in a text such as ``8G``, ``500MB`` or ``1e9``, with 1 K = 1000 bytes; else `InputError`."""
    digits, factor = text.strip().upper().removesuffix("B"), 1.0
    if digits[-1:] in tuple("KMGT"):
        factor = 1e3 ** ("KMGT".index(digits[-1]) + 1)
        digits = digits[:-1]
    try:
        found = float(digits) * factor
    except ValueError:
        found = math.nan
    if not found > 0.0:
        raise InputError(f"{VARIABLE}={text}: not a number of bytes, such as 8G")
    return found


def bytes_text(size: float) -> str:
    """Text of a number of bytes with up to three significant digits: ``0.12 GB`` (from 100 MB on) or ``12.5 MB``."""
    return f"{size / 1e9:.3g} GB" if size >= 1e8 else f"{size / 1e6:.3g} MB"
