"""Tone bursts: in a band about a line, the stretch of time and the frequency that explain most of its complex series."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.threads import go_on
from allanite.fit.shapes.drifting import SAME, Band, band_about, loudest

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise

__all__ = ["louder", "placed", "polish_burst", "search_burst", "steady", "trials"]

#: Fewest values of the series in a burst, ratio of the lengths tried, part of a length by which a window moves.
SHORTEST, RATIO, MOVES = 16, 2.0**0.5, 4
#: Longest burst, of the record: one that is longer is a line.
LONGEST = 0.9
#: Values of the series by which the edges are placed.
FINE = 1 << 14
#: Places of either edge that are looked at about a window.
PLACES = 48
#: Pieces of three lengths of a burst in which its frequency is polished.
PIECES = 384


def trials(band: Band) -> int:
    """Windows that a search tries for each frequency, whatever their length: as many fewer frequencies has a short one."""
    return 2 * MOVES * len(_lengths(band.series.size))


def _lengths(size: int) -> NDArray[np.int64]:
    """Lengths of the windows tried, from the longest."""
    count = int(np.log(max(LONGEST * size / SHORTEST, 1.0)) / np.log(RATIO)) + 1
    return np.unique((LONGEST * size / RATIO ** np.arange(count)).astype(np.int64))[::-1]


def search_burst(band: Band) -> tuple[float, float, float, float]:
    """Frequency (cycles of the record), start and end (parts of it) and rise of logL of the strongest window tried."""
    from scipy.fft import fft

    k = band.series.size
    best = (0.0, 0.0, 1.0, -np.inf)
    for length in _lengths(k):
        go_on()
        step = max(1, int(length) // MOVES)
        rows = np.lib.stride_tricks.sliding_window_view(band.series, length)[::step]
        power = np.abs(fft(rows, 2 * length, axis=1)) ** 2 * (k / length)
        row, at = np.unravel_index(int(np.argmax(power)), power.shape)
        gain = float(power[row, at])
        if gain > best[3]:
            start = float(row) * step / k
            best = (band.first + 0.5 * at * k / length, start, start + length / k, gain)
    return best


def placed(
    band: Band, frequency: float, start: float, end: float
) -> tuple[float, float, float, float]:
    """The burst about a window with the frequency and the edges that explain most."""
    found = (frequency, start, end, -np.inf)
    for _ in range(2):
        found = _placed(band, *found[:3])
    return found


def steady(band: Band, frequency: float) -> float:
    """Rise of logL by a line near a frequency (half a cycle of the record to either side) that is there all the time."""
    near = frequency + np.linspace(-0.5, 0.5, 21)
    return max(float(np.abs(_summed(band, float(f))[-1]) ** 2) for f in near)


def louder(band: Band, frequency: float, start: float, end: float) -> float:
    """How many times as powerful as the noise the band is in a stretch of the record beside a burst there; 1 or more."""
    inside = band.series[round(start * band.series.size) : round(end * band.series.size)]
    count = max(inside.size, 2)
    # A burst alone has its whole gain in one of so many sums, of which noise has 1 in each.
    burst = float(_gain(band, _summed(band, frequency), start, end))
    power = float(np.sum(np.abs(inside) ** 2)) / (end - start)
    return max(1.0, (power - burst / count) * count / (count - 1))


def _placed(
    band: Band, frequency: float, start: float, end: float
) -> tuple[float, float, float, float]:
    """The best edges about a window, at one frequency, and the best frequency between them."""
    total = _summed(band, frequency)
    reach = 0.5 * (end - start)
    firsts = np.clip(start + reach * np.linspace(-1.0, 1.0, PLACES + 1), 0.0, 1.0)
    lasts = np.clip(end + reach * np.linspace(-1.0, 1.0, PLACES + 1), 0.0, 1.0)
    gains = _gain(band, total, firsts[:, None], lasts[None, :])
    i, j = np.unravel_index(int(np.argmax(gains)), gains.shape)
    return _polished(band, frequency, float(firsts[i]), float(lasts[j]))


def _summed(band: Band, frequency: float) -> NDArray[np.complex128]:
    """Sums of the series turned back by a frequency, up to each place: shape (k + 1,)."""
    u = np.arange(band.series.size) / band.series.size
    turned = band.series * np.exp(-2j * np.pi * (frequency - band.first) * u)
    return np.concatenate([[0.0], np.cumsum(turned)])


def _gain(band: Band, total: NDArray[np.complex128], start: Any, end: Any) -> NDArray[np.float64]:
    """Rise of logL by a burst between parts of the record."""
    k = band.series.size
    places = np.arange(k + 1) / k
    inside = np.interp(end, places, total) - np.interp(start, places, total)
    length = np.asarray(end - start)
    enough = (length >= SHORTEST / k) & (length <= LONGEST)
    return np.where(enough, np.abs(inside) ** 2 / np.maximum(length, 1e-12), 0.0)


def _polished(
    band: Band, frequency: float, start: float, end: float
) -> tuple[float, float, float, float]:
    """The maximum of the gain near a burst."""
    from scipy.optimize import minimize

    length = end - start
    scale = np.array([0.2 / length, 0.02 * length, 0.02 * length])
    origin = np.array([frequency, start, end])
    # Sums over pieces so short that a frequency tried turns by next to nothing within one.
    knots = np.linspace(max(0.0, start - length), min(1.0, end + length), PIECES + 1)
    places = np.arange(band.series.size + 1) / band.series.size
    total = _summed(band, frequency)
    sums = np.interp(knots, places, total)

    def loss(x: NDArray[np.float64], *_: Any, **__: Any) -> float:
        f, a, b = origin + scale * x
        a, b = max(float(a), knots[0]), min(float(b), knots[-1])
        if not SHORTEST / band.series.size <= b - a <= LONGEST:
            return 0.0
        first, last = np.searchsorted(knots, a, side="right"), np.searchsorted(knots, b)
        edges = np.concatenate([[a], knots[first:last], [b]])
        ends = np.interp([a, b], places, total)
        at = np.concatenate([ends[:1], sums[first:last], ends[1:]])
        turn = np.exp(-1j * np.pi * (f - frequency) * (edges[1:] + edges[:-1]))
        return -float(np.abs(turn @ np.diff(at)) ** 2 / (b - a))

    go_on()
    first = np.vstack([np.zeros(3), np.eye(3)])
    options: Any = {"initial_simplex": first, "xatol": 1e-3, "fatol": 1e-4, "maxiter": 300}
    found = minimize(loss, np.zeros(3), method="Nelder-Mead", options=options)
    f, a, b = origin + scale * found.x
    return (
        float(f),
        max(float(a), float(knots[0])),
        min(float(b), float(knots[-1])),
        float(-found.fun),
    )


def polish_burst(
    effect: Deterministic, ordinates: NDArray[np.float64], noise: Noise, data: Data
) -> Deterministic:
    """The burst with the frequency and the times that explain most of the ordinates (n,) without it.

    Without values, the strongest about the largest ordinate.
    """
    values, T = effect.values, data.duration
    f, start, end = values["frequency"], values["start"], values["end"]
    if f is None:
        f = loudest(effect, ordinates, noise, data)
    if start is None or end is None:
        about = band_about(f, f, ordinates, noise, data)
        at = placed(about, *search_burst(about)[:3])[:3]
    else:
        at = f * T, (start - data.start) / T, (end - data.start) / T
    band = band_about(at[0] / T, at[0] / T, ordinates, noise, data, FINE)
    before = float(_gain(band, _summed(band, at[0]), at[1], at[2]))
    middle, first, last, gain = _polished(band, *at)
    if start is not None and gain - before < SAME:
        return effect
    return effect.with_values(
        frequency=max(middle / T, 1e-12), start=data.start + first * T, end=data.start + last * T
    )
