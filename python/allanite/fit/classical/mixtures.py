"""Expected Allan variances, and their covariance, of any mixture of given effects.

The covariance of the estimates is a quadratic form of the squared coefficients, because that of the differences is
linear in them: C(θ) = Σ_ab θ_a θ_b C_ab. Its p(p+1)/2 parts are found once, by polarisation; after that a mixture
costs a sum of small matrices, and least squares can look at hundreds of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.effects.terms import Term

    Array = NDArray[np.float64]

__all__ = ["Mixtures", "plain"]

#: Ordinates taken one by one; above, so many for each factor of e.
SINGLE, PER_E = 512, 400


def plain(terms: Sequence[Term], factor: float = 1.0) -> list[tuple[str, list[float]]]:
    """Terms as the core takes them, their variances times `factor`."""
    return [t.scaled(factor).kernel for t in terms]


@dataclass(frozen=True, slots=True, eq=False)
class Mixtures:
    """What any sum of p effects leads to at k averaging factors.

    Attributes
    ----------
    columns : ndarray, shape (k, p)
        Expected Allan variance of each effect at coefficient 1.
    parts : ndarray, shape (p, p, k, k)
        C_ab, symmetric in a and b.
    transfer : ndarray, shape (f, k)
        Share of the variance at a sample of the cosine frequencies in each Allan variance.
    spectra : ndarray, shape (f, p)
        Spectrum of each effect at coefficient 1 there.
    weights : ndarray, shape (f,)
        Ordinates that each sampled frequency stands for.
    """

    columns: Array
    parts: Array
    transfer: Array
    spectra: Array
    weights: Array

    @classmethod
    def of(
        cls,
        unit_terms: Sequence[Sequence[Term]],
        n: int,
        factors: NDArray[np.int64],
        around: Array,
    ) -> Mixtures:
        """Parts for effects at coefficient 1; `around`, shape (k,), is the size of the variances to be explained.

        Effects are added in the proportions in which each alone reaches `around`, so that no part drowns.
        """
        p = len(unit_terms)
        columns = np.column_stack(
            [_kernels.allan_variances(plain(t), n, factors)[0] for t in unit_terms]
        )
        scale = (around[:, None] / columns).min(axis=0)
        parts = np.empty((p, p, factors.size, factors.size))
        for a in range(p):
            mine = plain(unit_terms[a], float(scale[a]))
            parts[a, a] = _kernels.allan_covariance(mine, n, factors)[1]
            for b in range(a):
                other = plain(unit_terms[b], float(scale[b]))
                both = _kernels.allan_covariance(mine + other, n, factors)[1]
                parts[a, b] = parts[b, a] = (both - parts[a, a] - parts[b, b]) / 2.0
        parts /= np.multiply.outer(scale, scale)[:, :, None, None]
        # Every ordinate at the slow end, then a sample of them: transfer functions are smooth on average.
        last = n - 1
        j = np.arange(1, min(SINGLE, last) + 1, dtype=np.float64)
        weights = np.ones(j.size)
        if last > SINGLE:
            edges = np.unique(
                np.round(
                    np.geomspace(SINGLE + 0.5, last + 0.5, int(PER_E * np.log(last / SINGLE)) + 2)
                )
            )
            weights = np.concatenate([weights, np.diff(edges)])
            j = np.concatenate([j, (edges[1:] + edges[:-1]) / 2.0])
        w = np.pi * j / n
        transfer = (
            2.0
            * np.sin(np.multiply.outer(w / 2.0, factors)) ** 4
            / (np.sin(w / 2.0)[:, None] * factors) ** 2
            / n
        )
        spectra = np.column_stack(
            [np.sum([t.spectrum(w) for t in terms], axis=0) for terms in unit_terms]
        )
        return cls(columns, parts, transfer, spectra, weights)

    def covariance(self, squares: Array) -> Array:
        """Of the estimates, shape (k, k), where the squared coefficients are `squares`, shape (p,)."""
        return np.asarray(np.einsum("a,b,abij->ij", squares, squares, self.parts))

    def skewness(self, squares: Array, readout: Array) -> float:
        """Of the sum of estimates weighted by `readout`, shape (k,).

        A sum of squares of the ordinates, which are nearly independent: κ3/κ2^{3/2} with κ_q ∝ Σ (S H)^q.
        """
        x = (self.spectra @ squares) * (self.transfer @ readout)
        second = float(self.weights @ x**2)
        return float(np.sqrt(8.0) * (self.weights @ x**3) / second**1.5) if second > 0 else 0.0
