"""A cache of arrays with a limit in bytes, and cached sample times of a record."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.memory import cleared_by_free_buffers

__all__ = ["MIN_TRIM_SAMPLES", "ArrayCache", "series_cache", "times_of", "trim_memory"]

#: Minimum size of the cache for series of a record, bytes. Chosen by judgment; not measured.
MIN_CACHE_BYTES = 3 << 25
#: Maximum number of samples up to which the cache grows with the record; it holds four series of 8 bytes per sample.
#: Chosen by judgment; not measured.
MAX_CACHED_SAMPLES = 10**7
#: Minimum number of samples of a record after whose search freed memory is returned to the system: 1 MB per array.
#: Chosen by judgment; not measured.
MIN_TRIM_SAMPLES = 1 << 17


@cleared_by_free_buffers
@lru_cache(maxsize=1)
def times_of(n: int, rate: float, start: float) -> NDArray[np.float64]:
    """Array of the time of each sample of a record that begins at `start`, s, shape (n,); cached and read-only."""
    time = np.arange(n, dtype=np.float64)
    time /= rate
    time += start
    time.flags.writeable = False
    return time


def trim_memory(samples: int) -> None:
    """Return freed memory to the operating system after a search of a record of at least 131072 samples.

    Only in processes of the command; a library leaves the allocator to the program that uses it.
    """
    if samples >= MIN_TRIM_SAMPLES:
        _kernels.trim()


@dataclass(eq=False)
class ArrayCache:
    """Thread-safe cache of arrays by key; the least recently used arrays are dropped first.

    Attributes
    ----------
    most : int
        Maximum size of all arrays, bytes.
    """

    most: int
    _kept: dict[Hashable, NDArray[np.float64]] = field(default_factory=dict, repr=False)
    _bytes: int = field(default=0, repr=False)
    _lock: Lock = field(default_factory=Lock, repr=False)

    def get(self, key: Hashable, make: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Array of a key; made by `make` and stored if it is not cached.

        Arrays larger than `most` bytes are not stored. The arrays used longest ago are dropped beyond `most`. Two
        threads may make the same array twice.
        """
        with self._lock:
            found = self._kept.pop(key, None)
            if found is not None:
                self._kept[key] = found
                return found
        found = make()
        if found.nbytes > self.most:
            return found
        with self._lock:
            other = self._kept.pop(key, None)
            self._bytes += found.nbytes - (0 if other is None else other.nbytes)
            self._kept[key] = found
            while self._bytes > self.most:
                self._bytes -= self._kept.pop(next(iter(self._kept))).nbytes
        return found

    def forget(self) -> None:
        """Remove all arrays from the cache."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0

    def __reduce__(self) -> tuple[type[ArrayCache], tuple[int]]:
        """Pickle the cache without its arrays; another process computes them anew."""
        return ArrayCache, (self.most,)

    def holds(self, size: int) -> bool:
        """True if three arrays of `size` bytes fit into the cache."""
        return 3 * size <= self.most


def series_cache(n: int) -> ArrayCache:
    """New empty `ArrayCache` for series of a record of n samples."""
    return ArrayCache(max(MIN_CACHE_BYTES, 32 * min(n, MAX_CACHED_SAMPLES)))
