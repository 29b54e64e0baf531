"""Missing samples: the record completed under the fitted model, and what that leaves each ordinate to say.

With x the samples that are there, m = E(record | x) and e a draw of what is not known of the rest, m + e is a record of
the model wherever the model is true (conditional simulation, Durbin & Koopman 2002). It is what the views over time and
over τ look at. The fit takes the ordinates of m alone, divided by √(1 − r), r the share of the power of e in the model's:
their variance is again S, whatever is missing, and known functions of time are seen in them with the gain √(1 − r).

A model that another filled the holes for would find itself confirmed (Dempster, Laird & Rubin 1977 climb so, slowly, and
to the maximum that is nearest). So what a model is to expect of m is not its own spectrum but that of its samples through
the same filling: the power in an ordinate is partly that of those it is mixed with by the holes (`mixing.py`).

In the ordinates the model's covariance is diagonal (rust/spectrum.rs), so that m needs no more than cosine transforms: the
missing samples solve Q_mm x_m = −Q_mo x_o, Q = Cᵀ S⁻¹ C, by conjugate gradients (Stroud, Stein & Lysen 2017).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.threads import go_on
from allanite.fit.likelihood.data import LOWEST
from allanite.fit.likelihood.expected import column, density
from allanite.fit.likelihood.peaks import nodes_of
from allanite.fit.likelihood.remembered import Remembered
from allanite.fit.likelihood.stop_band import NOTHING, empty
from allanite.fit.missing.mixing import mixing_of, seen_of
from allanite.fit.missing.shares import CELLS, share_of

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["complete", "settle"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Rounds of completion and fit at most; the fit has settled where its logL would change by less than this.
ROUNDS, SETTLED = 8, 0.02
#: Draws of the unknown part, from which its share in each ordinate is found: of a short record more; samples drawn in all.
DRAWS, FEWEST_DRAWS, DRAWN = 8, 2, 200_000
#: As many missing samples are solved for at once.
FEW = 2048
#: Where the holes change what is seen of every bin by less than this part of its scatter each shows itself alone.
UNNOTICED = 0.01
#: What rounding may take from their matrix, of its diagonal.
ROUNDED = (1e-12, 1e-10, 1e-8)
#: Relative residual at which conjugate gradients stop, and their most steps.
PRECISE, STEPS = 1e-5, 400


def _spectrum(data: Data, model: Model, level: Array | None) -> Array:
    """Expected squared ordinates of the random part, shape (n,); the mean, j = 0, is free."""
    bins = data.bins
    nodes = nodes_of(model, bins, data.rate)
    known = density(data.terms(model), nodes, data.n)
    if level is not None:
        known = known * level[np.searchsorted(bins.edges, nodes, side="right") - 1]
    j = np.maximum(np.arange(data.n, dtype=np.float64), 1.0)
    return np.asarray(np.exp(np.interp(np.log(j), np.log(nodes), np.log(known))))


class _Bridge:
    """Conditional means of missing samples under a spectrum."""

    def __init__(self, missing: Mask, spectrum: Array) -> None:
        self.missing = missing
        self.precision = 1.0 / spectrum
        self.precision[0] = 0.0
        self.steps = 0
        self.exact = _factor(missing, self.precision)
        if self.exact is not None:
            return
        # Inside a gap of L samples nothing slower than 2L samples is seen: there Σ is nearly the inverse of Q.
        change = np.diff(np.concatenate([[0], missing.astype(np.int8), [0]]))
        lengths = (np.flatnonzero(change == -1) - np.flatnonzero(change == 1)).astype(float)
        typical = float((lengths**2).sum() / lengths.sum())
        slow = min(missing.size - 1, int(missing.size / typical))
        self.rough = np.minimum(spectrum, spectrum[max(1, slow)])

    def _apply(self, values: Array, weight: Array) -> Array:
        whole = np.zeros(self.missing.size)
        whole[self.missing] = values
        return self._weighted(whole, weight)

    def _weighted(self, whole: Array, weight: Array) -> Array:
        go_on()
        ordinates = _kernels.cosine_transform(whole)
        ordinates *= weight
        return _kernels.inverse_cosine_transform(ordinates)[self.missing]

    def mean(self, samples: Array) -> Array:
        """Samples with the missing ones replaced by their mean given the others (and what stands there as a start)."""
        residual = -self._weighted(samples, self.precision)
        out = samples.copy()
        if self.exact is not None:
            from scipy.linalg import cho_solve

            out[self.missing] += cho_solve(self.exact, residual)
            return out
        step = np.zeros(residual.size)
        searched = rough = self._apply(residual, self.rough)
        size = first = float(residual @ rough)
        for _ in range(STEPS):
            if size <= PRECISE**2 * first:
                break
            self.steps += 1
            changed = self._apply(searched, self.precision)
            length = size / float(searched @ changed)
            step += length * searched
            residual -= length * changed
            rough = self._apply(residual, self.rough)
            size, before = float(residual @ rough), size
            searched = rough + (size / before) * searched
        out[self.missing] += step
        return out


def _factor(missing: Mask, precision: Array) -> tuple[Array, bool] | None:
    """The Cholesky factor of Q_mm, where few samples are missing.

    Σ_j p_j φ_j(i) φ_j(k) depends on i − k and on i + k + 1.
    """
    from scipy.linalg import LinAlgError, cho_factor

    at = np.flatnonzero(missing)
    if at.size > FEW:
        return None
    n = missing.size
    waves = np.fft.rfft(np.concatenate([precision, [0.0], precision[:0:-1]])).real / (2 * n)

    def of(lag: NDArray[np.int64]) -> Array:
        return np.asarray(waves[np.minimum(lag, 2 * n - lag)])

    matrix = of(np.abs(at[:, None] - at)) + of(at[:, None] + at + 1)
    own = matrix.diagonal().copy()
    for more in (0.0, *ROUNDED):
        # Positive definite, though the precision of the mean is 0: never are all samples missing. But for rounding.
        np.fill_diagonal(matrix, own * (1.0 + more))
        with suppress(LinAlgError):
            return cho_factor(matrix, lower=True)
    return None


def complete(data: Data, model: Model, level: Array | None = None, seed: int = 0) -> Data:
    """The record with its missing samples completed under a model with values.

    Parameters
    ----------
    data : Data
        With `missing`; what stands in the missing samples is replaced.
    model : Model
    level : ndarray, shape (bins,), optional
        By how much the power of each bin probably differs from the model (`Solution.level`), so that what the model lacks
        is not missing from the completed record either.
    seed : int
        Of the draws.

    Returns
    -------
    Data
        Samples with one draw; ordinates, their gain, and bins with their degrees of freedom as the module says.
    """
    missing = data.missing
    assert missing is not None
    spectrum = _spectrum(data, model, level)
    bridge = _Bridge(missing, spectrum)
    signal = data.signal(model.deterministic) if model.deterministic else None
    noise = data.samples if signal is None else data.samples - signal
    mean = bridge.mean(noise)
    rng = np.random.default_rng(seed)
    root = np.sqrt(spectrum)
    root[0] = 0.0
    unseen, seen = np.zeros(data.n), np.zeros(data.n)
    solved = data.n <= CELLS
    draws = 1 if solved else min(DRAWS, max(FEWEST_DRAWS, DRAWN // data.n))
    for _ in range(draws):
        drawn = _kernels.inverse_cosine_transform(root * rng.standard_normal(data.n))
        start = drawn.copy()
        start[missing] = 0.0
        known = bridge.mean(start)
        unknown = drawn - known
        unseen += _kernels.cosine_transform(unknown) ** 2 / draws
        seen += _kernels.cosine_transform(known) ** 2 / draws
    share = share_of(missing, spectrum, None if solved else (unseen, seen), data.bins)
    gain = np.sqrt(1.0 - share)
    ordinates = _kernels.cosine_transform(mean) / gain
    samples = mean + unknown
    if signal is not None:
        ordinates += gain * _kernels.cosine_transform(signal)
        samples += signal
    mixing = mixing_of(missing, share, data.bins)
    # What all bins tell of the power in one is worth Σ (δ − c)² = seen × mixing: bins that show the same share it.
    count = seen_of(share, data.bins) * mixing.diagonal() / (mixing**2).sum(axis=0)
    power = column(data.terms(model), replace(data, mixing=None))
    mixing *= np.outer(power, 1.0 / power)
    number = np.diff(data.bins.edges)
    unknown = 1.0 - seen_of(share, data.bins) / number
    few = bool((unknown * np.sqrt(0.5 * number) < UNNOTICED).all())
    bins = replace(data.bins, count=np.where(empty(data.bins), NOTHING * count, count))
    return replace(
        data,
        samples=samples,
        ordinates=ordinates,
        bins=bins,
        gain=gain,
        mixing=None if few else mixing,
        mixed=Remembered(LOWEST),
    )


def _apart(one: Data, other: Data) -> float:
    """How far two completions of a record are apart: by so much of logL in all bins at most."""
    first, second = (
        np.add.reduceat(data.ordinates**2, data.bins.edges[:-1]) for data in (one, other)
    )
    return 0.5 * float(other.bins.count @ np.log(second / first) ** 2)


def settle(data: Data, model: Model) -> tuple[Data, Solution]:
    """The record completed under the model that is fitted to it, and that fit.

    Parameters
    ----------
    data : Data
        With missing samples bridged.
    model : Model
        As for `solve`.
    """
    from allanite.fit.engine import solve, with_coefficients

    known = all(
        value is not None
        for effect in model
        for name, value in effect.values.items()
        if not effect.parameter(name).optional
    )
    if known and model.stochastic:
        data = complete(data, model)
    solution = solve(data, model)
    # What the model lacks is looked for where the holes are filled by the model alone: filled with what was seen before,
    # every first guess would confirm itself where frequencies are aliased.
    for trusting in (True, False):
        last = np.inf
        theta = solution.theta
        for _ in range(ROUNDS):
            level = None if trusting else solution.level
            before = solution.spectrum if level is None else solution.spectrum * level
            completed = complete(data, with_coefficients(solution.model, theta), level)
            if data.gain is not None and _apart(data, completed) < SETTLED:
                break
            data = completed
            # Shapes without a value are looked for anew: in a bridged record they may be the bridges'.
            solution = solve(data, model if trusting else solution.model)
            after = solution.spectrum if level is None else solution.spectrum * solution.level
            moved = 0.5 * float(data.bins.count @ np.log(after / before) ** 2)
            if moved < SETTLED:
                break
            # Two models that lead to each other: the one between them leads to itself.
            theta = solution.theta if moved < 0.5 * last else 0.5 * (theta + solution.theta)
            last = moved
        if not solution.discrepancy:
            break
    return data, solution
