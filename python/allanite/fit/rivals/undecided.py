"""Intervals over all models that a record cannot tell from the one that was chosen."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.parameters import NORMAL, Estimate
from allanite.effects import Deterministic
from allanite.fit.engine import solve
from allanite.fit.estimates import estimates
from allanite.fit.rivals.alternatives import shown
from allanite.fit.rivals.evidence import RIVAL, gained

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit
    from allanite.fit.solution import Solution

__all__ = ["Undecided", "undecided"]

#: Shares of the law below the ends of a 95 % interval.
ENDS = (0.025, 0.975)
#: Halvings that find an end.
HALVINGS = 60


@dataclass(frozen=True, slots=True)
class Undecided:
    """What models that a record cannot tell apart say together.

    Attributes
    ----------
    models : tuple of (str, float)
        Their names and probabilities, the chosen one first.
    intervals : tuple of dict of str to (float, float)
        Of every effect of the chosen model the 95 % intervals of its coefficients over all of them, by parameter, in the
        units of the estimates. An effect that a model does not have is 0 there.
    instead : tuple of (tuple of Effect, float) or None
        Of every effect of the chosen model what the likeliest model without it has instead, and the probability of all
        models without it; None where every model has it.
    """

    models: tuple[tuple[str, float], ...]
    intervals: tuple[dict[str, tuple[float, float]], ...]
    instead: tuple[tuple[tuple[Effect, ...], float] | None, ...] = ()


@dataclass(frozen=True, slots=True)
class _Law:
    """What one model says of a number: its value alone, an upper limit, or two half normal laws that meet at the value."""

    value: float = 0.0
    low: float = 0.0
    high: float = 0.0
    #: Whether the number has no sign: its logarithm has the law.
    ratio: bool = False

    def below(self, x: float) -> float:
        """Probability of a number of at most x."""
        from scipy.special import ndtr

        if self.high == self.low:
            return float(x >= self.value)
        if self.ratio and self.low <= 0.0:
            # A limit: as likely absent as not.
            return float(ndtr(NORMAL * x / self.high)) if x >= 0.0 else 0.0
        if not self.ratio:
            end = self.low if x < self.value else self.high
            return float(ndtr(NORMAL * (x - self.value) / max(abs(end - self.value), 1e-300)))
        if x <= 0.0:
            return 0.0
        end = self.low if x < self.value else self.high
        width = max(abs(np.log(end / self.value)), 1e-12)
        return float(ndtr(NORMAL * np.log(x / self.value) / width))


def undecided(fit: Fit) -> Undecided | None:
    """The models within 3 of the evidence of a fit, by their declared rivals, and what they say together.

    The probability of a model is in proportion to its evidence (Hoeting et al. 1999, Statist. Sci. 14, eq. 2).
    None where the fit is the only one, or was not made by likelihood.
    """
    if fit.method != "whittle":
        return None
    found = {_kinds(fit.model): (0.0, fit.solution)}
    for score, solution in _within(fit):
        name = _kinds(solution.model)
        if name not in found or found[name][0] < score:
            found[name] = score, solution
    if len(found) == 1:
        return None
    scores = np.array([score for score, _ in found.values()])
    weights = np.exp(scores - scores.max())
    weights /= weights.sum()
    unit, units = fit.recording.unit, fit.recording.covariate_units
    said = [_numbered(fit.model, fit.estimates)]
    said += [
        _numbered(s.model, estimates(s, fit.data, unit, units)) for _, s in list(found.values())[1:]
    ]
    intervals = []
    for key, values in said[0].items():
        own = {}
        for name, estimate in values.items():
            laws = [_law(each.get(key, {}).get(name)) for each in said]
            if _counts(estimate):
                own[name] = _interval(laws, weights)
        intervals.append(own)
    names = (solution.model.name for _, solution in found.values())
    models = tuple(zip(names, map(float, weights), strict=True))
    likely = list(zip((s.model for _, s in found.values()), map(float, weights), strict=True))
    return Undecided(models, tuple(intervals), _instead(fit.model, likely[1:]))


def _instead(
    chosen: Model, others: list[tuple[Model, float]]
) -> tuple[tuple[tuple[Effect, ...], float] | None, ...]:
    """`Undecided.instead` of every effect of the chosen model."""
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
    return tuple(sorted(effect.kind for effect in model))


def _within(fit: Fit) -> Iterator[tuple[float, Solution]]:
    """Other models of the record within `RIVAL` of the fit's evidence: another effect, or two, in the place of one.

    What happens once is no rival by its evidence alone: that does not pay for the times that were tried.
    """
    for place in range(len(fit.model)):
        if not shown(fit, place):
            continue
        for other in fit.alternatives(place):
            if other.evidence > -RIVAL and not _once(other.effect):
                yield other.evidence, other.solution
        for pair in fit.together(place):
            if not any(map(_once, pair.model.effects[-2:])):
                solution = solve(fit.data, pair.model, like=fit.solution)
                more = gained(solution, fit.solution, fit.data)
                if more > -RIVAL:
                    yield more, solution


def _once(effect: Effect) -> bool:
    return isinstance(effect, Deterministic) and effect.happens_once


def _numbered(model: Model, values: tuple[dict[str, Any], ...]) -> dict[tuple[str, int], Any]:
    """Values of effects by their kind and number among those of that kind."""
    seen: Counter[str] = Counter()
    out = {}
    for effect, own in zip(model, values, strict=True):
        coefficients = {p.name for p in effect.parameters if p.role == "coefficient"}
        kept = {name: value for name, value in own.items() if name in coefficients}
        out[effect.kind, seen[effect.kind]] = kept
        seen[effect.kind] += 1
    return out


def _counts(value: Any) -> bool:
    return isinstance(value, Estimate) and value.interval is not None


def _law(value: Any) -> _Law:
    if not isinstance(value, Estimate):
        return _Law()
    if value.interval is None:
        return _Law(float(value), float(value), float(value))
    low, high = value.interval
    ratio = low >= 0.0 and float(value) >= 0.0
    return _Law(float(value), low, high, ratio)


def _interval(
    laws: list[_Law], weights: np.ndarray[Any, np.dtype[np.float64]]
) -> tuple[float, float]:
    """The ends of the mixture of the laws, by halving."""
    reach = max(max(abs(law.low), abs(law.high), abs(law.value)) for law in laws)
    least = -4.0 * reach if any(min(law.low, law.value) < 0.0 for law in laws) else 0.0

    def end(share: float) -> float:
        low, high = least, 4.0 * reach
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            below = sum(w * law.below(middle) for law, w in zip(laws, weights, strict=True))
            low, high = (low, middle) if below >= share else (middle, high)
        return 0.0 if abs(high) < 1e-12 * reach else high

    return end(ENDS[0]), end(ENDS[1])
