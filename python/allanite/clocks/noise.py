"""The noise of a clock's phase: white and flicker PM, white, flicker and random-walk FM, chosen by evidence."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import parse_model
from allanite.fit.stamped.candidates import Candidate, FittedNoise, fit_noise
from allanite.fit.stamped.noise import integrated_noise

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.stamped.likelihood import StampedSeries

#: White PM, flicker PM, white FM, flicker FM, random-walk FM: in order of the slope of their frequency densities.
EFFECTS = parse_model("Q+F+N+B+K").stochastic
#: Number of samples that `thinned_indices` keeps of each part of the record; twice as many of the last part.
#: Chosen by judgment; not measured.
SAMPLES_PER_PART = 512


def thinned_indices(n: int) -> NDArray[np.int64]:
    """Ascending indices of those of n samples that a fit uses, shape (k,): all recent ones, ever fewer of the older ones.

    These are the last 1024 samples, every second one of the 1024 before, every fourth one of the 2048 before those, and
    so on. The dense samples at the end determine fast noise and the present phase, the sparse samples before them
    determine slow noise.
    """
    rows: list[NDArray[np.int64]] = []
    end, stride = n, 1
    while end > 0:
        first = max(end - SAMPLES_PER_PART * stride * (2 if stride == 1 else 1), 0)
        some = np.arange(end - 1, first - 1, -stride, dtype=np.int64)
        rows.append(some)
        end = int(some[-1]) if some.size and int(some[-1]) > 0 else 0
        stride *= 2
    return np.unique(np.concatenate(rows))


def clock_noise(
    series: StampedSeries, rate: float, progress: Callable[[int], None] | None = None
) -> list[FittedNoise]:
    """One `FittedNoise` for each sum of clock noises that was tried, highest evidence first.

    The search starts with the best single noise or pair. Each step adds, removes or replaces the one noise that raises
    the evidence most. `progress` is called with the number of fits so far.
    """
    fits: dict[tuple[int, ...], FittedNoise] = {}

    def fit(places: tuple[int, ...], start: FittedNoise | None = None) -> FittedNoise:
        """`FittedNoise` of the sum of the noises with the indices `places` in `EFFECTS`, cached in `fits`."""
        if places not in fits:
            candidate = Candidate(tuple(EFFECTS[i] for i in places))
            fits[places] = fit_noise(series, candidate, rate, integrated_noise, start)
            if progress is not None:
                progress(len(fits))
        return fits[places]

    every = range(len(EFFECTS))
    starts = [places for many in (1, 2) for places in combinations(every, many)]
    best: tuple[int, ...] = max(starts, key=lambda one: fit(one).evidence)
    while True:
        # One noise more, one less, or another one in its place.
        changes = [{i} for i in every] + [{i, j} for i in best for j in every if j not in best]
        around = [tuple(sorted({*best} ^ change)) for change in changes if {*best} != change]
        better = max(around, key=lambda one: fit(one, fits[best]).evidence)
        if fits[better].evidence <= fits[best].evidence:
            break
        best = better
    return sorted(fits.values(), key=lambda f: -f.evidence)
