"""A summary prepared for fitting, and its power over time; errors for requests that need single samples.

The low-rate samples of a summary give the lowest ordinates of the whole record, corrected by the gain of the halvings.
All higher bins take the power of the segments of their octave. They have the degrees of freedom of the record's ordinates,
because the segments are independent and lose no information (`summary/lapped.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.deviation import Deviation, oadev
from allanite.effects import Model
from allanite.fit.likelihood.data import Data
from allanite.fit.likelihood.peaks import MAX_MISSING_FRACTION
from allanite.fit.likelihood.remembered import ArrayCache
from allanite.fit.likelihood.sections import Cells, Sections
from allanite.fit.prediction import FOLDS
from allanite.spectrum import Bins, bins_of, bridge_gaps
from allanite.summary import Summary
from allanite.summary.gaps import fill_missing
from allanite.summary.lapped import LOW, SEGMENT, low_pass_gain
from allanite.summary.level import BANDS, FINE, TILE
from allanite.summary.lines import without_lines
from allanite.summary.reading import Reading
from allanite.summary.sums import Blocks

#: Minimum number of kept (low-rate) samples per averaging time for which the Allan curve is computed from kept samples.
#: Chosen by judgment; not measured.
MIN_KEPT_PER_TAU = 16
#: Maximum size, bytes, of each cache of `SummaryData`; small, since summaries are used if memory is scarce.
#: Chosen by judgment; not measured.
CACHE_BYTES = 1 << 23
#: Number of time cells for the power of an octave over time. Chosen by judgment; not measured.
TIME_CELLS = 160


@dataclass(frozen=True, slots=True, eq=False)
class SummaryBins(Bins):
    """Bins of the summarized record: the `known` lowest contain single ordinates, the others the power of segments.

    `folds`, shape (FOLDS + 1, 2, bins − known), are the number of ordinates and mean power of each other bin: first of all
    coefficients, then of each fold.
    """

    known: int
    folds: Array

    __repr__ = brief

    def power(self, ordinates: Array) -> Array:
        """Mean power of each bin, shape (bins,).

        Low bins take it from the squared `ordinates`, higher ones from the transforms of segments in the summary.
        """
        edges = self.edges[: self.known]
        low = np.add.reduceat(ordinates**2, edges) / self.count[: self.known]
        return np.concatenate([low, self.folds[0, 1]])

    def folded(self, ordinates: Array, folds: int) -> tuple[Array, Array]:
        """Pair (number, sum of squares) of the ordinates in each fold and bin, two arrays of shape (folds, bins).

        Fold k of a cross-validation contains the ordinates with index modulo `folds` equal to k. Bins without single
        ordinates contain coefficients of the transforms of segments instead. `folds` must be `FOLDS`.
        """
        edges, count = self.edges[: self.known + 1], self.count[: self.known]
        low = Bins(self.n, edges, count, self.nodes, self.owner, self.groups)
        number, total = low.folded(ordinates, folds)
        high = self.folds[1:]
        return np.hstack([number, high[:, 0]]), np.hstack([total, high[:, 0] * high[:, 1]])


@align_when_unpickled
@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class SummaryData(Data):
    """A summary prepared for fitting: samples are kept at a lower rate, and ordinates up to `phase_limit`.

    Attributes
    ----------
    summary : Summary
        Its n is the number of all samples of the record, also those at the ends that no kept sample covers.
    reading : Reading
    """

    summary: Summary
    reading: Reading

    whole = False

    @property
    def lost(self) -> float:
        """Fraction of the samples that are missing, 0 … 1."""
        return self.summary.missing / self.summary.n

    def factors(self) -> NDArray[np.int64]:
        """Averaging factors of the Allan curve of the summary, in samples, at most a third of the record.

        Factors at which gaps left out at least half of the differences are excluded, unless at least 16 kept low-rate
        samples lie within τ.
        """
        curve: Deviation = self.summary.oadev()
        m = curve.factors
        shown = (curve.n > curve.lost) | (m >= MIN_KEPT_PER_TAU * self.factor)
        return np.asarray(m[shown & (m <= max(1, self.n // 3))])

    def deviation(self, factors: NDArray[np.int64], subtracted: Array | None = None) -> Array:
        """Overlapping Allan deviation of the record minus the signal `subtracted`, U, at the averaging `factors`.

        Without a signal, the result is what the summary accumulated. The kept low-rate samples are used instead for τ with
        at least 16 of them, if gaps left out differences or if there is a signal. At shorter τ, the Allan variance of the
        signal is subtracted from the accumulated one. At least 1e-6 of the accumulated variance remains.
        """
        curve: Deviation = self.summary.oadev()
        at = np.searchsorted(curve.factors, factors)
        found = curve.deviation[at]
        fine = factors >= MIN_KEPT_PER_TAU * self.factor
        holed = fine & (curve.lost[at] > 0)
        found[holed] = _interpolated(self.samples, factors[holed], self.factor, self.rate)
        if subtracted is None:
            return found
        taken = found**2 - self.deviation_of(subtracted, factors) ** 2
        left = _interpolated(self.samples - subtracted, factors[fine], self.factor, self.rate)
        taken[fine] = left**2
        return np.asarray(np.sqrt(np.maximum(taken, 1e-6 * found**2)))

    def deviation_of(self, signal: Array, factors: NDArray[np.int64]) -> Array:
        """Overlapping Allan deviation of a slow signal sampled at `time`, at `factors`.

        Below the interval of the kept samples the deviation is extrapolated in proportion to τ.
        """
        covered = np.maximum(factors, self.factor)
        found = _interpolated(signal, covered, self.factor, self.rate)
        return np.asarray(found * factors / covered)

    @property
    def limits(self) -> tuple[float, float]:
        """Pair: lowest and highest frequency whose power over time is kept, Hz."""
        top = LOW / SEGMENT * self.rate
        return top / (1 << len(self.reading.octaves)), top

    @property
    def time_cells(self) -> Array:
        """Array of the edges of 160 equal time cells (`TIME_CELLS`), in samples of the record, shape (161,)."""
        return np.linspace(0.0, self.summary.n, TIME_CELLS + 1)

    def block_edges(self, blocks: Blocks, level: int) -> Array:
        """Edges of successive time `blocks` of octave `level`, in samples of the record, shape (blocks + 1,).

        Octaves are numbered from 0, the highest. Edges outside the record are moved to its ends.
        """
        size = float((TILE << blocks.size) << level)
        edges = (blocks.first + np.arange(blocks.frames.size + 1)) * size - self.summary.start
        return np.asarray(edges.clip(0.0, self.summary.n))

    def octaves(self, expected: Any, relative_power: Any) -> list[tuple[int, int, Array, float]]:
        """List of (first ordinate, end ordinate, power, number), one for each octave with segments, highest first.

        The arguments and the values are those of `Data.octaves`, with 160 time cells. Cells without a segment are
        interpolated, so that they show no change.
        """
        out, cut = [], self.n
        for level, octave in enumerate(self.reading.octaves):
            per, blocks = self.n / (SEGMENT << level), octave.blocks
            edges, middle, left = fine_bands(level)
            j = np.clip(np.round(middle * per), 1, self.n - 1).astype(np.int64)
            at = self.block_edges(blocks, level)
            times = self.span[0] + 0.5 * (at[1:] + at[:-1]) / self.rate
            model = expected(j) * np.diff(edges) * left * relative_power(j, times)
            model = model.reshape(-1, BANDS, FINE // BANDS).sum(axis=2)
            power = (blocks.sums.value / model).mean(axis=1)
            total, frames = (
                redistributed(values, at, self.time_cells) for values in (power, blocks.frames)
            )
            low, high = self._first_of(level), min(round(2 * LOW * per), cut)
            cut = low
            seen = np.flatnonzero(frames > 0.0)
            if seen.size:
                # Cells without a segment are interpolated, so that they show no change.
                ratio = np.interp(np.arange(TIME_CELLS), seen, total[seen] / frames[seen])
                out.append((low, high, ratio, (high - low) / TIME_CELLS))
        return out

    def _first_of(self, level: int) -> int:
        """First ordinate of the octave `level`; each level halves the frequency."""
        return round(LOW * self.n / (SEGMENT << level))

    def at_octave_resolution(self, power: Array, first: int) -> Array:
        """`power`, in 160 time cells, averaged within the stored blocks of the octave that begins at `first`.

        `power` itself if no octave begins at this ordinate.
        """
        levels = range(len(self.reading.octaves))
        level = next((level for level in levels if self._first_of(level) == first), None)
        if level is None:
            return power
        edges = np.unique(self.block_edges(self.reading.octaves[level].blocks, level))
        # Incomplete blocks at the ends are joined with their neighbor.
        edges[0], edges[-1] = 0.0, self.summary.n
        cells, sizes = self.time_cells, np.diff(edges)
        sums, parts = (redistributed(v, cells, edges) for v in (power, np.ones(TIME_CELLS)))
        total, whole = (redistributed(v, edges, cells) for v in (sums / parts * sizes, sizes))
        return total / whole

    def resolved_sections(
        self, band: tuple[float, float], max_number: int, min_product: float
    ) -> int:
        """Number of equal sections of the record in which a band (low, high), Hz, can be followed; 0 if it cannot.

        The number is `max_number`, halved until the summary stores at least as many sections. It is 0 in four cases:

        - The middle of the band is not between the stored frequencies.
        - Over 10 % of the samples, or of the octave's sections, are missing.
        - The band is narrower than four frequency cells of the octave.
        - The width of the band times the duration of a segment is below `min_product`.
        """
        low, high = band
        bottom, top = self.limits
        if not bottom < 0.5 * (low + high) < top or self.lost > MAX_MISSING_FRACTION:
            return 0
        level = int(np.log2(top / (0.5 * (low + high))))
        octave = self.reading.octaves[level]
        if octave.sections.frames.sum() < (1.0 - MAX_MISSING_FRACTION) * octave.frames:
            return 0  # a part comes from an older file without sections
        if (high - low) * (SEGMENT << level) / self.rate < max(min_product, 2.0 * LOW / FINE):
            return 0
        number = max_number
        while number > octave.sections.frames.size:
            number //= 2
        return number

    def sections(self, model: Model, number: int) -> Sections:
        """`SectionsOfSummary`: power over time in `number` equal sections.

        Known functions of time of the model lie below the stored frequencies and need not be removed.
        """
        return SectionsOfSummary(self, number)


class SectionsOfSummary(Sections):
    """`number` equal time sections of a summary's spectrogram."""

    def __init__(self, data: SummaryData, number: int) -> None:
        self.data, self.number, self.limits = data, number, data.limits

    def cells(self, within: tuple[float, float], _step: float) -> Cells:
        """`Cells`: power of each section in the stored frequency cells between the two frequencies `within`, Hz.

        The width of the cells is fixed by the summary; `_step` is not used.
        """
        data, power, count, at = self.data, [], [], []
        ends = np.linspace(0.0, data.summary.n, self.number + 1)
        for level, octave in enumerate(data.reading.octaves):
            edges, middle, left = fine_bands(level)
            hertz = data.rate / (2.0 * SEGMENT * (1 << level))
            inside = (edges[:-1] * hertz > within[0]) & (edges[1:] * hertz < within[1])
            if not inside.any():
                continue
            # Fraction of each block that lies in each section.
            block = data.block_edges(octave.sections, level)
            common = np.minimum(ends[1:, None], block[1:]) - np.maximum(ends[:-1, None], block[:-1])
            share = np.clip(common, 0.0, None) / np.maximum(np.diff(block), 1e-9)
            number = np.outer(share @ octave.sections.frames, np.diff(edges))[:, inside]
            total = (share @ octave.sections.sums.value / left)[:, inside]
            power.append(total / np.maximum(number, 1e-9))
            count.append(number)
            at.append((np.round(middle[inside]).astype(np.int64), SEGMENT << level))
        return Cells(np.hstack(power), np.hstack(count), tuple(at))


