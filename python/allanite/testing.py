"""Tests of the properties that an effect declares, for built-in effects and for your own.

>>> from allanite.testing import check_effect
>>> check_effect(GaussMarkov(q_c=1e-3, correlation_time=3.0))
"""

from __future__ import annotations

import json
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.effects import (
    SEARCH_METHODS,
    Columns,
    Deterministic,
    Effect,
    GaussMarkov,
    Model,
    Modifier,
    Parameter,
    Stochastic,
    find,
    model_from_dict,
    model_to_dict,
    parse_model,
    white_noise,
)
from allanite.simulate import simulate
from allanite.spectrum import bins_of

#: Sampling rate of the test records, Hz.
RATE = 50.0
#: Samples of each simulated record, and number of records.
LENGTH, RECORDS = 2048, 384
#: Allowed difference of a mean from its expectation, in standard errors. The largest of a few hundred normal differences
#: exceeds 4.5 in one of a thousand runs.
SIGMAS = 5.0
#: Allowed negative density due to rounding, as a fraction of each term. Measured at the zeros of filters: 15 units in the
#: last place.
ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
#: Factor by which the noise of a typical change of level is louder.
FACTOR = 3.0
ROLES = {"coefficient", "shape", "choice", "time", "derived"}


def _assert_that(condition: object, message: str) -> None:
    """Raise AssertionError with the message unless the condition is true."""
    if not condition:
        raise AssertionError(message)


def check_effect(effect: Effect, covariates: Columns | None = None) -> None:
    """Test all properties that an effect declares; raises `AssertionError` for the first property that does not hold.

    Parameters
    ----------
    effect : Effect
        Effect with a value of every parameter. The values must suit a record of 2048 samples at 50 Hz: time constants
        of 0.1 to 10 s, times within 41 s, frequencies below 25 Hz.
    covariates : mapping of str to ndarray, shape (2048,), optional
        Logged columns that the effect follows, by name.

    Raises
    ------
    AssertionError
        A property does not hold. The message names the effect and the property.
    """
    columns = dict(covariates or {})
    check_declaration(effect)
    check_round_trip(effect)
    if isinstance(effect, Deterministic):
        check_amplitudes(effect, columns)
    else:
        check_density(effect)
    check_simulation(effect, columns)


def example_of(
    kind: type[Effect], n: int = LENGTH, rate: float = RATE, columns: Columns | None = None
) -> Effect:
    """Effect of a kind with typical values for a record of `n` samples at `rate` Hz with the logged `columns`.

    Coefficients are 1, factors are 3, and shapes are the medians of their grids. Optional parameters have no value.
    """
    texts = {f.name: str(f.type) for f in fields(kind)}
    beside = Model((white_noise(),))
    first = next(iter(kind.candidates(beside, columns or {})), kind())
    effect = first.variants()[0]
    whole = n / rate
    thirds = iter((whole / 3.0, 2.0 * whole / 3.0))
    bands = iter((0.1 * rate, 0.2 * rate))
    # What comes twice, and when each is over.
    twice = iter(((whole / 3.0, 2.0 * whole / 3.0), (0.4 * whole, 0.9 * whole)))
    for p in kind.parameters:
        if p.optional or p.role == "derived" or getattr(effect, p.name) is not None:
            continue
        if p.role == "shape":
            # The grid of an end depends on the beginning that is given already.
            value: object = float(np.median(effect.grid(p.name, n, rate)))
        elif p.role == "time" and "tuple" in texts[p.name]:
            value = next(twice) if p.unit == "s" else (FACTOR, 1.0)
        elif p.unit == "unit":
            value = float(np.mean(next(iter((columns or {}).values()))))
        elif p.role == "time":
            times = {"s": thirds, "Hz": bands}.get(str(p.unit))
            value = min(FACTOR, 0.5 * p.high) if times is None else next(times)
        elif p.role == "coefficient":
            value = 1.0
        else:
            continue
        effect = effect.with_values(**{p.name: value})
    return effect


