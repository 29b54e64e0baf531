"""Suggestions of missing effects: run all screens, judge their candidates by p-values, and rank them by score.

`Suggestion.score` is the score of a candidate. `allanite.suggestion.ranking` decides ties.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.extensions import values_of_modules
from allanite.common.former import warn_of_former_name
from allanite.common.numbers import number
from allanite.common.threads import Pool
from allanite.effects import Modifier, Stochastic
from allanite.fit.likelihood.remembered import MIN_TRIM_SAMPLES, trim_memory
from allanite.fit.likelihood.whitened import whitened_ordinates
from allanite.fit.result import Fit, parameter_dict
from allanite.fit.rivals.evidence import discrepancy_gain, parameters_cost
from allanite.fit.rivals.line_trials import line_trials
from allanite.fit.rivals.score import prior
from allanite.fit.shapes.matched import slow_families
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY, MAIN_SHARE
from allanite.suggestion.exclusions_first import excludes_or_changes_level
from allanite.suggestion.explanation import explain
from allanite.suggestion.p_values import Family, log_p_value
from allanite.suggestion.ranking import in_order, min_score
from allanite.suggestion.screens._screen import OwnScreen, View
from allanite.suggestion.screens.band_levels import best_levels, screen_band_level
from allanite.suggestion.screens.drifting_bands import bands_that_may_move, screen_drifting_bands
from allanite.suggestion.screens.drifting_lines import bands_with_excess, screen_drifting_lines
from allanite.suggestion.screens.level_changes import (
    overdispersion_without,
    screen_outliers_and_levels,
)
from allanite.suggestion.screens.lines import screen_lines
from allanite.suggestion.screens.slow_functions import screen_slow, with_gains_next_to_best
from allanite.suggestion.screens.spectral import (
    Candidate,
    Screen,
    candidates_elsewhere,
    screen_spectral,
)
from allanite.suggestion.screens.tone_bursts import screen_tone_bursts

#: Number of searches that run at a time, in addition to that of the spectrum. Large records use one, since each search
#: holds copies of the record.
WORKERS = 2
#: Screens that need no other screen than that of the spectrum.
OWN_SCREENS: tuple[OwnScreen, ...] = tuple(
    values_of_modules("SCREEN", "allanite.suggestion.screens")
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.effects import Effect
    from allanite.fit.likelihood.whitened import Whitened
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
        """Rise of the log evidence plus the log prior of the effect, nats; suggestions are ranked by it.

        The ΔlogL of a moving band already contains the cost of its course.
        """
        effect = self.effect
        if self.gives_way:
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
    def gives_way(self) -> tuple[str, ...]:
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
        return self.found.estimates_of_last

    @cached_property
    def explanation(self) -> str:
        """Text of one or more sentences: name, values, share of the Allan variance and physics of the effect."""
        return explain(self.effect, self.found, self.before, self.note)

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
        """True for one-time events, and for all effects that have times as parameters (changes of level, exclusions).

        One half of a record cannot predict such an effect from the other half, so only its p-value decides.
        """
        return any(p.role == "time" for p in self.effect.parameters) or getattr(
            self.effect, "happens_once", False
        )

    @property
    def p_value(self) -> float:
        """P-value corrected for the number of trials, at least 1e-300."""
        return float(10.0 ** max(self.log10_p, -300.0))

    def to_dict(self) -> dict[str, Any]:
        """JSON record (dict) of the suggestion: kind, parameters, significance, evidence, explanation and alternatives."""
        parameters = {}
        for name, value in self.estimates.items():
            parameters[name] = parameter_dict(value)
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
    least = min(float(one.sum()), float(two.sum()))
    return least > 0.0 and float(np.minimum(one, two).sum()) > MAIN_SHARE * least


def _band(effect: Effect) -> tuple[float, float] | None:
    """Pair (lowest, highest) frequency, Hz, that an effect occupies or whose level it changes; None for other effects."""
    return effect.band if isinstance(effect, Modifier) else effect.occupies


def _ranges_overlap(one: tuple[float, float] | None, other: tuple[float, float] | None) -> bool:
    """True if two ranges (low, high) have a value in common; False if one is None."""
    if one is None or other is None:
        return False
    return one[0] <= other[1] and other[0] <= one[1]


def suggest(
    fit: Fit, whitened: Whitened, on_progress: Progress | None = None
) -> tuple[Suggestion, ...]:
    """Tuple of suggestions for a fit, best first, from all searches.

    `whitened` is the whitened record of the fit. `on_progress` is called with (stages done, 5).
    """
    done = count(1)

    def progress() -> None:
        """Call `on_progress`, if given, with one more stage done."""
        if on_progress is not None:
            on_progress(next(done), 5)

    surplus = discrepancy_gain(fit.solution, fit.data)
    found = _look_with_all_screens(fit, whitened, progress)
    with Pool(WORKERS) as pool:
        judged = pool.map(
            lambda c: _suggestion(
                fit, c, found.families, found.searches, surplus, found.scatter_of(c)
            ),
            found.candidates,
        )
        suggestions = in_order(_with_shares(fit, list(judged)), fit, found.overdispersion)
    progress()
    return suggestions


@dataclass(frozen=True, slots=True)
class _Found:
    """What all screens of a check found.

    Attributes
    ----------
    candidates : tuple of Candidate
    families : dict of str to Family
        Families that share their false alarms, by name.
    searches : int
        Number of searches that share the false alarms of the check.
    slow : frozenset of str
        Names of the families of slow functions.
    overdispersion, loudness : float
        Overdispersion of the spectrum and largest relative power over time, due to a missing change of level.
    """

    candidates: tuple[Candidate, ...]
    families: dict[str, Family]
    searches: int
    slow: frozenset[str]
    overdispersion: float
    loudness: float

    def scatter_of(self, candidate: Candidate) -> float:
        """Factor, at least 1, by which missing changes of the noise level raise the ΔlogL of a candidate by chance.

        For a slow function of time, it is the largest relative power at any time; otherwise the overdispersion of the
        spectrum.
        """
        return self.loudness if candidate.family in self.slow else self.overdispersion


def _look_with_all_screens(fit: Fit, whitened: Whitened, progress: Callable[[], None]) -> _Found:
    """`_Found`: candidates of all searches for missing effects of a fit, with what is needed for their p-values.

    `progress` is called without arguments after each of four stages.
    """
    base, data = fit.solution, fit.data
    # Whitened by the model alone: a discrepancy would absorb narrow lines and bands.
    white = whitened_ordinates(base, data, np.ones(base.count.size))
    with Pool(WORKERS if data.samples.size < MIN_TRIM_SAMPLES else 1) as pool:
        lines_found = pool.submit(screen_lines, base, data, whitened.samples, white)
        spectral = screen_spectral(base, data, white)
        progress()
        trim_memory(data.samples.size)
        rival = _best_drifting_process(spectral.candidates)
        slow = slow_families(base.model, data.covariates)
        found = {
            name: pool.submit(screen_slow, blanks, base, data, rival, lambda: whitened)
            for name, blanks in sorted(slow.items())
        }
        moments = pool.submit(screen_outliers_and_levels, base, data, whitened)
        view = View(base, data, whitened, spectral.candidates)
        alone = [pool.submit(screen.look, view) for screen in OWN_SCREENS]
        swelling = pool.submit(screen_band_level, base, data, whitened)
        steady = lines_found.result()
        bands = bands_with_excess(spectral.candidates, base, data, white)
        lines = (*steady, *screen_drifting_lines(bands, steady, base, data))
        lines = (*lines, *screen_tone_bursts(bands, (*lines, *spectral.candidates), base, data))
        followed = bands_that_may_move(base, data)
        moving = screen_drifting_bands(followed, base, data)
        progress()
        outliers, levels = moments.result()
        levels = best_levels((*levels, swelling.result()), data.n)
        own = [candidate for one in alone for candidate in one.result()]
        progress()
        screens = with_gains_next_to_best({name: f.result() for name, f in found.items()}, data)
        progress()
    families = _families(spectral, screens, data.n, bool(followed))
    # Forms of a change of level beyond one interval: several levels, a period, one band, and each logged column.
    searches = len(families) + 3 + len(data.covariates)
    candidates: tuple[Candidate, ...] = (
        *spectral.candidates,
        *lines,
        *moving,
        *(c for screen in screens.values() for c in screen.candidates),
        *(c for c in (outliers, *levels) if c is not None),
        *own,
    )
    overdispersion, loudness = overdispersion_without(base, data, levels, searches)
    return _Found(candidates, families, searches, frozenset(slow), overdispersion, loudness)


def suggestions_elsewhere(refused: Suggestion) -> Iterator[Suggestion]:
    """Iterator over significant suggestions of the same kind as a refused band, at other frequencies.

    Their p-values use the same number of trials as the refused band. Empty if the refused effect replaces other effects,
    or is no band that was found in the spectrum.
    """
    # A check suggests only the best band of a kind. Its trials are the most, since trials rise with ΔlogL.
    fit, effect = refused.before, refused.effect
    if effect.screened != "spectral" or effect.occupies is None or refused.gives_way:
        return
    surplus = discrepancy_gain(fit.solution, fit.data)
    for candidate in candidates_elsewhere(effect, fit.solution, fit.data):
        alone = {candidate.family: Family(candidate.family, (0.0,))}
        one = _suggestion(fit, candidate, alone, refused.trials, surplus, 1.0)
        if one.significant:
            yield _with_shares(fit, [one])[0]


def _best_drifting_process(candidates: Iterable[Candidate]) -> Solution | None:
    """`Solution` of the model with the candidate of the best slowly drifting random process; None without one.

    A slow function of time must explain something beyond this process.
    """
    red = [c for c in candidates if isinstance(c.effect, Stochastic) and c.effect.wanders]
    return max(red, key=lambda c: c.gain).solution if red else None


def _families(
    spectral: Screen, screens: dict[str, Screen], n: int, followed: bool
) -> dict[str, Family]:
    """Dict from name to `Family`: the groups of searches, each of which has one false-alarm probability.

    `spectral` is the search of the spectrum; `screens` are those for slow functions of time; `n` is the number of
    samples. With `followed`, the dict also has the group ``course`` of bands with a moving frequency.
    """
    names = sorted({"spectral", *spectral.families})
    families = {name: Family(name) for name in ("level", "outlier")}
    families |= {screen.family: Family(screen.family) for screen in OWN_SCREENS}
    families["line"] = Family("line", width=line_trials(n))
    for name in names:
        arcs = [a for a, f in zip(spectral.arcs, spectral.families, strict=True) if f == name]
        families[name] = Family(name, tuple(arcs))
    for name, screen in screens.items():
        if screen.arcs:
            families[name] = Family(name, screen.arcs, sides=2)
    if followed:
        families["course"] = Family("course")
    return families


def _suggestion(
    fit: Fit,
    candidate: Candidate,
    families: dict[str, Family],
    searches: float,
    surplus: float,
    scatter: float,
) -> Suggestion:
    """`Suggestion` made from a candidate, with its ΔlogL and its p-value, corrected for the number of `searches`.

    `families` maps the name of a family to the trials of its search. `surplus` is the ΔlogL that the discrepancy of the
    model without the effect explains. It is added to the ΔlogL if the model with the effect needs no discrepancy. The
    ΔlogL is divided by `scatter` for the p-value, except for levels, outliers and excluded segments. `removes_percent`
    is NaN and `rivals` is empty; callers fill them in.
    """
    from scipy.special import log_ndtr

    solution = candidate.solution
    assert solution is not None
    x = candidate.gain
    judged = x if candidate.judged_gain is None else candidate.judged_gain
    if solution.best.scale is not None:
        surplus = 0.0
    # If the model needs no discrepancy with the effect, the null hypothesis is a true model without it.
    judged += surplus
    if candidate.family not in {"level", "outlier", "stretch"}:
        judged /= scatter
    family = families[candidate.family]
    uncorrected = candidate.log_p_value
    if candidate.family in {"line", "band"} and uncorrected is not None:
        uncorrected += judged * (scatter - 1.0)
    if uncorrected is None:
        uncorrected = log_p_value(family, judged)
    log_p = min(0.0, uncorrected + np.log(searches))
    single = -judged if candidate.family == "line" else float(log_ndtr(-np.sqrt(2.0 * judged)))
    penalty = candidate.parameters * np.log(max(float(fit.solution.weight.sum()), 2.0))
    data = candidate.data or fit.data
    found = Fit(fit.recording, solution.model, fit.method, data, solution)
    made = Suggestion(
        solution.model.effects[-1],
        bool(log_p < np.log(FALSE_ALARM_PROBABILITY)),
        float(x + surplus),
        float(2.0 * (x + surplus) - penalty),
        float(log_p / np.log(10.0)),
        float(np.exp(min(max(log_p - single, 0.0), 700.0))),
        math.nan,
        (),
        found,
        fit,
        candidate.note,
        float(surplus),
    )
    # A discrepancy names no effect, so that the effect need not explain more than the discrepancy did.
    pays = made.score + made.surplus > min_score(made.effect)
    return replace(made, significant=made.significant and pays)


def _with_shares(fit: Fit, judged: list[Suggestion]) -> list[Suggestion]:
    """List of copies of the suggestions with `removes_percent` set.

    The percentage is the part of the unexplained misfit of `fit` that the suggestion removes. An exclusion, a change of
    level or a moving band removes the amount by which the misfit of the spectrum falls. Other suggestions remove their
    ΔlogL. 100 % is the misfit of `fit`, or more: the largest sum of a removed ΔlogL and the misfit that remains after
    it.
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
