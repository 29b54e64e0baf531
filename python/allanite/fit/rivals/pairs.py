"""Replace one effect by two, e.g. a random walk by a ramp and a step, or flicker by a Gauss-Markov process and a drift."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOG, Deterministic, Effect, Model, Modifier, Stochastic
from allanite.fit.engine import solve
from allanite.fit.kept import kept_with_fit
from allanite.fit.rivals.alternatives import (
    MAX_POLISH_DELTA_LOGL,
    Scan,
    best_of_kinds,
    fit_replacement,
    is_detected,
    is_removable,
    slow_scans,
    solution_without,
)
from allanite.fit.rivals.evidence import (
    MAX_RIVAL_LOG_EVIDENCE,
    evidence,
    evidence_gain,
    parameter_cost,
)
from allanite.fit.rivals.score import is_broad, replacing_prior
from allanite.fit.shapes.matched import filter_ordinates

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.fit.solution import Solution

#: Number of best slow functions to which a second effect is added. Chosen by judgment; not measured.
MAX_FIRST_FUNCTIONS = 3
#: Number of best pairs of slow functions that are fitted. Chosen by judgment; not measured.
MAX_FITTED_PAIRS = 6
#: Two slow functions count as equal if this fraction or less of the energy of one is orthogonal to the other.
#: Chosen by judgment; not measured.
MIN_ORTHOGONAL_ENERGY = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A model whose last two effects replace one; its shapes are from a grid.

    `evidence` is the ln evidence of this model minus that of the original model.
    """

    evidence: float
    model: Model

    @property
    def kinds(self) -> tuple[str, str]:
        """Pair of texts: the kinds of the two effects."""
        one, other = self.model.effects[-2:]
        return one.kind, other.kind


def can_be_split(effect: Effect) -> bool:
    """True if a search may try to replace this effect by two effects.

    These are slow functions of time, processes that drift slowly, broad humps of the spectrum, and processes that only
    describe a spectrum without a cause. Effects that may not be removed (`is_removable`) cannot be split either.
    """
    if not is_removable(effect):
        return False
    if isinstance(effect, Stochastic):
        return effect.wanders or effect.last_resort or is_broad(effect)
    return isinstance(effect, Deterministic) and effect.low


@kept_with_fit
def alternatives_to_pairs(fit: Fit) -> tuple[tuple[float, tuple[int, int], Solution], ...]:
    """Tuple of (ln evidence minus that of the fit, indices, solution): models in which others replace two processes.

    `indices` are the places of the two replaced effects: random processes that drift slowly and may be removed. Both are
    detected, or neither is although the evidence is over 3 nats lower without both. One or two processes of other kinds
    replace them. Models whose evidence is lower by 3 nats or more are omitted. Empty for a model of at most two effects.
    The tuple is kept with the fit.
    """
    effects = fit.model.effects
    wandering = [p for p, e in enumerate(effects) if _wanders(type(e)) and is_removable(e)]
    found = []
    for out in combinations(wandering, 2) if len(effects) > 2 else ():
        detected = {is_detected(fit, place) for place in out}
        if len(detected) > 1:
            continue
        base = solution_without(fit, *out)
        needed = evidence_gain(base, fit.solution, fit.data) < -MAX_RIVAL_LOG_EVIDENCE
        if not (detected == {True} or needed):
            continue
        removed = {effects[place].kind for place in out}
        kinds = [
            cls
            for cls in CATALOG
            if _wanders(cls) and cls.is_tried_in_spectrum() and cls.kind not in removed
        ]
        ones = [one for cls in kinds if (one := fit_replacement(cls, base, fit.data)) is not None]
        twos = [
            two
            for one in ones
            for cls in kinds
            if not (one.model.effects[-1].last_resort or cls.last_resort)
            and (two := fit_replacement(cls, one, fit.data)) is not None
        ]
        for rough in (*ones, *twos):
            lead = evidence_gain(rough, fit.solution, fit.data)
            if lead < -MAX_RIVAL_LOG_EVIDENCE - MAX_POLISH_DELTA_LOGL:
                continue
            solution = solve(fit.data, rough.model, like=fit.solution)
            lead = evidence_gain(solution, fit.solution, fit.data)
            if lead > -MAX_RIVAL_LOG_EVIDENCE:
                found.append((lead, out, solution))
    return tuple(found)


