"""A summary made ready for fitting.

Its low-rate samples give the lowest ordinates of the whole record, each as the record itself would (the halvings' gain
taken out); all higher bins have the power of the segments of their octave, with the degrees of freedom of the record's
ordinates, since segments share nothing and lose nothing (`summary/lapped.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.deviation import Deviation, oadev
from allanite.fit.likelihood.data import Data
from allanite.fit.likelihood.peaks import FEW
from allanite.fit.likelihood.remembered import Remembered
from allanite.fit.likelihood.sections import Cells
from allanite.spectrum import Bins, bins_of, bridge_gaps
from allanite.summary.lapped import LOW, SEGMENT, gain
from allanite.summary.level import BANDS, FINE, TILE
from allanite.summary.lines import without_lines

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.sections import Sections
    from allanite.summary import Summary
    from allanite.summary.reading import Reading
    from allanite.summary.sums import Blocks

__all__ = ["SummaryData", "of_summary", "refused"]

Array = NDArray[np.float64]
#: Cells of the time axis in which octaves of segments are looked at.
CELLS = 160
#: Kept samples to an averaging time from which the curve is taken from them where a function of time is taken out.
ENOUGH = 16
#: Bytes of what a search comes back to: a record that did not fit is looked at in little memory.
FUNCTIONS, LOWEST = 1 << 23, 1 << 23


@dataclass(frozen=True, slots=True, eq=False)
class SummaryBins(Bins):
    """The bins of the record, of which the lowest hold single ordinates and the others the power of segments.

    Attributes
    ----------
    known : int
        Bins of single ordinates.
    folds : ndarray, shape (folds + 1, 2, bins − known)
        Number of ordinates and mean power of the others: of all, then of every `folds`-th coefficient.
    """

    known: int
    folds: Array

    __repr__ = brief

    def power(self, ordinates: Array) -> Array:
        """Bin means: of squared ordinates, and those of the segments."""
        edges = self.edges[: self.known]
        low = np.add.reduceat(ordinates**2, edges) / self.count[: self.known]
        return np.concatenate([low, self.folds[0, 1]])

    def folded(self, ordinates: Array, folds: int) -> tuple[Array, Array]:
        """Number and sum of squares of each fold of each bin; coefficients are dealt as ordinates are."""
        number, total = _low_bins(self).folded(ordinates, folds)
        high = self.folds[1:]
        return (
            np.hstack([number, high[:, 0]]),
            np.hstack([total, high[:, 0] * high[:, 1]]),
        )


def _low_bins(bins: SummaryBins) -> Bins:
    return Bins(
        bins.n,
        bins.edges[: bins.known + 1],
        bins.count[: bins.known],
        bins.nodes,
        bins.owner,
        bins.groups,
    )


@dataclass(frozen=True, slots=True, eq=False)
class SummaryData(Data):
    """What a fit needs of a summary; see `Data`.

    Attributes
    ----------
    samples : ndarray, shape (m,)
        Kept samples at a lower rate.
    ordinates : ndarray, shape (known,)
        The lowest ordinates of the record; `known` is less than `n`.
    factor : int
        Samples of the record to a kept one.
    summary : Summary
    reading : Reading
    """

    factor: int = 1
    summary: Any = None
    reading: Any = None

    __repr__ = brief

    @property
    def n(self) -> int:
        """Samples of the record."""
        return int(self.samples.size) * self.factor

    @property
    def lost(self) -> float:
        """Share of the kept samples that are missing."""
        return float(np.mean(np.isnan(self.reading.samples)))

    @property
    def time(self) -> Array:
        """Middle of each kept sample, s since the first sample of the recording."""
        time = np.arange(self.samples.size, dtype=np.float64)
        time *= self.factor / self.rate
        time += self.start + 0.5 * (self.factor - 1) / self.rate
        return time

    def transform(self, series: Array) -> Array:
        """Lowest ordinates of a slow series that is given at `time`."""
        found = _kernels.cosine_transform(np.ascontiguousarray(series))[: self.ordinates.size]
        return np.asarray(found * np.sqrt(self.factor))

    def factors(self) -> NDArray[np.int64]:
        """Averaging factors of the curve that was accumulated, to a third of the record."""
        m = self.summary.oadev().factors
        return np.asarray(m[m <= max(1, self.n // 3)])

    def deviation(self, factors: NDArray[np.int64], less: Array | None = None) -> Array:
        """The accumulated curve; without a signal, the curve of the kept samples where these are fine enough."""
        curve: Deviation = self.summary.oadev()
        found = curve.deviation[np.searchsorted(curve.factors, factors)]
        if less is None:
            return found
        taken = found**2 - self.deviation_of(less, factors) ** 2
        fine = factors >= ENOUGH * self.factor
        left = _interpolated(self.samples - less, factors[fine], self.factor, self.rate)
        taken[fine] = left**2
        return np.asarray(np.sqrt(np.maximum(taken, 1e-6 * found**2)))

    def deviation_of(self, signal: Array, factors: NDArray[np.int64]) -> Array:
        """Curve of a slow signal that is given at `time`; it rises as τ below the interval of these."""
        least = np.maximum(factors, self.factor)
        found = _interpolated(signal, least, self.factor, self.rate)
        return np.asarray(found * factors / least)

    def octaves(self, expected: Any, louder: Any) -> list[tuple[int, int, Array, float]]:
        """Power over time of the octaves that are kept in segments, over what is expected, from the top.

        Parameters
        ----------
        expected : callable
            Density of ordinates j, U² per sample.
        louder : callable
            Power of ordinates j at some times over that, shape (times, ordinates).

        Returns
        -------
        list of (first ordinate, end, power, values)
            `CELLS` powers of an octave each, and how many ordinates each is the mean of.
        """
        out = []
        cut = self.n
        for level, octave in enumerate(self.reading.octaves):
            scale, blocks = 1 << level, octave.blocks
            per = self.n / (SEGMENT * scale)
            edges, middle, loss = _fine(level)
            j = np.clip(np.round(middle * per), 1, self.n - 1).astype(np.int64)
            at = self.block_edges(blocks, scale)
            times = self.span[0] + 0.5 * (at[1:] + at[:-1]) / self.rate
            model = expected(j) * np.diff(edges) * loss * louder(j, times)
            power = (blocks.sums.value / model.reshape(-1, BANDS, FINE // BANDS).sum(axis=2)).mean(
                axis=1
            )
            # Of each cell the share of the blocks that lie in it.
            cells = np.linspace(0.0, self.summary.n, CELLS + 1)
            total, frames = (_shared(values, at, cells) for values in (power, blocks.frames))
            mean = total.sum() / max(frames.sum(), 1e-9)
            ratio = np.where(frames > 0.0, total / np.maximum(frames, 1e-9), mean)
            low, high = round(LOW * per), min(round(2 * LOW * per), cut)
            out.append((low, high, ratio, (high - low) / CELLS))
            cut = low
        return out

    def block_edges(self, blocks: Blocks, scale: int) -> Array:
        """Where blocks begin and end, in samples of the record."""
        size = float((TILE << blocks.size) * scale)
        edges = (blocks.first + np.arange(blocks.frames.size + 1)) * size - self.summary.start
        return np.asarray(edges.clip(0.0, self.summary.n))

    def as_seen(self, power: Array, first: int) -> Array:
        """Power in cells as the map shows it in the octave from an ordinate on: where a block is longer, its mean."""
        per = self.n / SEGMENT
        level = round(np.log2(LOW * per / max(first, 1)))
        if level >= len(self.reading.octaves) or round(LOW * per / (1 << level)) != first:
            return power
        edges = np.unique(self.block_edges(self.reading.octaves[level].blocks, 1 << level))
        # What is less than a block at an end is with its neighbour.
        edges[0], edges[-1] = 0.0, self.summary.n
        cells = np.linspace(0.0, self.summary.n, CELLS + 1)
        means = _shared(power, cells, edges) / _shared(np.ones(CELLS), cells, edges)
        sizes = np.diff(edges)
        return _shared(means * sizes, edges, cells) / _shared(sizes, edges, cells)

    def most_sections(self, band: tuple[float, float], most: int, resolved: float) -> int:
        """In how many `sections`, at `most`, half of a band, Hz, has so many ordinates, or two cells; 0 where in none."""
        low, high = band
        bottom, top = _limits(self)
        if not bottom < 0.5 * (low + high) < top or self.lost > FEW:
            return 0
        level = int(np.log2(top / (0.5 * (low + high))))
        octave = self.reading.octaves[level]
        if octave.sections.frames.sum() < (1.0 - FEW) * octave.frames:
            return 0
        if (high - low) * SEGMENT * (1 << level) / self.rate < max(resolved, 2.0 * LOW / FINE):
            return 0
        number = most
        while number > octave.sections.frames.size:
            number //= 2
        return number

    def sections(self, model: Model, number: int) -> Sections:
        """So many equal sections; known functions of time are below the frequencies of these."""
        return SectionsOfSummary(self, number)


class SectionsOfSummary:
    """Sections of the octaves that a summary keeps in segments."""

    def __init__(self, data: SummaryData, number: int) -> None:
        self.data, self.number, self.limits = data, number, _limits(data)

    def cells(self, within: tuple[float, float], _step: float) -> Cells:
        """The cells that are kept between two frequencies, Hz, as wide as they are."""
        data, power, count, at = self.data, [], [], []
        ends = np.linspace(0.0, data.summary.n, self.number + 1)
        for level, octave in enumerate(data.reading.octaves):
            edges, middle, loss = _fine(level)
            hertz = data.rate / (2.0 * SEGMENT * (1 << level))
            inside = (edges[:-1] * hertz > within[0]) & (edges[1:] * hertz < within[1])
            if not inside.any():
                continue
            # Of each section the share of the blocks that lie in it.
            block = data.block_edges(octave.sections, 1 << level)
            shared = np.minimum(ends[1:, None], block[1:]) - np.maximum(ends[:-1, None], block[:-1])
            share = np.clip(shared, 0.0, None) / np.maximum(np.diff(block), 1e-9)
            number = np.outer(share @ octave.sections.frames, np.diff(edges))[:, inside]
            total = (share @ octave.sections.sums.value / loss)[:, inside]
            power.append(total / np.maximum(number, 1e-9))
            count.append(number)
            at.append((np.round(middle[inside]).astype(np.int64), SEGMENT << level))
        return Cells(np.hstack(power), np.hstack(count), tuple(at))


def _shared(values: Array, edges: Array, others: Array) -> Array:
    """Sums of values between edges, between other edges: of each the share that lies there."""
    return np.diff(np.interp(others, edges, np.concatenate([[0.0], np.cumsum(values)])))


def _fine(level: int) -> tuple[NDArray[np.int64], Array, Array]:
    """Edges and middles of the fine bands of a level, in its coefficients, and what is left there of a density."""
    edges = LOW + np.arange(FINE + 1, dtype=np.int64) * LOW // FINE
    middle = np.asarray(0.5 * (edges[1:] + edges[:-1]), dtype=np.float64)
    loss = gain(middle / (2.0 * SEGMENT * 2.0**level), level) ** 2 / 2.0**level
    return edges, middle, loss


def _limits(data: SummaryData) -> tuple[float, float]:
    """Frequencies between which the power in segments is kept over time, Hz."""
    top = LOW / SEGMENT * data.rate
    return top / (1 << len(data.reading.octaves)), top


def _interpolated(samples: Array, factors: NDArray[np.int64], factor: int, rate: float) -> Array:
    """Deviation of kept samples at averaging factors of the record."""
    top = samples.size // 3
    m = np.unique(np.round(np.geomspace(1, top, 160)).astype(np.int64))
    found = oadev(samples, rate=rate / factor, factors=m)
    level = np.log(np.maximum(found.deviation, 1e-300))
    return np.asarray(np.exp(np.interp(np.log(factors / factor), np.log(found.factors), level)))


def refused(summary: Summary, model: Model, method: str) -> None:
    """Say what a summary that does not keep its samples cannot be asked for.

    Raises
    ------
    InputError
        Another method than the likelihood, samples taken out, a line above the frequencies that are kept in phase.
    """
    from allanite.effects import Periodic

    if method != "whittle":
        raise InputError(
            f"method {method!r} needs samples, which a summary of this length does not keep"
        )
    if any(e.removes for e in model.modifiers):
        raise InputError(
            "outliers and disturbances are taken out of samples, which a summary of this length does not keep"
        )
    top = phase_limit(summary.reading(), summary.rate)
    for line in (e for e in model if isinstance(e, Periodic)):
        if (line.frequency or 0.0) > top:
            raise InputError(
                f"{line.kind}: frequency = {line.frequency:g} Hz, but the summary keeps phases up to {top:.4g} Hz:"
                " fit a piece of the record"
            )


def phase_limit(reading: Reading, rate: float) -> float:
    """Frequency up to which single ordinates are kept, Hz."""
    return LOW / SEGMENT * rate / reading.factor


def of_summary(summary: Summary) -> Data:
    """Data of a one-column summary that does not keep all its samples.

    Raises
    ------
    TooShortError
        Constant samples, or none.
    """
    reading = summary.reading()
    factor, depth = reading.factor, len(reading.octaves)
    samples = bridge_gaps(reading.samples)
    if float(np.ptp(samples)) == 0.0:
        raise TooShortError(
            f"column {summary.columns[0]!r} is constant ({samples[0]:g}): there is no noise to fit"
        )
    n = samples.size * factor
    bins = bins_of(n)
    known = int(np.searchsorted(bins.edges, 2 * LOW / SEGMENT * samples.size, side="right")) - 1
    top = int(bins.edges[known])
    ordinates = _kernels.cosine_transform(samples)[:top] * np.sqrt(factor)
    ordinates /= gain(np.arange(top) / (2.0 * n), depth)
    folds = _folds(reading, bins, known)
    covariates = {name: bridge_gaps(v) for name, v in summary.low_rate(depth).items()}
    return SummaryData(
        samples,
        ordinates,
        summary.rate,
        SummaryBins(n, bins.edges, bins.count, bins.nodes, bins.owner, bins.groups, known, folds),
        covariates,
        (reading.start * factor - summary.start) / summary.rate,
        functions=Remembered(FUNCTIONS),
        lowest=Remembered(LOWEST),
        factor=factor,
        summary=summary,
        reading=reading,
    )


def _folds(reading: Reading, bins: Bins, known: int, folds: int = 5) -> Array:
    """Ordinates and mean power of the bins above the known ones: of all coefficients, and of each fold of them."""
    edges, power, place = [], [], []
    for level in reversed(range(len(reading.octaves))):
        found, _ = without_lines(reading, level, 1.0)
        m = np.arange(LOW, LOW + found.size)
        edges.append(m * (bins.n / (SEGMENT * 2.0**level)))
        power.append(found)
        place.append(m)
    j = np.append(np.concatenate(edges), float(bins.n))
    level_of, m = np.concatenate(power), np.concatenate(place)
    width = np.diff(j)
    wanted = bins.edges[known:] - 0.5
    out = np.empty((folds + 1, 2, wanted.size - 1))
    for fold in range(folds + 1):
        own = width * (1.0 if fold == 0 else m % folds == fold - 1)
        inside, total = (
            np.diff(np.interp(wanted, j, np.concatenate([[0.0], np.cumsum(v)])))
            for v in (own, own * level_of)
        )
        share = inside / np.maximum(inside, 1e-300)
        out[fold, 1] = total / np.maximum(inside, 1e-300)
        out[fold, 0] = inside * share
    # The ends of the grid are not those of the record by half an ordinate.
    count = np.diff(bins.edges[known:]).astype(float)
    out[0, 0] = count
    whole = out[1:, 0].sum(axis=0)
    out[1:, 0] *= count / np.maximum(whole, 1e-300)
    return out