def redistributed(values: Array, edges: Array, others: Array) -> Array:
    """Sums in cells with the edges `others`, from the sums `values` in cells with the edges `edges`, spread evenly."""
    return np.diff(np.interp(others, edges, np.concatenate([[0.0], np.cumsum(values)])))


def fine_bands(level: int) -> tuple[NDArray[np.int64], Array, Array]:
    """Tuple (edges, middles, gains) of the fine frequency bands of an octave, after `level` halvings of the sampling rate.

    Edges, shape (bands + 1,), and middles, shape (bands,), are indices of the cosine transform of one time segment. The
    gain of a band is the expected squared coefficient, divided by the density of the record at the same frequency.
    """
    edges = LOW + np.arange(FINE + 1, dtype=np.int64) * LOW // FINE
    middle = np.asarray(0.5 * (edges[1:] + edges[:-1]), dtype=np.float64)
    left = low_pass_gain(middle / (2.0 * SEGMENT * 2.0**level), level) ** 2 / 2.0**level
    return edges, middle, left


def _interpolated(samples: Array, factors: NDArray[np.int64], factor: int, rate: float) -> Array:
    """Overlapping Allan deviation of kept low-rate samples, at averaging `factors` in samples of the record.

    `rate` is that of the record, and `factor` is its number of samples per kept sample. The deviation is interpolated
    linearly in ln τ and ln deviation, and constant outside.
    """
    top = samples.size // 3
    m = np.unique(np.round(np.geomspace(1, top, 160)).astype(np.int64))
    found = oadev(samples, rate=rate / factor, factors=m)
    level = np.log(np.maximum(found.deviation, 1e-300))
    return np.asarray(np.exp(np.interp(np.log(factors / factor), np.log(found.factors), level)))