def _wanders(cls: type[Effect]) -> bool:
    """True for the class of a random process that drifts slowly."""
    return issubclass(cls, Stochastic) and cls.wanders


@kept_with_fit
def alternative_pairs(fit: Fit, place: int) -> tuple[Pair, ...]:
    """Tuple of `Pair`, the highest evidence first: two effects that may replace the one at index `place`.

    At least one of the two is a declared alternative of that effect. Only the best pair of the same two kinds is listed,
    and only if its evidence is less than 3 nats below that of the fit. Empty if the effect may not be removed, if it is
    neither a modifier nor can be split (`can_be_split`), or if the model has no other effect. The tuple is kept with the
    fit.
    """
    out = fit.model.effects[place]
    splits = can_be_split(out) or (isinstance(out, Modifier) and is_removable(out))
    if not splits or len(fit.model) == 1:
        return ()
    base, had = solution_without(fit, place), evidence(fit.solution)
    search = _PairSearch(fit.data, out, base, had - MAX_RIVAL_LOG_EVIDENCE)
    found = [Pair(value - had, model) for value, model in search.pairs()]
    # Only the best pair of each two kinds stays.
    best: dict[frozenset[str], Pair] = {}
    for pair in sorted(found, key=lambda pair: -pair.evidence):
        if pair.evidence > -MAX_RIVAL_LOG_EVIDENCE:
            best.setdefault(frozenset(pair.kinds), pair)
    return tuple(best.values())


@kept_with_fit
def solution_with_pair(fit: Fit, pair: Pair) -> Solution:
    """`Solution` of the model in which one of its `alternative_pairs` is used, with fitted shapes; kept with the fit."""
    return solve(fit.data, pair.model, like=fit.solution)


def _expected_score(found: tuple[float, Effect]) -> float:
    """ΔlogL of a slow function minus the cost of its parameters plus its prior, nats, from (ΔlogL, function)."""
    gain, effect = found
    return gain - effect.numbers * parameter_cost(2.0 * gain) + replacing_prior(effect)


