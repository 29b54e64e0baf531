"""Simulation: samples of a model.

The compiled core draws each random process. Filters and level changes then act on the samples, and the known functions
of time are added.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.validation import SEEDS, positive, positive_rate, whole
from allanite.effects import Model, as_model, segment_weights
from allanite.effects.terms import Exponential, White
from allanite.recording import Recording
from allanite.recording.samples import covariate_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import ArrayLike

    from allanite.effects import Effect, Modifier, Response, Stochastic
    from allanite.effects.terms import Term

    Gain = Callable[..., Array]

#: Maximum number of samples. A double represents all indices up to this number; no memory holds so many samples.
SAMPLES = 2**53
#: Samples that are simulated at a time before the record begins, while filters settle.
SETTLING_CHUNK = 2**20
#: Maximum number of taps of the filter that extracts a band, and half of its length in units of rate/bandwidth.
MAX_TAPS, HALF_TAPS_PER_PERIOD = 4096, 4.0


def arma(terms: tuple[Term, ...]) -> tuple[float, list[float], list[float]]:
    """Tuple (σ, numerator b, denominator a) of the ARMA process with the spectrum of `terms`, exponentials and white noise.

    Its input is white noise with standard deviation σ. b begins with b0 = 1; a begins with a1, because a0 = 1 is omitted.
    The spectrum of the terms times |a|² is the spectrum of a moving average; b is its minimum-phase factor.
    """
    phi = np.array([complex(t.phi) for t in terms if isinstance(t, Exponential)])
    poles = np.concatenate([phi, phi[phi.imag != 0.0].conj()])
    order = poles.size
    w = np.pi * np.arange(1, 4 * order + 2, 2) / (4 * order + 2)
    moving = np.sum([t.spectrum(w) for t in terms], axis=0)
    for p in poles:
        moving = moving * np.abs(np.exp(1j * w) - p) ** 2
    # Autocovariance r(0) … r(order) of the moving average, from its spectrum at the middles of equal bands.
    g = np.cos(np.outer(np.arange(order + 1), w)) @ moving / w.size
    g = np.where(np.abs(g) < 1e-12 * g[0], 0.0, g)
    roots = np.roots(np.trim_zeros(np.concatenate([g[:0:-1], g])))
    inside = sorted(roots, key=abs)[: roots.size // 2]
    b = np.real(np.poly(inside)) if inside else np.ones(1)
    gain = float(np.sqrt(g[0] / float(b @ b)))
    b = np.pad(b, (0, order + 1 - b.size))
    return gain, list(map(float, b)), list(map(float, np.real(np.poly(poles))[1:]))


def _generators(model: Model, effect: Any, rate: float) -> list[tuple[str, list[float]]]:
    """List of (name, parameters) of the random-number generators of the compiled core whose sum simulates an effect.

    Generators of white noise include the filter among the modifiers of the `model`. InputError if the variance of a sample
    is too large for a double, or if the core has no generator for a term.
    """
    part = Model((effect, *model.modifiers)) if effect.white else Model((effect,))
    with np.errstate(over="ignore", invalid="ignore"):
        terms = part.terms(rate)
    if not all(np.isfinite(t.numbers).all() for t in terms):
        raise InputError(
            f"{effect.kind}: the variance of a sample at {rate:g} Hz is too large for a double: lower"
            f" {effect.coefficient} or the rate"
        )
    own = effect.generator(rate)
    if own is not None:
        return [own]
    if effect.white:
        level = Model((effect,)).terms(rate)[0].numbers[0]
        found = [g for m in model.modifiers if (g := m.generators(level, rate)) is not None]
        if found:
            return found[0]
    lags = [t for t in terms if isinstance(t, Exponential)]
    white = [t for t in terms if isinstance(t, White)]
    # An exponential with a negative density at some frequency is a process only in sum with the other terms.
    are_processes = all(_has_nonnegative_spectrum(t) for t in lags)
    if not are_processes or (len(lags) == 1 and (white or lags[0].generator is None)):
        rest = [t for t in terms if not isinstance(t, (Exponential, White))]
        return [_filter_generator((*lags, *white)), *(_generator(t) for t in rest)]
    return [_generator(t) for t in terms]


def _has_nonnegative_spectrum(lag: Exponential) -> bool:
    """True if the spectrum of an exponential term is nowhere negative, so that the term alone is a random process.

    The numerator of the spectrum is linear in cos w, so that it is enough to test w = 0 and w = π.
    """
    return bool((lag.spectrum(np.array([0.0, np.pi])) >= 0.0).all())


def _generator(term: Term) -> tuple[str, list[float]]:
    """Pair (name, parameters) of the core's generator of one term: its own generator, or filtered white noise."""
    return term.generator or _filter_generator((term,))


