"""Cross-spectra of the residuals: do axes share noise?

Residuals are whitened by their own models, so that the ordinates of a band have one variance and no spectral leakage.
For independent axes, the squared coherence of K ordinates has P(> c) = (1 − c)^(K − 1) exactly (Bendat & Piersol,
Random Data, 4th ed., 9.2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.documents import fields_dict
from allanite.common.parameters import NORMAL
from allanite.common.threads import results_or_raise, side_by_side
from allanite.fit.likelihood.stop_band import is_mostly_empty
from allanite.fit.likelihood.whitened import end_samples, whitened_ordinates

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from allanite.fit.result import Fit

#: Minimum number of ordinates of a band; bands are octaves from half of the rate down. Chosen by judgment; not measured.
MIN_BAND_ORDINATES = 16
#: False-alarm probability of all bands of all pairs together.
FALSE_ALARM_LEVEL = 0.01


@dataclass(frozen=True, slots=True)
class CrossBand:
    """Coherence of two axes in one octave.

    Attributes
    ----------
    low, high : float
        Ends of the octave, Hz.
    coherence, chance : float
        Squared coherence, and its 95 % quantile for independent axes.
    phase : float
        Phase of the second axis relative to the first, rad.
    correlation, interval
        Correlation coefficient (in phase) and its 95 % interval.
    p_value : float
        Probability that independent axes have this coherence or more, in this band alone.
    significant : bool
        True if the coherence is significant, counting every band of every pair.
    """

    low: float
    high: float
    coherence: float
    chance: float
    phase: float
    correlation: float
    interval: tuple[float, float]
    p_value: float
    significant: bool

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON of the attributes; ends in Hz (``low_hz``, ``high_hz``), and ``phase_rad``."""
        return fields_dict(self, low="low_hz", high="high_hz", phase="phase_rad")


@dataclass(frozen=True, slots=True)
class CrossSpectrum:
    """Coherence of two columns in octaves, lowest first."""

    columns: tuple[str, str]
    bands: tuple[CrossBand, ...]

    @property
    def significant(self) -> tuple[CrossBand, ...]:
        """Tuple of `CrossBand`: significant bands, most coherent first; empty if there are none."""
        return tuple(sorted((b for b in self.bands if b.significant), key=lambda b: -b.coherence))

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: columns and bands."""
        return fields_dict(self)


def cross_spectra(fits: Mapping[str, Fit]) -> tuple[CrossSpectrum, ...]:
    """Coherence of the residuals, in octaves, for all pairs of columns of equal length and rate.

    Octaves in which a filter leaves almost no power on either column are omitted. A band is significant if its p-value
    is below 0.01 divided by the number of bands of all pairs.
    """
    pairs = {}
    for a, b in combinations(fits, 2):
        data_a, data_b = fits[a].data, fits[b].data
        if (data_a.n, data_a.rate) == (data_b.n, data_b.rate):
            # Ordinate k of the Fourier transform is ordinate 2k of the cosine transform.
            pairs[a, b] = [
                (first, end)
                for first, end in _octave_edges(data_a.n // 2)
                if not any(is_mostly_empty(d.bins, 2 * first, 2 * end) for d in (data_a, data_b))
            ]
    names = [name for name in fits if any(name in pair for pair in pairs)]
    tasks = [partial(_whitened_transform, fits[name]) for name in names]
    white = dict(zip(names, results_or_raise(side_by_side(tasks)), strict=True))
    level = FALSE_ALARM_LEVEL / max(1, sum(map(len, pairs.values())))
    out = []
    for (a, b), edges in pairs.items():
        step = fits[a].data.rate / fits[a].data.n
        bands = tuple(_cross_band(white[a], white[b], e, step, level) for e in edges)
        out.append(CrossSpectrum((a, b), bands))
    return tuple(out)


def _whitened_transform(fit: Fit) -> NDArray[np.complex128]:
    """``numpy.fft.rfft`` of the residual of a fit, filtered so that it is white noise if the model is right."""
    white = whitened_ordinates(fit.solution, fit.data, fit.solution.level)
    samples = _kernels.inverse_cosine_transform(white)
    # Behind a deep stop band the ends of the transform stand out on every axis, which would look coherent.
    ends = end_samples(samples.size)
    samples[:ends] = samples[samples.size - ends :] = 0.0
    return np.fft.rfft(samples)


def _octave_edges(last: int) -> list[tuple[int, int]]:
    """(first, end) indices of the Fourier frequencies of each octave, lowest octave first; `end` is exclusive.

    Frequency 0 is excluded. Octaves with fewer than `MIN_BAND_ORDINATES` frequencies are omitted.
    """
    out = []
    high = last
    while high - (low := high // 2) >= MIN_BAND_ORDINATES:
        out.append((max(low, 1), high))
        high = low
    return out[::-1]


def _cross_band(
    x: NDArray[np.complex128],
    y: NDArray[np.complex128],
    edge: tuple[int, int],
    step: float,
    level: float,
) -> CrossBand:
    """`CrossBand` of the octave with the Fourier indices edge[0] to edge[1] − 1; significant if p < `level`.

    `x` and `y` are the Fourier transforms of the whitened residuals, `step` is the frequency of index 1, Hz.
    """
    a, b = x[slice(*edge)], y[slice(*edge)]
    count = a.size
    size = float(np.sqrt(np.vdot(a, a).real * np.vdot(b, b).real)) or 1.0
    shared = complex(np.vdot(a, b)) / size
    coherence = min(abs(shared) ** 2, 1.0)
    p = float((1.0 - coherence) ** (count - 1))
    # Fisher's z with two real values per ordinate.
    r = float(np.clip(shared.real, -0.999999, 0.999999))
    half = NORMAL / float(np.sqrt(2 * count - 3))
    low, high = (float(np.tanh(np.arctanh(r) + s * half)) for s in (-1.0, 1.0))
    chance = 1.0 - 0.05 ** (1.0 / (count - 1))
    phase = float(np.angle(shared))
    ends = edge[0] * step, edge[1] * step
    return CrossBand(*ends, coherence, chance, phase, r, (low, high), p, p < level)
