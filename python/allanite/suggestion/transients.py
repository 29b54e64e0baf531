"""Candidates that happen in time: changes of the noise level, isolated outliers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.tails import coarse_step, outlier_limit
from allanite.criticism.over_time import overdispersion
from allanite.effects import CATALOGUE, Model, Modifier
from allanite.fit.data import without_samples
from allanite.fit.engine import solve
from allanite.fit.missing import complete
from allanite.fit.whitened import expected_level, white_power, whiten, with_normal_tails
from allanite.suggestion.evidence import interval_trials
from allanite.suggestion.spectral import Candidate

if TYPE_CHECKING:
    from allanite.fit.data import Data
    from allanite.fit.solution import Solution
    from allanite.fit.whitened import Whitened

__all__ = ["screen_levels", "screen_moments", "screen_outliers"]

#: Stretches of the time axis whose levels are compared, and of the finer axis on which an interval is placed.
COARSE, FINE = 256, 4096


def screen_moments(
    solution: Solution, data: Data, whitened: Whitened
) -> tuple[Candidate | None, Candidate | None]:
    """Screen outliers first; a change of level is then looked for in the samples without them."""
    outliers = screen_outliers(solution, data, whitened.samples)
    if outliers is None or outliers.solution is None or outliers.data is None:
        return outliers, screen_levels(solution, data, whitened)
    cleaned = outliers.solution
    level = screen_levels(cleaned, outliers.data, whiten(cleaned, outliers.data))
    if level is not None:
        refitted = solve(data, solution.model + level.effect, like=solution, rounds=3)
        level = replace(level, solution=refitted)
    return outliers, level


def screen_levels(solution: Solution, data: Data, whitened: Whitened) -> Candidate | None:
    """The interval in which the white noise differs most from the rest, of any length.

    logL of two levels against one rises by −½(d_in ln ρ_in + d_out ln ρ_out), ρ the mean powers inside and outside.
    """
    power, share, freedom = white_power(solution, data, whitened)
    if power is None:
        return None
    edges = np.linspace(data.start, data.start + data.duration, power.size + 1)
    power = power / (1.0 + share * (expected_level(solution, edges) - 1.0))
    cells = min(COARSE, power.size // 8)
    if cells < 8:
        return None
    freedom /= overdispersion(power)
    plain = power
    steady = with_normal_tails(solution, whitened)
    if steady is not whitened:
        power, _, freedom = white_power(solution, data, steady)
        assert power is not None
    start, end, gain, chance = _best_interval(power, freedom, cells)
    if cells < FINE <= power.size // 8:
        # Where it begins and ends is a matter of the estimate; what was tried and found is above.
        start, end, gain = _refine(power, freedom, start, end, power.size // cells)
    inside = plain[start:end].mean()
    outside = np.delete(plain, np.s_[start:end]).mean() if end - start < plain.size else 1.0
    ratio = float(inside / outside)
    # The white part alone changes: what else is in the bands dilutes it.
    factor = float(np.sqrt(max(1e-6, 1.0 + (ratio - 1.0) / share)))
    scale = data.duration / power.size
    interval = data.start + start * scale, data.start + end * scale
    changes = (cls.during(*interval, factor) for cls in _screened("level"))
    effect = next((change for change in changes if change is not None), None)
    # Where the model is wrong by so much anyway, a smaller change of level is no effect.
    if effect is None or gain < 4.0 or abs(factor - 1.0) < solution.discrepancy:
        return None
    refitted = solve(data, solution.model + effect, like=solution, rounds=3)
    return Candidate(refitted.model.effects[-1], gain, "level", refitted, 3, min(0.0, chance))


def _screened(key: str) -> list[type[Modifier]]:
    return [cls for cls in CATALOGUE if issubclass(cls, Modifier) and cls.screened == key]


def _log_tail(gain: float) -> float:
    from scipy.special import log_ndtr

    return float(log_ndtr(-np.sqrt(2.0 * gain)) + np.log(2.0))


def _best_interval(
    power: NDArray[np.float64], freedom: float, cells: int
) -> tuple[int, int, float, float]:
    """The interval of cells least likely by chance, its rise of logL and the log of that chance."""
    edges = (np.arange(cells + 1) * power.size // cells).astype(np.int64)
    total = np.concatenate([[0.0], np.cumsum(power)])[edges]
    size = float(power.size)
    best = (0, 0, 0.0, np.inf)
    for octave in (1 << k for k in range(int(np.log2(cells)))):
        step = max(1, octave // 8)
        lengths = np.arange(octave, min(2 * octave, cells), step)
        first = np.arange(0, cells, step)
        first, last = (
            a.ravel() for a in np.broadcast_arrays(first[:, None], first[:, None] + lengths)
        )
        first, last = first[last <= cells], last[last <= cells]
        inside = (edges[last] - edges[first]).astype(float)
        gain = _two_levels(total[last] - total[first], inside, total[-1], size, freedom)
        top = int(np.argmax(gain))
        x = float(gain[top])
        chance = np.log(interval_trials(cells, octave, x)) + _log_tail(x) if x > 0.0 else 0.0
        if chance < best[3]:
            best = (int(edges[first[top]]), int(edges[last[top]]), x, float(chance))
    return best


def _two_levels(
    inside: NDArray[np.float64], count: NDArray[np.float64], total: float, n: float, freedom: float
) -> NDArray[np.float64]:
    """−½ Σ d ln ρ, d = `freedom` for each value."""
    a = np.maximum(inside / count, 1e-12)
    b = np.maximum((total - inside) / (n - count), 1e-12)
    mean = total / n
    return np.asarray(-0.5 * freedom * (count * np.log(a / mean) + (n - count) * np.log(b / mean)))


def _refine(
    power: NDArray[np.float64], freedom: float, start: int, end: int, least: int
) -> tuple[int, int, float]:
    """Move each boundary, one after the other, over the finest axis within two coarse cells.

    The interval keeps at least `least` values: anything shorter is an outlier, not a level.
    """
    reach = 2 * power.size // COARSE
    total = np.concatenate([[0.0], np.cumsum(power)])
    n, gain = float(power.size), -np.inf
    for _ in range(3):
        for side in (0, 1):
            centre = end if side else start
            tried = np.arange(max(0, centre - reach), min(power.size, centre + reach) + 1)
            tried = tried[tried > start] if side else tried[tried < end]
            low, high = (
                (np.full(tried.size, start), tried) if side else (tried, np.full(tried.size, end))
            )
            usable = (high - low >= least) & (high - low < power.size)
            value = np.full(tried.size, -np.inf)
            value[usable] = _two_levels(
                total[high[usable]] - total[low[usable]],
                (high - low)[usable].astype(float),
                float(total[-1]),
                n,
                freedom,
            )
            top = int(np.argmax(value))
            gain = float(value[top])
            start, end = (start, int(tried[top])) if side else (int(tried[top]), end)
    return start, end, gain


def _step(data: Data, samples: NDArray[np.float64]) -> float:
    """Step to which samples are rounded, in units of the whitened ones; 0 where it is small."""
    some = data.samples if data.missing is None else data.samples[~data.missing]
    step = coarse_step(some)
    return step / max(float(np.std(np.diff(some))), step) * np.sqrt(2.0) * float(np.std(samples))


def screen_outliers(
    solution: Solution, data: Data, samples: NDArray[np.float64]
) -> Candidate | None:
    """Samples of the whitened record beyond what n normal ones reach once in a hundred records.

    The scale is that of quantiles, which a few per cent of outliers do not move; the gain is what giving each
    its own level would raise logL by, less the ln n of choosing it.
    """
    from scipy.special import log_ndtr, ndtri_exp

    wanted = [c for c in _screened("outlier") if c.candidates(solution.model, data.covariates)]
    if not wanted or samples.size < data.n:
        return None
    centre = np.median(samples)
    # The widest of three quantiles (of a normal law 0.6745, 1 and 2 σ): noise that is merely not normal has no outliers.
    size = np.abs(samples - centre)
    scale = float(np.max(np.quantile(size, [0.5, 0.6827, 0.9545]) / [0.6745, 1.0, 2.0]))
    if scale == 0.0:
        return None
    z = np.abs(samples - centre) / scale
    limit = -float(ndtri_exp(np.log(0.005 / data.n)))
    if z.max() > limit:
        # What the record's own tail reaches is none; a coarse step rounds up.
        there = size if data.missing is None else size[~data.missing]
        limit = max(
            limit, outlier_limit(there / scale, 0.01 / data.n, _step(data, samples) / scale)
        )
    index = np.flatnonzero(z > limit)
    if index.size == 0 or index.size > data.n // 5:
        return None
    gain = float(np.sum(0.5 * z[index] ** 2 - np.log(data.n)))
    if gain <= 0.0:
        return None
    largest = float(np.log(2.0 * data.n) + log_ndtr(-float(z.max())))
    effect = wanted[0].at((data.start + index / data.rate).tolist())
    if effect is None:
        return None
    cleaned = without_samples(data, effect.missing(data.n, data.rate))
    cleaned = complete(cleaned, solution.model, solution.level)
    refitted = solve(cleaned, Model((*solution.model.effects, effect)), rounds=3)
    return Candidate(
        refitted.model.effects[-1], gain, "outlier", refitted, 1, min(0.0, largest), data=cleaned
    )
