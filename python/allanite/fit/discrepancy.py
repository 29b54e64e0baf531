"""The likelihood of a model that is not perfect.

In each bin b the power over what the model expects is e^{ε_b} χ²_n/n with an unknown discrepancy ε_b ~ δ t₂: most bins are
right, a few may be far off. t₂ is a normal of variance δ²w with w inverse-gamma (1, 1); for a given w the bin's power is
close to a gamma variable of the same mean and log-variance 2/n + δ²w, so that the marginal likelihood is a short sum over w.
δ = 0 is the Whittle likelihood. A bin that disagrees keeps the vote of the few degrees of freedom that its w leaves.

(Scale mixtures of normals: Andrews & Mallows 1974; robust likelihood with fitted scale: Lange, Little & Taylor 1989.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief

__all__ = [
    "EVIDENCE",
    "SCALES",
    "Judged",
    "best_scale",
    "better_scale",
    "chance_deviance",
    "judge",
    "judge_many",
    "levels",
    "profile",
    "scale_interval",
]

Array = NDArray[np.float64]

#: A discrepancy is claimed where it raises logL by this much; half of χ²₁ reaches it in 0.7 % of true models, in all others
#: δ is 0 and the fit is the Whittle fit.
EVIDENCE = 3.0
#: Scales tried, 16 a decade: within one step the likelihood falls by less than 0.05.
SCALES = np.geomspace(1e-3, 3.0, 57)
#: Quadrature over w: P(w < x) = e^{−1/x}; 99.999 % of it lies inside.
_EDGES = np.exp(np.linspace(-2.0, 11.5, 15))
_NODES = np.sqrt(_EDGES[1:] * _EDGES[:-1])
_CUMULATED = np.exp(-1.0 / _EDGES)
_CUMULATED[0], _CUMULATED[-1] = 0.0, 1.0
_WEIGHTS = np.diff(_CUMULATED)


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A spectrum judged at one scale of discrepancy.

    Attributes
    ----------
    log_likelihood : float
        Marginal logL, in units of the Whittle likelihood −½ Σ n (ln S + I/S).
    weight : ndarray, shape (bins,)
        Effective degrees of freedom of each bin, at most its count.
    """

    log_likelihood: float
    weight: Array

    __repr__ = brief


@lru_cache(maxsize=64)
def _tables(key: bytes) -> tuple[Array, Array]:
    """Shape k (scales, bins, nodes) of each gamma law, and ln of its weight and norm less the norm at δ = 0."""
    from scipy.special import gammaln

    half = np.frombuffer(key)[:, None] / 2.0
    k = half / (1.0 + half * SCALES[:, None, None] ** 2 * _NODES)
    norm = np.log(_WEIGHTS) + k * np.log(k) - gammaln(k) - (half * np.log(half) - gammaln(half))
    return k, norm


def judge(power: Array, count: Array, spectrum: Array, scale: int | None) -> Judged:
    """Marginal logL of a spectrum at the scale of this index (None: δ = 0)."""
    x = np.log(power / spectrum)
    y = x - np.exp(x)
    plain = 0.5 * float(count @ np.log(power))
    if scale is None:
        return Judged(0.5 * float(count @ y) - plain, count)
    k, norm = _tables(count.tobytes())
    log = k[scale] * y[:, None]
    log += norm[scale]
    top = log.max(axis=1)
    share = np.exp(log - top[:, None])
    total = share.sum(axis=1)
    weight = 2.0 * (share * k[scale]).sum(axis=1) / total
    return Judged(float(np.sum(top + np.log(total))) - plain, weight)


def profile(power: Array, count: Array, spectrum: Array, scales: slice = slice(None)) -> Array:
    """Marginal logL of a spectrum at every scale of a slice, shape (scales,)."""
    return judge_many(power, count, spectrum[None], scales)[:, 0]


def judge_many(power: Array, count: Array, spectra: Array, scales: slice) -> Array:
    """Marginal logL of many spectra, shape (m, bins), at every scale of a slice, shape (scales, m)."""
    x = np.log(power / spectra)
    y = (x - np.exp(x))[:, :, None]
    k, norm = _tables(count.tobytes())
    out = np.empty((k[scales].shape[0], spectra.shape[0]))
    for i, (shape, constant) in enumerate(zip(k[scales], norm[scales], strict=True)):
        log = shape * y + constant
        top = log.max(axis=2)
        log -= top[:, :, None]
        np.exp(log, out=log)
        out[i] = (np.log(log.sum(axis=2)) + top).sum(axis=1)
    return np.asarray(out - 0.5 * float(count @ np.log(power)))


def best_scale(power: Array, count: Array, spectrum: Array) -> tuple[int, float]:
    """The scale at which a spectrum is most likely, and its marginal logL."""
    coarse = 4 * int(np.argmax(profile(power, count, spectrum, slice(None, None, 4))))
    start = judge(power, count, spectrum, coarse)
    scale, best = better_scale(power, count, spectrum, coarse, start)
    return scale, best.log_likelihood


def better_scale(
    power: Array, count: Array, spectrum: Array, scale: int, best: Judged
) -> tuple[int, Judged]:
    """The neighbour of a scale that is better, and so on, and its judgement."""
    for step in (1, -1):
        while 0 <= scale + step < SCALES.size:
            found = judge(power, count, spectrum, scale + step)
            if found.log_likelihood <= best.log_likelihood:
                break
            scale, best = scale + step, found
    return scale, best


def levels(power: Array, count: Array, spectrum: Array, scale: int | None) -> Array:
    """What e^ε probably is in each bin, shape (bins,): 1 where the model is taken for true."""
    if scale is None:
        return np.ones_like(power)
    x = np.log(power / spectrum)
    k, norm = _tables(count.tobytes())
    log = k[scale] * (x - np.exp(x))[:, None] + norm[scale]
    share = np.exp(log - log.max(axis=1)[:, None])
    share /= share.sum(axis=1)[:, None]
    # The share of a bin's distance in ln that its w takes for a discrepancy.
    taken = 1.0 - 2.0 * k[scale] / count[:, None]
    return np.asarray(np.exp((share * taken).sum(axis=1) * x))


def scale_interval(
    power: Array, count: Array, spectrum: Array, scale: int | None
) -> tuple[float, float]:
    """95 % interval of the scale at this spectrum, from its profile likelihood; from 0 where 0 is inside."""
    values = profile(power, count, spectrum)
    plain = judge(power, count, spectrum, None).log_likelihood
    inside = values > max(float(values.max()), plain) - 1.9207
    if not inside.any():
        return 0.0, float(SCALES[0])
    at = SCALES[inside]
    low = 0.0 if scale is None or plain > float(values.max()) - 1.9207 else float(at[0])
    return low, float(at[-1])


def chance_deviance(count: Array) -> float:
    """Expected logL of the saturated model above that of the true one: Σ ½n E[x − 1 − ln x], x ~ χ²_n/n."""
    from scipy.special import digamma

    half = count / 2.0
    return float(half @ (np.log(half) - digamma(half)))