def _filter_generator(terms: tuple[Term, ...]) -> tuple[str, list[float]]:
    """Pair ("filtered", parameters) of the generator that simulates a sum of exponentials and white noise.

    InputError if their filter has more than two poles.
    """
    if sum(1 + bool(complex(t.phi).imag) for t in terms if isinstance(t, Exponential)) > 2:
        raise InputError(
            "an effect of more than two lags, one with a negative density at some frequency, cannot be simulated:"
            " declare its `generator`"
        )
    gain, b, a = arma(terms)
    return "filtered", [gain, *b, *[0.0] * (3 - len(b)), *a, *[0.0] * (2 - len(a))]


class SimulationOptions(TypedDict, total=False):
    """Options of `simulate` and `simulate_chunks`."""

    duration: float | None
    n: int | None
    rate: float
    seed: int
    unit: str
    covariates: Mapping[str, ArrayLike] | None
    axis: int
    replicate: int


def simulate(
    model: Model | Effect | str,
    *,
    duration: float | None = None,
    n: int | None = None,
    rate: float,
    seed: int = 0,
    unit: str = "1",
    covariates: Mapping[str, ArrayLike] | None = None,
    axis: int = 0,
    replicate: int = 0,
) -> Recording:
    """Simulated recording of a model.

    The samples have the spectrum and the Allan variance of the model at every frequency and averaging factor.

    Parameters
    ----------
    model : Model, Effect or str
        Model in which every parameter has a value.
    duration : float, optional
        Length of the record in s. Give either `duration` or `n`.
    n : int, optional
        Number of samples.
    rate : float
        Sampling rate in Hz.
    seed : int
        Seed from 0 to 2^64 − 1. The same seed gives the same samples for any number of threads.
    unit : str
        Unit U of the samples and of the model's values.
    covariates : mapping of str to array_like, shape (n,), optional
        Logged columns that effects of the model follow, by name.
    axis : int
        Number of the axis. Each axis gets an independent record from the same seed.
    replicate : int
        Number of the repetition, from 0 to 2^32 − 1. Each repetition gets an independent record from the same seed and
        axis.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        A value of the model is missing or too large. The rate or the length is not positive, or the record does not fit
        into memory. Seed, axis or replicate is not a whole number from 0 on.
    """
    source = _SimulatedRecord(model, rate, duration, n, seed, unit, covariates, axis, replicate)
    return source.next_samples(source.n)


def simulate_chunks(
    model: Model | Effect | str, *, size: int = 2**20, **options: Unpack[SimulationOptions]
) -> Iterator[Recording]:
    """Iterator over consecutive segments of the recording that `simulate` returns, with exactly the same samples.

    Only one segment at a time is in memory, unless an effect needs the whole record (for example a logged column).

    Parameters
    ----------
    model : Model, Effect or str
        Model in which every parameter has a value.
    size : int
        Number of samples of each segment; the last segment may be shorter.
    options
        Parameters of the whole record: `duration` or `n`, `rate`, `seed`, `unit`, `covariates`, `axis` and `replicate`;
        see `simulate`. Each segment contains its part of the covariates.

    Returns
    -------
    iterator of Recording
        Sample k of segment i is sample i·size + k of the record.

    Raises
    ------
    InputError
        The errors of `simulate`, or a size below 1. The error is raised by the call, before the first segment.
    """
    size = whole(size, "size", 1, SAMPLES, "the number of samples of a segment")
    source = _SimulatedRecord(model, **options)
    steps = range(0, source.n, size)
    return (source.next_samples(min(size, source.n - first)) for first in steps)


