"""Smallest N and K (or N and a Gauss-Markov process) that cover the model's upper limits at all τ and frequencies."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.numbers import percent_text
from allanite.effects import Effect, white_noise
from allanite.exports._axis import Axis
from allanite.exports._follow import SMALL_WALK_SHARE, negligible_walk
from allanite.exports._held import NoiseParameters, gauss_markov_effect, random_walk_effect

#: Number of tried correlation times per decade.
LAGS_PER_DECADE = 12
#: Number of points of both curves per decade, and within each band of the model.
POINTS_PER_DECADE, POINTS_PER_BAND = 48, 65


def overbound_walk(axis: Axis) -> NoiseParameters:
    """`NoiseParameters` with the smallest N and K whose Allan variance and density cover the upper limits of an axis."""
    limits = _Limits(axis)
    white, slow = limits.smallest(random_walk_effect(1.0))[0]
    if slow > 0.0:
        return NoiseParameters(float(np.sqrt(white)), float(np.sqrt(slow)), overbound=True)
    N = float(np.sqrt(white))
    remark = (
        f"the model needs none: this K adds {percent_text(SMALL_WALK_SHARE)} to the Allan variance at"
        f" {axis.horizon:.3g} s"
    )
    return NoiseParameters(
        N, negligible_walk(N, axis.horizon, axis.sampling), remarks=(("K", remark),), overbound=True
    )


def overbound_gauss_markov(axis: Axis, time: float | None = None) -> NoiseParameters:
    """`NoiseParameters` with the smallest N and Gauss-Markov process that cover the upper limits of an axis.

    `time` (s) fixes the correlation time. Otherwise the time is that with the smallest mean excess over the limits.
    """
    limits, tau = _Limits(axis), axis.taus
    low, high = 4.0 * tau[0], 10.0 * tau[-1]
    count = max(2, int(LAGS_PER_DECADE * np.log10(high / low)))
    times = np.geomspace(low, high, count) if time is None else np.array([time])
    found = [(limits.smallest(gauss_markov_effect(1.0, T)), T) for T in times]
    (sizes, _), best = min(found, key=lambda item: item[0][1])
    white, slow = np.sqrt(sizes)
    return NoiseParameters(float(white), 0.0, float(slow), float(best), overbound=True)


class _Limits:
    """Allan variance and density of the upper limits of an axis, on grids up to the horizon and within its bands."""

    def __init__(self, axis: Axis) -> None:
        self.axis, fs = axis, axis.sampling
        last = axis.taus[-1]
        count = int(POINTS_PER_DECADE * np.log10(last * fs)) + 2
        factors = np.unique(np.round(np.geomspace(1.0, last * fs, count)))
        self.tau = np.asarray(factors / fs, dtype=np.float64)
        # A filter that is aided for three horizons and coasts for one depends on frequencies down to 1/(4 horizons).
        self.f = np.geomspace(0.25 / last, 0.4999 * fs, count)
        self.in_bands = np.concatenate([np.zeros(0), *_band_frequencies(axis)])
        f = np.concatenate([self.f, self.in_bands])
        self.limit = np.concatenate([axis.upper_allan_variance(self.tau), axis.upper_psd(f)])
        # Both curves have the same total weight. Points in bands only bound the numbers and have no weight.
        sizes = (self.tau.size, 1.0), (self.f.size, 1.0), (self.in_bands.size, 0.0)
        self.weight = np.concatenate([np.full(n, one / max(n, 1)) for n, one in sizes])
        if not (self.limit > 0.0).any():
            raise InputError(
                f"{axis.name}: the model has no noise: fit a model with noise, such as N+K"
            )

    def _curves(self, effect: Effect) -> Array:
        """Array with the Allan variance of an effect at `tau`, followed by its density at `f`, then at `in_bands`."""
        fs = self.axis.sampling
        f = np.concatenate([self.f, self.in_bands])
        return np.concatenate([effect.allan_variance(self.tau, fs), effect.psd(f, fs)])

    def smallest(self, slow: Effect) -> tuple[Array, float]:
        """Pair (squares, excess): (N², K²) or (N², q_c²) of the smallest noise that is nowhere below the limits.

        The excess is the mean ratio of its curves to the limits over τ, plus that over frequency; narrow bands do not
        count. `slow` is the slow process with coefficient 1. Raises `InputError` if the linear program has no solution.
        """
        from scipy.optimize import linprog

        there = self.limit > 0.0
        columns = [self._curves(effect) for effect in (white_noise(1.0), slow)]
        design = np.column_stack(columns)[there] / self.limit[there, None]
        size = design.max(axis=0)
        cost = self.weight[there] @ design / size
        found = linprog(cost, A_ub=-design / size, b_ub=-np.ones(len(design)), method="highs")
        if found.x is None:
            raise InputError(f"{self.axis.name}: no overbound was found ({found.message})")
        scaled = np.maximum(found.x, 0.0)
        # The solver satisfies its constraints only to a relative 1e-7.
        scaled *= max(1.0, 1.0 / float((design / size @ scaled).min()))
        return scaled / size, float(cost @ scaled)


def _band_frequencies(axis: Axis) -> Iterator[Array]:
    """Yield at most 65 frequencies (Hz), evenly spaced, for the band of each band-limited model in `axis.corners`.

    Frequencies at 0, or at half the sampling rate or above, are left out.
    """
    for forms in axis.corners:
        for form in forms:
            band = form.stochastic[0].occupies
            if band is not None:
                f = np.linspace(band[0], band[1], POINTS_PER_BAND)
                yield f[(f > 0.0) & (f < 0.5 * axis.sampling)]
