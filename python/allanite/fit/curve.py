"""Measured and modeled Allan deviation: errors, normal scores and confidence bands."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.aligned import align_when_unpickled
from allanite.common.arrays import Array
from allanite.common.showing import brief
from allanite.effects import Model, Modifier
from allanite.fit.bands import bands, degrees_of_freedom, expected_variance
from allanite.fit.likelihood.changing_power import mean_squared_level
from allanite.fit.likelihood.whittle import normal_scores

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data

#: Minimum equivalent degrees of freedom of a deviation that counts in the Allan error. Below, the measured deviation has a
#: standard error above 1/√(2·10) = 22 %.
MIN_EDF = 10.0
#: Minimum |z| at which the Allan curve contradicts the model. The largest |z| of a true model exceeds it in about 0.2 % of
#: records, since neighboring τ share most samples.
MIN_FAILING_SCORE = 4.0
#: Maximum Allan error, in expected scatters, of a model that the Allan curve does not contradict. None of 2000 fits of the
#: true models N, N+B, N+K and N+B+K exceeds it (benches/claims/allan_scatter.py --records 500). Neighboring τ may all miss
#: a model by less than `MIN_FAILING_SCORE`.
MAX_ADEQUATE_ERROR_SCATTERS = 3.0


@align_when_unpickled
@dataclass(frozen=True, eq=False)
class Curve:
    """Measured and modeled overlapping Allan deviation, U, on one grid of averaging times, shape (k,).

    `factors` are averaging times in samples. `low` and `high` are the 95 % band of the measured deviation if the model is
    true. `edf` are equivalent degrees of freedom under the model, and `z` standard normal scores. `of` are the data and the
    model.
    """

    tau: Array
    factors: NDArray[np.int64]
    measured: Array
    model: Array
    low: Array
    high: Array
    edf: Array
    z: Array
    of: tuple[Data, Model] = field(repr=False)

    __repr__ = brief

    @cached_property
    def components(self) -> dict[str, Array]:
        """Dict from the kind of each effect to the Allan deviation of this effect alone, U, shape (k,)."""
        return components_at(*self.of, self.factors)

    @property
    def ratio(self) -> Array:
        """Array of the measured Allan deviation divided by that of the model, shape (k,)."""
        return self.measured / self.model

    @property
    def is_counted(self) -> NDArray[np.bool_]:
        """Mask of the τ that count in the Allan error: edf ≥ 10 and a measured deviation above 0; shape (k,)."""
        return np.asarray((self.edf >= MIN_EDF) & (self.measured > 0.0))

    @property
    def rms_percent(self) -> float | None:
        """Geometric rms error of the model, 100·(e^{rms of ln(model/measured)} − 1) %, over τ with edf ≥ 10, or None."""
        apart = self._log_ratio()
        return None if apart.size == 0 else float(100.0 * np.expm1(np.sqrt(np.mean(apart**2))))

    @property
    def expected_scatter_percent(self) -> float | None:
        """Expectation of `rms_percent` if the model is true (measurement scatter), %; None without τ with edf ≥ 10."""
        keep = self.is_counted
        if not keep.any():
            return None
        return float(100.0 * np.expm1(np.sqrt(np.mean(0.5 / self.edf[keep]))))

    @property
    def contradicts_model(self) -> bool:
        """True if a single deviation, or the Allan error over all τ, differs significantly from the model.

        The false-alarm probability is about 0.2 %.
        """
        if float(np.nanmax(np.abs(self.z))) >= MIN_FAILING_SCORE:
            return True
        error, scatter = self.rms_percent or 0.0, self.expected_scatter_percent or 0.0
        return error > MAX_ADEQUATE_ERROR_SCATTERS * scatter

    def error_increase(self, before: Curve, ignored_scores: float) -> float:
        """Mean square of ln(model/measured) of this curve minus that of the curve `before`, over τ with edf ≥ 10.

        0.0 without such τ. A τ contributes 0 if |ln(model/measured)| changes there by at most `ignored_scores` standard
        deviations of the measurement. A rise contributes 0, too, if the error of `before` was larger at another τ, in
        standard deviations: a missing effect also hides errors of the present ones.
        """
        keep = self.is_counted & before.is_counted
        if not keep.any():
            return 0.0
        new, old = (np.abs(np.log(c.model[keep] / c.measured[keep])) for c in (self, before))
        scatter = np.sqrt(0.5 / self.edf[keep])
        moved = np.abs(new - old) > ignored_scores * scatter
        moved &= (new < old) | (new / scatter > (old / scatter).max())
        return float(np.mean(np.where(moved, new**2 - old**2, 0.0)))

    @property
    def worst(self) -> tuple[float, float] | None:
        """Pair (model/measured, τ in s) with the ratio furthest from 1, among τ with edf ≥ 10; None without such τ."""
        apart = self._log_ratio()
        if apart.size == 0:
            return None
        top = int(np.argmax(np.abs(apart)))
        return float(np.exp(apart[top])), float(self.tau[self.is_counted][top])

    def _log_ratio(self) -> Array:
        """Array of ln(model/measured), both Allan deviations, at the τ with edf ≥ 10 and a measured deviation above 0."""
        keep = self.is_counted
        return np.asarray(np.log(self.model[keep] / self.measured[keep]))


@dataclass(frozen=True, slots=True, eq=False)
class DeviationBand:
    """95 % band of the measured deviation, U, at τ, s, if a model is true; all arrays have shape (k,).

    `low` and `high` are for each τ separately, `low_everywhere` and `high_everywhere` for all τ together. `inside` says
    that the measured curve stays within the latter.
    """

    tau: Array
    low: Array
    high: Array
    low_everywhere: Array
    high_everywhere: Array
    edf: Array
    inside: bool

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: ``level`` (0.95), ``inside``, and ``points``, a list with one dict for each τ."""
        names = ("low", "high", "low_everywhere", "high_everywhere", "edf")
        points = [
            {"tau_s": float(t), **{name: float(getattr(self, name)[k]) for name in names}}
            for k, t in enumerate(self.tau)
        ]
        return {"level": 0.95, "inside": self.inside, "points": points}