def check_declaration(effect: Effect) -> None:
    """Raise `AssertionError` for the first declaration of an effect that is missing or inconsistent.

    These are its texts, parameters, bounds and grids, and the kind of search (`screened`).
    """
    cls = type(effect)
    for name in ("kind", "short", "title", "physics", "looks_like", "check_by"):
        text = getattr(cls, name, "")
        _assert_that(isinstance(text, str) and text.strip(), f"{cls.__name__}: {name} is empty")
    kind = cls.kind
    _assert_that(cls.parameters, f"{kind}: no parameters")
    names = [p.name for p in cls.parameters]
    _assert_that(len(set(names)) == len(names), f"{kind}: a parameter is declared twice")
    for p in cls.parameters:
        _assert_that(isinstance(p, Parameter), f"{kind}: {p!r} is not a Parameter")
        _assert_that(
            isinstance(p.unit, float) or (isinstance(p.unit, str) and p.unit),
            f"{kind}.{p.name}: no unit",
        )
        _assert_that(p.description, f"{kind}.{p.name}: no description")
        _assert_that(p.role in ROLES, f"{kind}.{p.name}: role {p.role!r} is unknown")
        _assert_that(p.low < p.high, f"{kind}.{p.name}: bounds {p.low} … {p.high}")
        _assert_that(
            hasattr(effect, p.name),
            f"{kind}: declares the parameter {p.name} but has no such field",
        )
        if isinstance(effect.values[p.name], float) and p.role != "derived" and p.low > -np.inf:
            try:
                effect.with_values(**{p.name: p.low - 1.0})
            except InputError:
                continue
            _assert_that(False, f"{kind}: a value of {p.name} below its bound {p.low} is accepted")
    _assert_that(kind not in cls.rivals, f"{kind}: the effect lists itself in `rivals`")
    _assert_that(cls.screened in SEARCH_METHODS, f"{kind}: screened = {cls.screened!r} is unknown")
    for name in cls.shown():
        _assert_that(
            name in names, f"{kind}: `shown` names {name}, but the effect has no such parameter"
        )
    if effect.periodic:
        _assert_that(
            cls.screened in {"line", "none"},
            f'{kind}: a periodic effect needs screened = "line" or "none"',
        )
    elif isinstance(effect, Deterministic):
        known = {"slow", "none"} if effect.low else {"drifting line", "passing line", "none"}
        _assert_that(
            cls.screened in known,
            f"{kind}: screened = {cls.screened!r}, but the effect allows only {sorted(known)}",
        )
    if isinstance(effect, Stochastic):
        _assert_that(effect.coefficient in names, f"{kind}: coefficient is not a parameter")
    for name in effect.free_shapes if cls.screened in {"spectral", "slow"} else ():
        p, values = effect.parameter(name), np.asarray(effect.grid(name, 100_000, RATE))
        _assert_that(values.size > 1, f"{kind}: the grid of {name} is empty")
        _assert_that(
            np.isfinite(values).all() and (values >= p.low).all() and (values <= p.high).all(),
            f"{kind}: the grid of {name} leaves its bounds",
        )


def check_round_trip(effect: Effect) -> None:
    """Raise `AssertionError` unless an effect can be written to a model file and to a model string and read back.

    The values from a model file must be equal in every bit, those from a model string to a relative 10⁻⁵. Effects that are
    not in the catalog are not checked: model strings cannot name them.
    """
    if find(effect.kind) is not type(effect):
        return
    model = Model((effect,))
    back = model_from_dict(json.loads(json.dumps(model_to_dict(model))), effect.kind)
    _assert_that(back == model, f"{effect.kind}: JSON gives {back}, not {model}")
    parsed = parse_model(str(model)).effects[0]
    _assert_that(type(parsed) is type(effect), f"{effect.kind}: {model} is read as {parsed.kind}")
    lists = any(isinstance(value, tuple) for value in effect.values.values())
    for p in effect.parameters:
        written, read = effect.values[p.name], parsed.values[p.name]
        # Model strings do not contain lists of times, or values that are derived from lists.
        if isinstance(written, tuple) or (lists and p.role == "derived"):
            continue
        same = written == read or (
            isinstance(written, float)
            and isinstance(read, float)
            and abs(read - written) <= 1e-5 * abs(written)
        )
        _assert_that(same, f"{effect.kind}: {model} is read with {p.name} = {read}, not {written}")


def _as_model(effect: Effect) -> Model:
    """`Model` of the effect alone, or of white noise with N = 1 and the effect if it is a modifier."""
    return Model((white_noise(1.0), effect) if isinstance(effect, Modifier) else (effect,))


