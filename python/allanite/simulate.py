"""From a model to samples of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects import Model, parse_model
from allanite.errors import InputError
from allanite.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.effects import Effect
    from allanite.effects.terms import Term

__all__ = ["processes", "simulate"]


def processes(terms: tuple[Term, ...]) -> list[tuple[str, list[float]]]:
    """Generators of the core for primitive terms."""
    out: list[tuple[str, list[float]]] = []
    for name, v in terms:
        if name in {"white", "blue", "random_walk"} or name == "flicker":
            out.append((name, [float(np.sqrt(v[0]))]))
        elif name == "power_law":
            out.append((name, [v[0], float(np.sqrt(v[1]))]))
        elif name == "moving_average":
            out.append((name, [float(np.sqrt(v[0])), v[1]]))
        elif name == "exponential" and v[3] == 0.0 and v[0] >= 0.0:
            out.append(("gauss_markov", [float(np.sqrt(v[0])), v[2]]))
        else:
            raise AssertionError(name)
    return out


def _section(terms: tuple[Term, ...]) -> list[tuple[str, list[float]]]:
    """One exponential (and perhaps a white rest) as white noise through a second-order section.

    The autocovariance Re(a φ^h) + rest has the spectrum of an ARMA(2, ≤2): the numerator b is the minimum-phase
    factor of the moving average that remains after the poles are taken out.
    """
    exponential = next(v for name, v in terms if name == "exponential")
    white = sum(v[0] for name, v in terms if name == "white")
    a, phi = complex(exponential[0], exponential[1]), complex(exponential[2], exponential[3])
    real = phi.imag == 0.0
    poles = [1.0, -phi.real, 0.0] if real else [1.0, -2.0 * phi.real, abs(phi) ** 2]
    lags = np.array([(a * phi**h).real for h in range(5)])
    r = np.concatenate([lags[:0:-1], lags])
    r[4] += white
    # Autocovariance of a(z)x: convolve r with a(z)a(1/z); beyond lag 2 it is zero.
    moving = np.convolve(r, np.convolve(poles, poles[::-1]))
    middle = moving.size // 2
    g = moving[middle - 2 : middle + 3]
    roots = np.roots(np.trim_zeros(np.where(np.abs(g) < 1e-12 * abs(g[2]), 0.0, g)))
    inside = sorted(roots, key=abs)[: roots.size // 2]
    b = np.real(np.poly(inside)) if inside else np.array([1.0])
    gain = np.sqrt(g[2] / float(b @ b))
    b = np.concatenate([b, np.zeros(3 - b.size)])
    return [("filtered", [float(gain), *map(float, b), *map(float, poles[1:])])]


def _of_effect(model: Model, effect: Any, rate: float) -> list[tuple[str, list[float]]]:
    part = (
        Model((effect, *model.modifiers))
        if effect.kind == "angle_random_walk"
        else Model((effect,))
    )
    terms = part.terms(rate)
    if effect.kind == "burst_noise":
        switching = 0.5 * (1.0 - terms[0][1][2])
        return [("telegraph", [effect.values["amplitude"], switching])]
    if any(name == "exponential" and (v[3] != 0.0 or len(terms) > 1) for name, v in terms):
        return _section(terms)
    return processes(terms)


def simulate(
    model: Model | Effect | str,
    *,
    duration: float | None = None,
    n: int | None = None,
    rate: float,
    seed: int = 0,
    unit: str = "1",
    covariates: Mapping[str, NDArray[np.float64]] | None = None,
    axis: int = 0,
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
        The same seed gives the same bits whatever the number of threads.
    unit : str
        Unit U of the samples and of the model's values.
    covariates : mapping of str to ndarray, shape (n,), optional
        Columns that covariate effects refer to.
    axis : int
        Another axis is another, independent record of the same seed.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        A value of the model is missing, or rate or length are not positive.
    """
    if isinstance(model, str):
        model = parse_model(model)
    if not isinstance(model, Model):
        model = Model((model,))
    if not rate > 0:
        raise InputError(f"rate = {rate} Hz: a sampling rate is positive")
    if (duration is None) == (n is None):
        raise InputError("give either a duration in seconds or a number of samples n")
    count = int(n) if n is not None else round(float(duration or 0.0) * rate)
    if count < 1:
        raise InputError(f"a record of {count} samples: ask for a longer duration")
    for effect in model:
        for p in effect.parameters:
            optional = p.role in {"derived", "choice"} or p.name in {
                "phase",
                "lag",
                "quadratic",
                "count",
            }
            if not optional and effect.values[p.name] is None:
                raise InputError(
                    f"{effect.kind}: {p.name} has no value: a simulation needs all of them"
                )
    level = [e for e in model.modifiers if e.kind == "noise_level_change"]
    # Nobody else reads the times: they take as long as the noise.
    time = np.arange(count if level or model.deterministic else 0) / rate
    given = {k: np.asarray(v, dtype=float) for k, v in (covariates or {}).items()}
    parts: list[NDArray[np.float64]] = []
    generators: list[tuple[str, list[float]]] = []
    for number, effect in enumerate(model.stochastic):
        own = _of_effect(Model(tuple(e for e in model if e not in level)), effect, float(rate))
        if effect.kind == "angle_random_walk" and level:
            white = _kernels.simulate(own, count, seed, 1 + number, axis)
            for change in level:
                v = change.values
                white[(time >= v["start"]) & (time < v["end"])] *= v["factor"]
            parts.append(white)
        else:
            generators += own
    if generators or not parts:
        parts.append(_kernels.simulate(generators, count, seed, 0, axis))
    total = parts[0]
    for part in parts[1:]:
        total += part
    for known in model.deterministic:
        total += known.signal(time, given)
    total.flags.writeable = False  # which spares the recording a copy
    return Recording(total, rate=rate, unit=unit, covariates=given or None)
