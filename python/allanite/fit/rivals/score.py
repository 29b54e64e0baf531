"""Score of a model: its log evidence plus the priors of its effects, nats. Four rules weigh the priors:

| prior | of | used for |
|---|---|---|
| `prior` | one effect | suggestions (`Suggestion.score`) and plans; drops, if below 0 (`gain_without`) |
| `replacing_prior` | one effect; +3 for every named slow process | the next two; which functions start a pair |
| `prior_change` | all effects of two models, within ±3 | additions and merges of a search (`score_change`) |
| `Replacement.prior` | rarest effect of each side, within ±3 | replacements that a search tries; `undecided` |
"""

from __future__ import annotations

from allanite.effects import Deterministic, Effect, Model, Stochastic
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE

#: Largest damping ratio of a mode of a structure or mount; a broader resonance may be the edge of a filter.
#: Basis: measured with benches/claims/quantized_filters.py --records 4: of 24 filters with quantization, 18, 17 and 15 are
#: named with 0.1, 0.2 and 0.4, and 9 without this rule; 12 of 12 resonances of damping 0.15 to 0.5 keep their name.
MAX_MODE_DAMPING = 0.2


def prior(effect: Effect) -> float:
    """Part of a model's score for one effect, nats: from its kind, and the width of a band, but not from the record.

    It is +3 for a common cause, 0 for others, and −3 per coefficient if the effect names no cause. Common causes are
    the standard coefficients (Q, N, B, K, R) and functions of a logged column. Power laws, bands too wide for a mode of
    a structure, and extended forms of slow functions name no cause. ±3 nats are odds of 20 : 1.
    """
    known = effect if isinstance(effect, Deterministic) else None
    if effect.last_resort or is_broad(effect) or (known and known.refined):
        return -MAX_RIVAL_LOG_EVIDENCE * sum(p.role == "coefficient" for p in effect.parameters)
    usual = effect.standard is not None or (known and known.follows is not None)
    return MAX_RIVAL_LOG_EVIDENCE if usual else 0.0


def replacing_prior(effect: Effect) -> float:
    """Prior of an effect where effects replace each other, nats: `prior`, but +3 for every slow process with a name.

    So the evidence alone chooses between flicker, a random walk and a Gauss-Markov process.
    """
    slow = isinstance(effect, Stochastic) and effect.wanders and not effect.last_resort
    return MAX_RIVAL_LOG_EVIDENCE if slow else prior(effect)


def prior_change(before: Model, after: Model) -> float:
    """Change of the sum of the priors from the model `before` to the model `after`, nats, limited to ±3.

    The limit is the prior of one effect. Without it, priors would favor the model with more effects.
    """
    change = sum(map(replacing_prior, after)) - sum(map(replacing_prior, before))
    return min(max(change, -MAX_RIVAL_LOG_EVIDENCE), MAX_RIVAL_LOG_EVIDENCE)


def is_broad(effect: Effect) -> bool:
    """True for a band that is wider than a structural mode: damping above 0.2.

    The edge of a filter and quantization can imitate such a band.
    """
    if not isinstance(effect, Stochastic) or effect.occupies is None:
        return False
    low, high = effect.occupies
    return high - low > 2.0 * MAX_MODE_DAMPING * 0.5 * (low + high)