def _quadrature_nodes(m: int) -> tuple[Array, Array]:
    """Pair (nodes, weights) of a composite Gauss-Legendre quadrature over (0, π), both of shape (nodes,).

    It suits integrands that contain sin⁴(mw/2), as in the Allan variance at averaging factor `m`. The weights do not
    contain this factor. The nodes are dense near w = 0, where spectra diverge, and resolve each period of the sine.
    """
    x, v = np.polynomial.legendre.leggauss(8)
    edges = np.unique(
        np.concatenate([np.geomspace(1e-30, 1e-3, 200), np.linspace(0.0, np.pi, 40 * max(m, 80))])
    )
    half = np.diff(edges) / 2.0
    middle = edges[:-1] + half
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * v).ravel()


def check_density(effect: Effect) -> None:
    """Raise `AssertionError` if the density of an effect is negative, or does not integrate to its Allan variance.

    A modifier is tested on white noise. The Allan deviation of a `Stochastic` must be proportional to its coefficient.
    """
    model = _as_model(effect)
    for m in (1, 2, 3, 10, 100):
        w, weight = _quadrature_nodes(m)
        density = model.psd(w * RATE / (2.0 * np.pi), RATE)
        # At the zeros of a filter, terms of opposite sign cancel up to rounding.
        sizes = sum(np.abs(term.spectrum(w)) for term in model.terms(RATE)) / RATE
        _assert_that((density > -ROUNDING * sizes).all(), f"{effect.kind}: the density is negative")
        gain = 4.0 * np.sin(m * w / 2.0) ** 4 / (m * np.sin(w / 2.0)) ** 2
        integral = float((weight * density * gain).sum() * RATE / (2.0 * np.pi))
        declared = float(model.allan_variance(m / RATE, RATE))
        _assert_that(
            abs(integral / declared - 1.0) < 1e-5,
            f"{effect.kind}: at averaging factor {m} the density integrates to {integral:.8g}, "
            f"but the declared Allan variance is {declared:.8g}",
        )
    if isinstance(effect, Stochastic):
        name = effect.coefficient
        louder = effect.with_values(**{name: 3.0 * effect.values[name]})
        tau = np.array([1, 7, 300]) / RATE
        ratio = louder.allan_variance(tau, RATE) / effect.allan_variance(tau, RATE)
        _assert_that(
            np.allclose(ratio, 9.0, rtol=1e-12),
            f"{effect.kind}: three times {name} is not three times the deviation",
        )


def check_amplitudes(effect: Deterministic, covariates: Columns | None = None) -> None:
    """Raise `AssertionError` unless the signal of a known function is `regressors` @ `amplitudes`, and not constant.

    `with_amplitudes` must set the amplitudes, and the signal must be proportional to them. The Allan variance of the signal
    must agree with the declared one to 2 % of the largest value; an Allan variance of zeros is not compared.
    """
    columns, kind = dict(covariates or {}), effect.kind
    time = np.arange(LENGTH) / RATE
    matrix, amplitudes = effect.regressors(time, columns), effect.amplitudes()
    _assert_that(matrix.shape == (LENGTH, amplitudes.size), f"{kind}: regressors {matrix.shape}")
    _assert_that(np.isfinite(matrix).all(), f"{kind}: regressors are not finite")
    signal = effect.signal(time, columns)
    _assert_that(np.ptp(signal) > 0.0, f"{kind}: the signal is constant with these values")
    size = float(np.abs(signal).max())
    _assert_that(
        np.allclose(signal, matrix @ amplitudes, atol=1e-12 * size, rtol=0.0),
        f"{kind}: signal is not regressors @ amplitudes",
    )
    for factor in (1.0, 2.0, 0.25):
        scaled = effect.with_amplitudes(factor * amplitudes)
        _assert_that(
            np.allclose(scaled.amplitudes(), factor * amplitudes, rtol=1e-12, atol=1e-300),
            f"{kind}: with_amplitudes does not keep {factor} × amplitudes",
        )
        _assert_that(
            np.allclose(scaled.signal(time, columns), factor * signal, atol=1e-9 * size, rtol=0.0),
            f"{kind}: not linear in its amplitudes",
        )
    declared = Model((effect,)).allan_variance(FACTORS / RATE, RATE)
    if declared.any():
        measured = _overlapping_allan_variance(signal, FACTORS)
        # The record does not contain a whole number of cycles of a line.
        _assert_that(
            (np.abs(measured - declared) <= 0.02 * declared.max()).all(),
            f"{kind}: Allan variance of the signal {measured}, declared {declared}",
        )


