"""Correlated noise: the correlation of every pair of units in octaves of frequency, and their Allan covariance."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from allanite.axes.coherence import cross_spectra
from allanite.common.showing import brief

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.axes.coherence import CrossBand
    from allanite.common.arrays import Array
    from allanite.fit import Fit

#: Frequencies per octave of the integral over an Allan variance, and decades below 1/τ at which it begins. Chosen by
#: judgment; not measured.
POINTS_PER_OCTAVE, DECADES_BELOW = 48, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Correlation:
    """Correlation of the noise of two units in octaves of frequency.

    Attributes
    ----------
    pair : (int, int)
        Indices of the units.
    edges : ndarray, shape (octaves + 1,)
        Limits of the octaves in ascending order, Hz.
    values : ndarray, shape (octaves,)
        In-phase correlation in each octave; 0 if none was detected.
    """

    pair: tuple[int, int]
    edges: Array
    values: Array

    __repr__ = brief

    def at(self, f: Array) -> Array:
        """Correlation at the frequencies f, Hz; outside of all octaves, that of the nearest octave."""
        place = np.searchsorted(self.edges, f, side="right") - 1
        return self.values[np.clip(place, 0, self.values.size - 1)]


def correlations(boards: Sequence[Mapping[int, Fit]]) -> tuple[Correlation, ...]:
    """Correlation of the noise over frequency, for each pair of units on one board with a significant octave."""
    found = []
    for board in boards:
        named = {str(place): fit for place, fit in board.items()}
        spectra = {one.columns: one.bands for one in cross_spectra(named)}
        for a, b in combinations(board, 2):
            bands = spectra.get((str(a), str(b)))
            if bands and any(band.significant for band in bands):
                edges = np.array([bands[0].low, *(band.high for band in bands)])
                found.append(Correlation((a, b), edges, np.array(_octave_correlations(bands))))
    return tuple(found)


def _octave_correlations(bands: Sequence[CrossBand]) -> list[float]:
    """In-phase correlations of two columns, one per octave in `bands`; one octave must be significant.

    A significant octave has its measured correlation. Any other octave takes over the value of the nearest significant
    octave if its own 95 % interval contains this value, else it has 0.
    """
    significant = [k for k, band in enumerate(bands) if band.significant]
    out = []
    for k, band in enumerate(bands):
        if k in significant:
            out.append(band.correlation)
            continue
        near = bands[min(significant, key=lambda s: abs(s - k))].correlation
        low, high = band.interval
        out.append(near if low <= near <= high else 0.0)
    return out


def allan_covariance(fits: Sequence[Fit], shared: Sequence[Correlation], tau: Array) -> Array:
    """Allan covariances of all units at each averaging time `tau` (s), shape (τ, units, units).

    For two units in `shared`, the covariance is the product of both Allan deviations times their mean correlation,
    otherwise 0. The mean is taken over frequency, weighted by the contribution of each frequency to the Allan variance.
    """
    variance = np.column_stack(
        [fit.model.allan_variance(tau, rate=fit.recording.rate) for fit in fits]
    )
    out = np.zeros((tau.size, len(fits), len(fits)))
    out[:, range(len(fits)), range(len(fits))] = variance
    for one in shared:
        a, b = one.pair
        rate = fits[a].recording.rate
        for k, t in enumerate(tau):
            low = 10.0**-DECADES_BELOW / t
            count = max(int(POINTS_PER_OCTAVE * np.log2(0.5 * rate / low)), POINTS_PER_OCTAVE)
            f = np.geomspace(low, 0.5 * rate, count)
            density = np.sqrt(fits[a].model.psd(f, rate) * fits[b].model.psd(f, rate))
            m = max(round(float(t) * rate), 1)
            gain = np.sin(np.pi * f * m / rate) ** 4 / (m * np.sin(np.pi * f / rate)) ** 2
            weight = density * gain * f  # f, because the frequencies are evenly spaced in ln f
            share = float(weight @ one.at(f) / weight.sum())
            out[k, a, b] = out[k, b, a] = share * np.sqrt(variance[k, a] * variance[k, b])
    return out