def require_summary_supports(summary: Summary, model: Model, method: str) -> None:
    """Raise InputError if a fit needs single samples, which a summary does not keep.

    These are fits by another method than whittle, of a model that excludes samples, or with a line above `phase_limit`.
    """
    if method != "whittle":
        raise InputError(
            f"method {method!r} needs samples, which a summary of this length does not keep"
        )
    if any(e.removes for e in model.modifiers):
        raise InputError(
            "outliers and disturbances need single samples, which a summary of this length does not keep"
        )
    top = phase_limit(summary.reading(), summary.rate)
    for line in model.deterministic:
        frequency = line.base_frequency or 0.0
        if frequency > top:
            raise InputError(
                f"{line.kind}: frequency = {frequency:g} Hz, but the summary keeps phases only up to {top:.4g} Hz;"
                " fit a segment of the record"
            )


def phase_limit(reading: Reading, rate: float) -> float:
    """Highest frequency, Hz, at which a summary keeps single ordinates."""
    return LOW / SEGMENT * rate / reading.factor


def of_summary(summary: Summary) -> SummaryData:
    """`SummaryData` of a one-column summary without single samples; `TooShortError` for constant or no samples."""
    reading = summary.reading()
    factor, depth = reading.factor, len(reading.octaves)
    samples = fill_missing(reading.samples)
    if float(np.ptp(samples)) == 0.0:
        raise TooShortError(
            f"column {summary.columns[0]!r} is constant ({samples[0]:g}); there is no noise to fit"
        )
    n = samples.size * factor
    bins = bins_of(n)
    known = int(np.searchsorted(bins.edges, 2 * LOW / SEGMENT * samples.size, side="right")) - 1
    top = int(bins.edges[known])
    ordinates = _kernels.cosine_transform(samples)[:top] * np.sqrt(factor)
    ordinates /= low_pass_gain(np.arange(top) / (2.0 * n), depth)
    folds = _power_in_folds(reading, bins, known)
    covariates = {name: bridge_gaps(v) for name, v in summary.low_rate(depth).items()}
    return SummaryData(
        samples,
        ordinates,
        summary.rate,
        SummaryBins(n, bins.edges, bins.count, bins.nodes, bins.owner, bins.groups, known, folds),
        covariates,
        (reading.start * factor - summary.start) / summary.rate,
        functions=ArrayCache(CACHE_BYTES),
        lowest=ArrayCache(CACHE_BYTES),
        factor=factor,
        summary=summary,
        reading=reading,
    )


def _power_in_folds(reading: Reading, bins: Bins, known: int) -> Array:
    """(Number of ordinates, mean power) of each bin without single ordinates, shape (FOLDS + 1, 2, bins − known).

    The power comes from the cosine transforms of time segments, with spectral lines removed. Entry 0 of the first axis uses
    all coefficients of these transforms. Entry k + 1 uses those whose index modulo `FOLDS` is k.
    """
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
    wanted = np.asarray(bins.edges[known:] - 0.5, dtype=np.float64)
    out = np.empty((FOLDS + 1, 2, wanted.size - 1))
    for fold in range(FOLDS + 1):
        own = width * (1.0 if fold == 0 else m % FOLDS == fold - 1)
        inside, total = (redistributed(v, j, wanted) for v in (own, own * level_of))
        out[fold] = inside, total / np.maximum(inside, 1e-300)
    # The ends of the coefficient grid differ from those of the record by half an ordinate.
    count = np.diff(bins.edges[known:]).astype(float)
    out[0, 0] = count
    whole = out[1:, 0].sum(axis=0)
    out[1:, 0] *= count / np.maximum(whole, 1e-300)
    return out
