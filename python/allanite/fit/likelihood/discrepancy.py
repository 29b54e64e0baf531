"""The likelihood of a model that is not perfect.

In each bin b the power over what the model expects is e^{ε_b} χ²_n/n with an unknown discrepancy ε_b ~ δ t₂: most bins are
right, a few may be far off. t₂ is a normal of variance δ²w with w inverse-gamma (1, 1); for a given w the bin's power
is close to a gamma variable of the same mean and log-variance 2/n + δ²w, so that the marginal likelihood is a short sum
over w.
δ = 0 is the Whittle likelihood. A bin that disagrees keeps the vote of the few degrees of freedom that its w leaves.

Computed by the core (`_kernels.Likelihood`), with 14 nodes in w.

(Scale mixtures of normals: Andrews & Mallows 1974; robust likelihood with fitted scale: Lange, Little & Taylor 1989.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.showing import brief
from allanite.common.threads import go_on
from allanite.spectrum.spectrum import cells_of

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
    "likelihood",
    "linearised",
    "profile",
    "scale_interval",
]

Array = NDArray[np.float64]

#: A discrepancy is claimed where it raises logL by this much; half of χ²₁ reaches it in 0.7 % of true models, in all others
#: δ is 0 and the fit is the Whittle fit.
EVIDENCE = 3.0
#: Scales tried, 16 a decade: within one step the likelihood falls by less than 0.05.
SCALES = np.geomspace(1e-3, 3.0, 57)
#: ½·3.841, half of the 95 % point of χ²₁: a profile likelihood falls by so much at the ends of its interval.
HALF_CHI2 = 1.9207


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
def _of_bytes(count: bytes, cells: bool) -> _kernels.Likelihood:
    counts = np.frombuffer(count)
    return _kernels.Likelihood(
        counts, SCALES, [*range(counts.size)] if cells else cells_of(counts.size)
    )


def likelihood(count: Array, *, cells: bool = False) -> _kernels.Likelihood:
    """The law of bins, or of cells, with these degrees of freedom; its tables are kept for the next call."""
    go_on()  # every climb asks here, again and again
    return _of_bytes(count.tobytes(), cells)


def judge(power: Array, count: Array, spectrum: Array, scale: int | None) -> Judged:
    """Marginal logL of a spectrum at the scale of this index (None: δ = 0)."""
    return Judged(*likelihood(count).judge(power, spectrum, scale))


def profile(power: Array, count: Array, spectrum: Array, scales: slice = slice(None)) -> Array:
    """Marginal logL of a spectrum at every scale of a slice, shape (scales,)."""
    return judge_many(power, count, spectrum[None], scales)[:, 0]


def judge_many(power: Array, count: Array, spectra: Array, scales: slice) -> Array:
    """Marginal logL of many spectra, shape (m, bins), at every scale of a slice, shape (scales, m)."""
    return likelihood(count).profile(power, spectra, range(SCALES.size)[scales])


def best_scale(power: Array, count: Array, spectrum: Array) -> tuple[int, float]:
    """The scale at which a spectrum is most likely, and its marginal logL."""
    return likelihood(count).best_scale(power, spectrum)[:2]


def better_scale(
    power: Array, count: Array, spectrum: Array, scale: int, best: Judged
) -> tuple[int, Judged]:
    """The neighbour of a scale that is better, and so on, and its judgement."""
    found, value, weight = likelihood(count).best_scale(power, spectrum, scale)
    return (scale, best) if found == scale else (found, Judged(value, weight))


def levels(power: Array, count: Array, spectrum: Array, scale: int | None) -> Array:
    """What e^ε probably is in each bin, shape (bins,): 1 where the model is taken for true."""
    if scale is None:
        return np.ones_like(power)
    # The share of a bin's distance in ln that its w takes for a discrepancy.
    first = cells_of(count.size)
    total = np.add.reduceat(count, first)
    taken = 1.0 - np.add.reduceat(judge(power, count, spectrum, scale).weight, first) / total
    mean = np.add.reduceat(count * power / spectrum, first) / total
    return np.repeat(mean**taken, np.diff([*first, count.size]))


def linearised(
    slopes: Array, power: Array, count: Array, spectrum: Array, weight: Array
) -> tuple[Array, Array]:
    """Least-squares rows for a change of ln S, slopes · x, and the residual that it is to meet.

    Parameters
    ----------
    slopes : ndarray, shape (bins, p)
        ∂ln S/∂x.
    power, count, spectrum, weight : ndarray, shape (bins,)
        Weights as `judge` returns them.

    Returns
    -------
    tuple of ndarray, shapes (rows, p) and (rows,)
        Bins against the mean of their cell with all their degrees of freedom, then the mean of each cell with those
        that the discrepancy leaves it. Half of rowsᵀ·rows is the Fisher information, half of rowsᵀ·residual the gradient.
    """
    first = cells_of(count.size)
    sizes = np.diff([*first, count.size])
    total, left = np.add.reduceat(count, first), np.add.reduceat(weight, first)
    ratio = power / spectrum
    mean = np.add.reduceat(count * ratio, first) / total
    middle = np.add.reduceat(count[:, None] * slopes, first, axis=0) / total[:, None]
    steep = 1.0 + left / total * (mean - 1.0)
    root = np.sqrt(count)
    inside = (slopes - np.repeat(middle, sizes, axis=0)) * root[:, None]
    residual = np.repeat(steep, sizes) * (ratio / np.repeat(mean, sizes) - 1.0) * root
    rows = np.vstack([inside, middle * np.sqrt(left)[:, None]])
    return rows, np.concatenate([residual, (mean - 1.0) * np.sqrt(left)])


def scale_interval(
    power: Array, count: Array, spectrum: Array, scale: int | None
) -> tuple[float, float]:
    """95 % interval of the scale at this spectrum, from its profile likelihood; from 0 where 0 is inside."""
    values = profile(power, count, spectrum)
    plain = judge(power, count, spectrum, None).log_likelihood
    inside = values > max(float(values.max()), plain) - HALF_CHI2
    if not inside.any():
        return 0.0, float(SCALES[0])
    at = SCALES[inside]
    low = 0.0 if scale is None or plain > float(values.max()) - HALF_CHI2 else float(at[0])
    return low, float(at[-1])


def chance_deviance(count: Array) -> float:
    """Expected logL of the saturated model above that of the true one: Σ ½n E[x − 1 − ln x], x ~ χ²_n/n."""
    from scipy.special import digamma

    half = count / 2.0
    return float(half @ (np.log(half) - digamma(half)))
