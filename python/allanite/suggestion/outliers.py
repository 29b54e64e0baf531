"""Candidate outliers: single samples that none of the noise's are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOGUE, Model, Modifier
from allanite.fit.engine import solve
from allanite.fit.likelihood.data import without_samples
from allanite.fit.likelihood.whitened import ends_of
from allanite.fit.missing import complete
from allanite.recording.tails import coarse_step, outlier_limit
from allanite.suggestion.spectral import Candidate

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["at_the_ends", "only_at_the_ends", "screen_outliers"]

#: Samples behind one at an end that it is compared with, and places at which is seen how far samples usually are apart.
BEHIND, USUAL = 9, 1 << 14


def _step(data: Data, samples: NDArray[np.float64]) -> float:
    """Step to which samples are rounded, in units of the whitened ones; 0 where it is small."""
    some = data.samples if data.missing is None else data.samples[~data.missing]
    step = coarse_step(some)
    return step / max(float(np.std(np.diff(some))), step) * np.sqrt(2.0) * float(np.std(samples))


def at_the_ends(solution: Solution, data: Data) -> NDArray[np.float64]:
    """How far samples of the two ends stand out, in standard deviations where they do, shape (n,), else 0.

    The whitened record says nothing of the ends, where a sensor that just began, or a filter that was
    empty, puts its outliers. From the middle outwards, each is compared with the median of those behind it that do not
    stand out, and with how far samples that far apart usually are. One record of noise in a thousand has one.
    """
    from scipy.special import ndtri

    found = np.zeros(data.n)
    ends = ends_of(data.n)
    if ends < 1:
        return found
    samples = data.samples
    if solution.model.deterministic:
        samples = samples - data.signal(solution.model.deterministic)
    reach = np.arange(BEHIND)

    def apart(at: NDArray[np.int64] | int, way: int) -> NDArray[np.float64]:
        behind = np.asarray(at)[..., None] + way * reach
        return np.abs(samples[at] - np.median(samples[behind + way * gap], axis=-1))

    places = np.linspace(0, data.n - 1 - BEHIND - ends, min(data.n, USUAL)).astype(np.int64)
    gap = 1
    usual = apart(places, 1)
    scales = {gap: _scale(usual)}
    if scales[gap] == 0.0:
        return found
    chance = 0.001 / (2 * ends)
    limit = -float(ndtri(0.5 * chance))
    step = _step(data, usual) / scales[gap]
    limit = max(limit, outlier_limit(usual / scales[gap], chance, step))
    for first, way in ((ends - 1, 1), (data.n - ends, -1)):
        gap = 1
        for at in range(first, first - way * ends, -way):
            if data.missing is not None and data.missing[at]:
                continue
            if gap not in scales:
                scales[gap] = _scale(apart(places, 1))
            z = float(apart(at, way)) / scales[gap]
            found[at] = z if z > limit else 0.0
            gap = gap + 1 if z > limit else 1
    return found


def only_at_the_ends(effect: Modifier, data: Data) -> bool:
    """Whether it takes samples out, all of them some of the first and the last."""
    if not effect.removes:
        return False
    taken = effect.missing(data.n, data.rate)
    ends = ends_of(data.n)
    return bool(taken.any()) and not taken[ends : data.n - ends].any()


def _scale(size: NDArray[np.float64]) -> float:
    """Standard deviation by the widest of three quantiles (of a normal law 0.6745, 1 and 2 σ).

    Noise that is merely not normal has no outliers.
    """
    return float(np.max(np.quantile(size, [0.5, 0.6827, 0.9545]) / [0.6745, 1.0, 2.0]))


def screen_outliers(
    solution: Solution, data: Data, samples: NDArray[np.float64]
) -> Candidate | None:
    """Samples of the whitened record beyond what n normal ones reach once in a hundred records.

    The scale is that of quantiles, which a few per cent of outliers do not move; the gain is what giving each
    its own level would raise logL by, less the ln n of choosing it.
    """
    from scipy.special import log_ndtr, ndtri_exp

    kinds = [c for c in CATALOGUE if issubclass(c, Modifier) and c.screened == "outlier"]
    wanted = [c for c in kinds if c.candidates(solution.model, data.covariates)]
    if not wanted or samples.size < data.n:
        return None
    centre = np.median(samples)
    size = np.abs(samples - centre)
    scale = _scale(size)
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
    z = np.where(z > limit, z, 0.0)
    z += at_the_ends(solution, data)
    index = np.flatnonzero(z)
    if index.size == 0 or index.size > data.n // 5:
        return None
    seen = data.samples if data.missing is None else data.samples[~data.missing]
    if float(np.ptp(np.quantile(seen, [0.01, 0.99]))) == 0.0:
        return None  # a column of few codes: hardly anything but one of them would be left
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
