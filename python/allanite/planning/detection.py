"""What a record of given length and rate will tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.common.validation import positive, positive_rate
from allanite.effects import (
    CATALOGUE,
    Deterministic,
    Effect,
    Model,
    Modifier,
    Periodic,
    Stochastic,
    as_model,
    parse_model,
)
from allanite.planning import expected as _expected
from allanite.planning.chance import Rise, needed
from allanite.planning.errors import standard_errors
from allanite.planning.trials import family_of

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution
    from allanite.planning.expected import Array, Columns

__all__ = ["Power", "detection_power"]


@dataclass(frozen=True, slots=True, eq=False)
class Power:
    """What a record will tell of an effect and of the numbers of its model.

    Attributes
    ----------
    model : Model
        The truth: the model and, if one was asked for, the effect.
    effect : Effect or None
        The effect that `check` is to find, not in the model that is fitted first.
    duration, rate : float
        s, Hz.
    delta_log_likelihood : float or None
        Expected rise of logL when the effect is added (mean over records).
    spread : float or None
        Standard deviation of that rise from record to record.
    needed : float or None
        The rise that `check` calls significant after the corrections for all that it tries.
    probability : float or None
        Probability that `check` names the effect as significant.
    standard_errors : mapping of str to float
        Standard error of each number when the whole model is fitted, by ``N``, ``GM.q_c``, in its own unit.

    Examples
    --------
    >>> found = al.detection_power("N(N=0.01)+K(K=1e-4)", duration=3600, rate=10)
    >>> found.value("N"), bool(found.relative("N") < 0.01), found.to_dict()["schema"]
    (0.01, True, 'allanite/power/1')
    """

    model: Model
    effect: Effect | None
    duration: float
    rate: float
    delta_log_likelihood: float | None
    spread: float | None
    needed: float | None
    probability: float | None
    standard_errors: Mapping[str, float]

    def value(self, name: str) -> float:
        """The true value of the number `name`, one of those in `standard_errors`.

        Raises
        ------
        InputError
            The model has no such number.
        """
        from allanite.planning.errors import labels

        label, _, parameter = name.partition(".")
        for found, effect in zip(labels(self.model), self.model, strict=True):
            if (
                found == label
                and (parameter or label) in effect.values
                and name in self.standard_errors
            ):
                return float(effect.values[parameter or label])
        known = ", ".join(self.standard_errors)
        raise InputError(f"{name}: the model has no such number (it has: {known})")

    def relative(self, name: str) -> float:
        """Standard error of the number `name` (``K``, ``GM.correlation_time``) as a share of its value."""
        return self.standard_errors[name] / abs(self.value(name)) if self.value(name) else np.inf

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, schema ``allanite/power/1``; what the record tells nothing of is null."""
        from allanite.effects.files import model_to_dict

        return {
            "schema": "allanite/power/1",
            "version": _kernels.version(),
            "model": str(self.model),
            "effects": model_to_dict(self.model)["effects"],
            "effect": None if self.effect is None else self.effect.kind,
            "duration_s": self.duration,
            "rate_hz": self.rate,
            "delta_log_likelihood": self.delta_log_likelihood,
            "spread": self.spread,
            "needed": self.needed,
            "probability": self.probability,
            "standard_errors": {
                name: {
                    "value": self.value(name),
                    "std_error": error if np.isfinite(error) else None,
                    "relative": self.relative(name) if np.isfinite(error) else None,
                }
                for name, error in self.standard_errors.items()
            },
        }

    def __str__(self) -> str:
        lines = [f"{self.model} over {self.duration:.6g} s at {self.rate:.6g} Hz"]
        if self.effect is not None and self.probability is not None:
            lines.append(
                f"check finds {self.effect.kind} with probability {self.probability:.3f}: ΔlogL "
                f"{self.delta_log_likelihood:.1f} ± {self.spread:.1f} expected, {self.needed:.1f} needed"
            )
        lines.append(f"{'':22} {'value':>12} {'std error':>12} {'':>8}")
        lines += [
            f"{name:22} {self.value(name):12.5g} {error:12.3g} {100 * self.relative(name):7.3g} %"
            for name, error in self.standard_errors.items()
        ]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<pre>{self}</pre>"


