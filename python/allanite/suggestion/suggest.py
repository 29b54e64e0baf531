"""Suggestions of missing effects: run all screens, judge their candidates by p-values, and rank them by score.

`Suggestion.score` is the score of a candidate. Its prior (`allanite.fit.rivals.score`) decides ties.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import count
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from allanite.common.former import warn_of_former_name
from allanite.common.numbers import number
from allanite.common.threads import Pool
from allanite.effects import Effect, Modifier
from allanite.fit.estimates import estimates
from allanite.fit.likelihood.remembered import trim_memory
from allanite.fit.likelihood.whitened import (
    Whitened,
    replace_unsteady_ordinates,
    whitened_ordinates,
)
from allanite.fit.result import Fit, parameter_dict
from allanite.fit.rivals.evidence import discrepancy_gain, parameters_cost
from allanite.fit.rivals.score import prior
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY, MAIN_SHARE
from allanite.suggestion.exclusions_first import excludes_or_changes_level
from allanite.suggestion.explanation import explain
from allanite.suggestion.p_values import log_p_value
from allanite.suggestion.ranking import in_order, min_score
from allanite.suggestion.screens._screen import (
    Candidate,
    Context,
    Screen,
    Screens,
    parallel_searches,
)
from allanite.suggestion.screens.level_changes import overdispersion_without

#: All screens by name.
SCREENS = Screens("allanite.suggestion.screens")

T = TypeVar("T")

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.fit.solution import Solution

    Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Suggestion:
    """One effect that may be missing, with its evidence.

    Attributes
    ----------
    effect : Effect
        The effect with its fitted values.
    significant : bool
        True if the p-value, corrected for the number of effects and frequencies searched, is below 1 %, and the effect
        explains more than its parameters cost: its score without a discrepancy is above 0.5 nats. The score of
        exclusions and changes of level does not count.
    delta_log_likelihood : float
        ΔlogL of the model with the effect, nats.
    delta_bic : float
        Decrease of the Bayesian information criterion, 2ΔlogL − Σ ln n; positive values favor the effect.
    log10_p : float
        log10 of the corrected p-value (which may underflow).
    trials : float
        Corrected p-value over the p-value of a single test.
    removes_percent : float
        Part of the unexplained misfit of the spectrum that the effect removes, %. All suggestions of a check have the
        same whole: the misfit without any addition, as in the first step of a study.
    rivals : tuple of str
        Kinds of alternative explanations whose score differs by less than 3 nats (20 : 1).
    found, before : Fit
        Fit with the effect, and fit without it.
    note : str
        Further clause of the explanation; may be empty.
    surplus : float
        Part of the ΔlogL, nats, that a discrepancy of the model explained before. 0 if the model with the effect needs a
        discrepancy too.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.01)+SIN(f=2.5,A=0.01)")
    >>> check = al.AngleRandomWalk().fit(truth.simulate(duration=300, rate=10, seed=1)).check()
    >>> first = check.suggestions[0]
    >>> first.kind, first.significant, first.to_dict()["kind"]
    ('sinusoid', True, 'sinusoid')
    """

    effect: Effect
    significant: bool
    delta_log_likelihood: float
    delta_bic: float
    log10_p: float
    trials: float
    removes_percent: float
    rivals: tuple[str, ...]
    found: Fit
    before: Fit
    note: str = ""
    surplus: float = 0.0

    @cached_property
    def score(self) -> float:
        """Rise of the log evidence plus the prior of the effect (`prior`), nats; suggestions are ranked by it.

        The rise is the ΔlogL, minus `surplus`, minus the cost of the effect's parameters:

        * A suggestion that replaces effects (`replaced_kinds`) has no further cost: its ΔlogL already contains the cost of
          the course of a moving band.
        * A modifier costs ½ ln n for each parameter, n being the effective degrees of freedom (`delta_bic`).
        * Any other effect costs `parameters_cost`.
        """
        effect = self.effect
        if self.replaced_kinds:
            return self.delta_log_likelihood - self.surplus + prior(effect)
        if isinstance(effect, Modifier):
            return 0.5 * self.delta_bic - self.surplus + prior(effect)
        return (
            self.delta_log_likelihood
            - self.surplus
            - parameters_cost(self.solution.effects[-1], self.solution)
            + prior(effect)
        )

    @property
    def rank(self) -> float:
        """Twice the `score`, nats; a former name, which warns of deprecated use."""
        warn_of_former_name("Suggestion.rank", "2 * Suggestion.score")
        return 2.0 * self.score

    @property
    def replaced_kinds(self) -> tuple[str, ...]:
        """Tuple of the kinds that the effect replaces: they are in the model `before`, but not in `found`."""
        kinds = [Counter(e.kind for e in fit.model) for fit in (self.before, self.found)]
        return tuple((kinds[0] - kinds[1]).elements())

    @property
    def solution(self) -> Solution:
        """`Solution` of the refitted model with the effect."""
        return self.found.solution

    @cached_property
    def estimates(self) -> dict[str, Any]:
        """Dict of the parameters of the suggested effect: JSON name → `Estimate` (value and error) or a plain value."""
        fit = self.found
        return estimates(fit.solution, fit.data, fit.recording, [len(fit.model) - 1])[0]

    @cached_property
    def explanation(self) -> str:
        """Text of one or more sentences: name, values, share of the Allan variance and physics of the effect."""
        return explain(self)

    @cached_property
    def gains(self) -> NDArray[np.float64]:
        """Array of the ΔlogL of each bin of the spectrum, 0 where it falls, shape (bins,).

        Empty if the bins of the two fits differ, e.g. because samples are excluded.
        """
        before, after = (
            -0.5 * s.count * (np.log(s.spectrum) + s.power / s.spectrum)
            for s in (self.before.solution, self.solution)
        )
        return np.maximum(after - before, 0.0) if after.size == before.size else np.zeros(0)

    @property
    def check_by(self) -> str:
        """Text that says how to confirm or refute the effect in the laboratory."""
        return self.found.text_of(self.effect, "check_by")

    def __repr__(self) -> str:
        significant = "" if self.significant else ", not significant"
        return (
            f"Suggestion({self.effect}: ΔlogL {self.delta_log_likelihood:.1f}, "
            f"{self.removes_text}{significant})"
        )

    @property
    def removes_text(self) -> str:
        """Text such as ``removes 90 % of the unexplained misfit``, with the percentage of this suggestion."""
        return f"removes {number(self.removes_percent, 2)} % of the unexplained misfit"

    @property
    def kind(self) -> str:
        """Kind of the effect, such as ``sinusoid``."""
        return self.effect.kind

    @property
    def effect_happens_once(self) -> bool:
        """True for one-time events, and for effects with times as parameters (changes of level, exclusions, moving bands).

        One half of a record cannot predict such an effect from the other half, so only its p-value decides.
        """
        effect = self.effect
        return effect.happens_once or any(p.role == "time" for p in effect.parameters)

    @property
    def p_value(self) -> float:
        """P-value corrected for the number of trials, at least 1e-300."""
        return float(10.0 ** max(self.log10_p, -300.0))

    def to_dict(self) -> dict[str, Any]:
        """JSON record (dict) of the suggestion: kind, parameters, significance, evidence, explanation and alternatives."""
        parameters = {name: parameter_dict(value) for name, value in self.estimates.items()}
        return {
            "kind": self.kind,
            "parameters": parameters,
            "significant": self.significant,
            "evidence": {
                "delta_log_likelihood": self.delta_log_likelihood,
                "delta_bic": self.delta_bic,
                "p_value": self.p_value,
                "log10_p_value": self.log10_p,
                "trials": self.trials,
            },
            "removes_percent": self.removes_percent,
            "explanation": self.explanation,
            "check_by": self.check_by,
            "rivals": list(self.rivals),
        }


def explain_same_misfit(first: Suggestion, other: Suggestion) -> bool:
    """True if two suggestions explain the same misfit.

    They are listed as each other's `rivals`, overlap in both frequency and time, or share over half of the smaller
    ΔlogL at the same frequencies. The last test is omitted for exclusions and changes of the noise level, which leave
    the spectrum as it is.
    """
    if other.kind in first.rivals or first.kind in other.rivals:
        return True
    if _ranges_overlap(_band(first.effect), _band(other.effect)) and _ranges_overlap(
        first.effect.when, other.effect.when
    ):
        return True
    one, two = first.gains, other.gains
    if one.size != two.size or any(excludes_or_changes_level(s.effect) for s in (first, other)):
        return False
    return float(np.minimum(one, two).sum()) > MAIN_SHARE * min(float(one.sum()), float(two.sum()))


def _band(effect: Effect) -> tuple[float, float] | None:
    """Pair (lowest, highest) frequency, Hz, that an effect occupies or whose level it changes; None for other effects."""
    return effect.band if isinstance(effect, Modifier) else effect.occupies


def _ranges_overlap(one: tuple[float, float] | None, other: tuple[float, float] | None) -> bool:
    """True if two ranges (low, high) have a value in common; False if one is None."""
    return one is not None and other is not None and one[0] <= other[1] and other[0] <= one[1]


def suggest(
    fit: Fit, whitened: Whitened, on_progress: Progress | None = None
) -> tuple[Suggestion, ...]:
    """Tuple of suggestions for a fit, best first, from all searches.

    `whitened` is the whitened record of the fit. `on_progress` is called with (stages done, number of stages).
    """
    done, stages = count(1), len(SCREENS) + 1

    def progress() -> None:
        """Call `on_progress`, if given, with one more stage done."""
        if on_progress is not None:
            on_progress(next(done), stages)

    base, data = fit.solution, fit.data
    surplus = discrepancy_gain(base, data)
    # Whitened by the model alone: a discrepancy would absorb narrow lines and bands.
    white = whitened_ordinates(base, data, np.ones(base.count.size))
    replace_unsteady_ordinates(white, base, data)
    context = Context(base, data, whitened, white)
    candidates = _look_with_all_screens(context, progress)
    searches = sum(
        _unless_it_fails(screen, partial(screen.searches, context), 0)
        for screen in SCREENS.values()
    )
    levels = [c for c in candidates if c.effect.changes_level]
    overdispersion, loudness = overdispersion_without(base, data, levels, searches)
    scatter = {"spectrum": overdispersion, "time": loudness, "none": 1.0}
    judged = [
        _suggestion(fit, c, searches=searches, surplus=surplus, scatter=scatter[c.family.scatter])
        for c in candidates
    ]
    suggestions = in_order(_with_shares(fit, judged), fit, whitened, overdispersion)
    progress()
    return suggestions


def _look_with_all_screens(context: Context, on_end: Callable[[], None]) -> tuple[Candidate, ...]:
    """Tuple of the candidates of all screens, which run in parallel, each after those that it needs."""
    waiting, running = list(SCREENS.values()), dict[Future[tuple[Candidate, ...]], Screen]()
    with Pool(1 + parallel_searches(context.data)) as pool:
        while waiting or running:
            for screen in [s for s in waiting if context.found.keys() >= {*s.after}]:
                waiting.remove(screen)
                running[pool.submit(_candidates_of, screen, context)] = screen
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                context.found[running.pop(done).name] = done.result()
                trim_memory(context.data.samples.size)
                on_end()
    return tuple(c for name in SCREENS for c in context.found[name])


def _candidates_of(screen: Screen, context: Context) -> tuple[Candidate, ...]:
    """Tuple of the candidates that a screen finds; empty if the screen needs samples, and the data are a summary."""
    if screen.needs_samples and not context.data.whole:
        return ()
    return _unless_it_fails(screen, lambda: tuple(screen.look(context)), ())


def _unless_it_fails(screen: Screen, compute: Callable[[], T], otherwise: T) -> T:
    """Result of `compute` for a screen; `otherwise`, with a warning, if a screen of an installed package raises.

    So a faulty package does not end the check. An exception of a screen of allanite is raised: it is a bug.
    """
    try:
        return compute()
    except Exception as error:
        if not SCREENS.is_installed(screen):
            raise
        failure = f"{type(error).__name__}: {error}"
        warnings.warn(
            f"the screen {screen.name!r} of an installed package failed, and is skipped: {failure}",
            stacklevel=2,
        )
        return otherwise


def _suggestion(
    fit: Fit, candidate: Candidate, *, searches: float, surplus: float, scatter: float
) -> Suggestion:
    """`Suggestion` made from a candidate, with its ΔlogL and its p-value, corrected for the number of `searches`.

    `surplus` is the ΔlogL that the discrepancy of the model without the effect explains. It is added to the ΔlogL if the
    model with the effect needs no discrepancy. The ΔlogL is divided by `scatter` for the p-value. `removes_percent` is NaN
    until `_with_shares`, and `rivals` are empty until `in_order`.
    """
    from scipy.special import log_ndtr

    solution = candidate.solution
    assert solution is not None
    x = candidate.gain
    judged = x if candidate.judged_gain is None else candidate.judged_gain
    if solution.best.scale is not None:
        surplus = 0.0
    # If the model needs no discrepancy with the effect, the null hypothesis is a true model without it.
    judged = (judged + surplus) / scatter
    uncorrected = candidate.log_p_value
    if uncorrected is None:
        uncorrected = log_p_value(candidate.family, judged)
    else:
        uncorrected += judged * (scatter - 1.0)
    log_p = min(0.0, uncorrected + np.log(searches))
    is_line = candidate.family.width > 0.0
    single = -judged if is_line else float(log_ndtr(-np.sqrt(2.0 * judged)))
    penalty = candidate.parameters * np.log(max(float(fit.solution.weight.sum()), 2.0))
    data = candidate.data or fit.data
    found = Fit(fit.recording, solution.model, fit.method, data, solution)
    made = Suggestion(
        effect=solution.model.effects[-1],
        significant=bool(log_p < np.log(FALSE_ALARM_PROBABILITY)),
        delta_log_likelihood=float(x + surplus),
        delta_bic=float(2.0 * (x + surplus) - penalty),
        log10_p=float(log_p / np.log(10.0)),
        trials=float(np.exp(min(max(log_p - single, 0.0), 700.0))),
        removes_percent=math.nan,
        rivals=(),
        found=found,
        before=fit,
        note=candidate.note,
        surplus=float(surplus),
    )
    # A discrepancy names no effect, so that the effect need not explain more than the discrepancy did.
    pays = made.score + made.surplus > min_score(made.effect)
    return replace(made, significant=made.significant and pays)


def _with_shares(fit: Fit, judged: list[Suggestion]) -> list[Suggestion]:
    """List of copies of the suggestions with `removes_percent` set: the part of the unexplained misfit that each removes.

    An exclusion, a change of level or a moving band removes the amount by which the misfit of the spectrum falls. Other
    suggestions remove their ΔlogL. 100 % is the misfit of `fit`, or the largest sum of a removed and a remaining misfit.
    """
    # The bins of `fit.unexplained_misfit` do not resolve a line. A study counts its first step in this way, too.
    removed: list[float] = []
    whole = max(fit.unexplained_misfit, 0.0)
    for s in judged:
        left = max(s.found.unexplained_misfit, 0.0)
        if excludes_or_changes_level(s.effect) or s.effect.moving:
            removed.append(max(fit.unexplained_misfit - left, 0.0))
        else:
            removed.append(max(s.delta_log_likelihood, 0.0))
            whole = max(whole, left + removed[-1])
    return [
        replace(s, removes_percent=100.0 * min(part / whole, 1.0) if whole > 0.0 else 0.0)
        for s, part in zip(judged, removed, strict=True)
    ]
