"""Foreign libraries print what they stumble over; a command's streams hold its own words alone."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["quiet"]


@contextmanager
def quiet(module: Any) -> Iterator[None]:
    """Let a module of a foreign library print nothing; streams are shared with other threads, and stay as they are.

    Parameters
    ----------
    module : module
        The one whose functions call ``print``.
    """
    names = vars(module)
    names["print"] = lambda *_, **__: None
    try:
        yield
    finally:
        names.pop("print", None)  # another thread may have been quicker
