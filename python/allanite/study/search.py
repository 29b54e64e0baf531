"""Check, add the best missing effect, refit, drop and replace what it made needless; until nothing helps."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.common.blas import one_thread
from allanite.common.errors import TooShortError
from allanite.common.several import Several, by_column, former_use
from allanite.common.threads import before, columns_at_work, results, side_by_side
from allanite.common.validation import positive, recorded
from allanite.effects import Away, Model, Modifier, Stochastic, as_model
from allanite.fit import fit_model
from allanite.fit.likelihood.remembered import trim_memory
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.solution import Process
from allanite.study.drop_and_replace import added_to, pruned, swapped, with_samples_out
from allanite.study.error_comparison import (
    as_good,
    errors_fall,
    predicts,
    rises,
    wider,
    within_chance,
)
from allanite.study.final_replacement import exchanged
from allanite.study.harmonics_and_side_bands import with_companions
from allanite.study.ladder import Rung, Study, came_back
from allanite.study.merged_excursions import every_visit
from allanite.study.merged_levels import one_level, several_levels
from allanite.study.nameless_shape import unstacked
from allanite.study.second_effect import is_there, with_another
from allanite.study.spectrum_changes import alone, bins_moved, faded, moved, rise
from allanite.study.splitting import parted
from allanite.study.story import dropped_on_the_way, story
from allanite.study.wandering_lines import wandering
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

__all__ = ["full", "improve", "improve_columns", "next_rung"]


@one_thread()
def improve(
    recording: Recording,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
) -> Study:
    """Add the best missing effect until nothing significant is left.

    Parameters
    ----------
    recording : Recording
        One column; `improve_columns` improves each of several.
    model : Model, Effect or str
        Where to start.
    on_progress : callable, optional
        Called with (rungs done, most rungs).
    limit : int
        Most additions, beside at most 32 lines and stretches left out: each has ordinates or times of its own.
    tolerance : float, optional
        Per cent of the deviation: a model whose discrepancy is below it is good enough.
    seconds : float, optional
        Time after which no further effect is looked for. The first model is fitted and checked whatever it takes. By
        default a minute of processor time, and ten seconds more for every million samples.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        Samples that cannot be fitted, or an unknown model.
    TooShortError
        Fewer than 32 samples, or constant ones.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.1)+K(K=0.02)")
    >>> study = al.improve(truth.simulate(duration=1000, rate=10, seed=1), "N")
    >>> study.fit.model.name, study.stopped_because
    ('N+K', 'adequate')
    """
    recorded(recording)
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
    recording = fit.recording
    ladder = [Rung(fit)]
    while True:
        check = check_fit(fit)
        if on_progress is not None:
            on_progress(len(ladder), max(limit + 1, len(ladder)))
        stop = _stop(check, tolerance)
        if stop is None and full(ladder, limit):
            stop = "limit"
        better = None
        try:
            with before(deadline, clock):
                if stop is None:
                    better, stop = next_rung(ladder, check), "nothing helps"
                elif stop != "within tolerance":
                    better = _ending(ladder, check)
        except TimeoutError:
            stop = stop or "time"
        if better is None:
            return _study(recording, ladder, check, stop or "nothing helps", tolerance)
        ladder.append(better)
        with suppress(TimeoutError), before(deadline, clock):
            for rung in _more(ladder, check):
                if full(ladder, limit) or _within(rung.fit, tolerance):
                    break
                ladder.append(rung)
        fit = ladder[-1].fit
        for rung in ladder:
            if rung.fit.data is not fit.data:
                rung.fit.data.forget()
        trim_memory(fit.data.n)


def improve_columns(
    recording: Recording,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
) -> Several[Study]:
    """Improve the model of each column, two columns at a time.

    `allanite.characterize` also says what the columns have in common.

    Parameters
    ----------
    recording : Recording
        One or more columns.
    model, on_progress, limit, tolerance, seconds
        As of `improve`.

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
    recorded(recording)
    tasks = by_column(
        recording, lambda c: lambda: improve(c, model, on_progress, limit, tolerance, seconds)
    )
    return Several(dict(zip(tasks, results(side_by_side(list(tasks.values()))), strict=True)))


