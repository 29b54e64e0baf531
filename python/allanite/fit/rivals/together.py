"""Two effects where one stands: a ramp and a step for a random walk, a lag beside a temperature for flicker."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOGUE, Deterministic, Effect, Model, Stochastic
from allanite.fit.engine import solve
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.rivals.alternatives import POLISH, best_slow, instead, may_leave, slow_scans
from allanite.fit.rivals.evidence import RIVAL, evidence, of_number
from allanite.fit.shapes.matched import lowest

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.result import Fit
    from allanite.fit.solution import Solution

__all__ = ["Pair", "splits", "together"]

#: Slow functions beside which a process is looked for, and pairs of slow functions that are fitted.
BESIDE, FITTED = 3, 6
#: Slow functions of which so little is left beside another are that other.
SAME = 1e-3


@dataclass(frozen=True, slots=True)
class Pair:
    """Two effects in the place of one.

    Attributes
    ----------
    evidence : float
        ln of its evidence over that of the model with the one, at the shapes of a scan.
    model : Model
        The pair stands last.
    """

    evidence: float
    model: Model

    @property
    def kinds(self) -> tuple[str, str]:
        """Of the two."""
        one, other = self.model.effects[-2:]
        return one.kind, other.kind


def splits(effect: Effect) -> bool:
    """Whether an effect may stand for two: what is slow, and what only describes."""
    if not may_leave(effect):
        return False
    if isinstance(effect, Stochastic):
        return effect.wanders or effect.last_resort
    return effect.screened == "slow"


def together(fit: Fit, place: int) -> list[Pair]:
    """Pairs of effects that may stand where one does, the one with the most evidence first.

    One of the two at least is a declared rival of what stands there. A pair that is clearly behind is not listed.
    """
    effects = fit.model.effects
    out = effects[place]
    less = Model(effects[:place] + effects[place + 1 :])
    if not splits(out) or not len(less):
        return []
    base = solve(fit.data, less, like=fit.solution, polish=False)
    had = evidence(fit.solution)
    best: dict[frozenset[str], Pair] = {}
    for found, model in _Search(fit.data, out, base, had - RIVAL).pairs():
        pair = Pair(found - had, model)
        key = frozenset(pair.kinds)
        if pair.evidence > -RIVAL and (key not in best or pair.evidence > best[key].evidence):
            best[key] = pair
    return sorted(best.values(), key=lambda pair: -pair.evidence)


@dataclass(frozen=True, slots=True)
class _Search:
    """Pairs for an effect that was taken out, and what their evidence may be."""

    data: Data
    out: Effect
    base: Solution
    least: float

    def pairs(self) -> list[tuple[float, Model]]:
        """Every pair worth a look, with its evidence at the shapes of a scan."""
        found = self._functions()
        slow = sorted(self._slow(self.base).values(), key=lambda each: -each[0])[:BESIDE]
        starts = [
            solve(self.data, self.base.model + e, like=self.base, rounds=3, polish=False)
            for _, e in slow
        ]
        processes = [
            s for s in (self._process(cls, self.base) for cls in self._kinds()) if s is not None
        ]
        for one in processes:
            first = one.model.effects[-1]
            for gain, other in self._slow(one).values():
                if self._reads(first, other):
                    cost = other.numbers * of_number(2.0 * gain)
                    found.append((evidence(one) + gain - cost, one.model + other))
        for one in [*starts, *processes]:
            first = one.model.effects[-1]
            # Its numbers have to be paid as well.
            hopeless = self.least + one.log_likelihood - evidence(one) - POLISH
            for cls in self._kinds():
                if cls.kind != first.kind and self._reads(first, cls):
                    both = self._process(cls, one, hopeless)
                    if both is not None:
                        found.append((evidence(both), both.model))
        return found

    def _reads(self, *pair: Effect | type[Effect]) -> bool:
        """Whether one of a pair is a rival of what was taken out."""
        return any(one.may_be(self.out) for one in pair)

    def _kinds(self) -> list[type[Effect]]:
        """Processes that a pair may hold."""
        return [
            cls
            for cls in CATALOGUE
            if issubclass(cls, Stochastic)
            and cls.screened == "spectral"
            and not (cls.last_resort or cls.nameless)
            and cls.kind != self.out.kind
            and cls.may_be(self.out)
        ]

    def _process(
        self, cls: type[Effect], base: Solution, least: float = -np.inf
    ) -> Solution | None:
        part = RandomPart(self.data, base.power, base.count)
        return instead(cls, base, part, least)

    def _slow(self, base: Solution) -> dict[str, tuple[float, Deterministic]]:
        return best_slow(base, self.data, self._another)

    def _another(self, blank: Deterministic) -> bool:
        # A refined form is looked for behind the plain one, not beside something else.
        return blank.kind != self.out.kind and not blank.refined

    def _functions(self) -> list[tuple[float, Model]]:
        """The best pair of slow functions of every two kinds: all points of their grids beside each other.

        What they leave behind is not known before: the most promising are fitted.
        """
        base = self.base
        j = lowest(self.data)
        target = base.ordinates[j] / np.sqrt(base.noise(self.data).variance(j))
        scans = slow_scans(base, self.data, self._another)
        blocks = [(points, unit, unit @ target) for points, _, unit in scans]
        found = []
        for (ones, u, z), (others, v, w) in combinations(blocks, 2):
            if ones[0].kind == others[0].kind or not self._reads(ones[0], others[0]):
                continue
            shared = u @ v.T
            free = np.maximum(1.0 - shared**2, SAME)
            twice = (z[:, None] ** 2 + w**2 - 2.0 * shared * z[:, None] * w) / free
            twice[1.0 - shared**2 <= SAME] = 0.0
            i, k = np.unravel_index(int(np.argmax(twice)), twice.shape)
            gain = 0.5 * float(twice[i, k])
            cost = (ones[i].numbers + others[k].numbers) * of_number(gain)
            found.append((gain - cost, base.model + ones[i] + others[k]))
        found.sort(key=lambda each: -each[0])
        solved = [solve(self.data, model, polish=False, rounds=4) for _, model in found[:FITTED]]
        return [(evidence(s), s.model) for s in solved]
