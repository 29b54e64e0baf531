"""Frequencies that are expected before the record is seen: calendar, tides, satellites, mains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.suggestion.constants import MAINS_TOLERANCE

#: Length of a day, s.
DAY = 86400.0
#: Known periods, s: the tropical year and its half and third, the draconitic year of GPS (Ray et al. 2008, GPS Solut. 12),
#: the day and its half and third, the sidereal day and its half (the orbit of GPS), the tides M2, O1 and N2 (Doodson
#: 1921, Proc. R. Soc. A 100).
PERIODS = (
    365.2422 * DAY,
    365.2422 / 2 * DAY,
    365.2422 / 3 * DAY,
    351.4 * DAY,
    DAY,
    DAY / 2,
    DAY / 3,
    86164.1,
    86164.1 / 2,
    12.4206 * 3600,
    25.8193 * 3600,
    12.6583 * 3600,
)
#: Mains frequencies and their first overtones, Hz.
MAINS = (50.0, 60.0, 100.0, 120.0)


def known_bands(n: int, rate: float) -> NDArray[np.float64]:
    """Array of the bands (low, high), Hz, in which n samples at `rate` Hz show known frequencies or their aliases.

    Its shape is (bands, 2), unsorted. A band is at least one resolution 1/T wide. Frequencies and aliases of at most 2/T
    are omitted.
    """
    width = rate / n
    exact = np.array([1.0 / period for period in PERIODS])
    frequency = np.concatenate([exact, MAINS])
    half = np.concatenate([np.zeros(exact.size), MAINS_TOLERANCE * np.array(MAINS)])
    half = np.maximum(half, 0.5 * width)
    seen = np.abs(frequency - rate * np.round(frequency / rate))
    there = seen > 2.0 * width
    return np.column_stack([seen - half, np.minimum(seen + half, 0.5 * rate)])[there]
