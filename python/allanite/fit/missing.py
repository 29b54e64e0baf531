"""Missing samples: the record completed under the fitted model, and what that leaves each ordinate to say.

With x the samples that are there, m = E(record | x) and e a draw of what is not known of the rest, m + e is a record of
the model wherever the model is true (conditional simulation, Durbin & Koopman 2002). It is what the views over time and
over τ look at. The fit takes the ordinates of m alone, divided by √(1 − r), r the share of the power of e in the model's:
their variance is again S, whatever is missing, and known functions of time are seen in them with the gain √(1 − r). Its
fixed point is the maximum of the likelihood of the samples that are there (Dempster, Laird & Rubin 1977).

In the ordinates the model's covariance is diagonal (rust/spectrum.rs), so that m needs no more than cosine transforms: the
missing samples solve Q_mm x_m = −Q_mo x_o, Q = Cᵀ S⁻¹ C, by conjugate gradients (Stroud, Stein & Lysen 2017).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.fit.likelihood.data import density

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution
    from allanite.spectrum import Bins

__all__ = ["complete", "covariance_of_scores", "settle"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Rounds of completion and fit at most; the fit has settled where its logL would change by less than this.
ROUNDS, SETTLED = 8, 0.02
#: Draws of the unknown part, from which its share in each ordinate is found.
DRAWS = 2
#: Squared ordinates averaged for that share, at least, and the share of the frequency that they span.
SMOOTH, SPAN = 64, 0.3
#: Relative residual at which conjugate gradients stop, and their most steps.
PRECISE, STEPS = 1e-5, 400
#: Ordinates seen to no more than this share are left out.
LEAST_SEEN = 0.02


def _spectrum(data: Data, model: Model, level: Array | None) -> Array:
    """Expected squared ordinates of the random part, shape (n,); the mean, j = 0, is free."""
    bins = data.bins
    known = density(data.terms(model), bins.nodes, data.n)
    if level is not None:
        known = known * level[bins.owner]
    j = np.maximum(np.arange(data.n, dtype=np.float64), 1.0)
    return np.asarray(np.exp(np.interp(np.log(j), np.log(bins.nodes), np.log(known))))


class _Bridge:
    """Conditional means of missing samples under a spectrum."""

    def __init__(self, missing: Mask, spectrum: Array) -> None:
        self.missing = missing
        self.precision = 1.0 / spectrum
        self.precision[0] = 0.0
        # Inside a gap of L samples nothing slower than 2L samples is seen: there Σ is nearly the inverse of Q.
        change = np.diff(np.concatenate([[0], missing.astype(np.int8), [0]]))
        lengths = (np.flatnonzero(change == -1) - np.flatnonzero(change == 1)).astype(float)
        typical = float((lengths**2).sum() / lengths.sum())
        slow = min(missing.size - 1, int(missing.size / typical))
        self.rough = np.minimum(spectrum, spectrum[max(1, slow)])
        self.steps = 0

    def _apply(self, values: Array, weight: Array) -> Array:
        whole = np.zeros(self.missing.size)
        whole[self.missing] = values
        return self._weighted(whole, weight)

    def _weighted(self, whole: Array, weight: Array) -> Array:
        ordinates = _kernels.cosine_transform(whole)
        ordinates *= weight
        return _kernels.inverse_cosine_transform(ordinates)[self.missing]

    def mean(self, samples: Array) -> Array:
        """Samples with the missing ones replaced by their mean given the others (and what stands there as a start)."""
        residual = -self._weighted(samples, self.precision)
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
        out = samples.copy()
        out[self.missing] += step
        return out


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
    for _ in range(DRAWS):
        drawn = _kernels.inverse_cosine_transform(root * rng.standard_normal(data.n))
        start = drawn.copy()
        start[missing] = 0.0
        known = bridge.mean(start)
        unknown = drawn - known
        unseen += _kernels.cosine_transform(unknown) ** 2 / DRAWS
        seen += _kernels.cosine_transform(known) ** 2 / DRAWS
    share = _share(unseen / spectrum, seen / spectrum, spectrum, int(missing.sum()), data.bins)
    gain = np.sqrt(1.0 - share)
    ordinates = _kernels.cosine_transform(mean) / gain
    samples = mean + unknown
    if signal is not None:
        ordinates += gain * _kernels.cosine_transform(signal)
        samples += signal
    bins = replace(data.bins, count=_freedom(missing, share, data.bins))
    return replace(data, samples=samples, ordinates=ordinates, bins=bins, gain=gain)


def _share(unseen: Array, seen: Array, spectrum: Array, missing: int, bins: Bins) -> Array:
    """The share r of each ordinate that is not known, from the powers of drawn parts that are not and that are.

    Holes like noise of variance v on the samples would leave r = v/(v + S); what they are instead changes slowly over
    frequency. Σ_j r_j = tr(Q_mm⁻¹ Q_mm) is the number of missing samples, whatever the spectrum.
    """
    low, high = spectrum[1:].min() * 1e-6, spectrum[1:].max() * 1e6
    for _ in range(60):
        v = np.sqrt(low * high)
        low, high = (v, high) if (v / (v + spectrum)).sum() < missing else (low, v)
    rough = v / (v + spectrum)
    # Each power scatters by twice its square.
    weight = (1.0 - rough) ** 2 / ((1.0 - rough) ** 2 + rough**2)
    share = rough * _smooth(weight * unseen + (1.0 - weight) * (1.0 - seen), rough, bins)
    share *= missing / share.sum()
    return np.clip(share, 0.0, 1.0 - LEAST_SEEN)


def _smooth(values: Array, rough: Array, bins: Bins) -> Array:
    """Values over rough ones, of wide stretches, spread over the ordinates by straight lines in ln j."""
    first = [1]
    for edge in bins.edges[1:-1].tolist():
        if edge - first[-1] >= max(SMOOTH, SPAN * edge):
            first.append(edge)
    if len(first) > 1 and bins.n - first[-1] < SMOOTH:
        first.pop()
    edges = np.array([*first, bins.n], dtype=np.float64)
    ratio = np.add.reduceat(values, first) / np.add.reduceat(rough, first)
    centres = np.log(np.sqrt(edges[:-1] * (edges[1:] - 1.0)))
    j = np.maximum(np.arange(bins.n, dtype=np.float64), 1.0)
    return np.asarray(np.interp(np.log(j), centres, ratio))


def _coupling(missing: Mask) -> Array:
    """Squared correlation that the holes make between ordinates h apart, over the share of them, h = 0…2n−1.

    The cosine transform of the mask itself: what is missing of white noise is the mask times the noise.
    """
    n = missing.size
    # Σ_k mask_k cos(πh(k+½)/n)/n; beyond n it repeats with the other sign and backwards.
    transform = _kernels.cosine_transform(missing.astype(np.float64)) * np.sqrt(0.5 / n)
    transform[0] = missing.mean()
    return np.asarray(np.concatenate([transform, [0.0], transform[:0:-1]]) ** 2)


def _pairs(missing: Mask, edges: NDArray[np.int64]) -> Array:
    """Σ over ordinates j, i of two bins of their squared correlation by the holes, shape (bins, bins)."""
    squared = _coupling(missing)
    n = missing.size
    # Twice summed, a sum over a rectangle of j − i or of j + i is four values.
    both = np.cumsum(np.cumsum(np.concatenate([squared[n - 1 : 0 : -1], squared])))

    def corner(at: NDArray[np.int64]) -> Array:
        return np.where(at < 0, 0.0, both[np.maximum(at, 0)])

    low, high = edges[:-1], edges[1:]
    offset = n - 1  # `both` begins at j − i = −(n − 1)
    a, b, c, d = low[:, None], high[:, None], low[None], high[None]
    apart = corner(b - c + offset - 1) - corner(a - c + offset - 1)
    apart = apart - corner(b - d + offset - 1) + corner(a - d + offset - 1)
    total = corner(b + d - 2 + offset) - corner(a + d - 2 + offset)
    total = total - corner(b + c - 2 + offset) + corner(a + c - 2 + offset)
    return np.asarray(apart + total)


def _freedom(missing: Mask, share: Array, bins: Bins) -> Array:
    """Degrees of freedom of the bins: as many as their power scatters like."""
    number = np.diff(bins.edges).astype(float)
    inside = _shared(missing, share, bins).diagonal()
    seen = 1.0 - np.add.reduceat(share, bins.edges[:-1]) / number
    return np.minimum((number * seen) ** 2 / inside, number)


def _shared(missing: Mask, share: Array, bins: Bins) -> Array:
    """Σ over ordinates j, i of two bins of (1 − c)², c the correlation of e; its mean in a bin is `share`."""
    number = np.diff(bins.edges).astype(float)
    mean = np.add.reduceat(share, bins.edges[:-1]) / number
    scale = mean / missing.mean()
    out = _pairs(missing, bins.edges) * np.outer(scale, scale)
    least = number * mean**2
    at = np.arange(number.size)
    out[at, at] = number * (1.0 - 2.0 * mean) + np.maximum(out[at, at], least)
    return np.asarray(out)


def covariance_of_scores(data: Data, weight: Array, slopes: Array) -> Array | None:
    """Covariance of the logarithms of fitted numbers where holes make the power of bins depend on each other.

    The estimate solves Σ_b w_b (I_b/S_b − 1) ∂lnS_b/∂φ = 0; I_b scatters, and answers to a change of S, by `_shared`
    (Godambe's sandwich).

    Parameters
    ----------
    data : Data
    weight : ndarray, shape (bins,)
        Effective degrees of freedom.
    slopes : ndarray, shape (bins, p)
        ∂lnS_b/∂φ.

    Returns
    -------
    ndarray, shape (p, p), or None
        None where nothing is missing.
    """
    if data.missing is None or data.gain is None:
        return None
    share = 1.0 - data.gain**2
    number = np.diff(data.bins.edges)
    seen = 1.0 - np.add.reduceat(share, data.bins.edges[:-1]) / number
    rows = slopes * (weight / (number * seen))[:, None]
    shared = _shared(data.missing, share, data.bins)
    answer = np.linalg.pinv(rows.T @ shared @ slopes, rcond=1e-10)
    return np.asarray(2.0 * answer @ (rows.T @ shared @ rows) @ answer.T)


def settle(data: Data, model: Model) -> tuple[Data, Solution]:
    """The record completed under the model that is fitted to it, and that fit.

    Parameters
    ----------
    data : Data
        With missing samples bridged.
    model : Model
        As for `solve`.
    """
    from allanite.fit.engine import solve

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
        for _ in range(ROUNDS):
            level = None if trusting else solution.level
            before = solution.spectrum if level is None else solution.spectrum * level
            data = complete(data, solution.model, level)
            # Shapes without a value are looked for anew: in a bridged record they may be the bridges'.
            solution = solve(data, model if trusting else solution.model)
            after = solution.spectrum if level is None else solution.spectrum * solution.level
            if 0.5 * float(data.bins.count @ np.log(after / before) ** 2) < SETTLED:
                break
        if not solution.discrepancy:
            break
    return data, solution
