"""The residual whitened by the model, over time: in samples, and the power of octave bands.

The residual ordinates, whitened by the model, are cut into octave bands; the inverse cosine transform of a band's ordinates
alone is a series of as many values as the band has ordinates, each local in time (a Wilson basis): their squares are the
band's power over time, χ²₁ each where the model holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.showing import brief
from allanite.common.threads import results, side_by_side
from allanite.effects import Moving
from allanite.fit.likelihood.bands_in_time import (
    in_time,
    moving_power,
    share_of,
    steady,
    steady_course,
)
from allanite.fit.likelihood.expected import density
from allanite.fit.likelihood.peaks import nodes_of
from allanite.fit.likelihood.stop_band import without_empty
from allanite.recording.tails import CENSORED, coarse_step, tail_of

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Process, Solution

__all__ = [
    "Whitened",
    "cell_means",
    "ends_of",
    "expected_level",
    "step_in",
    "white_power",
    "white_share",
    "whiten",
    "whitened_ordinates",
    "with_normal_tails",
]

#: Fewest values of a band.
BAND = 256
#: Samples at either end of a record of which the time view says nothing, at most; a sixty-fourth of a short one.
ENDS = 64
#: Depth (in ln of the density) to which a narrow gap of the spectrum is whitened, below what stands this far (in ln of
#: the frequency) to both sides.
DEEP, ASIDE = 7.0, (0.05, 0.1, 0.2, 0.35, 0.6)
#: Share of a band's power from which on the white noise is what is seen there.
DOMINATES = 0.5
#: Of the octaves that it dominates those are looked at that have this part of the time resolution of the finest.
FINEST = 8
#: Stretches of which each has a level of its own where the tails are judged, and samples that tell them as well as all.
STRETCHES, ENOUGH = 64, 1 << 20
#: Samples beside which a single one stands out, by so many times what the largest of a normal record has: the median of so
#: many is known to 0.787/(0.6745 √32) = 21 % of itself, of which three are allowed for.
BESIDE, APART = 32, 1.7


@dataclass(frozen=True, eq=False)
class Whitened:
    """The residual over the root of the density that is probably there: the model's, corrected where it is wrong.

    White of variance 1 at all frequencies, so that what differs between times is a matter of time.

    Attributes
    ----------
    samples : ndarray, shape (n,)
        Over time. Of a summary, which keeps the lowest ordinates alone, as many as these.
    bands : tuple
        (first ordinate, end, power over time, squares in each value) of each octave from the top, while it has `BAND`
        values, and most of its ordinates hold something.
    step : float
        To which the record is rounded, in units of the samples; 0 where it is small.
    """

    samples: NDArray[np.float64]
    bands: tuple[tuple[int, int, NDArray[np.float64], float], ...]
    step: float = 0.0

    __repr__ = brief

    @cached_property
    def without_single(self) -> Whitened:
        """The same, single samples that stand out of those beside them as large as these.

        They are outliers, whatever the level: as powerful as a stretch, they would decide when it changes.
        """
        return _without_single(self)

    @cached_property
    def normalised(self) -> Whitened:
        """`with_normal_tails` of it. Several searches of a check ask."""
        return _normalised(self)


def whiten(solution: Solution, data: Data) -> Whitened:
    """The whitened residual of a solution, over time and in octaves."""
    white = _whitening(solution, data, solution.level) * _drawn(solution, data)
    for effect in solution.model.modifiers:
        if effect.band is not None:
            steady(white, effect, solution, data)
    for own in solution.processes:
        if isinstance(own.effect, Moving):
            steady_course(white, own, own.effect, solution, data)
    bands = data.octaves(
        lambda j: np.exp(_log_density(solution, data, solution.level, np.log(j))),
        lambda j, times: moving_power(solution, data, j, times),
    )
    found = _over_time(white, bands)
    found = replace(found, step=step_in(data, found.samples))
    if not any(effect.passing for effect in solution.model.modifiers):
        return found
    return _steadied(solution, data, found)


def _steadied(solution: Solution, data: Data, whitened: Whitened) -> Whitened:
    """The same where the level of the white noise changes: of one level at all times, as far as the model knows.

    In the bands that the white noise dominates, and in the samples, what it has is divided by what is expected at each
    time; others stay.
    """
    _, share, _ = white_power(solution, data, whitened)
    samples = whitened.samples / np.sqrt(1.0 + share * (_relative_power(solution, data) - 1.0))
    steady = {}
    if samples.size == data.n:
        steady = {b[0]: b for b in _over_time(_kernels.cosine_transform(samples), []).bands}
    bands = []
    for low, high, power, each in whitened.bands:
        own = white_share(solution, data, (low + high) // 2)
        if own >= DOMINATES and low in steady:
            bands.append(steady[low])
        else:
            expected = data.as_seen(expected_level(solution.model, data, power.size), low)
            bands.append((low, high, power / (1.0 + own * (expected - 1.0)), each))
    return Whitened(samples, tuple(bands), whitened.step)


def _relative_power(solution: Solution, data: Data) -> NDArray[np.float64]:
    """Power of the white noise at each sample that is kept over the record's mean."""
    if solution.ordinates.size != data.n:
        return expected_level(solution.model, data, solution.ordinates.size)
    gain = np.ones(data.n)
    for effect in solution.model.modifiers:
        if effect.passing:
            gain *= effect.gain(data.time, data.covariates)
    gain **= 2
    gain /= gain.mean()
    return gain