#: Averaging factors at which Allan variances are compared.
FACTORS = np.unique(np.round(np.geomspace(1, LENGTH // 4, 14)).astype(np.int64))


def _overlapping_allan_variance(samples: Array, factors: NDArray[np.int64]) -> Array:
    """Overlapping Allan variance of samples in the last axis at each averaging factor, shape (..., factors)."""
    phase = np.concatenate([np.zeros((*samples.shape[:-1], 1)), np.cumsum(samples, -1)], -1)
    out = []
    for m in factors:
        second = phase[..., 2 * m :] - 2.0 * phase[..., m:-m] + phase[..., : -2 * m]
        out.append(np.mean(second**2, axis=-1) / (2.0 * m * m))
    return np.stack(out, axis=-1)


def check_simulation(effect: Effect, covariates: Columns | None = None) -> None:
    """Raise `AssertionError` unless equal seeds give equal samples, and simulated records have the declared properties.

    A known function must be added exactly to another process. For other effects, the mean Allan variance and spectrum
    of 384 records must agree with the declared ones to 5 standard errors. The records are the difference of simulations
    with and without the effect, or white noise after an effect that changes all processes. For effects that last only
    for a time, long averages and low frequencies are not compared.
    """
    columns, kind = dict(covariates or {}), effect.kind
    other, model = Model((GaussMarkov(q_c=2.0, correlation_time=0.5),)), _as_model(effect)
    # A modifier of the whole signal would also change the other effect.
    alone = isinstance(effect, Modifier) and bool(effect.whole or effect.band)

    def run(simulated: Model, seed: int) -> Array:
        """Array of 2048 simulated samples of a model with this seed."""
        found = simulate(simulated, n=LENGTH, rate=RATE, seed=seed, covariates=columns)
        return np.asarray(found.samples)

    _assert_that(
        (run(model, 1) == run(model, 1)).all(), f"{kind}: the same seed gives other samples"
    )
    if isinstance(effect, Deterministic):
        difference = run(other + effect, 3) - run(other, 3)
        signal = effect.signal(np.arange(LENGTH) / RATE, columns)
        _assert_that(
            np.allclose(difference, signal, atol=1e-9),
            f"{kind}: the simulation does not add the signal of the effect",
        )
        return
    _assert_that(
        (run(model, 1) != run(model, 2)).any(), f"{kind}: another seed gives the same samples"
    )
    records = np.array(
        [run(model, s) if alone else run(other + model, s) - run(other, s) for s in range(RECORDS)]
    )
    terms = model.terms(RATE, (0.0, LENGTH / RATE))
    # The declared variance of an effect that lasts only for a time is exact only for short averages.
    lasting = all(p.role != "time" for p in effect.parameters)
    factors = FACTORS if lasting else FACTORS[FACTORS <= LENGTH // 100]
    declared = sum(t.allan_variance(factors.astype(float)) for t in terms)
    _assert_agreement(
        _overlapping_allan_variance(records, factors),
        np.asarray(declared),
        f"{kind}: Allan variance at m",
        factors,
    )
    bins = bins_of(LENGTH)
    power = np.array([bins.power(_kernels.cosine_transform(r)) for r in records])
    expected = bins.mean(np.asarray(sum(t.cosine_variance(bins.nodes, LENGTH) for t in terms)))
    seen = bins.edges[:-1] >= (1 if lasting else 64)
    _assert_agreement(
        power[:, seen], expected[seen], f"{kind}: power from ordinate", bins.edges[:-1][seen]
    )


def _assert_agreement(values: Array, expected: Array, what: str, places: NDArray[np.int64]) -> None:
    """Raise `AssertionError` if a mean of `values` over records is 5 standard errors or more from `expected`.

    `values` has shape (records, k). `what` names the quantity, and `places` are the averaging factors or ordinates, shape
    (k,), for the message.
    """
    error = values.std(axis=0, ddof=1) / np.sqrt(values.shape[0])
    z = (values.mean(axis=0) - expected) / error
    worst = int(np.argmax(np.abs(z)))
    _assert_that(
        abs(z[worst]) < SIGMAS,
        f"{what} {places[worst]}: {values.mean(axis=0)[worst]:.6g} ± {error[worst]:.2g} simulated, "
        f"{expected[worst]:.6g} declared",
    )
