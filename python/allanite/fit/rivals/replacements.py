"""Models in which other effects replace one or two effects of a fit, with their lead in ln evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.rivals.pairs import solution_with_pair
from allanite.fit.rivals.score import replacing_prior

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.fit.solution import Solution


@dataclass(frozen=True, eq=False, slots=True)
class Replacement:
    """A fit in which the effects `new`, the last of its model, replace the effects `out` at `places` of another model.

    `lead` is its ln evidence minus that of the other model, nats.
    """

    lead: float
    places: tuple[int, ...]
    out: tuple[Effect, ...]
    new: tuple[Effect, ...]
    solution: Solution

    @property
    def prior(self) -> float:
        """Change of the score by priors, nats, limited to ±3.

        The rarest effect of each side counts, so that the number of effects makes no difference.
        """
        change = min(map(replacing_prior, self.new)) - min(map(replacing_prior, self.out))
        return min(max(change, -MAX_RIVAL_LOG_EVIDENCE), MAX_RIVAL_LOG_EVIDENCE)


def replacements(fit: Fit, may_replace: Callable[[Effect, Effect], bool]) -> Iterator[Replacement]:
    """Iterator over `Replacement`: other effects replace one detected effect, or two slow processes.

    A single effect is replaced by one of its declared alternatives, or by a pair of effects. At least one effect of the
    pair is a declared alternative. Two slow processes are replaced by one or two slow processes of other kinds
    (`alternatives_to_pairs`). `may_replace(new, old)` must be True for each new and each replaced effect. The same model
    may occur twice.
    """
    effects = fit.model.effects

    def allowed(new: Sequence[Effect], out: Sequence[Effect]) -> bool:
        """True if each of the effects `new` may replace each of `out`."""
        return all(may_replace(one, other) for one in new for other in out)

    for lead, places, solution in fit.alternatives_to_pairs:
        out = tuple(effects[place] for place in places)
        new = solution.model.effects[len(effects) - len(places) :]
        if allowed(new, out):
            yield Replacement(lead, places, out, new, solution)
    for place, old in enumerate(effects):
        if not is_detected(fit, place):
            continue
        for one in fit.alternatives(place):
            if allowed((one.effect,), (old,)):
                yield Replacement(one.evidence, (place,), (old,), (one.effect,), one.solution)
        for pair in fit.alternative_pairs(place):
            if allowed(pair.model.effects[-2:], (old,)):
                solution = solution_with_pair(fit, pair)
                lead = evidence_gain(solution, fit.solution, fit.data)
                yield Replacement(lead, (place,), (old,), solution.model.effects[-2:], solution)