def _study(
    recording: Recording,
    ladder: list[Rung],
    check: Check,
    stop: str,
    tolerance: float | None,
) -> Study:
    """The result of a search: its steps in the order in which they are read."""
    steps = story(ladder) if stop != "time" else tuple(ladder)
    study = Study(recording, steps, check, stop, tolerance, dropped_on_the_way(ladder))
    return (
        replace(study, stopped_because="nothing helps")
        if stop == "adequate" and study.doubts
        else study
    )


def with_given_designs(model: Model) -> Model:
    """The model with the designs and orders of its filters held where they are given."""

    def held(effect: Effect) -> Effect:
        given = (p.name for p in effect.parameters if p.role == "choice" and p.name != "column")
        names = [n for n in given if effect.values[n] is not None and n not in effect.held]
        filtering = isinstance(effect, Modifier) and names
        return replace(effect, hold=(*effect.hold, *names)) if filtering else effect

    return Model(tuple(map(held, model.effects)))


def _stop(check: Check, tolerance: float | None) -> str | None:
    if check.adequate:
        return "adequate"
    return "within tolerance" if _within(check.fit, tolerance) else None


def full(ladder: Sequence[Rung], limit: int = MAX_ADDED_EFFECTS) -> bool:
    """Whether a ladder is as long as it may be."""
    alone = sum(rung.added is not None and _stands_alone(rung.added) for rung in ladder)
    return alone >= MAX_INDEPENDENT_ADDITIONS or len(ladder) - alone > limit


def _stands_alone(effect: Effect) -> bool:
    """Whether it says nothing of any other: a line, or what takes samples out."""
    return effect.screened == "line" or (isinstance(effect, Modifier) and effect.removes)


def _within(fit: Fit, tolerance: float | None) -> bool:
    return tolerance is not None and fit.discrepancy.percent < tolerance


def next_rung(ladder: Sequence[Rung], check: Check) -> Rung | None:
    """The rung that `improve` puts on a ladder whose last fit was checked, or None if nothing helps."""
    for suggestion in check.significant:
        rung = _rung(ladder, suggestion, check)
        if rung is not None:
            return _with_companions(ladder[-1].fit, rung)
    shape = unstacked(ladder)
    if shape is not None and errors_fall(ladder[-1].fit, shape.fit):
        return shape
    return exchanged(ladder)


def _ending(ladder: Sequence[Rung], check: Check) -> Rung | None:
    """The rung at the end, that adds none: a band gives way to one that moves, a visit to all, an effect to a better."""
    for suggestion in check.significant:
        if suggestion.gives_way or isinstance(suggestion.effect, Away):
            rung = _rung(ladder, suggestion, check)
            if rung is not None and len(rung.new) <= len(rung.removed):
                return rung
    return exchanged(ladder)


def _with_companions(before: Fit, rung: Rung) -> Rung:
    """The rung with the harmonics of a narrow band, or as the side bands of one, where no error rises by it."""
    other = with_companions(before, rung)
    return other if other is rung or errors_fall(rung.fit, other.fit) else rung


def _more(ladder: Sequence[Rung], check: Check) -> Iterator[Rung]:
    """Rungs for what the same check found behind the addition that was just made, and for what came after them.

    One line says nothing of another: each has its own ordinates. Where nothing has given way and the model is where it was,
    another check would find what this one did. What explains the same misfit as an addition is left to the next check.
    """
    ladder = list(ladder)
    lines, still = _is_line(ladder[-1].added), alone(check.fit, ladder[-1])
    came = [s for s in check.significant if any(s.effect is e for e in ladder[-1].new)]
    for suggestion in check.significant:
        if suggestion in came or any(same_misfit(s, suggestion) for s in came):
            continue
        if is_there(suggestion, ladder[-1].fit):
            continue
        if ladder[-1].removed or not (still or lines):
            return
        line = _is_line(suggestion.effect) and not suggestion.note
        if not line and not still:
            return
        rung = _rung(ladder, suggestion, check)
        if (
            rung is None
            or rung.risen is None
            or rung.risen < MIN_RETAINED_GAIN_FRACTION * suggestion.delta_log_likelihood
        ):
            return
        apart = alone(ladder[-1].fit, rung)
        if line and (rung.added is not suggestion.effect or not apart):
            return
        if rung.fit.data is not ladder[-1].fit.data:
            ladder[-1].fit.data.forget()
        ladder.append(rung)
        yield rung
        came.append(suggestion)
        lines, still = lines and line, still and apart


