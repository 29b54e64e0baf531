"""Expected Allan variances and their covariance for any mixture of given effects.

The covariance of the estimates is a quadratic form of the squared coefficients, C(θ) = Σ_ab θ_a θ_b C_ab, because the
covariance of the differences is linear in them. The p(p+1)/2 parts are computed once, by polarization. A mixture then
costs only a sum of small matrices, so that least squares can try hundreds of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.effects.terms import Term


#: Number of lowest ordinates that are used one by one. Chosen by judgment; not measured.
SINGLE_ORDINATES = 512
#: Number of sampled frequencies per factor e of frequency above these ordinates. Chosen by judgment; not measured.
FREQUENCIES_PER_E = 400


def kernel_terms(terms: Sequence[Term], factor: float = 1.0) -> list[tuple[str, list[float]]]:
    """List of (name, parameters) of spectral terms for the compiled core, with variances multiplied by `factor`."""
    return [t.scaled(factor).kernel for t in terms]


@dataclass(frozen=True, slots=True, eq=False)
class Mixtures:
    """Expected Allan variances and covariances at k averaging factors for any mixture of p effects.

    Attributes
    ----------
    columns : ndarray, shape (k, p)
        Expected Allan variance of each effect at coefficient 1.
    parts : ndarray, shape (p, p, k, k)
        Parts C_ab of the covariance, symmetric in a and b.
    transfer : ndarray, shape (f, k)
        Weight of the power at each sampled frequency in each Allan variance.
    spectra : ndarray, shape (f, p)
        Spectrum of each effect at coefficient 1 at the sampled frequencies.
    weights : ndarray, shape (f,)
        Number of ordinates that each sampled frequency represents.
    """

    columns: Array
    parts: Array
    transfer: Array
    spectra: Array
    weights: Array

    @classmethod
    def of(
        cls, unit_terms: Sequence[Sequence[Term]], n: int, factors: NDArray[np.int64], around: Array
    ) -> Mixtures:
        """`Mixtures`: expected Allan variances and covariances of p effects at the averaging `factors`, for n samples.

        `unit_terms` are the spectral terms of each effect at coefficient 1. `around`, shape (k,), holds the measured
        variances. Each effect is scaled so that it alone reaches one of them, because small parts of the covariance
        would otherwise be lost in rounding.
        """
        p = len(unit_terms)
        columns = np.column_stack(
            [_kernels.allan_variances(kernel_terms(t), n, factors)[0] for t in unit_terms]
        )
        scale = (around[:, None] / columns).min(axis=0)
        parts = np.empty((p, p, factors.size, factors.size))
        for a in range(p):
            mine = kernel_terms(unit_terms[a], float(scale[a]))
            parts[a, a] = _kernels.allan_covariance(mine, n, factors)[1]
            for b in range(a):
                other = kernel_terms(unit_terms[b], float(scale[b]))
                both = _kernels.allan_covariance(mine + other, n, factors)[1]
                parts[a, b] = parts[b, a] = (both - parts[a, a] - parts[b, b]) / 2.0
        parts /= np.multiply.outer(scale, scale)[:, :, None, None]
        # All ordinates at the slow end, then a sample of them, since transfer functions are smooth on average.
        last = n - 1
        j = np.arange(1, min(SINGLE_ORDINATES, last) + 1, dtype=np.float64)
        weights = np.ones(j.size)
        if last > SINGLE_ORDINATES:
            count = int(FREQUENCIES_PER_E * np.log(last / SINGLE_ORDINATES)) + 2
            edges = np.geomspace(SINGLE_ORDINATES + 0.5, last + 0.5, count)
            edges = np.unique(np.round(edges))
            weights = np.concatenate([weights, np.diff(edges)])
            j = np.concatenate([j, (edges[1:] + edges[:-1]) / 2.0])
        w = np.pi * j / n
        one, mean = np.sin(w / 2.0)[:, None], np.sin(np.multiply.outer(w / 2.0, factors))
        transfer = 2.0 * mean**4 / (one * factors) ** 2 / n
        spectra = np.column_stack(
            [np.sum([t.spectrum(w) for t in terms], axis=0) for terms in unit_terms]
        )
        return cls(columns, parts, transfer, spectra, weights)

    def covariance(self, squares: Array) -> Array:
        """Array of the covariance of estimated Allan variances, shape (k, k), for squared coefficients of shape (p,)."""
        return np.asarray(np.einsum("a,b,abij->ij", squares, squares, self.parts))

    def skewness(self, squares: Array, readout: Array) -> float:
        """Skewness of a weighted sum of estimated Allan variances; 0 if the sum has no variance.

        `squares` are the squared coefficients, `readout` the weights of the Allan variances, shape (k,). The sum is a
        weighted sum of squares of nearly independent ordinates: κ3/κ2^{3/2} with κ_q ∝ Σ (S H)^q.
        """
        x = (self.spectra @ squares) * (self.transfer @ readout)
        second = float(self.weights @ x**2)
        return float(np.sqrt(8.0) * (self.weights @ x**3) / second**1.5) if second > 0 else 0.0
