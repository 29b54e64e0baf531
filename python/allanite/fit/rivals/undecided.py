"""Intervals averaged over all models that a record cannot distinguish from the chosen one."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.parameters import NORMAL, Estimate
from allanite.fit.estimates import estimates, has_interval
from allanite.fit.kept import kept_with_fit
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.replacements import replacements

if TYPE_CHECKING:
    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit

#: Probabilities below the ends of a central 95 % interval.
INTERVAL_PROBABILITIES = (0.025, 0.975)
#: Number of bisections that find an end: more than the 53 bits of a double.
BISECTIONS = 60


@dataclass(frozen=True, slots=True)
class Undecided:
    """Models that a record cannot distinguish, and intervals averaged over them.

    `models` are names and probabilities, the chosen one first. `intervals` are, for each effect of the chosen model, 95 %
    intervals of its coefficients over all models, by parameter, in the units of the estimates; without the effect, the
    coefficient is 0. `instead` has, for each effect of the chosen model, those that replace it in the most likely model
    without it, and the total probability of such models. None if every model has the effect.
    """

    models: tuple[tuple[str, float], ...]
    intervals: tuple[dict[str, tuple[float, float]], ...]
    instead: tuple[tuple[tuple[Effect, ...], float] | None, ...] = ()


@dataclass(frozen=True, slots=True)
class _Distribution:
    """Distribution of a parameter under one model: a fixed value, an upper limit, or two half normals joined at the value.

    `low` and `high` are the ends of the 95 % interval. If `logarithmic`, the parameter is not negative, and its logarithm
    has this distribution.
    """

    value: float = 0.0
    low: float = 0.0
    high: float = 0.0
    logarithmic: bool = False

    def cumulative_probability(self, x: float) -> float:
        """Probability that the parameter is at most x.

        An upper limit (`low` is 0) has probability ½ at 0 and is half normal above. A fixed value (`low` equals `high`) is
        a step.
        """
        from scipy.special import ndtr

        if self.high == self.low:
            return float(x >= self.value)
        end = self.low if x < self.value else self.high
        if not self.logarithmic:
            score = (x - self.value) / max(abs(end - self.value), 1e-300)
        elif x < 0.0 or (x == 0.0 and self.low > 0.0):
            return 0.0
        elif self.low <= 0.0:
            score = x / self.high
        else:
            score = np.log(x / self.value) / max(abs(np.log(end / self.value)), 1e-12)
        return float(ndtr(NORMAL * score))


@kept_with_fit
def undecided(fit: Fit) -> Undecided | None:
    """`Undecided`: other models whose score is less than 3 nats lower, and intervals averaged over all of them.

    The models are those of `replacements`. Models with a new one-time event are left out. Of the models with the same kinds
    of effects, the one with the highest score counts. The score is the ln evidence plus the prior (`Replacement.prior`), as
    in the search. The probability of a model is proportional to exp(score) (Hoeting et al. 1999, Statist. Sci. 14, eq. 2).
    None if there is no other model, or for another method than `whittle`. None as well for a fit that is not adequate: its
    intervals do not hold. Kept with the fit.
    """
    if fit.method != "whittle" or not fit.adequate:
        return None
    own = _kinds(fit.model)
    found = {own: (0.0, fit.solution)}
    # The evidence of an event lacks the cost of the many times at which it was tried.
    for other in replacements(fit, lambda new, _: not new.happens_once):
        lead, name = other.lead + other.prior, _kinds(other.solution.model)
        if lead <= -MAX_RIVAL_LOG_EVIDENCE or name == own:
            continue
        if name not in found or found[name][0] < lead:
            found[name] = lead, other.solution
    if len(found) == 1:
        return None
    leads = np.array([lead for lead, _ in found.values()])
    weights = np.exp(leads - leads.max())
    weights /= weights.sum()
    solutions = [solution for _, solution in found.values()]
    chosen = _coefficients_by_kind(fit.model, fit.estimates)
    every = [chosen] + [
        _coefficients_by_kind(s.model, estimates(s, fit.data, fit.recording)) for s in solutions[1:]
    ]
    intervals = tuple(
        {
            name: _interval([_distribution(c.get(key, {}).get(name)) for c in every], weights)
            for name, estimate in values.items()
            if has_interval(estimate)
        }
        for key, values in chosen.items()
    )
    models = [(s.model, weight) for s, weight in zip(solutions, weights.tolist(), strict=True)]
    names = tuple((model.name, weight) for model, weight in models)
    return Undecided(names, intervals, _replacements(fit.model, models[1:]))


def _replacements(
    chosen: Model, others: list[tuple[Model, float]]
) -> tuple[tuple[tuple[Effect, ...], float] | None, ...]:
    """Tuple with one element for each effect of the `chosen` model: None, or a pair (replacing effects, probability).

    `others` are pairs (model, probability). A model lacks an effect if it has fewer effects of that kind than `chosen`. The
    replacing effects are those of new kinds in the most likely model that lacks it.
    """
    own = Counter(e.kind for e in chosen)
    found: list[tuple[tuple[Effect, ...], float] | None] = []
    for effect in chosen:
        without = [
            (weight, model)
            for model, weight in others
            if sum(e.kind == effect.kind for e in model) < own[effect.kind]
        ]
        if not without:
            found.append(None)
            continue
        _, likeliest = max(without, key=lambda each: each[0])
        new = tuple(e for e in likeliest if e.kind not in own)
        found.append((new, sum(weight for weight, _ in without)))
    return tuple(found)


def _kinds(model: Model) -> tuple[str, ...]:
    """Sorted tuple of the kinds of the effects of a model."""
    return tuple(sorted(effect.kind for effect in model))


def _coefficients_by_kind(
    model: Model, values: tuple[dict[str, Any], ...]
) -> dict[tuple[str, int], Any]:
    """Dict from (kind, number within the kind, from 0) to a dict of the effect's estimated coefficients by name."""
    seen: Counter[str] = Counter()
    out = {}
    for effect, own in zip(model, values, strict=True):
        coefficients = {p.name for p in effect.parameters if p.role == "coefficient"}
        kept = {name: value for name, value in own.items() if name in coefficients}
        out[effect.kind, seen[effect.kind]] = kept
        seen[effect.kind] += 1
    return out


def _distribution(value: Any) -> _Distribution:
    """`_Distribution` of an estimate; a fixed value if it has no interval, and 0 if `value` is not an estimate."""
    if not isinstance(value, Estimate):
        return _Distribution()
    if value.interval is None:
        return _Distribution(float(value), float(value), float(value))
    low, high = value.interval
    logarithmic = low >= 0.0 and float(value) >= 0.0
    return _Distribution(float(value), low, high, logarithmic)


def _interval(laws: list[_Distribution], weights: Array) -> tuple[float, float]:
    """Pair: central 95 % interval of a weighted mixture of distributions, by bisection."""
    reach = max(max(abs(law.low), abs(law.high), abs(law.value)) for law in laws)
    least = -4.0 * reach if any(min(law.low, law.value) < 0.0 for law in laws) else 0.0

    def quantile(share: float) -> float:
        """Value x at which the cumulative probability of the mixture equals `share`, by bisection."""
        low, high = least, 4.0 * reach
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            below = sum(
                w * law.cumulative_probability(middle) for law, w in zip(laws, weights, strict=True)
            )
            low, high = (low, middle) if below >= share else (middle, high)
        return 0.0 if abs(high) < 1e-12 * reach else high

    return quantile(INTERVAL_PROBABILITIES[0]), quantile(INTERVAL_PROBABILITIES[1])
