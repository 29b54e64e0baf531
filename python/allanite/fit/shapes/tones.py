"""Fit tone bursts: find the time interval and frequency that explain most of the complex series of a narrow band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.threads import stop_if_unwanted
from allanite.fit.shapes.drifting import Band, band_about, loudest_frequency
from allanite.fit.shapes.simplex import MIN_SHAPE_DELTA_LOGL, local_maximum

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise

#: Minimum length of a burst, in values of the series. Chosen by judgment; not measured.
MIN_BURST_VALUES = 16
#: Ratio of successive window lengths that are tried. Chosen by judgment; not measured.
LENGTH_RATIO = 2.0**0.5
#: Number of window positions per window length. Chosen by judgment; not measured.
POSITIONS_PER_LENGTH = 4
#: Maximum length of a burst, as a fraction of the record; a longer one is a steady line. Chosen by judgment; not measured.
MAX_BURST_FRACTION = 0.9
#: Minimum number of values of the series with which the edges are optimized. Chosen by judgment; not measured.
MIN_FINE_VALUES = 1 << 14
#: Number of intervals of the grid of positions that are tried for each edge of a burst. Chosen by judgment; not measured.
EDGE_INTERVALS = 48
#: Number of segments, over three lengths of a burst, whose sums are precomputed to optimize its frequency.
#: Chosen by judgment; not measured.
SUM_SEGMENTS = 384


def effective_trials(band: Band) -> int:
    """Effective number of time windows that a search for tone bursts tries for each independent frequency.

    Shorter windows have more positions but proportionally fewer independent frequencies.
    """
    return 2 * POSITIONS_PER_LENGTH * len(_burst_lengths(band.series.size))


def _burst_lengths(size: int) -> NDArray[np.int64]:
    """Lengths, in values, of the time windows tried for bursts in a series of `size` values, longest first."""
    most = MAX_BURST_FRACTION * size
    count = int(np.log(max(most / MIN_BURST_VALUES, 1.0)) / np.log(LENGTH_RATIO)) + 1
    return np.unique((most / LENGTH_RATIO ** np.arange(count)).astype(np.int64))[::-1]


def search_burst(band: Band) -> tuple[float, float, float, float]:
    """Tuple (frequency in cycles per record, start and end as fractions of the record, ΔlogL) of the strongest burst.

    Windows of about 16 values up to 0.9 of the series are tried, each at positions a quarter of its length apart.
    """
    from scipy.fft import fft

    k = band.series.size
    best = (0.0, 0.0, 1.0, -np.inf)
    for length in _burst_lengths(k):
        stop_if_unwanted()
        step = max(1, int(length) // POSITIONS_PER_LENGTH)
        rows = np.lib.stride_tricks.sliding_window_view(band.series, length)[::step]
        power = np.abs(fft(rows, 2 * length, axis=1)) ** 2 * (k / length)
        row, at = np.unravel_index(int(np.argmax(power)), power.shape)
        gain = float(power[row, at])
        if gain > best[3]:
            start = float(row) * step / k
            best = (band.first + 0.5 * at * k / length, start, start + length / k, gain)
    return best


def place_burst(
    band: Band, frequency: float, start: float, end: float
) -> tuple[float, float, float, float]:
    """Tuple (frequency, start, end, ΔlogL), in units as for `search_burst`, of a burst with optimized frequency and edges.

    Edges on a grid, up to half of the burst's length away, are tried first. Frequency and edges are then optimized together
    by the simplex method.
    """
    total = _summed(band, frequency)
    shifts = 0.5 * (end - start) * np.linspace(-1.0, 1.0, EDGE_INTERVALS + 1)
    firsts, lasts = (np.clip(edge + shifts, 0.0, 1.0) for edge in (start, end))
    gains = _gain(band, total, firsts[:, None], lasts[None, :])
    i, j = np.unravel_index(int(np.argmax(gains)), gains.shape)
    return _optimized(band, frequency, float(firsts[i]), float(lasts[j]))


def steady_line_gain(band: Band, frequency: float) -> float:
    """Largest ΔlogL of a steady line at 21 frequencies, evenly spaced from `frequency` − 0.5 to + 0.5 cycles per record."""
    near = frequency + np.linspace(-0.5, 0.5, 21)
    return max(float(np.abs(_summed(band, float(f))[-1]) ** 2) for f in near)


def relative_power(band: Band, frequency: float, start: float, end: float) -> float:
    """Ratio, at least 1, of noise power to expected noise power in the band during a tone burst.

    The noise power is the mean power of the band in that time minus the power of the burst.
    """
    inside = band.series[round(start * band.series.size) : round(end * band.series.size)]
    count = max(inside.size, 2)
    # A pure burst has its whole gain in one Fourier sum, while noise has power 1 in each sum.
    burst = float(_gain(band, _summed(band, frequency), start, end))
    power = float(np.sum(np.abs(inside) ** 2)) / (end - start)
    return max(1.0, (power - burst / count) * count / (count - 1))


def _summed(band: Band, frequency: float) -> NDArray[np.complex128]:
    """Array of the cumulative sums of the band's series demodulated by a frequency, cycles per record, shape (k + 1,)."""
    u = np.arange(band.series.size) / band.series.size
    turned = band.series * np.exp(-2j * np.pi * (frequency - band.first) * u)
    return np.concatenate([[0.0], np.cumsum(turned)])


