"""The residual whitened by the model, over time: whitened samples and the power of octave bands.

The whitened residual ordinates are cut into octave bands. The inverse cosine transform of a band's ordinates is a time
series with one value per ordinate, each local in time (a Wilson basis). The squares of these values are the band's power
over time; each is χ²₁ if the model holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array, medians
from allanite.common.memory import cleared_by_free_buffers
from allanite.common.showing import brief
from allanite.common.threads import results_or_raise, side_by_side
from allanite.fit.likelihood.bands_in_time import (
    band_series,
    density_shares,
    moving_power,
    remove_level_change,
    remove_motion,
)
from allanite.fit.likelihood.expected import density
from allanite.fit.likelihood.peaks import nodes_of
from allanite.fit.likelihood.stop_band import zero_empty_bins
from allanite.recording.tails import CENSORED_SHARES, coarse_step, tail_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Minimum number of values of an octave band. Chosen by judgment; not measured.
MIN_BAND_VALUES = 256
#: Maximum number of samples at either end of a record that are excluded from the whitened samples; short records
#: exclude 1/64. Chosen by judgment; not measured.
MAX_END_SAMPLES = 64
#: Maximum depth of a narrow notch of the model's spectrum that is whitened, in ln of the density (7 is 30 dB).
#: Chosen by judgment; not measured.
MAX_NOTCH_DEPTH = 7.0
#: Distances, in ln of the frequency, at which the density to both sides of a notch is evaluated.
#: Chosen by judgment; not measured.
NOTCH_SIDE_DISTANCES = (0.05, 0.1, 0.2, 0.35, 0.6)
#: Minimum share of white noise in a band's density with which the band shows the level of the white noise.
#: Chosen by judgment: white noise is then the largest part.
MIN_WHITE_SHARE = 0.5
#: Maximum ratio of the number of values of the finest band to that of a band used for the white power over time.
#: Chosen by judgment; not measured.
MAX_TIME_RESOLUTION_RATIO = 8
#: Number of segments, each with its own level, in which samples are tested for heavy tails. Chosen by judgment; not
#: measured.
TAIL_TEST_SEGMENTS = 64
#: Maximum number of samples used to test for heavy tails; longer records are thinned. Chosen by judgment; not measured.
MAX_TAIL_TEST_SAMPLES = 1 << 20
#: Number of samples of a cell whose median is the usual size of its samples.
OUTLIER_CELL_SAMPLES = 32
#: Minimum size of an outlier relative to the largest sample of a normal record. The median of 32 sizes has a relative
#: standard error of 0.787/(0.6745 √32) = 21 %; the factor allows for three of them.
OUTLIER_FACTOR = 1.7


@dataclass(frozen=True, eq=False)
class Whitened:
    """The residual divided by the root of the model's density, corrected by the discrepancy of each bin.

    The result is white with variance 1 at all frequencies. What remains are differences between times. `samples`, shape
    (n,), of a summary are as many as its lowest ordinates. `bands` are octaves from the highest down to those with
    `MIN_BAND_VALUES` values: (first ordinate, end ordinate, power over time, number of squares averaged in each value).
    Octaves with mostly empty bins are left out. `step` is the rounding step of the record in units of `samples`; 0 if it is
    small.
    """

    samples: Array
    bands: tuple[tuple[int, int, Array, float], ...]
    step: float = 0.0

    __repr__ = brief

    @property
    def is_from_summary(self) -> bool:
        """True if the whitened residual comes from a summary, which keeps no single samples."""
        return any(averaged != 1.0 for _, _, _, averaged in self.bands)

    @cached_property
    def without_outliers(self) -> Whitened:
        """Copy in which the size of each outlier is reduced to the robust standard deviation of its cell of 32 samples.

        An outlier exceeds 1.7 times the size that the largest of n normal samples exceeds in 1 % of records. It would
        imitate a change of level. The object itself is returned without outliers, for a summary, and for coarsely rounded
        samples.
        """
        from scipy.special import ndtri_exp

        samples = self.samples.copy()
        cells = samples[: samples.size // OUTLIER_CELL_SAMPLES * OUTLIER_CELL_SAMPLES].reshape(
            -1, OUTLIER_CELL_SAMPLES
        )
        if self.is_from_summary or self.step > 0.0 or not cells.size:
            return self
        size = np.abs(cells)
        usual = medians(size)[:, None] / 0.6745
        # The largest of as many normal samples exceeds this limit in one of a hundred records.
        limit = -float(ndtri_exp(np.log(0.005 / samples.size)))
        single = (size > OUTLIER_FACTOR * limit * usual) & (usual > 0.0)
        if not single.any():
            return self
        cells[single] = np.copysign(np.broadcast_to(usual, cells.shape), cells)[single]
        return self._with_samples(samples)

    @cached_property
    def with_normal_tails(self) -> Whitened:
        """Copy in which the samples are replaced by normal scores of their ranks, so that they are normal.

        `without_outliers` is returned instead for a summary, or if its samples are normal already. The scores keep changes
        of level over time, but a few largest samples no longer determine when a level changes.
        """
        samples = self.samples
        if self.is_from_summary or _is_normal(self.without_outliers.samples):
            return self.without_outliers
        if self.step > 0.0:
            # Break ties of rounded values at random; their given order would carry slow drifts below a step as loud as
            # noise. With the sign of the sample, the scores of a negated record are the negative ones.
            spread = np.random.default_rng(0).uniform(-0.5, 0.5, samples.size)
            samples = samples + self.step * spread * np.sign(samples)
        # The sort cannot be interrupted; a separate thread lets the main thread handle interrupts.
        [order] = results_or_raise(side_by_side([lambda: _kernels.order(samples)]))
        scores = np.empty(samples.size)
        scores[order] = _normal_scores(samples.size)
        return replace(self._with_samples(scores), step=0.0)

    def _with_samples(self, samples: Array) -> Whitened:
        """Copy with other `samples`; the power of the same octave bands is computed from these samples."""
        found = _samples_and_bands(_kernels.cosine_transform(samples))
        kept = {low for low, *_ in self.bands}
        bands = tuple(band for band in found.bands if band[0] in kept)
        return replace(found, bands=bands, step=self.step)


@cleared_by_free_buffers
@lru_cache(maxsize=1)
def _normal_scores(n: int) -> Array:
    """Array of the normal scores of n ranks, ascending, shape (n,); cached."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(n) + 0.5) / n))