def detection_power(
    model: Model | Effect | str,
    effect: Effect | str | None = None,
    *,
    duration: float,
    rate: float,
    covariates: Columns | None = None,
) -> Power:
    """What a record of `duration` s at `rate` Hz will tell; nothing is simulated.

    The model is fitted to the record that is to be expected (every bin with the power that the truth gives it), with
    and without the effect; what logL loses without it is the non-centrality of the test that `check` makes.

    Parameters
    ----------
    model : Model, Effect or str
        What is modelled anyway, with values.
    effect : Effect or str, optional
        What hides beside it, with values.
    duration, rate : float
        s, Hz.
    covariates : mapping of str to callable, optional
        Expected course of each column as a function of time in s, shape (n,) → (n,).

    Returns
    -------
    Power

    Raises
    ------
    InputError
        A value is missing, a column is not described, or the effect is one that a spectrum does not show.
    TooShortError
        Fewer samples than any fit needs.

    References
    ----------
    Cowan, G., Cranmer, K., Gross, E. & Vitells, O. (2011). Asymptotic formulae for likelihood-based tests of new physics.
    Eur. Phys. J. C 71, 1554: the expected record ("Asimov data set").

    Examples
    --------
    >>> line = al.Sinusoid(frequency=7.3, amplitude=6e-3)
    >>> found = al.detection_power("N(N=0.01)", line, duration=600, rate=100)
    >>> bool(found.probability > 0.9)
    True
    """
    base = as_model(model)
    added = None if effect is None else as_effect(effect)
    rate = positive_rate(rate)
    duration = positive(duration, "duration", "s", "a positive number of seconds")
    whole = base if added is None else base + added
    _expected.require(whole)
    data = _expected.blank(round(duration * rate), rate)
    grid = _expected.coarse(data, covariates)
    errors = MappingProxyType(standard_errors(whole, data, grid))
    if added is None:
        return Power(whole, None, duration, rate, None, None, None, None, errors)
    odds = chance_of(base, added, data, grid)
    return Power(
        whole,
        added,
        duration,
        rate,
        odds.rise.mean,
        odds.rise.spread,
        odds.needed,
        odds.probability,
        errors,
    )


def as_effect(effect: Effect | str) -> Effect:
    """The one effect of a string."""
    if isinstance(effect, str):
        parsed = parse_model(effect)
        if len(parsed) != 1:
            raise InputError(f"{effect!r} has {len(parsed)} effects: plan for one at a time")
        effect = parsed.effects[0]
    if effect.unplanned:
        raise InputError(f"{effect.kind}: not planned from a spectrum: {effect.unplanned}")
    return effect


@dataclass(frozen=True, slots=True, eq=False)
class Odds:
    """Distribution of the gain in logL, of the part that the significance test uses, and the least significant gain."""

    rise: Rise
    judged: Rise
    needed: float

    @property
    def probability(self) -> float:
        """Probability that the effect is found."""
        return self.judged.above(self.needed)


def chance_of(base: Model, effect: Effect, data: Data, grid: Data) -> Odds:
    """What `check` may see of an effect hidden beside a model."""
    noise = _expected.random_part(base)
    if isinstance(effect, Modifier) and effect.passing:
        rise = judged = _level(noise, effect, data)
        null = _expected.best_fit(noise, _expected.expected_power(noise, data), data)
    else:
        signal = np.zeros(data.bins.count.size)
        true = _expected.expected_power(noise + effect, data)
        if isinstance(effect, Deterministic):
            signal = _expected.signal_power(effect, data, grid)
        measured = true + signal / data.bins.count
        null = _expected.best_fit(noise, measured, data)
        rise = judged = _rise(base, null, effect, true, data, grid)
        if isinstance(effect, Deterministic) and not isinstance(effect, Periodic):
            # A slow function of time has to explain something beside the best random process.
            fits = [null, *(_expected.best_fit(m, measured, data) for m in _beside(noise))]
            best = max(fits, key=lambda s: s.log_likelihood)
            judged = _rise(base, best, effect, true, data, grid)
    family, families = family_of(base, effect, null, data, grid)
    return Odds(rise, judged, needed(family, families))


def _rise(base: Model, null: Solution, effect: Effect, true: Array, data: Data, grid: Data) -> Rise:
    """What the effect raises logL by, over a model whose random part is fitted as `null` to the expected record."""
    added = sum(
        p.role not in {"derived", "choice"} and p.unit != "text" and p.name not in effect.held
        for p in effect.parameters
    )
    free = null.columns[:, null.theta > 0.0] / null.spectrum[:, None]
    known = _expected.known(base, null, data, grid)
    signal = np.zeros(null.count.size)
    if isinstance(effect, Deterministic):
        signal = _expected.signal_beside(effect, known, null, data, grid)
    taken = _expected.taken(known, data)
    return Rise(null.count, true / null.spectrum, signal, free, added, taken)


def _beside(noise: Model) -> list[Model]:
    """The noise with each random process that may take the part of a slow function of time (see `suggestion.drifts`)."""
    return [
        noise + blank
        for cls in CATALOGUE
        if issubclass(cls, Stochastic) and cls.wanders
        for blank in cls.candidates(noise, {})
    ]


def _level(noise: Model, effect: Modifier, data: Data) -> Rise:
    """Two levels of the white part against one, over the bins that it dominates."""
    if noise.white is None:
        raise InputError(f"{effect.kind}: the model has no white noise whose level could change")
    white = Model((noise.white,))
    part: Array = _expected.expected_power(white, data) / _expected.expected_power(noise, data)
    seen = part > 0.5
    total = float(data.bins.count[seen].sum())
    share = float((data.bins.count * part)[seen].sum()) / max(total, 1.0)
    start, end = effect.when or data.span
    inside = max(0.0, min(end, data.duration) - max(start, 0.0)) / data.duration
    ratio = np.array([1.0 + share * (float(effect.mean_power(start, end)) - 1.0), 1.0])
    weight = np.array([inside, 1.0 - inside])
    return Rise(total * weight, ratio / (weight @ ratio), np.zeros(2), np.zeros((2, 0)), 3)
