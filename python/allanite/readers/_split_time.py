"""Stamps in two columns: whole seconds, and the rest of the second (ROS, ``timeval``, ``timespec``)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

__all__ = ["in_one", "is_split", "joined", "seconds_and_rest"]

_SECONDS = re.compile(r"^(?P<stem>.*?)(?:s|secs?|seconds?)$")
_REST = re.compile(
    r"^(?P<stem>.*?)(?:(?P<ns>n(?:ano)?(?:s|secs?|seconds?))|(?P<us>(?:u|µ|micro)(?:s|secs?|seconds?))"
    r"|(?P<ms>m(?:illi)?(?:s|secs?|seconds?)))$"
)
#: Parts of a second.
_PARTS = {"ns": 1_000_000_000, "us": 1_000_000, "ms": 1_000}


def seconds_and_rest(names: Sequence[str]) -> tuple[int, int] | None:
    """Find two columns of one stem, one of seconds and one of a part of them: ``stamp.sec``, ``stamp.nanosec``."""
    keys = [name.strip().lower() for name in names]
    rests: dict[str, int] = {}
    for at, key in enumerate(keys):
        match = _REST.match(key)
        if match is not None:
            rests.setdefault(match["stem"], at)
    for at, key in enumerate(keys):
        match = _SECONDS.match(key)
        rest = None if match is None else rests.get(match["stem"])
        if rest is not None and rest != at:
            return at, rest
    return None


def is_split(seconds: NDArray[Any], rest: NDArray[Any], name: str) -> bool:
    """Whether numbers are whole seconds and the rest of each, and not two clocks: shape (n,) each."""
    whole = np.isfinite(seconds).all() and np.isfinite(rest).all()
    if not whole or seconds.size == 0:
        return False
    within = rest.min() >= 0 and rest.max() < parts_of(name)
    integers = bool(np.all(seconds == np.rint(seconds)) and np.all(rest == np.rint(rest)))
    return bool(within and integers and np.abs(seconds).max() < 9e9)


def parts_of(name: str) -> int:
    """Into how many parts a column of this name divides a second."""
    match = _REST.match(name.strip().lower())
    return 1 if match is None else _PARTS[str(match.lastgroup)]


def joined(seconds: NDArray[Any], rest: NDArray[Any], name: str) -> NDArray[np.int64]:
    """Nanoseconds of both, exactly, shape (n,)."""
    second = _PARTS["ns"]
    return seconds.astype(np.int64) * second + rest.astype(np.int64) * (second // parts_of(name))


def in_one(
    chunks: Iterable[NDArray[np.float64]], places: tuple[int, int], name: str
) -> Iterator[NDArray[np.float64]]:
    """The chunks, shape (rows, columns), with seconds since the first row where the whole seconds were."""
    first: float | None = None
    for chunk in chunks:
        seconds, rest = (chunk[:, place] for place in places)
        first = float(seconds[0]) if first is None and seconds.size else first
        out = chunk.copy()
        out[:, places[0]] = (seconds - (first or 0.0)) + rest / parts_of(name)
        yield out
