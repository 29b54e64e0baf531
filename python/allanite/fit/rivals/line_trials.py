"""Number of trials of a search for lines; calendar, tides, satellites and mains are expected and have few of their own."""

from __future__ import annotations

import numpy as np

from allanite.common.arrays import Array

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
#: Unit: 1. Largest relative error of a mains frequency and of the sensor's clock.
#: Basis: judgment.
MAINS_TOLERANCE = 0.002


def known_bands(n: int, rate: float) -> Array:
    """Bands (low, high), Hz, in which n samples show mains, or known periods, or their aliases, shape (bands, 2).

    The periods are those of year, day, GPS and tides (`PERIODS`). A band is 1/T wide (T = n/rate), or ±0.2 % of a mains
    frequency if that is wider. Frequencies and aliases of at most 2/T are omitted.
    """
    width = rate / n
    exact = np.array([1.0 / period for period in PERIODS])
    frequency = np.concatenate([exact, MAINS])
    half = np.concatenate([np.zeros(exact.size), MAINS_TOLERANCE * np.array(MAINS)])
    half = np.maximum(half, 0.5 * width)
    seen = np.abs(frequency - rate * np.round(frequency / rate))
    there = seen > 2.0 * width
    ends = [np.maximum(seen - half, 0.0), np.minimum(seen + half, 0.5 * rate)]
    return np.column_stack(ends)[there]


def line_trials(n: int) -> float:
    """W (number of independent trials) of Baluev's false-alarm formula for all frequencies of n evenly spaced samples."""
    return 0.5 * n * float(np.sqrt(np.pi / 3.0))


def trials_at(cycles: Array, n: int, rate: float) -> Array:
    """Number of independent trials (W of Baluev's formula) of a line of `cycles` cycles in n samples.

    W is that of a search of all frequencies, divided by the share of the false alarms that this frequency gets. The false
    alarms are divided into three equal parts: for all frequencies, for octaves from one cycle to n/2, and for known
    frequencies (`known_bands`). If the record can show no known frequency, there are two parts. Each octave and each known
    frequency gets an equal share of its part. A slow line thus does not pay for all fast ones.
    """
    unknown, known, shares = _shares_of_false_alarms(cycles, n, rate)
    return np.asarray(shares * line_trials(n) / (unknown + known))


def expected_line_gain(cycles: float, n: int, rate: float) -> float:
    """Reduction of the ΔlogL, nats, that a line needs if its frequency is known beforehand; 0 for other frequencies.

    A frequency is known if it lies in one of `known_bands`. The reduction is the ln of the ratio of the numbers of
    independent trials without and with this knowledge (see `trials_at`).
    """
    unknown, known, _ = _shares_of_false_alarms(np.array([cycles]), n, rate)
    return float(np.log1p(known[0] / unknown[0]))


def _shares_of_false_alarms(cycles: Array, n: int, rate: float) -> tuple[Array, Array, float]:
    """Tuple (general, known, parts): weights that divide the false-alarm probability among lines at `cycles` per record.

    The weight 1 is what a trial obtains from the first of the `parts` equal parts of `trials_at`. `general` is 1 plus the
    weight from the octave of the line. `known` is the weight from the known band of the line, 0 outside these bands.
    """
    whole = line_trials(n)
    octaves = max(1.0, np.log2(n / 2.0))
    place = np.floor(np.log2(np.maximum(cycles, 1.0)))
    of_octave = 0.5 * n / (octaves * np.minimum(2.0**place, 0.25 * n))
    bands = known_bands(n, rate)
    widths = np.maximum(whole * (bands[:, 1] - bands[:, 0]) / (0.5 * rate), 1.0)
    frequency = np.asarray(cycles)[..., None] * rate / n
    inside = (bands[:, 0] <= frequency) & (frequency <= bands[:, 1])
    of_known = (inside / widths).sum(axis=-1) * whole / max(len(bands), 1)
    return np.asarray(1.0 + of_octave), np.asarray(of_known), 3.0 if bands.size else 2.0