class _SimulatedRecord:
    """Simulated record of a model, whose samples are taken in order; see `simulate` for the parameters."""

    def __init__(
        self,
        model: Model | Effect | str,
        rate: float,
        duration: float | None = None,
        n: int | None = None,
        seed: int = 0,
        unit: str = "1",
        covariates: Mapping[str, ArrayLike] | None = None,
        axis: int = 0,
        replicate: int = 0,
    ) -> None:
        model = as_model(model)
        self.rate = positive_rate(rate)
        self.n = _sample_count(duration, n, self.rate)
        self.unit = unit
        self.at = 0
        seed = whole(seed, "seed", 0, SEEDS)
        axis = whole(axis, "axis", 0, SEEDS)
        # The high half of the key is the replicate, the low half the number of the process within the record.
        key = whole(replicate, "replicate", 0, 2**32 - 1) << 32
        _require_values(model)
        self.covariates = {k: covariate_of(k, v, self.n) for k, v in (covariates or {}).items()}
        self.known = [e.sampler(self.n, self.rate, self.covariates) for e in model.deterministic]
        # Simulators of the random processes, and the factors on their samples over time.
        self.parts: list[tuple[_kernels.Simulator, list[Gain]]] = []
        span = (0.0, self.n / self.rate)
        swelling = [e for e in model.modifiers if e.band is not None]
        of_all = [e for e in swelling if not any(map(e.changes_level_of, model.stochastic))]
        self.filters: list[_StatefulFilter | _BandLevelFilter] = [
            *(_StatefulFilter(e.response(self.rate)) for e in model.filters),
            *(_BandLevelFilter(e, self.rate, span) for e in of_all),
        ]
        # The noise begins before the record, so that the filters have settled at its first sample.
        self.settling = sum(f.settling for f in self.filters)
        total = self.n + self.settling
        levels = [e for e in model.modifiers if e.changes_level]
        applied_here = (*levels, *(e for e in model.modifiers if e.whole is not None))
        steady = Model(tuple(e for e in model if e not in applied_here))
        generators: list[tuple[str, list[float]]] = []
        number = 0
        for whole_effect in model.stochastic:
            for effect, gains in _processes_with_gains(whole_effect, span):
                own = _generators(steady, effect, self.rate)
                gains += [e.gain for e in levels if e.band is None and effect.white]
                gains += [
                    _band_gain(e, self.rate, span)
                    for e in swelling
                    if e.changes_level_of(whole_effect)
                ]
                number += 1
                if gains:
                    alone = _kernels.Simulator(own, seed, key + number, axis, total)
                    self.parts.append((alone, gains))
                else:
                    generators += own
        if generators or not self.parts:
            rest = _kernels.Simulator(generators, seed, key, axis, total)
            self.parts.append((rest, []))
        for first in range(-self.settling, 0, SETTLING_CHUNK):
            self._noise(min(SETTLING_CHUNK, -first), first)

    def next_samples(self, count: int) -> Recording:
        """`Recording` of the next `count` samples of the simulated record."""
        first, self.at = self.at, self.at + count
        total = self._noise(count, first)
        for samples in self.known:
            total += samples(first, self.at)
        total.flags.writeable = False  # `Recording` copies only writeable arrays
        given = {k: v[first : self.at] for k, v in self.covariates.items()}
        return Recording(total, rate=self.rate, unit=self.unit, covariates=given or None)

    def _noise(self, count: int, first: int) -> Array:
        """The next `count` samples of the sum of the random processes after all filters; calls must continue the record.

        `first` is the index of the first of them; it is negative before the record, while the filters settle.
        """
        total: Array | None = None
        for process, gains in self.parts:
            part = process.next(count)
            if gains:
                at = np.arange(first, first + count)
                time = at / self.rate
                columns = {k: v[np.maximum(at, 0)] for k, v in self.covariates.items()}
                for gain in gains:
                    part *= gain(time, columns)
            if total is None:
                total = part
            else:
                total += part
        assert total is not None
        for filtering in self.filters:
            total = filtering.next(total, first)
        return total


def _processes_with_gains(
    effect: Stochastic, span: tuple[float, float]
) -> list[tuple[Stochastic, list[Gain]]]:
    """List of pairs (random process, list of gains) for the simulation of an effect.

    Each process is multiplied by all its gains; the sum of the products is the effect. A gain is a function of time (s)
    that returns an array of factors. An effect whose spectrum changes over the record (`moving`) has one process for each
    equal time segment. `span` is the first and last time of the record, s.
    """
    if not effect.moving:
        return [(effect, [])]

    def gain(segment: int, time: Array, _: object = None) -> Array:
        """Factor on the process of a time segment at each time (s): the root of its weight in `segment_weights`."""
        return np.sqrt(segment_weights(time, span, len(effect.segments))[segment])

    return [(process, [partial(gain, i)]) for i, process in enumerate(effect.segments)]