def _is_line(effect: Effect | None) -> bool:
    return effect is not None and effect.screened == "line"


def _rung(ladder: Sequence[Rung], suggestion: Suggestion, check: Check) -> Rung | None:
    """The rung that a suggestion leads to, if it helps; it knows how many tests were made for it."""
    try:
        rung = _helpful(ladder, suggestion, check)
    except TooShortError:
        return None  # of a short record it would leave too little
    if rung is None:
        return None
    kinds = {effect.kind for effect in rung.new}
    after = [own for own in rung.fit.solution.effects if own.effect.kind in kinds] if kinds else []
    if not all(is_placed(own, rung.fit.data.duration) for own in after):
        return None
    hardly = suggestion.effect_happens_once and suggestion.log10_p > MAX_EVENT_LOG10_P
    if hardly and rises(ladder[-1].fit, rung.fit) and not within_chance(rung.fit):
        return None  # hardly an event, and the curve is worse than chance makes it: a part of something else
    return rung if rung.trials is not None else replace(rung, trials=suggestion.trials)


def _helpful(ladder: Sequence[Rung], suggestion: Suggestion, check: Check) -> Rung | None:
    """The rung that a suggestion leads to: with what it needs, without what it makes needless; None if it does not help."""
    fit = ladder[-1].fit
    asked = len(ladder[0].fit.model)
    asked -= sum(rung.dropped_start for rung in ladder)
    gone = {kind for rung in ladder for kind in rung.removed}
    stand_in = {effect.kind for rung in ladder if rung.removed for effect in rung.brought}
    wanders = wandering(fit, suggestion, asked)
    if wanders is not None:
        return wanders
    lines = [s.effect for s in check.significant if s is not suggestion]
    came = added_to(fit, suggestion, asked, lines)
    if came is None:
        return None
    better, gave_way, with_it = came
    if not suggestion.effect_happens_once and not predicts(fit, better):
        return None
    risen = suggestion.delta_log_likelihood - suggestion.surplus
    taken = better
    if gave_way and not suggestion.gives_way:
        risen = rise(fit, better) or risen
    added = suggestion.effect
    # The curve says nothing of when a sensor is loud.
    elsewhere = isinstance(added, Modifier) and added.passing
    falls = elsewhere or errors_fall(fit, better)
    settled = falls and (elsewhere or not wider(fit, better))
    # What was hidden by samples that do not belong is told in the same step, if it is there.
    settled = settled and not (isinstance(added, Modifier) and added.removes and rises(fit, better))
    pair = None if settled else with_another(fit, better, check, falls)
    if pair is None and not falls:
        return None
    if pair is not None:
        two, beside = pair
        if beside.gives_way:
            both_rose = risen + beside.delta_log_likelihood
            return Rung(two, beside.effect, risen=both_rose, trials=beside.trials)
        without, gone_with_it = with_samples_out(better, beside, len(fit.model))
        if gone_with_it:
            rose = risen + rise(better, without)
            return Rung(without, beside.effect, risen=rose, trials=beside.trials)
        less, needless, left = pruned(two, fit, asked, came_back(ladder), stand_in)
        if added.kind in needless and as_good(two, less):
            # It stood for what came beside it.
            needless.remove(added.kind)
            rose = risen + rise(better, less)
            start = asked - left
            return Rung(less, beside.effect, tuple(needless), rose, start, trials=beside.trials)
        # The process is named first: samples that are taken out say nothing of the sensor's noise.
        removes = isinstance(added, Modifier) and added.removes
        both = (beside.effect, added) if removes else (added, beside.effect)
        return Rung(two, both[0], risen=risen + rise(better, two), brought=both[1:])
    every = every_visit(better, asked, check.suggestions) if isinstance(added, Away) else None
    if every is not None:
        better, kinds = every
        added, gave_way = better.model.effects[-1], (*gave_way, *kinds)
        risen += rise(taken, better)
        taken = better
    changes = several_levels(better, asked) if elsewhere else []
    if changes:
        one = one_level(better, changes)
        kinds = tuple(e.kind for e in changes[:-1])
        if one is None:
            return None
        return Rung(one, one.model.effects[-1], (*gave_way, *kinds), risen)
    still = every is None and len(ladder) > 1 and not moved(fit, better)
    if with_it or (still and not faded(fit, better, asked)):
        # What nothing has moved since it was looked at is as good as it was.
        return Rung(better, added, gave_way, risen, brought=with_it)
    new: list[Effect] = [added]
    removed: list[str] = []
    split = _split(better, [len(better.model) - 1], new, removed)
    if split is not None:
        better = split
    else:
        less, needless, still_asked = pruned(better, fit, asked, came_back(ladder), stand_in)
        if needless and (as_good(better, less) or _unseen(needless, better, less)):
            better, removed, asked = less, needless, still_asked
        tried: set[tuple[str, str]] = {(added.kind, kind) for kind in gone}
        own = set(range(asked)) | {len(better.model) - 1}
        # A wandering process that came first may have stood for two.
        own |= {i for i, e in enumerate(better.model) if isinstance(e, Stochastic) and e.wanders}
        # What is missing beside this one has a rung of its own.
        later = {s.kind for s in check.significant if not s.effect.may_be(added)}
        swap = swapped(better, _touched(own, ladder, better), tried, gone | later)
        if swap is not None and errors_fall(better, swap[0]):
            better, kind, other = swap
            if kind == added.kind:
                new = [other]
            else:
                new.append(other)
                removed.append(kind)
    # What came earlier may stand for two that show beside the new one.
    while True:
        places = sorted(_touched(set(range(asked, len(better.model))), ladder, better))
        split = _split(better, places, new, removed)
        if split is None:
            break
        better = split
    risen += rise(taken, better)
    if _ended_where_it_began(fit, better):
        return None
    start = sum(kind in {e.kind for e in ladder[0].fit.model} for kind in removed)
    return Rung(better, new[0], (*gave_way, *removed), risen, start, tuple(new[1:]))


