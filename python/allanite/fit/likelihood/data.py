"""A record prepared for fitting: samples with bridged gaps, cosine ordinates, frequency bins and logged columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array
from allanite.common.errors import TooShortError
from allanite.common.showing import brief
from allanite.common.threads import stop_if_unwanted
from allanite.common.validation import check_size
from allanite.deviation import oadev
from allanite.effects import Deterministic, Model, Stochastic
from allanite.effects.terms import Term
from allanite.fit.likelihood.peaks import has_all_ordinates
from allanite.fit.likelihood.remembered import ArrayCache, series_cache, times_of
from allanite.fit.likelihood.sections import Sections
from allanite.fit.likelihood.stop_band import bins_with_stop_band
from allanite.recording import Recording
from allanite.recording.coarse_column import without_steps
from allanite.recording.resolution import MIN_FLIPS
from allanite.spectrum import Bins, bridge_gaps
from allanite.summary import Summary

T = TypeVar("T", bound=np.generic)

#: Minimum number of samples of a record that is fitted. Chosen by judgment; not measured.
MIN_SAMPLES = 32
#: Minimum fraction of the samples that must be present. With fewer, the fit would describe the draws that stand for
#: missing samples. Chosen by judgment; not measured.
MIN_PRESENT_FRACTION = 1 / 200
#: Averaging times of the Allan curve per decade. Chosen by judgment; not measured.
TAUS_PER_DECADE = 8
#: Maximum size, bytes, of each of two caches of `Data`: lowest ordinates of known functions of time, and model columns
#: that are multiplied by the mixing matrix. Chosen by judgment; not measured.
CACHE_BYTES_LOWEST = 1 << 25


@align_when_unpickled
@dataclass(frozen=True, slots=True, eq=False)
class Data:
    """A record prepared for fitting, with all its n samples and ordinates. U is the unit of the samples.

    The subclass `SummaryData` has the lower rate and the lowest ordinates that a summary keeps.

    Attributes
    ----------
    samples : ndarray, shape (kept,)
        Kept samples at `time` with bridged gaps, U; each is the mean of `factor` samples of the record.
    ordinates : ndarray, shape (known,)
        The lowest ordinates of the orthonormal cosine transform; ordinate j has variance S(f_j)/τ0, U² per sample.
    rate : float
        Sampling rate, Hz.
    bins : Bins
        Frequency bins of all `n` ordinates of the record.
    covariates : mapping of str to ndarray, shape (kept,)
        Logged columns, such as temperatures, by name.
    start : float
        Time of the first sample within its recording, s.
    missing : ndarray of bool, shape (n,), or None
        True where a sample is missing; None if none is missing, and for a summary. Their values in `samples` are bridged,
        or draws from the model (`fit.missing`).
    gain : ndarray, shape (n,), or None
        Factors √(1 − r), by which missing samples reduce the ordinates of known functions of time. r is the share of the
        power of an ordinate that missing samples leave unknown. None for a summary, if no sample is missing, or if missing
        samples are not completed yet.
    mixing : ndarray, shape (bins, bins), or None
        Relative change of the observed power of a bin (row) per relative change of the true power of a bin (column). None
        for a summary, if no sample is missing, or if the mixing is negligible.
    completions : tuple of ndarray, shape (missing,)
        Missing samples as the last completion found them, from which the next one starts: the conditional mean, then the
        unknown part of each draw. Empty if they are not completed, or few.
    factor : int
        Number of samples of the record per kept sample.
    completed_signal : ndarray, shape (n,), or None
        Sum of the known functions of time, U, that the last completion assumed; None if samples are not completed.
    """

    samples: Array
    ordinates: Array
    rate: float
    bins: Bins
    covariates: Mapping[str, Array] = field(default_factory=dict)
    start: float = 0.0
    missing: NDArray[np.bool_] | None = None
    gain: Array | None = None
    mixing: Array | None = None
    completions: tuple[Array, ...] = ()
    factor: int = 1
    completed_signal: Array | None = None
    #: Cache: ordinates of regressors by effect and shapes.
    functions: ArrayCache = field(default_factory=lambda: series_cache(0), repr=False)
    #: Cache: lowest ordinates of regressors by effect and shapes.
    lowest: ArrayCache = field(default_factory=lambda: ArrayCache(CACHE_BYTES_LOWEST), repr=False)
    #: Cache of arrays of bins: the power; the fraction of missing samples; degrees of freedom by level changes and moving
    #: bands; model columns multiplied by `mixing` by effect and the modifiers that act on the effect.
    of_bins: ArrayCache = field(default_factory=lambda: ArrayCache(CACHE_BYTES_LOWEST), repr=False)

    __repr__ = brief

    #: True if every sample and every ordinate is kept: `samples` and `ordinates` have the shape (n,).
    whole: ClassVar[bool] = True

    @property
    def n(self) -> int:
        """Number of samples at the full rate."""
        return int(self.samples.size) * self.factor

    @property
    def time(self) -> Array:
        """Array of the middle time of each kept sample, s since the first sample of the recording, shape (kept,)."""
        middle = self.start + 0.5 * (self.factor - 1) / self.rate
        return times_of(self.samples.size, self.rate / self.factor, middle)

    @property
    def lost(self) -> float:
        """Fraction of the samples that are missing, 0 … 1."""
        missing = self.missing
        if missing is None:
            return 0.0
        return float(self.of_bins.get("lost", lambda: missing.mean(keepdims=True))[0])

    @property
    def power(self) -> Array:
        """Array of the mean square of the ordinates of each bin, U² per sample, shape (bins,); cached."""
        return self.of_bins.get("power", lambda: self.bins.power(self.ordinates))

    def present(self, values: NDArray[T]) -> NDArray[T]:
        """Array of those of the `values`, one for each kept sample, whose sample is not missing."""
        return values if self.missing is None else values[~self.missing]

    @property
    def ends_missing(self) -> bool:
        """True if the first and the last sample are missing; the ends then add no leakage to the ordinates."""
        return self.missing is not None and bool(self.missing[0] and self.missing[-1])

    @property
    def duration(self) -> float:
        """Duration of the record, s."""
        return self.n / self.rate

    @property
    def span(self) -> tuple[float, float]:
        """Pair: start and end time of the record, s."""
        return self.start, self.start + self.duration

    def terms(self, model: Model) -> tuple[Term, ...]:
        """Primitive spectral terms whose sum is the spectrum of a model with values.

        If the first and the last sample are missing, the terms contain no leakage from the ends of the record.
        """
        return self._without_end_leakage(model.terms(self.rate, self.span))

    def unit_terms(self, model: Model, effect: Stochastic) -> tuple[Term, ...]:
        """Primitive spectral terms, as of `terms`, of one effect of the model at coefficient 1."""
        return self._without_end_leakage(model.unit_terms(effect, self.rate, self.span))

    def _without_end_leakage(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        """Tuple of the given terms; if the end samples are missing, each term without its leakage from the ends."""
        return tuple(term.inside for term in terms) if self.ends_missing else terms

    def residual(self, model: Model) -> Array:
        """Array of `samples` minus the known functions of time, shape (kept,); `samples` itself if there are none."""
        known = model.deterministic
        return self.samples - self.signal(known) if known else self.samples

    def signal(self, effects: Sequence[Deterministic]) -> Array:
        """Array of the sum of the signals of at least one deterministic effect at `time`, U, shape (kept,)."""
        time = self.time
        total = effects[0].signal(time, self.covariates)
        for effect in effects[1:]:
            total += effect.signal(time, self.covariates)
        return total

    def transform(self, series: Array) -> Array:
        """Array of the lowest ordinates (cosine transform) of a series sampled at `time`, shape (known,).

        They are scaled as if the series had the full rate.
        """
        stop_if_unwanted()
        found = _kernels.cosine_transform(np.ascontiguousarray(series))
        return found if self.whole else found[: self.ordinates.size] * np.sqrt(self.factor)

    def factors(self) -> NDArray[np.int64]:
        """Array of the averaging factors of the Allan curve: eight per decade from 1, up to a third of the record."""
        return averaging_factors(self.n // 3)

    def deviation(self, factors: NDArray[np.int64], subtracted: Array | None = None) -> Array:
        """Array of the overlapping Allan deviation, U, of the samples minus the signal `subtracted`, shape of `factors`."""
        return self.deviation_of(
            self.samples if subtracted is None else self.samples - subtracted, factors
        )

    def deviation_of(self, signal: Array, factors: NDArray[np.int64]) -> Array:
        """Array of the overlapping Allan deviation, U, of a signal sampled at `time`, at the averaging `factors`."""
        stop_if_unwanted()
        return oadev(signal, rate=self.rate, factors=factors).deviation

    def resolved_sections(
        self, band: tuple[float, float], max_number: int, min_product: float
    ) -> int:
        """Number of equal time sections in which a band (low, high), Hz, can be followed; 0 if it cannot.

        The number is `max_number`, halved until the bandwidth times the duration of a section reaches `min_product`. It is
        0 if over 10 % of the samples are missing.
        """
        number = max_number if has_all_ordinates(self) else 0
        while number and (band[1] - band[0]) * self.duration / number < min_product:
            number //= 2
        return number

    def sections(self, model: Model, number: int) -> Sections:
        """`Sections`: samples minus the model's known functions of time, cut into `number` equal time sections."""
        return Sections(self.residual(model), self.rate, number)

    def octaves(
        self,
        expected: Callable[[NDArray[np.int64]], Array],
        relative_power: Callable[[NDArray[np.int64], Array], Array],
    ) -> list[tuple[int, int, Array, float]]:
        """List of (first ordinate, end ordinate, power, number), one for each octave of a summary; empty for a recording.

        In these octaves, a summary keeps only mean squares over time, no single ordinates. `power` is the mean square in
        each of equal time cells of `number` ordinates, divided by its expectation. `expected` maps ordinates j to the
        expected density, U² per sample. `relative_power` maps ordinates and times to the power relative to it, shape
        (times, ordinates).
        """
        return []

    def at_octave_resolution(self, power: Array, first: int) -> Array:
        """`power`, in equal time cells, averaged within the time blocks for which a summary keeps the power of one octave.

        `first` is the first ordinate of the octave. A recording keeps all ordinates and returns `power` itself.
        """
        return power

    def ordinates_without(self, effects: Sequence[Deterministic]) -> Array:
        """Array of the ordinates of the record minus those of the functions of time `effects`, shape (known,)."""
        return self.minus_functions(
            self.ordinates, [(effect, effect.amplitudes()) for effect in effects]
        )

    def minus_functions(
        self, ordinates: Array, parts: Sequence[tuple[Deterministic, Array]]
    ) -> Array:
        """`ordinates` minus known functions of time with given amplitudes, shape (known,).

        `parts` holds pairs of an effect and its amplitudes; negative amplitudes add a function. The functions are first
        multiplied by `gain` if samples are missing.
        """
        total: Array | None = None
        once: Array | None = None
        for effect, amplitudes in parts:
            if not amplitudes.any():
                continue
            # Cache the regressors only if two more effects of the same size fit.
            if 3 * amplitudes.size * self.ordinates.nbytes <= self.functions.max_bytes:
                rows = self.regressor_ordinates(effect)
                # For one row a plain product is vectorized better than the matrix product.
                part = amplitudes @ rows if len(rows) > 1 else amplitudes[0] * rows[0]
                total = part if total is None else np.add(total, part, out=total)
            else:
                signal = effect.with_amplitudes(amplitudes).signal(self.time, self.covariates)
                once = signal if once is None else np.add(once, signal, out=once)
        if once is not None:
            part = self.transform(once)
            total = part if total is None else np.add(total, part, out=total)
        if total is None:
            return ordinates
        if self.gain is not None:
            total *= self.gain
        return np.subtract(ordinates, total, out=total)

    def clear_caches(self) -> None:
        """Remove all cached arrays, to free memory or because the samples were replaced."""
        self.functions.clear()
        self.lowest.clear()
        self.of_bins.clear()

    def regressor_ordinates(self, effect: Deterministic) -> Array:
        """Array of the cosine transform of every regressor of an effect, shape (regressors, known); cached."""
        return self.functions.get(
            effect.seen_alike,
            lambda: np.array(
                [self.transform(s) for s in effect.regressors(self.time, self.covariates).T]
            ),
        )

    def attenuated(self, ordinates: Array, j: NDArray[np.int64]) -> Array:
        """Ordinates of known functions of time, shape (…, k), multiplied by `gain` at the indices j, shape (k,)."""
        return ordinates if self.gain is None else ordinates * self.gain[j]


