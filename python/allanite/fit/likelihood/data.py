"""A record made ready for fitting: ordinates, bins, covariates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.aligned import aligned_when_unpickled
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.common.threads import go_on
from allanite.common.validation import check_size
from allanite.deviation import oadev
from allanite.fit.likelihood.peaks import seen_singly
from allanite.fit.likelihood.remembered import Remembered, room_for, times_of
from allanite.fit.likelihood.sections import SectionsOfSamples
from allanite.fit.likelihood.stop_band import bins_seen
from allanite.recording.coarse_column import without_steps
from allanite.recording.resolution import FLIPS
from allanite.spectrum import Bins, bridge_gaps

if TYPE_CHECKING:
    from allanite.effects import Deterministic, Model, Stochastic
    from allanite.effects.terms import Term
    from allanite.fit.likelihood.sections import Sections

__all__ = ["LOWEST", "Data", "prepare", "without_samples"]

#: Fewest samples on which a model can be fitted.
SHORTEST = 32
#: Share of the samples that must be there: of fewer a fit would be that of what stands for the others.
LEAST = 1 / 200
#: Averaging times of the curve, a decade.
PER_DECADE = 8
#: Bytes of the lowest ordinates of many known functions of time, and of columns behind holes, that are remembered.
LOWEST = 1 << 25


@aligned_when_unpickled
@dataclass(frozen=True, slots=True, eq=False)
class Data:
    """Samples (gaps bridged), their cosine ordinates in U² per sample, bins and covariates.

    Attributes
    ----------
    samples : ndarray, shape (n,)
    ordinates : ndarray, shape (n,)
        Orthonormal cosine transform; ordinate j has variance S(f_j)/τ0.
    rate : float
        Hz.
    covariates : mapping of str to ndarray, shape (n,)
    start : float
        Time of the first sample within its recording, s.
    missing : ndarray of bool, shape (n,), or None
        Samples that are not there: what stands for them is a draw of the model (`fit.missing`).
    gain : ndarray, shape (n,), or None
        How much of a known function of time each ordinate shows, where samples are missing.
    mixing : ndarray, shape (bins, bins), or None
        Power that is seen in each bin (rows) of power that is in each, where samples are missing.
    """

    samples: NDArray[np.float64]
    ordinates: NDArray[np.float64]
    rate: float
    bins: Bins
    covariates: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    start: float = 0.0
    missing: NDArray[np.bool_] | None = None
    gain: NDArray[np.float64] | None = None
    mixing: NDArray[np.float64] | None = None
    #: Ordinates of the regressors of effects that were looked at, and the lowest of them, by effect and shapes.
    functions: Remembered = field(default_factory=lambda: room_for(0), repr=False)
    lowest: Remembered = field(default_factory=lambda: Remembered(LOWEST), repr=False)
    #: Columns behind the holes, by effect and what acts on it: a product with a matrix of all bins each.
    mixed: Remembered = field(default_factory=lambda: Remembered(LOWEST), repr=False)

    __repr__ = brief

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.samples.size)

    @property
    def time(self) -> NDArray[np.float64]:
        """Seconds since the first sample of the recording."""
        return times_of(self.n, self.rate, self.start)

    @property
    def lost(self) -> float:
        """Share of the samples that are missing."""
        return 0.0 if self.missing is None else np.count_nonzero(self.missing) / self.missing.size

    @property
    def ends_out(self) -> bool:
        """Whether the first and the last sample are missing, and with them what the ends add to every ordinate."""
        return self.missing is not None and bool(self.missing[0] and self.missing[-1])

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.n / self.rate

    @property
    def span(self) -> tuple[float, float]:
        """First and last time, s."""
        return self.start, self.start + self.duration

    def terms(self, model: Model) -> tuple[Term, ...]:
        """Primitive terms of a model with values, for this record."""
        return self._seen(model.terms(self.rate, self.span))

    def unit_terms(self, model: Model, effect: Stochastic) -> tuple[Term, ...]:
        """Primitive terms of one effect at coefficient 1, for this record."""
        return self._seen(model.unit_terms(effect, self.rate, self.span))

    def _seen(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        return tuple(term.inside for term in terms) if self.ends_out else terms

    def octaves(
        self,
        expected: Callable[[NDArray[np.int64]], NDArray[np.float64]],
        louder: Callable[[NDArray[np.int64], NDArray[np.float64]], NDArray[np.float64]],
    ) -> list[tuple[int, int, NDArray[np.float64], float]]:
        """Power over time of octaves of which no single ordinates are kept: of a recording there are none."""
        return []

    def as_seen(self, power: NDArray[np.float64], first: int) -> NDArray[np.float64]:
        """Power over time as the map over time shows it in the octave from an ordinate on."""
        return power

    def most_sections(self, band: tuple[float, float], most: int, resolved: float) -> int:
        """In how many `sections`, at `most`, half of a band, Hz, has so many ordinates; 0 where much is missing."""
        number = most if seen_singly(self) else 0
        while number and (band[1] - band[0]) * self.duration / number < resolved:
            number //= 2
        return number

    def sections(self, model: Model, number: int) -> Sections:
        """So many equal sections, without the known functions of a model."""
        return SectionsOfSamples(self.residual(model), self.rate, number)

    def half(self, which: int) -> Data:
        """The first (0) or second (1) half, as a record of its own."""
        middle = self.n // 2
        part = slice(0, middle) if which == 0 else slice(middle, None)
        samples = np.ascontiguousarray(self.samples[part])
        ordinates = _kernels.cosine_transform(samples)
        return Data(
            samples,
            ordinates,
            self.rate,
            bins_seen(ordinates),
            {name: values[part] for name, values in self.covariates.items()},
            self.start + (part.start or 0) / self.rate,
        )

    def residual(self, model: Model) -> NDArray[np.float64]:
        """The samples without the model's functions of time, shape (n,)."""
        known = model.deterministic
        return self.samples - self.signal(known) if known else self.samples

    def signal(self, effects: Sequence[Deterministic]) -> NDArray[np.float64]:
        """What the effects, at least one, add to the samples, shape (n,)."""
        time = self.time
        total = effects[0].signal(time, self.covariates)
        for effect in effects[1:]:
            total += effect.signal(time, self.covariates)
        return total

    def transform(self, series: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ordinates of a series that is given at `time`."""
        go_on()
        return _kernels.cosine_transform(np.ascontiguousarray(series))

    def factors(self) -> NDArray[np.int64]:
        """Averaging factors of the curve: eight a decade, to a third of the record."""
        top = max(1, self.n // 3)
        at = np.arange(0.0, np.log10(top) + 1e-9, 1 / PER_DECADE)
        return np.unique(np.round(10**at).astype(np.int64))

    def deviation(
        self, factors: NDArray[np.int64], less: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Overlapping Allan deviation of the samples, without a signal if one is given."""
        return self.deviation_of(self.samples if less is None else self.samples - less, factors)

    def deviation_of(
        self, signal: NDArray[np.float64], factors: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """The same of a signal that is given at `time`."""
        go_on()
        return oadev(signal, rate=self.rate, factors=factors).deviation

    def without(self, effects: Sequence[Deterministic]) -> NDArray[np.float64]:
        """Ordinates of the record with known functions of time taken out, shape (n,)."""
        return self.exchanged(self.ordinates, [(effect, effect.amplitudes()) for effect in effects])

    def exchanged(
        self,
        ordinates: NDArray[np.float64],
        parts: Sequence[tuple[Deterministic, NDArray[np.float64]]],
    ) -> NDArray[np.float64]:
        """Ordinates with known functions of time taken out that many times; negative amplitudes put them back."""
        total: NDArray[np.float64] | None = None
        once: NDArray[np.float64] | None = None
        for effect, amplitudes in parts:
            if not amplitudes.any():
                continue
            if self.functions.holds(amplitudes.size * self.ordinates.nbytes):
                rows = self.rows(effect)
                # Of one row the product would be a loop without the widest instructions.
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

    def forget(self) -> None:
        """Keep nothing as long as the record: of one with other samples, or that is done with."""
        self.functions.forget()
        self.lowest.forget()
        self.mixed.forget()

    def rows(self, effect: Deterministic) -> NDArray[np.float64]:
        """Ordinates of every regressor of an effect, shape (regressors, n)."""

        def made() -> NDArray[np.float64]:
            series = effect.regressors(self.time, self.covariates).T
            return np.array([self.transform(s) for s in series])

        return self.functions.get(effect.seen_alike, made)

    def seen(self, ordinates: NDArray[np.float64], j: NDArray[np.int64]) -> NDArray[np.float64]:
        """Ordinates j of known functions of time, shape (…, k), as this record shows them."""
        return ordinates if self.gain is None else ordinates * self.gain[j]


def prepare(recording: Any, missing: NDArray[np.bool_] | None = None) -> Data:
    """Data of a one-column recording.

    Raises
    ------
    InputError
        Infinities, several columns, or samples without any variation.
    TooShortError
        Fewer than 32 samples, or all of them missing.
    """
    samples = np.asarray(recording.rate_samples())
    label = (
        f"column {recording.columns[0]!r}" if getattr(recording, "columns", None) else "the record"
    )
    if samples.ndim != 1:
        raise InputError(f"a fit needs one column, found an array of shape {samples.shape}")
    if samples.size < SHORTEST:
        raise TooShortError(
            f"{label} has {samples.size} samples: a fit needs at least {SHORTEST}, and hours for slow effects"
        )
    values = samples.astype(np.float64, copy=False)
    if np.isinf(values).any():
        raise InputError(
            f"{label} has {int(np.isinf(values).sum())} infinite samples: remove or mark them as NaN"
        )
    holes = np.isnan(values)
    if missing is not None:
        holes |= missing
    there = int(holes.size - np.count_nonzero(holes))
    if there < max(SHORTEST, LEAST * holes.size):
        raise TooShortError(
            f"{label} has {there} of {holes.size} samples: a fit needs at least {SHORTEST}, one in"
            f" {1 / LEAST:g}, and hours for slow effects"
        )
    filled = bridge_gaps(values, missing)
    if float(np.ptp(filled)) == 0.0:
        raise TooShortError(f"{label} is constant ({filled[0]:g}): there is no noise to fit")
    changes = int(np.count_nonzero(filled[1:] != filled[:-1]))
    if changes < 2 * FLIPS:  # to another value and back
        raise TooShortError(
            f"{label} stands still but for {changes} change{'s' * (changes > 1)} of value: there is no noise to fit"
        )
    check_size(filled, label, "a fit")
    covariates = {
        name: without_steps(bridge_gaps(np.asarray(values)))
        for name, values in dict(recording.covariates).items()
    }
    ordinates = _kernels.cosine_transform(filled)
    return Data(
        filled,
        ordinates,
        float(recording.rate),
        bins_seen(ordinates),
        covariates,
        missing=holes if there < holes.size else None,
        functions=room_for(filled.size),
    )


def without_samples(data: Data, missing: NDArray[np.bool_]) -> Data:
    """The same record with more samples missing, bridged."""
    filled = bridge_gaps(data.samples, missing)
    if data.missing is not None:
        missing = missing | data.missing
    ordinates = _kernels.cosine_transform(filled)
    return replace(
        data,
        samples=filled,
        ordinates=ordinates,
        bins=bins_seen(ordinates),
        missing=missing,
        gain=None,
        mixing=None,
        functions=room_for(data.n),
        lowest=Remembered(LOWEST),
        mixed=Remembered(LOWEST),
    )