def with_normal_tails(whitened: Whitened) -> Whitened:
    """The same where its samples are normal at each time; else with normal samples in the order of these.

    A few of the largest samples of heavy tails would decide when a level changes, and of a coarse step hardly any differ.
    What changes over time is still there; single samples that stand out are not.
    """
    return whitened.normalised


def _without_single(whitened: Whitened) -> Whitened:
    from scipy.special import ndtri_exp

    samples = whitened.samples.copy()
    cells = samples[: samples.size // BESIDE * BESIDE].reshape(-1, BESIDE)
    if _of_segments(whitened) or whitened.step > 0.0 or not cells.size:
        return whitened
    size = np.abs(cells)
    usual = np.median(size, axis=1, keepdims=True) / 0.6745
    # The largest of so many normal samples, once in a hundred records.
    limit = -float(ndtri_exp(np.log(0.005 / samples.size)))
    single = (size > APART * limit * usual) & (usual > 0.0)
    if not single.any():
        return whitened
    cells[single] = np.copysign(np.broadcast_to(usual, cells.shape), cells)[single]
    return _again(whitened, samples)


def _of_segments(whitened: Whitened) -> bool:
    """Whether it is of a summary, of which there are no single samples."""
    return any(each != 1.0 for *_, each in whitened.bands)


def _again(whitened: Whitened, samples: NDArray[np.float64]) -> Whitened:
    """The same with other samples, and the octaves that it has of these."""
    found = _over_time(_kernels.cosine_transform(samples), [])
    kept = {low for low, *_ in whitened.bands}
    return replace(
        found, bands=tuple(band for band in found.bands if band[0] in kept), step=whitened.step
    )


def _normalised(whitened: Whitened) -> Whitened:
    from scipy.special import ndtri

    samples = whitened.samples
    if _of_segments(whitened) or _normal(whitened.without_single.samples):
        return whitened.without_single
    if whitened.step > 0.0:
        # In the order of values that rounding made equal is what wanders below a step, and it would be as large as noise.
        spread = np.random.default_rng(0).uniform(-0.5, 0.5, samples.size)
        samples = samples + whitened.step * spread
    # The core sorts to the end; beside it an interrupt is heard.
    [order] = results(side_by_side([lambda: _kernels.order(samples)]))
    scores = np.empty(samples.size)
    scores[order] = ndtri((np.arange(samples.size) + 0.5) / samples.size)
    return replace(_again(whitened, scores), step=0.0)


def _normal(samples: NDArray[np.float64]) -> bool:
    """Whether samples may be normal with a level of its own in each stretch."""
    if coarse_step(samples) > 0.0:
        return False
    size = np.abs(samples[:: -(-samples.size // ENOUGH)])
    if size.size < STRETCHES:
        return True
    size = size[: size.size // STRETCHES * STRETCHES].reshape(STRETCHES, -1)
    usual = np.median(size, axis=1, keepdims=True)
    if not usual.all():
        return False
    tail = tail_of((size / usual).ravel(), CENSORED[0])
    return tail is None or not tail.heavy


def step_in(data: Data, samples: NDArray[np.float64]) -> float:
    """Step to which a record is rounded, in units of samples made from it; 0 where it is small."""
    some = data.samples if data.missing is None else data.samples[~data.missing]
    step = coarse_step(some)
    if step == 0.0:
        return 0.0
    return step / max(float(np.std(np.diff(some))), step) * np.sqrt(2.0) * float(np.std(samples))


def ends_of(n: int) -> int:
    """Samples at either end of a record of n of which the whitened one says nothing."""
    return min(ENDS, n // 64)


def _over_time(
    white: NDArray[np.float64], bands: list[tuple[int, int, NDArray[np.float64], float]]
) -> Whitened:
    """Samples and octave bands of white ordinates, after the bands of which there are no single ones."""
    from scipy.fft import next_fast_len

    # Behind a deep stop band the ends of the transform, not the record, stand out.
    n = white.size
    ends = ends_of(n)
    high = n
    # An octave and what makes its transform, of one ordinate more, quick.
    while high - (low := high + 1 - next_fast_len(high - high // 2 + 1)) >= BAND:
        own, high = white[low:high], low
        if 2 * np.count_nonzero(own) < own.size:
            continue  # mostly empty bins
        power = in_time(own) ** 2
        edge = -(-ends * power.size // n)
        power[:edge] = power[edge : 5 * edge].mean()
        power[power.size - edge :] = power[power.size - 5 * edge : power.size - edge].mean()
        bands.append((low, low + own.size, power, 1.0))
    samples = _kernels.inverse_cosine_transform(white)
    samples[:ends] = samples[n - ends :] = 0.0
    return Whitened(samples, tuple(bands))


def _drawn(solution: Solution, data: Data) -> NDArray[np.float64]:
    """Residual ordinates of a record without holes: what is missing is drawn from the model."""
    if data.gain is None:
        return solution.ordinates
    return _kernels.cosine_transform(data.residual(solution.model))


def _whitening(solution: Solution, data: Data, level: NDArray[np.float64]) -> NDArray[np.float64]:
    """One over the root of the model's density times the level of each bin, shape (n,)."""
    j = np.maximum(np.arange(solution.ordinates.size, dtype=np.float64), 1.0)
    white = _log_density(solution, data, level, np.log(j, out=j))
    white *= -0.5
    return without_empty(np.asarray(np.exp(white, out=white)), data.bins)


def whitened_ordinates(
    solution: Solution, data: Data, level: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Residual ordinates over the root of the model's density times the level of each bin, shape (n,)."""
    white = _whitening(solution, data, level)
    white *= solution.ordinates
    return white


def _log_density(
    solution: Solution, data: Data, level: NDArray[np.float64], log_j: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Logarithm of the model's density times the level of each bin, at ordinates of which the logarithms are given."""
    bins = data.bins
    nodes = nodes_of(solution.model, bins, data.rate)
    owner = np.searchsorted(bins.edges, nodes, side="right") - 1
    known = np.log(density(data.terms(solution.model), nodes, data.n) * level[owner])
    at = np.log(nodes)
    return np.interp(log_j, at, _without_gaps(known, at))


def _without_gaps(known: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithms of a density, at logarithms of frequencies, without narrow gaps.

    What a notch leaves at its centre comes from the ends of the record: whitened in full, the first and last seconds of
    every filtered record would be loud.
    """
    sides = [np.max([np.interp(at + s * apart, at, known) for apart in ASIDE], 0) for s in (-1, 1)]
    return np.maximum(known, np.minimum(*sides) - DEEP)


def expected_level(model: Model, data: Data, cells: int) -> NDArray[np.float64]:
    """White power of equal stretches over the record's mean, from the level changes of a model, shape (cells,)."""
    power = np.ones(cells)
    edges = np.linspace(*data.span, cells + 1)
    for effect in model.modifiers:
        if effect.passing:
            names = [effect.follows] if effect.follows in data.covariates else []
            columns = {n: cell_means(data.covariates[n], cells) for n in names if n is not None}
            power *= effect.mean_power(edges[:-1], edges[1:], columns)
    return np.asarray(power / power.mean())


def cell_means(values: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    """Means of equal stretches, at most as many as there are values, shape (cells,)."""
    edges = np.arange(cells) * values.size // cells
    sizes = np.diff(np.append(edges, values.size))
    if not sizes.all():
        return np.asarray(values[edges])
    return np.asarray(np.add.reduceat(values, edges) / sizes)


def white_share(solution: Solution, data: Data, ordinate: int) -> float:
    """Part of the model's density at an ordinate that its white effect makes."""
    white = _white(solution)
    return 0.0 if white is None else share_of(white, solution, data, ordinate)


def _white(solution: Solution) -> Process | None:
    return next((own for own in solution.processes if own.effect.white), None)


def white_power(
    solution: Solution, data: Data, whitened: Whitened
) -> tuple[NDArray[np.float64] | None, float, float]:
    """Power over time of the octaves that the white effect dominates, its share in them, and values of all for each."""
    own = _white(solution)
    if own is None:
        return None, 0.0, 0.0
    bands = []
    for low, high, power, each in whitened.bands:
        share = share_of(own, solution, data, (low + high) // 2)
        if share >= DOMINATES:
            bands.append((power, each, share))
    length = max((power.size for power, _, _ in bands), default=0)
    total, weight, shares = np.zeros(length), 0.0, 0.0
    for power, each, share in bands:
        if power.size < length // FINEST:
            continue  # what happens between its values it shows in both
        # Spread the coarser bands over the finest time axis with their own number of values.
        index = (np.arange(length) * power.size // length).astype(np.int64)
        values = each * power.size / length
        total += power[index] * values
        weight += values
        shares += share * values
    if weight == 0.0:
        return None, 0.0, 0.0
    return total / weight, shares / weight, weight