def deviation_band(data: Data, model: Model, curve: Curve) -> DeviationBand:
    """`DeviationBand`: pointwise and simultaneous 95 % band of a measured curve under a model with values.

    The band uses the exact distribution of the random part (`fit.bands`), plus the curve of known functions of time.
    """
    terms = data.terms(model)
    noise = expected_variance(terms, curve.factors)
    known = np.maximum(curve.model**2 - noise, 0.0)
    found = bands(terms, data.n, curve.factors)

    def at(factor: Array) -> Array:
        """Modeled deviation at each τ, if the variance of the random part alone is divided by `factor`²."""
        return np.asarray(np.sqrt(known + noise / factor**2))

    low, high = at(found.high_everywhere), at(found.low_everywhere)
    inside = bool(np.all((low <= curve.measured) & (curve.measured <= high)))
    return DeviationBand(
        curve.tau, at(found.high_factor), at(found.low_factor), low, high, found.edf, inside
    )


def compare_curves(data: Data, model: Model) -> Curve:
    """`Curve`: overlapping Allan deviation of the record and of a model with values, with 95 % limits and z scores.

    Missing samples of the record are filled (`data.samples`). Deterministic effects contribute the Allan variance of their
    signal to the model.
    """
    from scipy.special import chdtri

    factors = data.factors()
    # The same for all models of a search.
    measured = data.of_bins.get("measured deviation", lambda: data.deviation(factors))
    terms = data.terms(model)
    noise = expected_variance(terms, factors)
    total, residual = noise, measured**2
    if model.deterministic:
        whole = data.signal(model.deterministic)
        total = noise + data.deviation_of(whole, factors) ** 2
        residual = data.deviation(factors, whole) ** 2
    edf = np.maximum(degrees_of_freedom(terms, data.n, factors), 1.0)
    if any(e.changes_level for e in model.modifiers) and model.white is not None:
        # Loud segments dominate, so that fewer samples determine the deviation.
        white = Model(tuple(e for e in model if e is model.white or isinstance(e, Modifier)))
        share = expected_variance(data.terms(white), factors) / noise
        edf = np.maximum(edf / (1.0 + share**2 * (mean_squared_level(model, data) - 1.0)), 1.0)
    z = normal_scores(residual, edf, noise)
    spread_low = np.sqrt(chdtri(edf, 0.975) / edf)
    spread_high = np.sqrt(chdtri(edf, 0.025) / edf)
    deviation = np.sqrt(total)
    return Curve(
        factors / data.rate,
        factors,
        measured,
        deviation,
        deviation * spread_low,
        deviation * spread_high,
        edf,
        z,
        (data, model),
    )


def components_at(data: Data, model: Model, factors: NDArray[np.int64]) -> dict[str, Array]:
    """Dict from kind to the Allan deviation of that effect alone, U, shape (k,); random effects first.

    Further effects of a kind have numbered names, such as ``resonance 2``; the number is the index among the random (or the
    deterministic) effects.
    """
    out: dict[str, Array] = {}
    for i, effect in enumerate(model.stochastic):
        size = (getattr(effect, effect.coefficient) or 0.0) ** 2
        own = tuple(t.scaled(size) for t in data.unit_terms(model, effect))
        name = effect.kind if effect.kind not in out else f"{effect.kind} {i}"
        out[name] = np.sqrt(expected_variance(own, factors))
    for i, known in enumerate(model.deterministic):
        name = known.kind if known.kind not in out else f"{known.kind} {i}"
        out[name] = data.deviation_of(known.signal(data.time, data.covariates), factors)
    return out
