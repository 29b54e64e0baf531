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
from allanite.fit.summarised.bins import SummaryBins, folds_of
from allanite.fit.summarised.maps import CELLS, Maps, SectionsOfSummary, fine_bands, shared
from allanite.spectrum import bins_of, bridge_gaps
from allanite.summary.gaps import mended
from allanite.summary.lapped import LOW, SEGMENT, gain
from allanite.summary.level import BANDS, FINE

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.sections import Sections
    from allanite.summary import Summary
    from allanite.summary.reading import Reading

__all__ = ["SummaryData", "of_summary", "refused"]

Array = NDArray[np.float64]
#: Kept samples to an averaging time from which the curve is taken from them where a function of time is taken out.
ENOUGH = 16
#: Bytes of what a search comes back to: a record that did not fit is looked at in little memory.
FUNCTIONS, LOWEST = 1 << 23, 1 << 23


@dataclass(frozen=True, slots=True, eq=False)
class SummaryData(Data):
    """What a fit needs of a summary; see `Data`.

    Attributes
    ----------
    samples : ndarray, shape (m,)
        Kept samples at a lower rate.
    ordinates : ndarray, shape (known,)
        The lowest ordinates of the record; `known` is less than `n`.
    lost : float
        Share of the samples that are missing.
    factor : int
        Samples of the record to a kept one.
    summary : Summary
    reading : Reading
    """

    lost: float = 0.0
    factor: int = 1
    summary: Any = None
    reading: Any = None

    __repr__ = brief

    @property
    def n(self) -> int:
        """Samples of the record."""
        return int(self.samples.size) * self.factor

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
        """Averaging factors of the curve that was accumulated, to a third of the record.

        Those at which gaps left most of its terms, or that the kept samples show.
        """
        curve: Deviation = self.summary.oadev()
        m = curve.factors
        shown = (curve.n > curve.lost) | (m >= ENOUGH * self.factor)
        return np.asarray(m[shown & (m <= max(1, self.n // 3))])

    def deviation(self, factors: NDArray[np.int64], less: Array | None = None) -> Array:
        """The accumulated curve; where gaps took terms, or without a signal, that of the kept samples if fine enough.

        What happens once may be in just those terms.
        """
        curve: Deviation = self.summary.oadev()
        at = np.searchsorted(curve.factors, factors)
        found = curve.deviation[at]
        fine = factors >= ENOUGH * self.factor
        holed = fine & (curve.lost[at] > 0)
        found[holed] = _interpolated(self.samples, factors[holed], self.factor, self.rate)
        if less is None:
            return found
        taken = found**2 - self.deviation_of(less, factors) ** 2
        left = _interpolated(self.samples - less, factors[fine], self.factor, self.rate)
        taken[fine] = left**2
        return np.asarray(np.sqrt(np.maximum(taken, 1e-6 * found**2)))

    def deviation_of(self, signal: Array, factors: NDArray[np.int64]) -> Array:
        """Curve of a slow signal that is given at `time`; it rises as τ below the interval of these."""
        least = np.maximum(factors, self.factor)
        found = _interpolated(signal, least, self.factor, self.rate)
        return np.asarray(found * factors / least)

    @property
    def maps(self) -> Maps:
        """Power over time."""
        return Maps(self.reading, self.rate, self.summary.start, self.summary.n)

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
        out, maps = [], self.maps
        cut = self.n
        for level, octave in enumerate(self.reading.octaves):
            per, blocks = self.n / (SEGMENT << level), octave.blocks
            edges, middle, left = fine_bands(level)
            j = np.clip(np.round(middle * per), 1, self.n - 1).astype(np.int64)
            at = maps.edges(blocks, level)
            times = self.span[0] + 0.5 * (at[1:] + at[:-1]) / self.rate
            model = expected(j) * np.diff(edges) * left * louder(j, times)
            model = model.reshape(-1, BANDS, FINE // BANDS).sum(axis=2)
            power = (blocks.sums.value / model).mean(axis=1)
            total, frames = (shared(values, at, maps.cells) for values in (power, blocks.frames))
            low, high = self._first_of(level), min(round(2 * LOW * per), cut)
            cut = low
            seen = np.flatnonzero(frames > 0.0)
            if seen.size:
                # Where no segment is, as about it: it does not change there.
                ratio = np.interp(np.arange(CELLS), seen, total[seen] / frames[seen])
                out.append((low, high, ratio, (high - low) / CELLS))
        return out

    def _first_of(self, level: int) -> int:
        """First ordinate of an octave."""
        return round(LOW * self.n / (SEGMENT << level))

    def as_seen(self, power: Array, first: int) -> Array:
        """Power in cells as the map shows it in the octave from an ordinate on; of others it is as it is."""
        levels = range(len(self.reading.octaves))
        level = next((level for level in levels if self._first_of(level) == first), None)
        return power if level is None else self.maps.as_seen(power, level)

    def most_sections(self, band: tuple[float, float], most: int, resolved: float) -> int:
        """In how many `sections`, at `most`, half of a band, Hz, has so many ordinates, or two cells; 0 where in none."""
        low, high = band
        bottom, top = self.maps.limits
        if not bottom < 0.5 * (low + high) < top or self.lost > FEW:
            return 0
        level = int(np.log2(top / (0.5 * (low + high))))
        octave = self.reading.octaves[level]
        if octave.sections.frames.sum() < (1.0 - FEW) * octave.frames:
            return 0  # a part is of a file that has no such map
        if (high - low) * (SEGMENT << level) / self.rate < max(resolved, 2.0 * LOW / FINE):
            return 0
        number = most
        while number > octave.sections.frames.size:
            number //= 2
        return number

    def sections(self, model: Model, number: int) -> Sections:
        """So many equal sections; known functions of time are below the frequencies of these."""
        return SectionsOfSummary(self.maps, number)


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
    samples = mended(reading.samples)
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
    folds = folds_of(reading, bins, known)
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
        lost=summary.missing / summary.n,
        factor=factor,
        summary=summary,
        reading=reading,
    )