def _gain(band: Band, total: NDArray[np.complex128], start: Any, end: Any) -> Array:
    """ΔlogL of a burst between `start` and `end` (fractions of the record); 0 if its length is not allowed.

    `total` are the cumulative sums of `_summed`.
    """
    k = band.series.size
    places = np.arange(k + 1) / k
    inside = np.interp(end, places, total) - np.interp(start, places, total)
    length = np.asarray(end - start)
    enough = (length >= MIN_BURST_VALUES / k) & (length <= MAX_BURST_FRACTION)
    return np.where(enough, np.abs(inside) ** 2 / np.maximum(length, 1e-12), 0.0)


def _optimized(
    band: Band, frequency: float, start: float, end: float
) -> tuple[float, float, float, float]:
    """Tuple (frequency, start, end, ΔlogL) of a tone burst at a local maximum of ΔlogL, by the simplex method.

    The search starts from the given frequency (cycles per record), start and end (fractions of the record).
    """
    length = end - start
    # The phase of a tried frequency hardly changes within one of these short segments.
    knots = np.linspace(max(0.0, start - length), min(1.0, end + length), SUM_SEGMENTS + 1)
    places = np.arange(band.series.size + 1) / band.series.size
    total = _summed(band, frequency)
    sums = np.interp(knots, places, total)

    def gain(x: Array) -> float:
        """ΔlogL of a tone burst with the frequency and edges `x`, clipped to the search; 0 if its length is not allowed."""
        f, a, b = float(x[0]), max(float(x[1]), knots[0]), min(float(x[2]), knots[-1])
        if not MIN_BURST_VALUES / band.series.size <= b - a <= MAX_BURST_FRACTION:
            return 0.0
        first, last = np.searchsorted(knots, a, side="right"), np.searchsorted(knots, b)
        edges = np.concatenate([[a], knots[first:last], [b]])
        ends = np.interp([a, b], places, total)
        at = np.concatenate([ends[:1], sums[first:last], ends[1:]])
        turn = np.exp(-1j * np.pi * (f - frequency) * (edges[1:] + edges[:-1]))
        return float(np.abs(turn @ np.diff(at)) ** 2 / (b - a))

    steps = np.array([0.2 / length, 0.02 * length, 0.02 * length])
    found, best = local_maximum(gain, np.array([frequency, start, end]), steps)
    f, a, b = found.tolist()
    return f, max(a, float(knots[0])), min(b, float(knots[-1])), best


def polish_burst(
    effect: Deterministic, ordinates: Array, noise: Noise, data: Data
) -> Deterministic:
    """Copy of the tone burst with the frequency and times that maximize logL for the residual `ordinates`, shape (n,).

    Without start and end, the strongest burst near its frequency is searched first. If the frequency has no value, that of
    the largest ordinate is used. For a burst with values, the effect itself is returned if logL rises by less than 1e-3.
    """
    values, T = effect.values, data.duration
    f, start, end = values["frequency"], values["start"], values["end"]
    if f is None:
        f = loudest_frequency(effect, ordinates, noise, data)
    if start is None or end is None:
        about = band_about(f, f, ordinates, noise, data)
        at = place_burst(about, *search_burst(about)[:3])[:3]
    else:
        at = f * T, (start - data.start) / T, (end - data.start) / T
    band = band_about(at[0] / T, at[0] / T, ordinates, noise, data, MIN_FINE_VALUES)
    before = float(_gain(band, _summed(band, at[0]), at[1], at[2]))
    middle, first, last, gain = _optimized(band, *at)
    if start is not None and gain - before < MIN_SHAPE_DELTA_LOGL:
        return effect
    return effect.with_values(
        frequency=max(middle / T, 1e-12), start=data.start + first * T, end=data.start + last * T
    )
