"""Arrays that a search comes back to, as many as a number of bytes holds."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Remembered"]


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

    def get(self, key: Hashable, make: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        """What stands under a key, made where it does not; threads may ask at once, and then make it twice."""
        found = self._kept.pop(key, None)
        if found is None:
            found = make()
        if found.nbytes <= self.most:
            self._kept[key] = found
        while sum(a.nbytes for a in list(self._kept.values())) > self.most:
            for oldest in list(self._kept)[:1]:
                self._kept.pop(oldest, None)
        return found

    def holds(self, size: int) -> bool:
        """Whether something of this many bytes is worth keeping: three of it have room."""
        return 3 * size <= self.most