def whiten(solution: Solution, data: Data) -> Whitened:
    """`Whitened` residual of a solution: white samples and octave bands (power over time).

    Changes over time that the model contains are divided out: level changes and bands of moving frequency. Ordinates at
    which a line wanders are replaced by draws (`Stochastic.unsteady`).
    """
    residual = solution.ordinates
    if data.gain is not None:
        # Here missing samples are draws from the model; `solution.ordinates` holds their conditional mean.
        residual = data.transform(data.residual(solution.model))
    white = whitened_ordinates(solution, data, solution.level, residual)
    for effect in solution.model.modifiers:
        if effect.band is not None:
            remove_level_change(white, effect, solution, data)
    for own in solution.processes:
        if own.effect.moving:
            remove_motion(white, own, own.effect, solution, data)
    replace_unsteady_ordinates(white, solution, data)
    bands = data.octaves(
        lambda j: np.exp(_log_density(solution, data, solution.level, np.log(j))),
        lambda j, times: moving_power(solution, data, j, times),
    )
    found = _samples_and_bands(white, bands)
    found = replace(found, step=rounding_step(data, found.samples))
    if not any(effect.changes_level for effect in solution.model.modifiers):
        return found
    return _without_level_changes(solution, data, found)


def replace_unsteady_ordinates(white: Array, solution: Solution, data: Data) -> None:
    """Replace the whitened ordinates `white` at which a line wanders (`Stochastic.unsteady`) by draws, in place.

    The line may stay at a frequency for a while. Its ordinates say nothing about the level of the noise over time, and
    nothing about tone bursts.
    """
    for own in solution.processes:
        if own.effect.unsteady is not None and own.theta > 0.0:
            first, last = (round(2.0 * f * data.duration) for f in own.effect.unsteady)
            there = white[first : last + 1]
            there[:] = np.random.default_rng(first).standard_normal(there.size)


def _without_level_changes(solution: Solution, data: Data, whitened: Whitened) -> Whitened:
    """Copy of `whitened` in which the level changes of the white noise that the model expects are divided out.

    Each sample is divided by √p. Here p = 1 + s(r − 1), with the share s of white noise in the power and the expected power
    r of the white noise relative to its mean. Octave bands with at least half white noise are computed from the divided
    samples. In other bands, and in all bands of a summary, the power over time is divided by the p of the band.
    """
    _, share, _ = white_power(solution, data, whitened)
    samples = whitened.samples / np.sqrt(1.0 + share * (_relative_power(solution, data) - 1.0))
    by_octave = {}
    if samples.size == data.n:
        by_octave = {b[0]: b for b in _samples_and_bands(_kernels.cosine_transform(samples)).bands}
    bands = []
    shares = _white_shares(solution, data, whitened).tolist()
    for (low, high, power, each), own in zip(whitened.bands, shares, strict=True):
        if own >= MIN_WHITE_SHARE and low in by_octave:
            bands.append(by_octave[low])
        else:
            expected = data.at_octave_resolution(
                expected_level(solution.model, data, power.size), low
            )
            bands.append((low, high, power / (1.0 + own * (expected - 1.0)), each))
    return Whitened(samples, tuple(bands), whitened.step)