@dataclass(frozen=True, slots=True)
class _PairSearch:
    """Search of pairs that replace the effect `out`, which `base` is fitted without, with at least `min_evidence`."""

    data: Data
    out: Effect
    base: Solution
    min_evidence: float

    def pairs(self) -> list[tuple[float, Model]]:
        """List, in no order, of (ln evidence, model): models in which two effects replace the removed effect.

        The shapes of the two effects are values of a grid. A filter or broad band is replaced by a random process and a
        filter. Any other effect is replaced by two functions of time, two random processes or one of each.
        """
        if is_broad(self.out) or isinstance(self.out, Modifier):
            # Quantization behind a filter has the same edge as another filter or a hump.
            filters = [
                cls
                for cls in CATALOG
                if issubclass(cls, Modifier) and cls.is_tried_in_spectrum() and cls.may_be(self.out)
            ]
            processes = self._fits_with_process()
            return [pair for one in processes for pair in self._with_second_effect(one, filters)]
        scans = list(self._scans(self.base))
        slow = sorted(best_of_kinds(scans).values(), key=_expected_score, reverse=True)
        found = self._function_pairs(scans)
        del scans  # directions of all grid points
        starts = [
            solve(self.data, self.base.model + e, like=self.base, rounds=3, polish=False)
            for _, e in slow[:MAX_FIRST_FUNCTIONS]
        ]
        processes = self._fits_with_process()
        for one in processes:
            first = one.model.effects[-1]
            for gain, other in best_of_kinds(self._scans(one)).values():
                if self._has_rival(first, other):
                    cost = other.numbers * parameter_cost(2.0 * gain)
                    found.append((evidence(one) + gain - cost, one.model + other))
        for one in [*starts, *processes]:
            first = one.model.effects[-1]
            others = [c for c in self._alternative_processes() if self._has_rival(first, c)]
            found += self._with_second_effect(one, others)
        return found

    def _with_second_effect(
        self, one: Solution, kinds: Sequence[type[Effect]]
    ) -> Iterator[tuple[float, Model]]:
        """Iterator over (ln evidence, model): the model of the fit `one` plus one effect of each of `kinds`.

        A kind is omitted if its best shape on a grid cannot reach `min_evidence`.
        """
        # Candidates below this logL cannot reach the minimum evidence, given the cost of the first effect.
        min_log_likelihood = (
            self.min_evidence + one.log_likelihood - evidence(one) - MAX_POLISH_DELTA_LOGL
        )
        for cls in kinds:
            both = fit_replacement(cls, one, self.data, min_log_likelihood)
            if both is not None:
                yield evidence(both), both.model

    def _has_rival(self, *pair: Effect | type[Effect]) -> bool:
        """True if at least one effect (or class) in `pair` is declared as an alternative of the replaced effect."""
        return any(one.may_be(self.out) for one in pair)

    def _fits_with_process(self) -> list[Solution]:
        """List of fits (`Solution`) of the base model plus one random process, for each of `_alternative_processes`.

        Classes without an acceptable fit are left out (`fit_replacement` returns None).
        """
        fits = (fit_replacement(c, self.base, self.data) for c in self._alternative_processes())
        return [one for one in fits if one is not None]

    def _alternative_processes(self) -> list[type[Effect]]:
        """List of the classes of random processes that are declared alternatives of the replaced effect, of other kinds.

        Excluded are power laws and other kinds that describe a spectrum without naming a cause.
        """
        return [
            cls
            for cls in CATALOG
            if issubclass(cls, Stochastic)
            and cls.is_tried_in_spectrum()
            and not (cls.last_resort or cls.nameless)
            and cls.kind != self.out.kind
            and cls.may_be(self.out)
        ]

    def _scans(self, base: Solution) -> Iterator[Scan]:
        """Iterator over matched-filter scans (`slow_scans`) for slow functions of time in the residual of the fit `base`.

        Not tried are functions of the same kind as the replaced effect, and those that extend a simpler function
        (`Deterministic.refined`).
        """
        return slow_scans(
            base, self.data, lambda blank: blank.kind != self.out.kind and not blank.refined
        )

    def _function_pairs(self, scans: list[Scan]) -> list[tuple[float, Model]]:
        """List of (ln evidence, model) of at most six pairs of slow functions, fitted with the shapes of the grid.

        All grid points of two kinds are combined, and the combination with the largest joint ΔlogL is kept. The six best
        kept pairs are then fitted.
        """
        base = self.base
        j = filter_ordinates(self.data)
        target = base.ordinates[j] / np.sqrt(base.noise(self.data).variance(j))
        blocks = [(points, unit, unit @ target) for points, _, unit in scans]
        found = []
        for (ones, u, z), (others, v, w) in combinations_with_replacement(blocks, 2):
            # Two steps of different heights look like an excursion. Other effects are no two of a kind.
            alike = ones[0].kind == others[0].kind and not (self.out.returns and ones[0].lasting)
            if alike or not self._has_rival(ones[0], others[0]):
                continue
            shared = u @ v.T
            free = np.maximum(1.0 - shared**2, MIN_ORTHOGONAL_ENERGY)
            twice = (z[:, None] ** 2 + w**2 - 2.0 * shared * z[:, None] * w) / free
            twice[1.0 - shared**2 <= MIN_ORTHOGONAL_ENERGY] = 0.0
            i, k = np.unravel_index(int(np.argmax(twice)), twice.shape)
            gain = 0.5 * float(twice[i, k])
            cost = (ones[i].numbers + others[k].numbers) * parameter_cost(gain)
            found.append((gain - cost, base.model + ones[i] + others[k]))
        found.sort(key=lambda each: -each[0])
        solved = [
            solve(self.data, model, like=base, polish=False, rounds=4)
            for _, model in found[:MAX_FITTED_PAIRS]
        ]
        return [(evidence(s), s.model) for s in solved]
