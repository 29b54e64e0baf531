"""From a model to samples of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.common.validation import SEEDS, positive, positive_rate, whole
from allanite.effects import Model, Moving, as_model, weights
from allanite.effects.terms import Exponential, White
from allanite.recording import Recording
from allanite.recording.samples import covariate_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from numpy.typing import ArrayLike, NDArray

    from allanite.effects import Effect, Modifier, Stochastic
    from allanite.effects._filter import Response
    from allanite.effects.terms import Term

    Array = NDArray[np.float64]

    Gain = Callable[..., Array]

__all__ = ["SAMPLES", "arma", "simulate", "simulate_chunks"]

#: Samples whose numbers are exact; no memory holds as many.
SAMPLES = 2**53
#: Samples at a time of what comes before a filtered record.
START = 2**20
#: Most taps of the filter that cuts a band out, and half of them in units of the inverse of its width.
TAPS, SHARP = 4096, 4.0


def arma(terms: tuple[Term, ...]) -> tuple[float, list[float], list[float]]:
    """Exponentials and a white rest as white noise through one filter: σ, b (with b0 = 1), a (without a0 = 1).

    Their spectrum without their poles is that of a moving average, of which b is the minimum-phase factor.
    """
    phi = np.array([complex(t.phi) for t in terms if isinstance(t, Exponential)])
    poles = np.concatenate([phi, phi[phi.imag != 0.0].conj()])
    order = poles.size
    w = np.pi * np.arange(1, 4 * order + 2, 2) / (4 * order + 2)
    moving = np.sum([t.spectrum(w) for t in terms], axis=0)
    for p in poles:
        moving = moving * np.abs(np.exp(1j * w) - p) ** 2
    # r(h) of a series of cosines that ends at the order, from the middles of as many bands.
    g = np.cos(np.outer(np.arange(order + 1), w)) @ moving / w.size
    g = np.where(np.abs(g) < 1e-12 * g[0], 0.0, g)
    roots = np.roots(np.trim_zeros(np.concatenate([g[:0:-1], g])))
    inside = sorted(roots, key=abs)[: roots.size // 2]
    b = np.real(np.poly(inside)) if inside else np.ones(1)
    gain = float(np.sqrt(g[0] / float(b @ b)))
    b = np.pad(b, (0, order + 1 - b.size))
    return gain, list(map(float, b)), list(map(float, np.real(np.poly(poles))[1:]))


def _of_effect(model: Model, effect: Any, rate: float) -> list[tuple[str, list[float]]]:
    part = Model((effect, *model.modifiers)) if effect.white else Model((effect,))
    with np.errstate(over="ignore", invalid="ignore"):
        terms = part.terms(rate)
    if not all(np.isfinite(t.numbers).all() for t in terms):
        raise InputError(
            f"{effect.kind}: its variance at {rate:g} Hz is too large to be a number: lower"
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
    # What is no process by itself (a negative density somewhere) is one together with the others.
    apart = all(_has_density(t) for t in lags)
    if not apart or (len(lags) == 1 and (white or lags[0].generator is None)):
        rest = [t for t in terms if not isinstance(t, (Exponential, White))]
        return [_section((*lags, *white)), *(_generator(t) for t in rest)]
    return [_generator(t) for t in terms]


def _has_density(lag: Exponential) -> bool:
    """Whether its spectrum is nowhere negative: over that of its poles it is linear in cos w, so both ends tell."""
    return bool((lag.spectrum(np.array([0.0, np.pi])) >= 0.0).all())


def _generator(term: Term) -> tuple[str, list[float]]:
    return term.generator or _section((term,))


def _section(terms: tuple[Term, ...]) -> tuple[str, list[float]]:
    if sum(1 + bool(complex(t.phi).imag) for t in terms if isinstance(t, Exponential)) > 2:
        raise InputError(
            "an effect of more than two lags, one with a negative density at some frequency, cannot be simulated:"
            " declare its `generator`"
        )
    gain, b, a = arma(terms)
    return "filtered", [gain, *b, *[0.0] * (3 - len(b)), *a, *[0.0] * (2 - len(a))]


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
    """Samples of a model, with the declared discrete spectrum and Allan variance at every averaging factor.

    Parameters
    ----------
    model : Model, Effect or str
        Every value given.
    duration, n : float, int
        Seconds, or number of samples; one of them.
    rate : float
        Sampling rate in Hz.
    seed : int
        From 0 to 2^64 − 1. The same seed gives the same bits whatever the number of threads.
    unit : str
        Unit U of the samples and of the model's values.
    covariates : mapping of str to array_like, shape (n,), optional
        Columns that covariate effects refer to.
    axis : int
        Another axis is another, independent record of the same seed.
    replicate : int
        Another repetition, from 0 to 2^32 − 1, is another, independent record of the same seed and axis.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        A value of the model is missing or too large, rate or length are not positive, a length that does not
        fit into memory, or a seed, axis or replicate that is no whole number from 0 on.
    """
    source = _Source(model, duration, n, rate, seed, unit, covariates, axis, replicate)
    return source.take(source.n)


def simulate_chunks(
    model: Model | Effect | str,
    *,
    size: int = 2**20,
    duration: float | None = None,
    n: int | None = None,
    rate: float,
    seed: int = 0,
    unit: str = "1",
    covariates: Mapping[str, ArrayLike] | None = None,
    axis: int = 0,
    replicate: int = 0,
) -> Iterator[Recording]:
    """The record of `simulate` in consecutive pieces, which together are the same samples bit for bit.

    Only the piece at hand is in memory, unless a covariate or an effect looks at the whole record.

    Parameters
    ----------
    size : int
        Samples of each piece; the last one has what remains.
    model, duration, n, rate, seed, unit, covariates, axis, replicate
        Of the whole record, as of `simulate`; each piece brings its part of the covariates.

    Returns
    -------
    iterator of Recording
        Each begins at a time of its own: sample k of piece i is sample i·size + k of the record.

    Raises
    ------
    InputError
        As of `simulate`, or a size below 1; before the first piece is asked for.
    """
    size = whole(size, "size", 1, SAMPLES, "the samples of a piece")
    source = _Source(model, duration, n, rate, seed, unit, covariates, axis, replicate)
    steps = range(0, source.n, size)
    return (source.take(min(size, source.n - first)) for first in steps)


class _Source:
    """One record of a model, handed out from its first sample to its last."""

    def __init__(
        self,
        model: Model | Effect | str,
        duration: float | None,
        n: int | None,
        rate: float,
        seed: int,
        unit: str,
        covariates: Mapping[str, ArrayLike] | None,
        axis: int,
        replicate: int,
    ) -> None:
        model = as_model(model)
        self.rate = positive_rate(rate)
        self.n = _length(duration, n, self.rate)
        self.unit = unit
        self.at = 0
        seed = whole(seed, "seed", 0, SEEDS)
        axis = whole(axis, "axis", 0, SEEDS)
        # The low half of the key tells the parts of one record from each other.
        key = whole(replicate, "replicate", 0, 2**32 - 1) << 32
        _require(model)
        self.covariates = {k: covariate_of(k, v, self.n) for k, v in (covariates or {}).items()}
        self.known = [e.sampler(self.n, self.rate, self.covariates) for e in model.deterministic]
        # Parts of the noise, and by what the samples of a part are multiplied at each time.
        self.parts: list[tuple[_kernels.Simulator, list[Gain]]] = []
        self.filters: list[_Running | _Swelling] = []
        self.filters += [_Running(e.response(self.rate)) for e in model.filters]
        span = (0.0, self.n / self.rate)
        swelling = [e for e in model.modifiers if e.band is not None]
        of_all = [e for e in swelling if not any(map(e.swells, model.stochastic))]
        self.filters += [_Swelling(e, self.rate, span) for e in of_all]
        # What is filtered begins before the record, by what the filters remember.
        self.before = sum(f.settling for f in self.filters)
        total = self.n + self.before
        levels = [e for e in model.modifiers if e.passing]
        aside = (*levels, *(e for e in model.modifiers if e.whole is not None))
        steady = Model(tuple(e for e in model if e not in aside))
        generators: list[tuple[str, list[float]]] = []
        number = 0
        for whole_effect in model.stochastic:
            for effect, gains in _in_turn(whole_effect, span):
                own = _of_effect(steady, effect, self.rate)
                gains += [e.gain for e in levels if e.band is None and effect.white]
                gains += [_swelling(e, self.rate, span) for e in swelling if e.swells(whole_effect)]
                number += 1
                if gains:
                    alone = _kernels.Simulator(own, seed, key + number, axis, total)
                    self.parts.append((alone, gains))
                else:
                    generators += own
        if generators or not self.parts:
            rest = _kernels.Simulator(generators, seed, key, axis, total)
            self.parts.append((rest, []))
        for first in range(-self.before, 0, START):
            self._noise(min(START, -first), first)

    def take(self, count: int) -> Recording:
        """The next `count` samples."""
        first, self.at = self.at, self.at + count
        total = self._noise(count, first)
        for samples in self.known:
            total += samples(first, self.at)
        total.flags.writeable = False  # which spares the recording a copy
        given = {k: v[first : self.at] for k, v in self.covariates.items()}
        return Recording(total, rate=self.rate, unit=self.unit, covariates=given or None)

    def _noise(self, count: int, first: int) -> Array:
        """Sum of the random processes."""
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


def _in_turn(effect: Stochastic, span: tuple[float, float]) -> list[tuple[Stochastic, list[Gain]]]:
    """The effect, or what it is in each part of the record, with what that is multiplied with at each time."""
    if not isinstance(effect, Moving):
        return [(effect, [])]

    def gain(part: int) -> Gain:
        return lambda time, _=None: np.sqrt(weights(time, span, len(effect.stretches))[part])

    return [(part, [gain(i)]) for i, part in enumerate(effect.stretches)]


def _swelling(effect: Modifier, rate: float, span: tuple[float, float]) -> Gain:
    """By what the samples of a band at each time are multiplied."""

    def gain(time: Array, _: Mapping[str, Array] | None = None) -> Array:
        return np.asarray(np.sqrt(effect.power_between(time, time + 1.0 / rate, span)))

    return gain


class _Swelling:
    """A band of the signal whose level changes, fed piece by piece; it comes late by half of the taps."""

    def __init__(self, effect: Modifier, rate: float, span: tuple[float, float]) -> None:
        from scipy.signal import firwin

        assert effect.band is not None
        self.rate, self.gain = rate, _swelling(effect, rate, span)
        low, high = effect.band
        wanted = SHARP * rate / max(high - low, 1e-300)
        half = int(np.clip(wanted, *(TAPS // 64, TAPS // 2)))
        # A band that begins at 0, or ends with the spectrum, has one edge.
        edges = [f for f in (low, high) if 0.0 < f < 0.5 * rate]
        self.taps = firwin(2 * half + 1, edges, fs=rate, pass_zero=low <= 0.0)
        self.settling = 2 * half
        self.state = np.zeros(2 * half)
        self.late = np.zeros(half)

    def next(self, samples: Array, first: int) -> Array:
        from scipy.signal import lfilter

        # Without a denominator pieces would be rounded as they are cut.
        band, self.state = lfilter(self.taps, [1.0, 0.0], samples, zi=self.state)
        late = np.concatenate([self.late, samples])
        self.late = late[samples.size :]
        time = np.arange(first, first + samples.size) / self.rate
        return np.asarray(late[: samples.size] + (self.gain(time) - 1.0) * band)


class _Running:
    """A filter of the whole signal, fed piece by piece."""

    def __init__(self, response: Response) -> None:
        self.b, self.a = response.b, response.a
        self.settling = response.settling
        self.state = np.zeros(len(response.poles))

    def next(self, samples: Array, _: int) -> Array:
        from scipy.signal import lfilter

        out, self.state = lfilter(self.b, self.a, samples, zi=self.state)
        return np.asarray(out)


def _length(duration: float | None, n: int | None, rate: float) -> int:
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
            " memory holds: ask for a shorter duration"
        )
    count = round(seconds * rate)
    if count < 1:
        raise InputError(f"a record of {count} samples: ask for a longer duration")
    return count


def _require(model: Model) -> None:
    """Every value that a simulation needs is there."""
    for effect in model:
        for p in effect.parameters:
            optional = p.role in {"derived", "choice"} or p.optional
            if not optional and effect.values[p.name] is None:
                raise InputError(
                    f"{effect.kind}: {p.name} has no value: a simulation needs all of them"
                )