def averaging_factors(top: int) -> NDArray[np.int64]:
    """Array of integer averaging factors from 1 to about `top`, eight per decade, ascending; [1] for a `top` below 1."""
    at = np.arange(0.0, np.log10(max(1, top)) + 1e-9, 1 / TAUS_PER_DECADE)
    return np.unique(np.round(10**at).astype(np.int64))


def prepare(recording: Recording | Summary, missing: NDArray[np.bool_] | None = None) -> Data:
    """`Data` of a one-column recording; `missing` are samples to treat as missing in addition to NaN.

    `InputError` for several columns, or a largest deviation from the mean that is not within 1e-75 to
    1e75. `TooShortError` for fewer than 32 or one in 200 samples present, constant samples, or fewer than 10 changes of
    value.
    """
    label = f"column {recording.columns[0]!r}"
    values = np.asarray(recording.rate_samples()).astype(np.float64, copy=False)
    holes = np.isnan(values)
    if missing is not None:
        holes |= missing
    there = int(holes.size - np.count_nonzero(holes))
    if there < max(MIN_SAMPLES, MIN_PRESENT_FRACTION * holes.size):
        of = "" if there == holes.size else f" of {holes.size}"
        raise TooShortError(
            f"{label} has only {there}{of} samples; a fit needs at least {MIN_SAMPLES} and one in"
            f" {1 / MIN_PRESENT_FRACTION:g}, and hours for slow effects"
        )
    filled = bridge_gaps(values, missing)
    _require_noise(filled, label)
    covariates = {
        name: without_steps(bridge_gaps(np.asarray(values)))
        for name, values in dict(recording.covariates).items()
    }
    return _sample_data(
        filled, holes if there < holes.size else None, float(recording.rate), covariates
    )