def _relative_power(solution: Solution, data: Data) -> Array:
    """Expected power of the white noise over time, divided by its mean, one value for each sample.

    It is 1 at missing samples: completed samples have the mean power of the record at all times. For a summary, there is
    one value for each of as many equal time segments as single ordinates.
    """
    power = expected_level(solution.model, data, solution.ordinates.size)
    if data.missing is not None:
        power[data.missing] = 1.0
    return power


def _is_normal(samples: Array) -> bool:
    """True if samples have no heavier tails than normal samples whose level may differ between 64 segments.

    Only heavy tails are tested. False for coarsely rounded samples. Otherwise True for fewer than 64 samples, and False if
    the median size of the samples of a segment is 0. True if the tail cannot be fitted (`tail_of`).
    """
    if coarse_step(samples) > 0.0:
        return False
    size = np.abs(samples[:: -(-samples.size // MAX_TAIL_TEST_SAMPLES)])
    if size.size < TAIL_TEST_SEGMENTS:
        return True
    size = size[: size.size // TAIL_TEST_SEGMENTS * TAIL_TEST_SEGMENTS].reshape(
        TAIL_TEST_SEGMENTS, -1
    )
    usual = medians(size)[:, None]
    if not usual.all():
        return False
    tail = tail_of((size / usual).ravel(), CENSORED_SHARES[0])
    return tail is None or not tail.heavy


def rounding_step(data: Data, samples: Array) -> float:
    """Step to which the record is rounded, converted to the unit of the whitened `samples`; 0 without coarse rounding.

    The step is converted by a ratio of standard deviations: √2 times that of `samples`, over that of the differences of
    successive samples of the record.
    """
    some = data.present(data.samples)
    step = coarse_step(some)
    if step == 0.0:
        return 0.0
    return step / max(float(np.std(np.diff(some))), step) * np.sqrt(2.0) * float(np.std(samples))


def end_samples(n: int) -> int:
    """Number of whitened samples that are excluded at either end of a record of n samples: n // 64, at most 64."""
    return min(MAX_END_SAMPLES, n // 64)


def _samples_and_bands(
    white: Array, bands: Sequence[tuple[int, int, Array, float]] = ()
) -> Whitened:
    """`Whitened` with the time series and the octave bands of the whitened ordinates `white`.

    The first and last samples (`end_samples`) are 0, and the mean of nearby values replaces the power there. Octaves with
    fewer than 256 ordinates, or with more than half of them 0, are omitted. `bands` are given bands of higher octaves.
    """
    from scipy.fft import next_fast_len

    # With a deep stop band, leakage makes the ends loud.
    n = white.size
    ends, octaves = end_samples(n), list(bands)
    high = n
    # The octave is extended so that its transform, with one more ordinate, has a fast length.
    while high - (low := high + 1 - next_fast_len(high - high // 2 + 1)) >= MIN_BAND_VALUES:
        own, high = white[low:high], low
        if 2 * np.count_nonzero(own) < own.size:
            continue  # mostly empty bins
        power = band_series(own) ** 2
        edge = -(-ends * power.size // n)
        power[:edge] = power[edge : 5 * edge].mean()
        power[power.size - edge :] = power[power.size - 5 * edge : power.size - edge].mean()
        octaves.append((low, low + own.size, power, 1.0))
    samples = _kernels.inverse_cosine_transform(white)
    samples[:ends] = samples[n - ends :] = 0.0
    return Whitened(samples, tuple(octaves))


def whitened_ordinates(
    solution: Solution, data: Data, level: Array, residual: Array | None = None
) -> Array:
    """Residual ordinates divided by √(model density × level of the bin), shape (n,); 0 in the bins of a stop band.

    `residual` are by default `solution.ordinates`.
    """
    residual = solution.ordinates if residual is None else residual
    j = np.maximum(np.arange(residual.size, dtype=np.float64), 1.0)
    white = _log_density(solution, data, level, np.log(j, out=j))
    white *= -0.5
    np.exp(white, out=white)
    white *= residual
    return zero_empty_bins(white, data.bins)


def _log_density(solution: Solution, data: Data, level: Array, log_j: Array) -> Array:
    """ln(model density × level of the bin), interpolated at ordinates given by their logarithms `log_j`.

    Narrow notches deeper than 7 (in ln) are filled up to this depth.
    """
    at, known = log_density_at_nodes(solution.model, data, level)
    return np.interp(log_j, at, _with_shallow_notches(known, at))


def log_density_at_nodes(model: Model, data: Data, level: Array | None) -> tuple[Array, Array]:
    """Pair of arrays: ln of selected ordinates (nodes), and ln(model density × level of the bin) there.

    The nodes are dense enough for linear interpolation in these logarithms. None means level 1.
    """
    bins = data.bins
    nodes = nodes_of(model, bins, data.rate)
    known = density(data.terms(model), nodes, data.n)
    if level is not None:
        known = known * level[np.searchsorted(bins.edges, nodes, side="right") - 1]
    return np.log(nodes), np.log(known)


def _with_shallow_notches(known: Array, at: Array) -> Array:
    """Ln densities `known` at ln frequencies `at`, raised so that no narrow notch is deeper than 7 (30 dB).

    The depth is measured from the lower of the two sides of a notch. Each side is the largest ln density at distances of
    0.05 to 0.6 in ln frequency. The power in the center of a notch is leakage from the ends of the record; dividing it by
    the full notch would make the first and last seconds loud.
    """
    sides = [
        np.max([np.interp(at + s * apart, at, known) for apart in NOTCH_SIDE_DISTANCES], 0)
        for s in (-1, 1)
    ]
    return np.maximum(known, np.minimum(*sides) - MAX_NOTCH_DEPTH)


def expected_level(model: Model, data: Data, cells: int) -> Array:
    """White-noise power of equal time segments under a model's level changes, relative to its mean, shape (cells,)."""
    power = np.ones(cells)
    edges = np.linspace(*data.span, cells + 1)
    for effect in model.modifiers:
        if effect.changes_level:
            followed = (item for item in data.covariates.items() if item[0] == effect.follows)
            columns = {name: cell_means(values, cells) for name, values in followed}
            power *= effect.mean_power(edges[:-1], edges[1:], columns)
    return np.asarray(power / power.mean())


def cell_means(values: Array, cells: int) -> Array:
    """Means of `values` in `cells` equal segments, shape (cells,).

    With more segments than values, each segment takes the single value at its start instead.
    """
    edges = np.arange(cells) * values.size // cells
    sizes = np.diff(np.append(edges, values.size))
    if not sizes.all():
        return np.asarray(values[edges])
    return np.asarray(np.add.reduceat(values, edges) / sizes)


def _white_shares(solution: Solution, data: Data, whitened: Whitened) -> Array:
    """Fraction, 0 … 1, of the model's density in the middle of each octave band that its white noise makes, shape (bands,).

    0 without white noise.
    """
    white = next((own for own in solution.processes if own.effect.white), None)
    if white is None or not whitened.bands:
        return np.zeros(len(whitened.bands))
    middles = np.array([(low + high) // 2 for low, high, *_ in whitened.bands])
    return density_shares(white, solution, data, middles)


def white_power(
    solution: Solution, data: Data, whitened: Whitened
) -> tuple[Array | None, float, float]:
    """Tuple (power, share, squares): means over the octave bands in which at least half is white noise.

    `power` is relative, over time. `share` is that of white noise in the power. `squares` is how many are averaged in each
    value. (None, 0.0, 0.0) without such bands. Bands whose time resolution is over 8 times coarser than the finest are
    ignored.
    """
    own = _white_shares(solution, data, whitened).tolist()
    bands = [
        (power, each, share)
        for (_, _, power, each), share in zip(whitened.bands, own, strict=True)
        if share >= MIN_WHITE_SHARE
    ]
    length = max((power.size for power, _, _ in bands), default=0)
    total, weight, shares = np.zeros(length), 0.0, 0.0
    for power, each, share in bands:
        if power.size < length // MAX_TIME_RESOLUTION_RATIO:
            continue  # too coarse in time
        # Spread the coarser bands over the finest time axis with their own number of values.
        index = (np.arange(length) * power.size // length).astype(np.int64)
        values = each * power.size / length
        total += power[index] * values
        weight += values
        shares += share * values
    if weight == 0.0:
        return None, 0.0, 0.0
    return total / weight, shares / weight, weight
