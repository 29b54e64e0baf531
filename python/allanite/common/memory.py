"""A budget of memory, looked at before anything large is made; and what is kept between calls."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from functools import _lru_cache_wrapper

__all__ = [
    "VARIABLE",
    "address_space",
    "budget",
    "forget",
    "free_memory",
    "over_budget",
    "released",
    "require",
    "shown_bytes",
    "source_of_budget",
]

Kept = TypeVar("Kept", bound="_lru_cache_wrapper[Any]")

#: Environment variable that sets the budget: a number of bytes, or with K, M, G, T.
VARIABLE = "ALLANITE_MEMORY"
#: Of the free memory, where nothing is set.
SHARE = 0.5
_CACHES: list[_lru_cache_wrapper[Any]] = []


def free_memory() -> float:
    """Bytes that can be had without pushing others out; infinite where nothing tells."""
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
        return next(1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvail"))
    except (OSError, StopIteration, ValueError, IndexError):
        return math.inf


def address_space() -> float:
    """Bytes of the address space that this process may use (``ulimit -v``); infinite without a limit."""
    try:
        import resource
    except ImportError:  # Windows has none
        return math.inf
    soft = resource.getrlimit(resource.RLIMIT_AS)[0]
    return math.inf if soft == resource.RLIM_INFINITY else float(soft)


def released(kept: Kept) -> Kept:
    """Let `allanite.release` empty this cache. Put it above `lru_cache`; only modules in use have caches to empty."""
    _CACHES.append(kept)
    return kept


def forget() -> None:
    """Empty the caches of fitted models."""
    for kept in _CACHES:
        kept.cache_clear()


def budget() -> float:
    """Bytes that may be asked for: half of the free memory, or what ``ALLANITE_MEMORY`` says."""
    said = os.environ.get(VARIABLE)
    return SHARE * free_memory() if said is None else _bytes(said)


def require(size: float, what: str) -> None:
    """Refuse what needs more than the budget.

    Parameters
    ----------
    size : float
        Bytes that will be asked for.
    what : str
        Beginning of the message: what needs them.

    Raises
    ------
    InputError
        More than half of the free memory, or than ``ALLANITE_MEMORY`` says.
    """
    most = budget()
    if size > most:
        raise InputError(
            f"{what} needs {shown_bytes(size)} of memory, more than {shown_bytes(most)} ({source_of_budget()}):"
            f" set {VARIABLE}={math.ceil(size / 1e9)}G to allow it"
        )


def source_of_budget() -> str:
    """Return where the budget comes from, for a message: the environment variable, or the free memory."""
    said = os.environ.get(VARIABLE)
    return "half of what is free" if said is None else f"{VARIABLE}={said}"


def over_budget(what: str) -> InputError:
    """Return the error for memory that could not be had although nobody knew before how much is needed."""
    most = budget()
    twice = f", or set {VARIABLE}={math.ceil(2 * most / 1e9)}G" if math.isfinite(most) else ""
    return InputError(
        f"{what} needs more memory than {shown_bytes(most)} ({source_of_budget()}): take fewer columns{twice}"
    )


def _bytes(text: str) -> float:
    digits, factor = text.strip().upper().removesuffix("B"), 1.0
    if digits[-1:] in tuple("KMGT"):
        factor = 1e3 ** ("KMGT".index(digits[-1]) + 1)
        digits = digits[:-1]
    try:
        found = float(digits) * factor
    except ValueError:
        found = math.nan
    if not found > 0.0:
        raise InputError(f"{VARIABLE}={text}: a number of bytes is needed, such as 8G")
    return found


def shown_bytes(size: float) -> str:
    """Return a number of bytes with its unit."""
    return f"{size / 1e9:.3g} GB" if size >= 1e8 else f"{size / 1e6:.3g} MB"