def _unseen(kinds: Sequence[str], fit: Fit, less: Fit) -> bool:
    """Whether the record shows no effect of some kinds, and no error rises by more than half of its scatter without."""
    places = [i for i, e in enumerate(fit.model) if e.kind in kinds]
    if any(is_detected(fit, i) for i in places) or not errors_fall(fit, less):
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


def _split(fit: Fit, places: Sequence[int], new: list[Effect], removed: list[str]) -> Fit | None:
    """The fit with two effects in the place of one that stood for both.

    They enter `new`; that one leaves it, or is among the `removed`.
    """
    found = parted(fit, places)
    if found is None or not errors_fall(fit, found[0]):
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


def _ended_where_it_began(before: Fit, after: Fit) -> bool:
    """Whether what came has gone again: the same kinds, which explain no more than before."""
    old, new = (sorted(e.kind for e in fit.model) for fit in (before, after))
    return (
        old == new
        and evidence_gain(after.solution, before.solution, before.data) < MAX_RIVAL_LOG_EVIDENCE
    )


def _touched(places: set[int], ladder: Sequence[Rung], better: Fit) -> set[int]:
    """Those places of a model that an addition may have left in a wrong light: the new one, and on the first rung all.

    Later, of the random processes those that are seen in a bin whose spectrum has moved: the others were looked at before
    and have the same to explain.
    """
    if len(ladder) == 1:
        return places
    at = bins_moved(ladder[-1].fit, better)
    solution = better.solution
    least = MIN_VISIBLE_POWER_FRACTION * solution.spectrum[at]
    stay = {
        place
        for place, own in enumerate(solution.effects)
        if isinstance(own, Process) and not (own.power[at] > least).any()
    }
    return (places - stay) | (places & {len(better.model) - 1})
