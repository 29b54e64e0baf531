"""A cache of arrays with a limit in bytes, and cached sample times of a record."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from threading import Lock

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.memory import cleared_by_free_buffers

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
def times_of(n: int, rate: float, start: float) -> Array:
    """Array of the time of each sample of a record that begins at `start`, s, shape (n,); cached and read-only."""
    time = np.arange(n, dtype=np.float64)
    time /= rate
    time += start
    time.flags.writeable = False
    return time


def trim_memory(samples: int) -> None:
    """Return freed memory to the operating system if a record has at least 131072 samples.

    It acts only in processes of the command line. A library leaves the allocator to the program that uses it.
    """
    if samples >= MIN_TRIM_SAMPLES:
        _kernels.trim()


@dataclass(eq=False)
class ArrayCache:
    """Thread-safe cache of arrays of at most `max_bytes` in all; the least recently used arrays are dropped first."""

    max_bytes: int
    _kept: dict[Hashable, Array] = field(default_factory=dict, repr=False)
    _bytes: int = field(default=0, repr=False)
    _lock: Lock = field(default_factory=Lock, repr=False)

    def get(self, key: Hashable, make: Callable[[], Array]) -> Array:
        """Array stored for `key`; if there is none, it is computed by `make` and stored.

        Arrays larger than `max_bytes` are not stored. Two threads may compute the same array twice.
        """
        with self._lock:
            found = self._kept.pop(key, None)
            if found is not None:
                self._kept[key] = found
                return found
        found = make()
        if found.nbytes > self.max_bytes:
            return found
        with self._lock:
            other = self._kept.pop(key, None)
            self._bytes += found.nbytes - (0 if other is None else other.nbytes)
            self._kept[key] = found
            while self._bytes > self.max_bytes:
                self._bytes -= self._kept.pop(next(iter(self._kept))).nbytes
        return found

    def clear(self) -> None:
        """Remove all arrays from the cache."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0

    def __reduce__(self) -> tuple[type[ArrayCache], tuple[int]]:
        """Pickle the cache without its arrays; another process computes them anew."""
        return ArrayCache, (self.max_bytes,)


def series_cache(n: int) -> ArrayCache:
    """New empty `ArrayCache` for four series of n doubles: 32n bytes, at least 101 MB and at most 320 MB."""
    return ArrayCache(max(MIN_CACHE_BYTES, 32 * min(n, MAX_CACHED_SAMPLES)))
