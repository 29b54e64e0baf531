"""Lines above the frequencies at which a summary keeps samples: found in the power of segments and removed from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.common.arrays import Array
from allanite.summary.lapped import LOW, SEGMENT, low_pass_gain
from allanite.summary.reading import Reading

#: Half width of a line, and half width of the neighborhood whose median is the level, in coefficients.
LINE_HALF_WIDTH, NEIGHBORHOOD = 6, 48
#: Minimum normal score of a line; white noise exceeds it in one record of 10 000.
MIN_LINE_SCORE = 5.6
#: Maximum excess power in the coefficients around a line, relative to that of the line; a resonance has more. Chosen by
#: judgment; not measured.
MAX_RELATIVE_EXCESS = 0.1


@dataclass(frozen=True, slots=True)
class Line:
    """Spectral line of unknown phase: frequency and its uncertainty `width`, Hz, and mean amplitude over the record, U."""

    frequency: float
    width: float
    amplitude: float


def octave_power(reading: Reading, level: int) -> Array:
    """Mean power of each transform coefficient of the octave with index `level`, U² per sample of the record.

    The attenuation of the low-pass is divided out.
    """
    octave = reading.octaves[level]
    m = np.arange(LOW, LOW + octave.power.high.size, dtype=np.float64)
    loss = low_pass_gain((m + 0.5) / (2.0 * SEGMENT * 2.0**level), level) ** 2
    return np.asarray(octave.power.value / max(octave.frames, 1e-9) * 2.0**level / loss)


def without_lines(reading: Reading, level: int, rate: float) -> tuple[Array, list[Line]]:
    """Tuple (power of one octave without spectral lines, shape (coefficients,); list of the lines, most significant first).

    The median of the neighbors replaces each line, and significance is relative to it. At most 32 lines: the search ends at
    the first peak that is too weak (normal score below 5.6) or too wide.
    """
    power = octave_power(reading, level)
    freedom = max(reading.octaves[level].frames, 1.0)
    spread = 2.0 / (9.0 * freedom)
    hz = rate / (2.0 * SEGMENT * 2.0**level)
    found: list[Line] = []
    for _ in range(32):
        windows = np.lib.stride_tricks.sliding_window_view(
            np.pad(power, NEIGHBORHOOD, mode="reflect"), 2 * NEIGHBORHOOD + 1
        )
        middle = np.median(windows, axis=1)
        score = (np.cbrt(power / middle) - (1.0 - spread)) / np.sqrt(spread)
        top = int(np.argmax(score))
        if score[top] < MIN_LINE_SCORE:
            break
        low, high = max(0, top - LINE_HALF_WIDTH), min(power.size, top + LINE_HALF_WIDTH + 1)
        excess = power - middle
        neighbors = [
            *excess[max(0, low - LINE_HALF_WIDTH) : low],
            *excess[high : high + LINE_HALF_WIDTH],
        ]
        whole = float(excess[low:high].sum())
        if abs(sum(neighbors)) > MAX_RELATIVE_EXCESS * whole:
            break
        place = np.arange(low, high)
        center = float(
            place @ np.maximum(excess[low:high], 0.0) / np.maximum(excess[low:high], 0.0).sum()
        )
        found.append(
            Line(
                (LOW + center + 0.5) * hz,
                hz,
                float(np.sqrt(max(2.0 * whole / SEGMENT / 2.0**level, 0.0))),
            )
        )
        power[low:high] = middle[low:high]
    return power, found
