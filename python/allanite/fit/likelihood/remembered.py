"""Arrays that a search comes back to, as many as a number of bytes holds."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.memory import released

__all__ = ["LARGE", "Remembered", "give_back", "room_for", "times_of"]

#: Bytes for series of a record, room for five of up to so many samples.
WHOLE, LONG = 3 << 25, 10**7
#: Samples from which arrays are large enough to be given back.
LARGE = 1 << 17


@released
@lru_cache(maxsize=1)
def times_of(n: int, rate: float, start: float) -> NDArray[np.float64]:
    """Seconds of each sample of a record, which every function of time asks for, shape (n,)."""
    time = np.arange(n, dtype=np.float64)
    time /= rate
    time += start
    time.flags.writeable = False
    return time


def give_back(samples: int) -> None:
    """Between two searches of a record: what they have freed, of a long one many copies of it, goes back to the system."""
    if samples >= LARGE:
        _kernels.trim()


@dataclass(eq=False)
class Remembered:
    """Arrays by key; the ones used last stay.

    Attributes
    ----------
    most : int
        Bytes of all of them.
    """

    most: int
    _kept: dict[Hashable, NDArray[np.float64]] = field(default_factory=dict, repr=False)
    _bytes: int = field(default=0, repr=False)
    _lock: Lock = field(default_factory=Lock, repr=False)

    def get(self, key: Hashable, make: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        """What stands under a key, made where it does not; threads may ask at once, and then make it twice."""
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
        """Keep nothing; what is asked for again is made again."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0

    def __reduce__(self) -> tuple[type[Remembered], tuple[int]]:
        """What crosses to another process is found again there."""
        return Remembered, (self.most,)

    def holds(self, size: int) -> bool:
        """Whether something of this many bytes is worth keeping: three of it have room."""
        return 3 * size <= self.most


def room_for(n: int) -> Remembered:
    """Room for series as long as a record of n samples."""
    return Remembered(max(WHOLE, 40 * min(n, LONG)))