def _require_noise(filled: Array, label: str) -> None:
    """Raise an error if a fit of the samples `filled` is impossible; `label` names them in the message.

    `TooShortError` if the samples are constant or change their value fewer than 10 times. `InputError` if their largest
    deviation from the mean is not within 1e-75 to 1e75.
    """
    if float(np.ptp(filled)) == 0.0:
        raise TooShortError(f"{label} is constant ({filled[0]:g}); there is no noise to fit")
    changes = int(np.count_nonzero(filled[1:] != filled[:-1]))
    if changes < 2 * MIN_FLIPS:  # one flip changes the value twice: to another value and back
        raise TooShortError(
            f"{label} changes its value only {changes} time{'s' * (changes > 1)}; there is no noise to fit"
        )
    check_size(filled, label, "a fit")


def _sample_data(
    filled: Array,
    missing: NDArray[np.bool_] | None,
    rate: float,
    covariates: Mapping[str, Array],
    start: float = 0.0,
) -> Data:
    """`Data` of the bridged samples `filled`, which are not completed yet, with empty caches."""
    ordinates, cache = _kernels.cosine_transform(filled), series_cache(filled.size)
    bins = bins_with_stop_band(ordinates)
    return Data(filled, ordinates, rate, bins, covariates, start, missing, functions=cache)


def without_samples(data: Data, missing: NDArray[np.bool_]) -> Data:
    """`Data` in which the samples of the mask `missing` are missing too, and bridged; with empty caches."""
    filled = bridge_gaps(data.samples, missing)
    if data.missing is not None:
        missing = missing | data.missing
    return _sample_data(filled, missing, data.rate, data.covariates, data.start)
