"""Search: check, add the best missing effect, refit, drop and replace what it makes needless, until nothing helps."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from allanite.common.blas import one_thread
from allanite.common.errors import TooShortError
from allanite.common.several import Several, by_column, former_use
from allanite.common.threads import columns_at_work, results_or_raise, side_by_side, with_deadline
from allanite.common.validation import positive, require_recording
from allanite.effects import Away, Model, Modifier, Stochastic, as_model
from allanite.fit import fit_model
from allanite.fit.likelihood.remembered import trim_memory
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.solution import Process
from allanite.study.drop_and_replace import (
    with_addition,
    with_best_alternative,
    with_exclusion,
    without_needless_effects,
)
from allanite.study.error_comparison import (
    allan_error_rises,
    allan_error_within_scatter,
    discrepancy_rises,
    is_as_good,
    no_error_rises,
    predicts_as_well,
)
from allanite.study.final_replacement import best_replacement
from allanite.study.harmonics_and_side_bands import with_harmonics_or_side_bands
from allanite.study.ladder import Rung, SearchInterrupted, Study, kinds_added_again
from allanite.study.merged_excursions import with_all_excursions
from allanite.study.merged_levels import levels_to_merge, with_merged_level
from allanite.study.nameless_shape import nameless_shape_step
from allanite.study.second_effect import is_already_explained, with_second_effect
from allanite.study.spectrum_changes import (
    changed_bins,
    changes_spectrum,
    delta_logl,
    hides_another,
    leaves_others_unchanged,
)
from allanite.study.splitting import with_pair
from allanite.study.story import story, tried_and_dropped
from allanite.study.wandering_lines import wandering_line_step
from allanite.suggestion import check_fit, same_misfit
from allanite.suggestion.constants import (
    DEFAULT_SECONDS,
    DEFAULT_SECONDS_PER_SAMPLE,
    MAX_ADDED_EFFECTS,
    MAX_ALLAN_RISE_SCATTERS,
    MAX_EVENT_LOG10_P,
    MAX_INDEPENDENT_ADDITIONS,
    MIN_RETAINED_GAIN_FRACTION,
    MIN_VISIBLE_POWER_FRACTION,
)
from allanite.suggestion.screens.slow_functions import is_placed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from allanite.effects import Effect
    from allanite.fit.result import Fit
    from allanite.recording import Recording
    from allanite.suggestion import Check, Suggestion
    from allanite.summary import Summary

__all__ = ["improve", "improve_columns", "is_full", "next_step"]


@one_thread()
def improve(
    recording: Recording | Summary,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
) -> Study:
    """Study that adds the best missing effect until nothing significant is left.

    Parameters
    ----------
    recording : Recording or Summary
        One column; `improve_columns` improves each of several.
    model : Model, Effect or str
        Where to start.
    on_progress : callable, optional
        Called with (steps done, most steps).
    limit : int
        Most additions. Up to 32 lines and excluded segments, which have their own ordinates or times, do not count.
    tolerance : float, optional
        % of the deviation. The search ends if the model discrepancy is below it.
    seconds : float, optional
        Time limit of the search, s. The first model is always fitted and checked. By default the limit is 60 s of
        processor time and 10 s more for each million samples.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        Samples that cannot be fitted, or an unknown model.
    TooShortError
        Fewer than 32 samples, or constant ones.
    SearchInterrupted
        Ctrl-C after the first check. This `KeyboardInterrupt` (`allanite.study.SearchInterrupted`) holds the steps
        found so far in `study`.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.1)+K(K=0.02)")
    >>> study = al.improve(truth.simulate(duration=1000, rate=10, seed=1), "N")
    >>> study.fit.model.name, study.stopped_because
    ('N+K', 'adequate')
    """
    require_recording(recording)
    if tolerance is not None:
        tolerance = positive(
            tolerance, "tolerance", "%", "give per cent of the deviation, such as 5"
        )
    if len(recording.columns) > 1:
        former_use(recording.columns, "al.improve_columns(recording, model)")
        several: Any = improve_columns(recording, model, on_progress, limit, tolerance, seconds)
        return several
    if seconds is None:
        clock = time.process_time
        allowed = columns_at_work() * (DEFAULT_SECONDS + DEFAULT_SECONDS_PER_SAMPLE * recording.n)
    else:
        clock = time.monotonic
        allowed = positive(seconds, "seconds", "s", "give seconds, such as 60")
    deadline = clock() + allowed
    fit = fit_model(recording, with_given_designs(as_model(model)))
    search = _Search([Rung(fit)], limit, tolerance)
    try:
        stop = search.run(deadline, clock, on_progress)
    except KeyboardInterrupt:
        if search.check is None:
            raise
        raise SearchInterrupted(search.study("interrupted")) from None
    return search.study(stop)


@dataclass
class _Search:
    """Stepwise search: its steps so far, and the last check with the number of steps that it covers."""

    ladder: list[Rung]
    limit: int
    tolerance: float | None
    check: Check | None = None
    checked: int = 0

    def run(
        self,
        deadline: float,
        clock: Callable[[], float],
        on_progress: Callable[[int, int], None] | None,
    ) -> str:
        """Add steps until the search ends. Returns the reason, as `Study.stopped_because` states it."""
        ladder = self.ladder
        while True:
            fit = ladder[-1].fit
            for rung in ladder:
                if rung.fit.data is not fit.data:
                    rung.fit.data.forget()
            trim_memory(fit.data.n)
            check = check_fit(fit)
            self.check, self.checked = check, len(ladder)
            if on_progress is not None:
                on_progress(len(ladder), max(self.limit + 1, len(ladder)))
            stop = _stop_reason(check, self.tolerance)
            if stop is None and is_full(ladder, self.limit):
                stop = "limit"
            better = None
            try:
                with with_deadline(deadline, clock):
                    if stop is None:
                        better, stop = next_step(ladder, check), "nothing helps"
                    elif stop != "within tolerance":
                        better = _final_step(ladder, check)
            except TimeoutError:
                stop = stop or "time"
            if better is None:
                return stop or "nothing helps"
            ladder.append(better)
            with suppress(TimeoutError), with_deadline(deadline, clock):
                for rung in _further_steps(ladder, check):
                    within = _is_within_tolerance(rung.fit, self.tolerance)
                    if is_full(ladder, self.limit) or within:
                        break
                    ladder.append(rung)

    def study(self, stop: str) -> Study:
        """Study of the steps that were checked."""
        assert self.check is not None
        ladder = self.ladder[: self.checked]
        return _study(self.check.fit.recording, ladder, self.check, stop, self.tolerance)


def improve_columns(
    recording: Recording | Summary,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
) -> Several[Study]:
    """Studies of several columns, two columns at a time.

    `allanite.characterize` also compares the columns.

    Parameters
    ----------
    recording : Recording or Summary
        One or more columns.
    model, on_progress, limit, tolerance
        As of `improve`.
    seconds : float, optional
        Time limit of each column, s: every column gets this time. `allanite.characterize` shares its limit among the
        columns.

    Returns
    -------
    Several
        A mapping from the name of a column to its `Study`.

    Raises
    ------
    InputError, TooShortError
        As of `improve`.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> studies = al.improve_columns(log, "N")
    >>> [study.stopped_because for study in studies.values()]
    ['adequate', 'adequate']
    """
    require_recording(recording)
    tasks = by_column(
        recording, lambda c: lambda: improve(c, model, on_progress, limit, tolerance, seconds)
    )
    return Several(
        dict(zip(tasks, results_or_raise(side_by_side(list(tasks.values()))), strict=True))
    )


def _study(
    recording: Recording,
    ladder: list[Rung],
    check: Check,
    stop: str,
    tolerance: float | None,
) -> Study:
    """Result of a search, with its steps in the order that users read."""
    steps = tuple(ladder) if stop in {"time", "interrupted"} else story(ladder)
    study = Study(recording, steps, check, stop, tolerance, tried_and_dropped(ladder))
    return (
        replace(study, stopped_because="nothing helps")
        if stop == "adequate" and study.doubts
        else study
    )


def with_given_designs(model: Model) -> Model:
    """Model in which the designs and orders of filters that the user gave are held."""

    def held(effect: Effect) -> Effect:
        """The effect with its given choices held, if it is a filter."""
        given = (p.name for p in effect.parameters if p.role == "choice" and p.name != "column")
        names = [n for n in given if effect.values[n] is not None and n not in effect.held]
        filtering = isinstance(effect, Modifier) and names
        return replace(effect, hold=(*effect.hold, *names)) if filtering else effect

    return Model(tuple(map(held, model.effects)))


def _stop_reason(check: Check, tolerance: float | None) -> str | None:
    """Reason to stop after a check, or None: ``adequate`` or ``within tolerance``."""
    if check.adequate:
        return "adequate"
    return "within tolerance" if _is_within_tolerance(check.fit, tolerance) else None


def is_full(ladder: Sequence[Rung], limit: int = MAX_ADDED_EFFECTS) -> bool:
    """True if the search has made as many additions as it may."""
    independent = sum(rung.added is not None and _is_independent(rung.added) for rung in ladder)
    return independent >= MAX_INDEPENDENT_ADDITIONS or len(ladder) - independent > limit


def _is_independent(effect: Effect) -> bool:
    """True if the effect does not affect others: a line, or an exclusion of samples."""
    return effect.screened == "line" or (isinstance(effect, Modifier) and effect.removes)


def _is_within_tolerance(fit: Fit, tolerance: float | None) -> bool:
    """True if the model discrepancy is below the tolerance, if there is one."""
    return tolerance is not None and fit.discrepancy.percent < tolerance


def next_step(ladder: Sequence[Rung], check: Check) -> Rung | None:
    """Next step of `improve` after a check of the last fit, or None if nothing helps."""
    for suggestion in check.significant:
        rung = _step_of(ladder, suggestion, check)
        if rung is not None:
            return _with_harmonics(ladder[-1].fit, rung)
    return nameless_shape_step(ladder) or best_replacement(ladder)


def _final_step(ladder: Sequence[Rung], check: Check) -> Rung | None:
    """Last step after an adequate check that adds no effect, or None.

    A moving band may replace a band, one effect may replace all excursions, a nameless shape a stack of effects, or an
    alternative with a higher score an effect.
    """
    for suggestion in check.significant:
        if suggestion.gives_way or isinstance(suggestion.effect, Away):
            rung = _step_of(ladder, suggestion, check)
            if rung is not None and len(rung.new) <= len(rung.removed):
                return rung
    return nameless_shape_step(ladder) or best_replacement(ladder)


def _with_harmonics(before: Fit, rung: Rung) -> Rung:
    """The step with the harmonics or side bands of a new narrow band, unless they raise an error."""
    other = with_harmonics_or_side_bands(before, rung)
    return other if other is rung or no_error_rises(rung.fit, other.fit) else rung


def _further_steps(ladder: Sequence[Rung], check: Check) -> Iterator[Rung]:
    """Further steps from the same check, as long as another check would find the same.

    Lines do not affect each other. After any other addition, the spectrum must not have changed, and no effect may have
    left. Suggestions that explain the same misfit as an addition are left to the next check.
    """
    ladder = list(ladder)
    lines, still = _is_line(ladder[-1].added), leaves_others_unchanged(check.fit, ladder[-1])
    added = [s for s in check.significant if any(s.effect is e for e in ladder[-1].new)]
    for suggestion in check.significant:
        if suggestion in added or any(same_misfit(s, suggestion) for s in added):
            continue
        if is_already_explained(suggestion, ladder[-1].fit):
            continue
        if ladder[-1].removed or not (still or lines):
            return
        line = _is_line(suggestion.effect) and not suggestion.note
        if not line and not still:
            return
        rung = _step_of(ladder, suggestion, check)
        if (
            rung is None
            or rung.risen is None
            or rung.risen < MIN_RETAINED_GAIN_FRACTION * suggestion.delta_log_likelihood
        ):
            return
        apart = leaves_others_unchanged(ladder[-1].fit, rung)
        if line and (rung.added is not suggestion.effect or not apart):
            return
        if rung.fit.data is not ladder[-1].fit.data:
            ladder[-1].fit.data.forget()
        ladder.append(rung)
        yield rung
        added.append(suggestion)
        lines, still = lines and line, still and apart


def _is_line(effect: Effect | None) -> bool:
    """True if the effect is a line."""
    return effect is not None and effect.screened == "line"


def _step_of(ladder: Sequence[Rung], suggestion: Suggestion, check: Check) -> Rung | None:
    """Step that a suggestion leads to, or None if it does not help; the step records the trials of its search."""
    try:
        rung = _improving_step(ladder, suggestion, check)
    except TooShortError:
        return None  # the exclusion would leave too few samples
    if rung is None:
        return None
    kinds = {effect.kind for effect in rung.new}
    after = [own for own in rung.fit.solution.effects if own.effect.kind in kinds] if kinds else []
    if not all(is_placed(own, rung.fit.data.duration) for own in after):
        return None
    hardly = suggestion.effect_happens_once and suggestion.log10_p > MAX_EVENT_LOG10_P
    if (
        hardly
        and allan_error_rises(ladder[-1].fit, rung.fit)
        and not allan_error_within_scatter(rung.fit)
    ):
        return None  # a weak event that makes the curve worse is probably part of another effect
    return rung if rung.trials is not None else replace(rung, trials=suggestion.trials)


def _improving_step(ladder: Sequence[Rung], suggestion: Suggestion, check: Check) -> Rung | None:
    """Step with a suggestion, what it needs beside it, and without what it makes needless; None if it does not help.

    The cases in order: a wandering line; a failed addition with a second effect; merged excursions; merged changes of
    level; an addition that changes nothing else; and the general case, which splits, drops and replaces other
    effects.
    """
    fit = ladder[-1].fit
    start_count = len(ladder[0].fit.model)
    start_count -= sum(rung.dropped_start for rung in ladder)
    gone = {kind for rung in ladder for kind in rung.removed}
    stand_in = {effect.kind for rung in ladder if rung.removed for effect in rung.brought}
    wanders = wandering_line_step(fit, suggestion, start_count)
    if wanders is not None:
        return wanders
    lines = [s.effect for s in check.significant if s is not suggestion]
    addition = with_addition(fit, suggestion, start_count, lines)
    if addition is None:
        return None
    better, gave_way, with_it = addition
    if not suggestion.effect_happens_once and not predicts_as_well(fit, better):
        return None
    risen = suggestion.delta_log_likelihood - suggestion.surplus
    taken = better
    if gave_way and not suggestion.gives_way:
        risen = delta_logl(fit, better) or risen
    added = suggestion.effect
    # The Allan curve does not show when a sensor is loud.
    elsewhere = isinstance(added, Modifier) and added.passing
    falls = elsewhere or no_error_rises(fit, better)
    settled = falls and (elsewhere or not discrepancy_rises(fit, better))
    # An effect that the excluded samples had hidden is added in the same step.
    settled = settled and not (
        isinstance(added, Modifier) and added.removes and allan_error_rises(fit, better)
    )
    pair = None if settled else with_second_effect(fit, better, check, falls)
    if pair is None and not falls:
        return None
    if pair is not None:
        two, beside = pair
        if beside.gives_way:
            both_rose = risen + beside.delta_log_likelihood
            return Rung(two, beside.effect, risen=both_rose, trials=beside.trials)
        without, gone_with_it = with_exclusion(better, beside, len(fit.model))
        if gone_with_it:
            rose = risen + delta_logl(better, without)
            return Rung(without, beside.effect, risen=rose, trials=beside.trials)
        less, needless, left = without_needless_effects(
            two, fit, start_count, kinds_added_again(ladder), stand_in
        )
        if added.kind in needless and is_as_good(two, less):
            # The first addition stood for the second one.
            needless.remove(added.kind)
            rose = risen + delta_logl(better, less)
            start = start_count - left
            return Rung(less, beside.effect, tuple(needless), rose, start, trials=beside.trials)
        # The process is named first, since excluded samples say nothing about the sensor's noise.
        removes = isinstance(added, Modifier) and added.removes
        both = (beside.effect, added) if removes else (added, beside.effect)
        return Rung(two, both[0], risen=risen + delta_logl(better, two), brought=both[1:])
    every = (
        with_all_excursions(better, start_count, check.suggestions)
        if isinstance(added, Away)
        else None
    )
    if every is not None:
        better, kinds = every
        added, gave_way = better.model.effects[-1], (*gave_way, *kinds)
        risen += delta_logl(taken, better)
        taken = better
    changes = levels_to_merge(better, start_count) if elsewhere else []
    if changes:
        one = with_merged_level(better, changes)
        kinds = tuple(e.kind for e in changes[:-1])
        if one is None:
            return None
        return Rung(one, one.model.effects[-1], (*gave_way, *kinds), risen)
    still = every is None and len(ladder) > 1 and not changes_spectrum(fit, better)
    if with_it or (still and not hides_another(fit, better, start_count)):
        # Nothing else changed, so there is nothing to drop or replace.
        return Rung(better, added, gave_way, risen, brought=with_it)
    new: list[Effect] = [added]
    removed: list[str] = []
    split = _with_split(better, [len(better.model) - 1], new, removed)
    if split is not None:
        better = split
    else:
        less, needless, still_asked = without_needless_effects(
            better, fit, start_count, kinds_added_again(ladder), stand_in
        )
        if needless and (is_as_good(better, less) or _are_undetected(needless, better, less)):
            better, removed, start_count = less, needless, still_asked
        tried: set[tuple[str, str]] = {(added.kind, kind) for kind in gone}
        own = set(range(start_count)) | {len(better.model) - 1}
        # A wandering process that was added earlier may have stood for two.
        own |= {i for i, e in enumerate(better.model) if isinstance(e, Stochastic) and e.wanders}
        # Significant effects that cannot be confused with this one get a step of their own.
        later = {s.kind for s in check.significant if not s.effect.may_be(added)}
        swap = with_best_alternative(
            better, _affected_places(own, ladder, better), tried, gone | later
        )
        if swap is not None and no_error_rises(better, swap[0]):
            better, kind, other = swap
            if kind == added.kind:
                new = [other]
            else:
                new.append(other)
                removed.append(kind)
    # An earlier addition may stand for two effects that appear beside the new one.
    while True:
        places = sorted(
            _affected_places(set(range(start_count, len(better.model))), ladder, better)
        )
        split = _with_split(better, places, new, removed)
        if split is None:
            break
        better = split
    risen += delta_logl(taken, better)
    if _is_unchanged(fit, better):
        return None
    start = sum(kind in {e.kind for e in ladder[0].fit.model} for kind in removed)
    return Rung(better, new[0], (*gave_way, *removed), risen, start, tuple(new[1:]))


def _are_undetected(kinds: Sequence[str], fit: Fit, less: Fit) -> bool:
    """True if the record shows none of these kinds, and the Allan error hardly rises without them."""
    places = [i for i, e in enumerate(fit.model) if e.kind in kinds]
    if any(is_detected(fit, i) for i in places) or not no_error_rises(fit, less):
        return False
    had, has, chance = (
        value or 0.0
        for value in (
            fit.curve.rms_percent,
            less.curve.rms_percent,
            less.curve.chance_percent,
        )
    )
    return has - had <= MAX_ALLAN_RISE_SCATTERS * chance


def _with_split(
    fit: Fit, places: Sequence[int], new: list[Effect], removed: list[str]
) -> Fit | None:
    """Fit with two effects in the place of one that stood for both, or None. The lists `new` and `removed` are updated."""
    found = with_pair(fit, places)
    if found is None or not no_error_rises(fit, found[0]):
        return None
    better, place, pair = found
    kind = fit.model.effects[place].kind
    own = next((i for i, effect in enumerate(new) if effect.kind == kind), None)
    if own is None:
        removed.append(kind)
        new += pair
    else:
        new[own : own + 1] = pair
    return better


def _is_unchanged(before: Fit, after: Fit) -> bool:
    """True if the model has the same kinds of effects as before and explains no more."""
    old, new = (sorted(e.kind for e in fit.model) for fit in (before, after))
    return (
        old == new
        and evidence_gain(after.solution, before.solution, before.data) < MAX_RIVAL_LOG_EVIDENCE
    )


def _affected_places(places: set[int], ladder: Sequence[Rung], better: Fit) -> set[int]:
    """Those places of a model that must be examined after an addition: all after the first step, later the affected ones.

    A random process is affected if it is visible in a bin whose spectrum has changed. The new effect is always examined.
    """
    if len(ladder) == 1:
        return places
    at = changed_bins(ladder[-1].fit, better)
    solution = better.solution
    least = MIN_VISIBLE_POWER_FRACTION * solution.spectrum[at]
    stay = {
        place
        for place, own in enumerate(solution.effects)
        if isinstance(own, Process) and not (own.power[at] > least).any()
    }
    return (places - stay) | (places & {len(better.model) - 1})
