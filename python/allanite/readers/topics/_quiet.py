"""Silence foreign libraries that print warnings, so that the output of a command only holds its own text."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def quiet(module: Any) -> Iterator[None]:
    """Context in which calls of ``print`` in the given module do nothing, in all threads. Streams are not redirected.

    If contexts overlap, the first one that ends also ends the silence of the others.
    """
    names = vars(module)
    names["print"] = lambda *_, **__: None
    try:
        yield
    finally:
        names.pop("print", None)  # another thread may have removed it already
