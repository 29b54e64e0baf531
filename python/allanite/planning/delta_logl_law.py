"""Distribution of ΔlogL of a true effect, and the ΔlogL that a check requires in view of all its searches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.effects import Deterministic, Modifier
from allanite.fit.likelihood.expected import Noise
from allanite.fit.rivals.line_trials import trials_at
from allanite.fit.shapes.matched import grid_points, matched_gains, slow_families
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY, LEVEL_CELLS
from allanite.suggestion.p_values import Family, arc_length, interval_trials, log_p_value
from allanite.suggestion.screens.spectral import directions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects import Effect, Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: ΔlogL, nats, at which the number of independent intervals of time is evaluated: that of a weak significant level change.
TYPICAL_DELTA_LOGL = 11.0


@dataclass(frozen=True, slots=True, eq=False)
class DeltaLoglLaw:
    """Probability distribution of ΔlogL when the true effect is added to the model; bins are independent.

    Let S be the true power, S₀ the power that the model without the effect fits to S, and s² the squared ordinates of a
    known function. With I = (s + √S ε)², ΔlogL at these spectra is T = ½ Σ [ln(S₀/S) + I/S₀ − ε²], a sum of non-central χ²
    variates. In a fit, S₀ follows the record. Let U be the score of its coefficients, V the covariance of U, and J the
    curvature of logL. The fit without the effect gains ½ Uᵀ J⁻¹ U. The fit with the effect gains ½ Uᵀ V⁻¹ U, and ½χ² for
    the parameters that the effect adds (White 1982, Econometrica 50, 1). For the variance of the sum, T is split into its
    projection on U and the remainder. Known functions of time in both models remove the ordinates along them from both
    fits. If the effect has most of its power there, these functions absorb it.

    In each bin, `count` is the number of ordinates, `ratio` S/S₀, and `signal` Σ s²/S₀. `slopes`, shape (bins, p), are the
    derivatives of ln S₀ with respect to its free coefficients. `added` is the number of parameters that the effect adds.
    `taken` are the ordinates of each bin that known functions absorb.
    """

    count: Array
    ratio: Array
    signal: Array
    slopes: Array
    added: int
    taken: Array | None = None

    @property
    def _free_ordinates(self) -> Array:
        """Array, shape (bins,): degrees of freedom of each bin minus those that fitted functions use up, at least 0."""
        return self.count if self.taken is None else np.maximum(self.count - self.taken, 0.0)

    @property
    def asimov_delta_logl(self) -> float:
        """ΔlogL, nats, on the expected record, in which every bin has its expected power: half the non-centrality."""
        a = self.ratio - 1.0
        gain = self._free_ordinates @ a - self.count @ np.log1p(a)
        return float(0.5 * (gain + self.signal.sum()))

    @property
    def mean(self) -> float:
        """Expected ΔlogL, nats."""
        _, gain, _ = self._projection()
        return self.asimov_delta_logl + 0.5 * self.added - 0.5 * float(np.trace(gain))

    @property
    def spread(self) -> float:
        """Standard deviation of ΔlogL from record to record, nats."""
        weights, gain, unit = self._projection()
        # Coefficients of ε², and of ε times the signal, in T after its projection on U is removed.
        along = unit @ weights
        squares = self.ratio - 1.0 - self.ratio * along
        linear = self.signal * self.ratio * (1.0 - along) ** 2
        variance = 0.5 * self._free_ordinates @ squares**2 + linear.sum() + 0.5 * self.added
        return float(np.sqrt(variance + weights @ weights + 0.5 * (gain**2).sum()))

    def _projection(self) -> tuple[Array, Array, Array]:
        """Tuple of three arrays for the correction of ΔlogL for the p parameters that the model fits anyway.

        * Covariance of T and U, shape (p,).
        * J⁻¹ − 1, shape (p, p).
        * Derivatives of ln(power without the effect) by the parameters, shape (bins, p).

        The parameters are combined so that the covariance of U is the unit matrix.
        """
        none = np.zeros((0, 0))
        if self.slopes.shape[1] == 0:
            return np.zeros(0), none, np.zeros((self.count.size, 0))
        n, ratio, a = self._free_ordinates, self.ratio, self.ratio - 1.0
        # Variance of Σ I/S₀ in a bin: 2 n ratio² + 4 ratio Σ s²/S₀.
        noise = 0.25 * (2.0 * n * ratio**2 + 4.0 * ratio * self.signal)
        score = self.slopes.T @ (self.slopes * noise[:, None])
        values, vectors = np.linalg.eigh(score)
        keep = values > 1e-12 * values.max()
        whiten = vectors[:, keep] / np.sqrt(values[keep])
        unit = self.slopes @ whiten
        curvature = unit.T @ (unit * (n * (ratio - 0.5) + self.signal)[:, None])
        # T varies with ε² as a and with ε as s√S/S₀, the score as ratio and the same.
        shared = 0.25 * (2.0 * n * ratio * a + 4.0 * ratio * self.signal)
        weights = unit.T @ shared
        gain = np.linalg.pinv(curvature, hermitian=True) - np.eye(unit.shape[1])
        return weights, gain, unit

    def exceedance_probability(self, x: float) -> float:
        """Probability that ΔlogL exceeds `x` nats, from a gamma distribution with the `mean` and `spread` of this law.

        The gamma distribution is exact for an absent effect (half of a χ²) and nearly normal for a strong effect.
        """
        from scipy.special import gammaincc

        scale = self.spread**2 / self.mean if self.mean > 0.0 else 1.0
        return float(gammaincc(max(self.mean, 1e-9) / scale, x / scale))


def needed_delta_logl(family: Family, families: int) -> float:
    """Smallest significant ΔlogL (nats) of an effect of this family, which shares the false alarms with all `families`."""
    target = np.log(FALSE_ALARM_PROBABILITY / families)
    low, high = 0.5, 50.0
    while log_p_value(family, high) > target:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if log_p_value(family, middle) > target:
            low = middle
        else:
            high = middle
    return high


def family_of(
    base: Model, effect: Effect, null: Solution, data: Data, grid: Data
) -> tuple[Family, int]:
    """Tuple (family of searches in which `check` looks for the effect, number of families that share the false alarms).

    The family is that of a slow function, a line, a change of level, or else a shape of the spectrum. `null` is the random
    part of `base`, the model without the effect, fitted to the expected record.
    """
    arcs: dict[str, list[float]] = {"spectral": []}
    for cls, _, unit in directions(null, data):
        arcs.setdefault(cls.family, []).append(arc_length(unit))
    slow = slow_families(base, grid.covariates)
    # Lines, levels, disturbances and outliers are searched in every record.
    families = len(arcs) + len(slow) + 4
    if isinstance(effect, Deterministic) and effect.low:
        return Family(
            effect.family, _arc_lengths(slow.get(effect.family, ()), null, grid), 2
        ), families
    if effect.periodic:
        cycles = np.array([effect.values["frequency"] * data.duration])
        return Family("line", width=float(trials_at(cycles, data.n, data.rate)[0])), families
    if isinstance(effect, Modifier) and effect.changes_level:
        start, end = effect.when or data.span
        length = (end - start) / data.duration
        octave = 2 ** int(np.log2(np.clip(length * LEVEL_CELLS, 1.0, LEVEL_CELLS / 2)))
        return Family(
            "level",
            (0.0,),
            sides=2 * round(interval_trials(LEVEL_CELLS, octave, TYPICAL_DELTA_LOGL)),
        ), families
    return Family(effect.family, tuple(arcs.get(effect.family, ()))), families


def _arc_lengths(kinds: Sequence[Deterministic], null: Solution, grid: Data) -> tuple[float, ...]:
    """Tuple of angles, rad, one for each known function: how far its direction turns over its grid of shape values.

    The direction is the unit vector of the function's whitened cosine transform. The angle measures the number of
    independent trials.
    """
    out = []
    for blank in kinds:
        nothing = np.zeros(grid.n)
        noise = Noise(grid.terms(null.model), grid.bins, np.ones(grid.bins.count.size))
        _, unit = matched_gains(
            grid_points(blank, grid.n, grid.rate), nothing, noise, grid, null.model.deterministic
        )
        out.append(arc_length(unit))
    return tuple(out)
