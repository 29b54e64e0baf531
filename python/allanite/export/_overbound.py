"""Smallest N and K (or N and a lag) above the model's upper limits at every τ and frequency of use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.effects import white_noise
from allanite.export._follow import LITTLE, small_walk
from allanite.export._held import Choice, lag, walk

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects._base import Effect
    from allanite.export._axis import Axis

__all__ = ["overbound_lag", "overbound_walk"]

#: Tried time constants a decade; points of both curves a decade, and within each band of the model.
PER_DECADE, DENSE, BAND = 12, 48, 65


def overbound_walk(axis: Axis) -> Choice:
    """N and K, by linear programming in their squares."""
    limits = _Limits(axis)
    white, slow = limits.smallest(walk(1.0))[0]
    if slow > 0.0:
        return Choice(float(np.sqrt(white)), float(np.sqrt(slow)), overbound=True)
    N = float(np.sqrt(white))
    remark = f"0 would do: this adds {LITTLE:.0%} to the Allan variance at {axis.horizon:.3g} s"
    return Choice(N, small_walk(N, axis), remarks=(("K", remark),), overbound=True)


def overbound_lag(axis: Axis, time: float | None = None) -> Choice:
    """N and a Gauss-Markov process of the best time constant, or of the one given."""
    limits, tau = _Limits(axis), axis.taus
    low, high = 4.0 * tau[0], 10.0 * tau[-1]
    count = max(2, int(PER_DECADE * np.log10(high / low)))
    times = np.geomspace(low, high, count) if time is None else np.array([time])
    found = [(limits.smallest(lag(1.0, T)), T) for T in times]
    (sizes, _), best = min(found, key=lambda item: item[0][1])
    white, slow = np.sqrt(sizes)
    return Choice(float(white), 0.0, float(slow), float(best), overbound=True)


class _Limits:
    """Both curves of an axis's upper limits, at every τ and frequency of use: in its bands too, and at their middles."""

    def __init__(self, axis: Axis) -> None:
        self.axis, fs = axis, axis.sampling
        last = axis.taus[-1]
        count = int(DENSE * np.log10(last * fs)) + 2
        factors = np.unique(np.round(np.geomspace(1.0, last * fs, count)))
        self.tau = np.asarray(factors / fs, dtype=np.float64)
        # Aiding of three horizons and coasting of one: a filter looks down to a quarter of one over the horizon.
        self.f = np.geomspace(0.25 / last, 0.4999 * fs, count)
        self.in_bands = np.concatenate([np.zeros(0), *_bands(axis)])
        f = np.concatenate([self.f, self.in_bands])
        self.limit = np.concatenate([axis.allan(self.tau, upper=True), axis.psd(f, upper=True)])
        # Both curves count alike, whatever their grids; a band bounds, and counts where the grid meets it.
        sizes = (self.tau.size, 1.0), (self.f.size, 1.0), (self.in_bands.size, 0.0)
        self.weight = np.concatenate([np.full(n, one / max(n, 1)) for n, one in sizes])
        if not (self.limit > 0.0).any():
            raise InputError(f"{axis.name}: the model has no noise: fit one that has")

    def _curves(self, effect: Effect) -> NDArray[np.float64]:
        fs = self.axis.sampling
        f = np.concatenate([self.f, self.in_bands])
        return np.concatenate([effect.allan_variance(self.tau, fs), effect.psd(f, fs)])

    def smallest(self, slow: Effect) -> tuple[NDArray[np.float64], float]:
        """Squares of N and of the slow coefficient, and the mean of the variance they stand for over the limits'."""
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
        # The solver holds its constraints to 1e-7 of their size.
        scaled *= max(1.0, 1.0 / float((design / size @ scaled).min()))
        return scaled / size, float(cost @ scaled)


def _bands(axis: Axis) -> Iterator[NDArray[np.float64]]:
    """Frequencies in the bands of the model's processes, and in those at the ends of their intervals, Hz."""
    for forms in axis.corners:
        for form in forms:
            band = form.stochastic[0].occupies
            if band is not None:
                f = np.linspace(band[0], band[1], BAND)
                yield f[(f > 0.0) & (f < 0.5 * axis.sampling)]