def _band_gain(effect: Modifier, rate: float, span: tuple[float, float]) -> Gain:
    """Function of time (s) that returns the factor on samples of a frequency band whose level `effect` changes.

    The mean of the squared factor over `span`, the first and last time of the record in s, is 1.
    """

    def gain(time: Array, _: object = None) -> Array:
        """Array of the factor at each time (s): root of the relative power of the band from this sample to the next."""
        return np.asarray(np.sqrt(effect.power_between(time, time + 1.0 / rate, span)))

    return gain


class _BandLevelFilter:
    """Filter that changes the level of one band of the signal over time. The output is delayed by half of its taps."""

    def __init__(self, effect: Modifier, rate: float, span: tuple[float, float]) -> None:
        from scipy.signal import firwin

        assert effect.band is not None
        self.rate, self.gain = rate, _band_gain(effect, rate, span)
        low, high = effect.band
        wanted = HALF_TAPS_PER_PERIOD * rate / max(high - low, 1e-300)
        half = int(np.clip(wanted, *(MAX_TAPS // 64, MAX_TAPS // 2)))
        # A band that begins at 0, or ends with the spectrum, has one edge.
        edges = [f for f in (low, high) if 0.0 < f < 0.5 * rate]
        self.taps = firwin(2 * half + 1, edges, fs=rate, pass_zero=low <= 0.0)
        self.settling = 2 * half
        self.state = np.zeros(2 * half)
        self.delayed = np.zeros(half)

    def next(self, samples: Array, first: int) -> Array:
        """The input `samples` with the changed level of one band, delayed by half the number of filter taps.

        Each call continues the record where the previous call ended. `first` is the index of the first input sample.
        """
        from scipy.signal import lfilter

        # With a denominator, rounding does not depend on how the record is divided into segments.
        band, self.state = lfilter(self.taps, [1.0, 0.0], samples, zi=self.state)
        delayed = np.concatenate([self.delayed, samples])
        self.delayed = delayed[samples.size :]
        time = np.arange(first, first + samples.size) / self.rate
        return np.asarray(delayed[: samples.size] + (self.gain(time) - 1.0) * band)


class _StatefulFilter:
    """Filter of the whole signal that keeps its state between segments."""

    def __init__(self, response: Response) -> None:
        self.b, self.a = response.b, response.a
        self.settling = response.settling
        self.state = np.zeros(len(response.poles))

    def next(self, samples: Array, _: int) -> Array:
        """The input `samples` after the recursive filter; each call continues the record where the previous call ended."""
        from scipy.signal import lfilter

        out, self.state = lfilter(self.b, self.a, samples, zi=self.state)
        return np.asarray(out)


def _sample_count(duration: float | None, n: int | None, rate: float) -> int:
    """Number of samples `n`, or `duration` (s) times `rate` (Hz), rounded; exactly one of both must be given.

    Raises `InputError` for both or none, for less than one sample, and for more than 2⁵³ samples.
    """
    if (duration is None) == (n is None):
        raise InputError("give either a duration in seconds or a number of samples n")
    if n is not None:
        if isinstance(n, (int, np.integer)) and n < 1:
            raise InputError(f"a record of {n} samples: at least 1 is needed")
        return whole(n, "n", 1, SAMPLES, "more do not fit into any memory")
    seconds = positive(duration, "duration", "s", "give a positive number of seconds")
    if seconds * rate > SAMPLES:
        raise InputError(
            f"duration = {seconds:g} s at {rate:g} Hz: {seconds * rate:.3g} samples are more than any"
            " memory holds; give a shorter duration"
        )
    count = round(seconds * rate)
    if count < 1:
        raise InputError(
            f"duration = {seconds:g} s at {rate:g} Hz is less than one sample: give a longer duration"
        )
    return count


def _require_values(model: Model) -> None:
    """Raise `InputError` if a parameter has no value, unless it is optional, a choice or derived."""
    for effect in model:
        for p in effect.parameters:
            optional = p.role in {"derived", "choice"} or p.optional
            if not optional and effect.values[p.name] is None:
                raise InputError(
                    f"{effect.kind}: {p.name} has no value; a simulation needs a value of every parameter:"
                    f" write {effect.short}({p.name}=…)"
                )
