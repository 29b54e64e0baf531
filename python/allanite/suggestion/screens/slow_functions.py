"""Screens of slow functions of time and of other columns: drifts, events, temperature dependences.

Each kind is a matched filter on the whitened ordinates at every point of its shape grid; the best point is refitted. A slow
function must explain something that a random process does not. Its p-value is therefore that of what it adds to the model
*with* the slowly drifting process of the highest ΔlogL; otherwise any slow column explains any random walk (spurious
regression).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.parameters import NORMAL
from allanite.common.threads import Pool
from allanite.effects import CATALOG, Deterministic, Effect, Stochastic
from allanite.fit.engine import solve
from allanite.fit.estimates import deterministic_shape_error, shape_error
from allanite.fit.likelihood.remembered import trim_memory
from allanite.fit.likelihood.whitened import cell_means, expected_level
from allanite.fit.missing.completion import complete_and_fit, information_ratio
from allanite.fit.rivals.columns import follow_columns_consistently
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, parameters_cost
from allanite.fit.shapes.matched import best_spans, grid_points, matched_gains, slow_families
from allanite.fit.solution import Regressed, Solution
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAIN_SHARE,
    MAX_NOISE_REFIT_FRACTION,
    MAX_SHORT_EVENT_SAMPLES,
    MAX_STEP_TIME_ERROR,
    MIN_SEGMENT_SAMPLES,
)
from allanite.suggestion.p_values import (
    Family,
    arc_length,
    log_chi2_tail,
    log_p_value,
    may_become_significant,
)
from allanite.suggestion.screens._screen import Candidate, Context, Screen, parallel_searches
from allanite.suggestion.screens.several_excursions import several_excursions

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise


#: Maximum number of cells of the record in which the noise level and the time of an event are resolved.
TIME_CELLS = 8192
#: Number of shapes tried between the two neighbors of the best point of a grid.
REFINED_POINTS = 33


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple of refitted `Candidate` of each slow function that the model may get, and of its significant forms."""
    data = context.data
    slow = slow_families(context.solution.model, data.covariates)
    with Pool(parallel_searches(data)) as pool:
        families = pool.map(lambda name: _screen_family(slow[name], context), sorted(slow))
        found: list[Candidate] = []
        arcs: dict[str, tuple[float, ...]] = {}
        for candidates, own in families:
            found += candidates
            for name, angle in own:
                arcs[name] = (*arcs.get(name, ()), angle)
    trials = {
        name: Family(name, own, sides=2, scatter="time" if name in slow else "spectrum")
        for name, own in arcs.items()
    }
    found = [replace(c, family=trials[c.family.name]) for c in found]
    return _with_gains_next_to_best(found, data)


def _best_wandering_process(context: Context) -> Solution | None:
    """`Solution` with the slowly drifting process of the highest ΔlogL that the screen of the spectrum found; or None."""
    red = [
        c
        for c in context.found["spectral"]
        if isinstance(c.effect, Stochastic) and c.effect.wanders
    ]
    return max(red, key=lambda c: c.gain).solution if red else None


def _number_of_families(context: Context) -> int:
    """Number of families of the slow functions that the model may get; if one was found, also those of richer forms."""
    names = set(slow_families(context.solution.model, context.data.covariates))
    if context.found[SCREEN.name]:
        names |= {cls.family for cls in CATALOG if cls.screened == "slow" and cls.found_with}
    return len(names)


SCREEN = Screen(
    "slow functions",
    "drifts, events and functions of logged columns: matched filters at every point of their grids",
    "time",
    look,
    after=("spectral",),
    searches=_number_of_families,
)


def _screen_family(
    blanks: tuple[Deterministic, ...], context: Context
) -> tuple[list[Candidate], list[tuple[str, float]]]:
    """Pair: list of refitted `Candidate` of the functions in `blanks` and of their significant forms; list of angles.

    The candidate is the best point of the grid of shapes, if its ΔlogL is at least 3. Forms have more parameters or several
    excursions. An angle is a pair (family, total angle of a grid of shapes, rad), for p-values.
    """
    data = context.data
    null = context.shared(_best_wandering_process) or context.solution
    found: list[Candidate] = []
    arcs: list[float] = []
    families: list[str] = []
    for blank in blanks:
        trim_memory(data.samples.size)
        points = grid_points(blank, data.n, data.rate)
        gain, directions = matched_gains(
            points, null.ordinates, null.noise(data), data, null.model.deterministic
        )
        arcs.append(arc_length(directions))
        del directions  # tens of megabytes, not needed during the refit
        families.append(blank.family)
        top = int(np.argmax(gain))
        worth = gain[top] >= MAX_RIVAL_LOG_EVIDENCE
        simple = (
            _refitted_candidate(points[top], Family(blank.family, (arcs[-1],)), context)
            if worth
            else None
        )
        if simple is not None and simple.solution is not None:
            placed = has_known_time(simple.solution.effects[-1], simple.solution, data)
            found += [simple] if placed else []
            alone = log_p_value(Family(blank.family, (arcs[-1],)), simple.judged_gain or 0.0)
            named = simple if placed and alone < np.log(FALSE_ALARM_PROBABILITY) else None
        else:
            named = None
        # Each independent place of the simple form could have been the start of a richer form.
        starts = max(1.0, arcs[-1] / (0.5 * np.pi))
        forms = _richer_forms(type(blank), simple, starts, context, named is not None)
        found += _significant_richer_forms(named, forms, context)
        found += _several_excursions(type(blank), forms, context)
        arcs += [arc * times for arc, times, _ in forms.values()]
        families += [effect.family for effect in forms]
    return found, list(zip(families, arcs, strict=True))


def has_known_time(own: object, solution: Solution, data: Data) -> bool:
    """True if all times of the effect `own` of `solution` are known; always True if it is no one-time slow function.

    A time is known if its 95 % interval lies inside the record. The standard error of an edge, whose likelihood is not
    smooth, must also be at most 2 % of the record.
    """
    # The level beyond a jump at an end of the record is not known.
    if not isinstance(own, Regressed) or not (own.effect.happens_once and own.effect.low):
        return True
    effect, variance = own.effect, float(own.covariance[0, 0])
    for name in effect.free_shapes:
        least, error = MAX_STEP_TIME_ERROR * data.duration, None
        if (edge := effect.shape_error(name, variance, data.duration)) is not None:
            error = edge if edge <= least else shape_error(own, name, solution, data)
            if error is None or error > least:
                return False
        elif name in effect.interval:
            error = deterministic_shape_error(effect, name, solution, data)
        if error is None:
            continue
        time = float(effect.values[name]) - data.start
        if not NORMAL * error < time < data.duration - NORMAL * error:
            return False
    return True


def _richer_forms(
    kind: type[Deterministic],
    simple: Candidate | None,
    starts: float,
    context: Context,
    is_significant: bool,
) -> dict[Deterministic, tuple[float, float, Noise]]:
    """Dict from each effect with more parameters than `simple`, shapes optimized, to a tuple (angle, starts, noise).

    The effects are forms of `simple` with more parameters, the best excursions between any two times, and forms of these.
    `angle`, rad, is the path length of the grid of shapes, and `starts` the number of independent start times; both count
    trials. `noise` is that of the model with `simple`, for excursions also without it if `simple` `is_significant`.
    """
    solution, data = context.solution, context.data
    base, known = solution.noise(data), solution.model.deterministic
    with_simple = None if simple is None else simple.solution
    noise = base if with_simple is None else with_simple.noise(data)
    found: dict[Deterministic, tuple[float, float, Noise]] = {}

    def add_extended(plain: Effect, starts: float, noise: Noise) -> None:
        """Add to the dict `found` each form of `plain` with more parameters, with its best shape values.

        A form that is in the dict already keeps its value.
        """
        for blank in plain.extended():
            assert isinstance(blank, Deterministic)
            grid = grid_points(blank, data.n, data.rate)
            gain, directions = matched_gains(grid, solution.ordinates, noise, data, known)
            start = grid[int(np.argmax(gain))]
            finer = _with_best_shapes(start, blank.free_shapes, solution, noise, data)
            found.setdefault(finer, (arc_length(directions), starts, noise))

    if simple is not None:
        add_extended(simple.effect, starts, noise)
    # Next to a step the fitted noise may be too low for an excursion elsewhere, so both noise models are tried.
    for own in (noise, base) if is_significant else (noise,):
        for effect, arc in best_spans(kind, solution.ordinates, own, data, known):
            # Each independent place could be either end.
            finer = _with_best_shapes(effect, effect.free_shapes, solution, own, data)
            places = max(1.0, arc / (0.5 * np.pi))
            found.setdefault(finer, (arc, places, own))
            add_extended(finer, places, own)
    return found


def _significant_richer_forms(
    simple: Candidate | None,
    forms: Mapping[Deterministic, tuple[float, float, Noise]],
    context: Context,
) -> list[Candidate]:
    """List of refitted `Candidate` of the effects in `forms` that explain significantly (1 %) more than `simple`.

    `forms` are as from `_richer_forms`. If `simple` is None, the comparison is with no effect. A form must also be
    significant alone.
    """
    solution, data = context.solution, context.data
    found: list[Candidate] = []
    gains = {
        effect: _matched_delta_logl(effect, solution, noise, data)
        for effect, (_, _, noise) in forms.items()
    }
    for effect, gain in sorted(gains.items(), key=lambda pair: -pair[1]):
        arc, starts, noise = forms[effect]
        plain = 0.0
        if simple is not None and isinstance(simple.effect, Deterministic):
            plain = _matched_delta_logl(simple.effect, solution, noise, data)
        best = (1.0 + MAX_NOISE_REFIT_FRACTION) * gain
        if not may_become_significant(Family(effect.family, (arc,)), best - plain):
            continue
        # Skip a form that could not be significant by itself, even uncorrected for the other searches of the check.
        alone = Family(effect.family, (arc * starts,))
        if not may_become_significant(alone, best):
            continue
        # One more free time always gains something; the gain over the simple form must be significant.
        simpler = solution if simple is None else simple.solution or solution
        over = simpler, Family(effect.family, (arc,))
        candidate = _refitted_candidate(effect, alone, context, over)
        if candidate is not None:
            found.append(candidate)
    return found


def _several_excursions(
    kind: type[Deterministic],
    forms: Mapping[Deterministic, tuple[float, float, Noise]],
    context: Context,
) -> list[Candidate]:
    """List with one refitted `Candidate`: several excursions (short events) as one effect; or empty.

    `judged_gain` is reduced by ln of the number of possible sets of excursions.
    """
    solution, data = context.solution, context.data
    alone = [
        (_matched_delta_logl(effect, solution, noise, data), arc * starts, effect)
        for effect, (arc, starts, noise) in forms.items()
        if effect.returns
    ]
    if not alone or any(effect.returns for effect in solution.model):
        return []
    _, arc, first = max(alone, key=lambda one: one[0])
    places = arc / (2.0 * np.pi)
    several = several_excursions(kind, first, places, solution, data)
    if several is None:
        return []
    effect, choices = several
    family = Family(first.family, (arc,))
    found = _refitted_candidate(effect, family, context)
    if found is None or found.judged_gain is None:
        return []
    return [replace(found, judged_gain=max(0.0, found.judged_gain - choices))]


def _matched_delta_logl(
    effect: Deterministic, solution: Solution, noise: Noise, data: Data
) -> float:
    """ΔlogL, nats, of adding one slow function of time to the model, computed by a matched filter for the given `noise`.

    The known functions of the model are fitted together with it.
    """
    known = solution.model.deterministic
    return float(matched_gains([effect], solution.ordinates, noise, data, known)[0][0])


def _with_best_shapes(
    effect: Deterministic, names: tuple[str, ...], solution: Solution, noise: Noise, data: Data
) -> Deterministic:
    """Copy of the effect whose shapes `names` are optimized in turn, each between the neighbors of its grid point."""
    known = solution.model.deterministic
    for name in names:
        grid = np.unique(effect.grid(name, data.n, data.rate))
        at = int(np.searchsorted(grid, effect.values[name]))
        low, high = grid[max(0, at - 1)], grid[min(grid.size - 1, at + 1)]
        tried = [
            effect.with_values(**{name: float(v)}) for v in np.linspace(low, high, REFINED_POINTS)
        ]
        gain, _ = matched_gains([effect, *tried], solution.ordinates, noise, data, known)
        effect = [effect, *tried][int(np.argmax(gain))]
    return effect


def _refitted_candidate(
    effect: Deterministic,
    family: Family,
    context: Context,
    over: tuple[Solution, Family] | None = None,
) -> Candidate | None:
    """Refitted `Candidate` that adds the slow function `effect` to the model; None if its `judged_gain` is not positive.

    None as well if an event rests on a few samples, or if the slope on a logged column has different signs at slow and fast
    time scales. With `over` = (solution with a simpler form or without one, family), None if the rise of logL above that
    solution is not significant (1 %), or if a time of the effect is not known.

    `judged_gain`, from which the p-value follows, is at most the ΔlogL beside the slowly drifting process of the highest
    ΔlogL. It is reduced for leakage through filters, for louder noise where the effect acts, and for missing samples. So it
    is for several amplitudes, and for short events with samples that are not normal.
    """
    base, data, rival = context.solution, context.data, context.shared(_best_wandering_process)
    refitted = solve(data, base.model + effect, like=base, settled=len(base.model), rounds=4)
    gain = judged = refitted.log_likelihood - base.log_likelihood
    if over is not None and not _is_clearly_richer(refitted, *over, base, data):
        return None
    if rival is not None and may_become_significant(family, gain):
        model = rival.model + refitted.model.effects[-1]
        with_rival = solve(data, model, like=rival, polish=False, rounds=4)
        judged = min(gain, with_rival.log_likelihood - rival.log_likelihood)
    found = refitted.model.effects[-1]
    assert isinstance(found, Deterministic)
    noise = refitted.noise(data)
    if any(term.memory for term in noise.terms):
        # The fit takes leakage from the ends of the record, which rings at the zeros of a filter, for the function.
        judged = min(judged, _matched_delta_logl(found, base, noise, data))
    judged /= _relative_noise_power(refitted, data)
    if may_become_significant(family, judged):
        judged /= max(1.0, information_ratio(data, refitted))
    if judged <= 0.0 or not follow_columns_consistently(
        refitted.model.deterministic[-1:], refitted, data
    ):
        return None
    judged = _equivalent_single_gain(judged, effect.amplitudes().size)
    if found.happens_once and not found.lasting:
        short = [event for event in found.singly if event.when is not None]
        if any(_rests_on_few_samples(event, base, data) for event in short):
            return None
        judged *= min((_share_with_normal_tails(e, context) for e in short), default=1.0)
    return Candidate(found, gain, family, refitted, found.numbers, judged_gain=judged)


def _is_clearly_richer(
    rich: Solution, simple: Solution, family: Family, base: Solution, data: Data
) -> bool:
    """True if ΔlogL of the model `rich` over `simple` is significant (1 %) in `family`, and all its times are known.

    With missing samples and a simple model that is not `base`, the ΔlogL of `_gain_over_simple` must also be significant.
    """

    def is_significant(gain: float) -> bool:
        """True if this ΔlogL, nats, has a p-value below 1 %."""
        return log_p_value(family, gain) < np.log(FALSE_ALARM_PROBABILITY)

    if not is_significant(rich.log_likelihood - simple.log_likelihood):
        return False
    if not has_known_time(rich.effects[-1], rich, data):
        return False
    return (
        data.gain is None or simple is base or is_significant(_gain_over_simple(rich, simple, data))
    )


def _gain_over_simple(rich: Solution, simple: Solution, data: Data) -> float:
    """ΔlogL, nats, of the model `rich` over the model `simple`, after these models have completed the missing samples.

    In `data`, a model with neither form has completed them. It bridges a step in a gap by a ramp, and only the rich model
    can follow a ramp. Here the rich model completes the samples and both models are fitted; then the simple model completes
    them and both are fitted. Each completion favors its own model, so the mean of the two ΔlogL is returned.
    """
    gain = 0.0
    for own, other, sign in ((rich, simple, 0.5), (simple, rich, -0.5)):
        again, fitted = complete_and_fit(data, own.model, own)
        # Times stay fixed; otherwise the rich model would follow the samples that the simple one has drawn.
        refitted = solve(again, other.model, like=fitted, settled=len(other.model), rounds=4)
        gain += sign * (fitted.log_likelihood - refitted.log_likelihood)
    return gain


def _rests_on_few_samples(event: Deterministic, base: Solution, data: Data) -> bool:
    """True if a short event depends on a few outliers: its trimmed mean is less than half of its mean.

    Both are means of the residual during the event, minus those of an equal time before it. False for a summary, for an
    event without duration, and for more than 4096 samples in the event. Otherwise True for fewer than 16 samples in the
    event, and False for fewer than 16 samples before it.
    """
    if event.when is None or event.when[0] == event.when[1] or data.samples.size < data.n:
        return False
    first, last = (round((t - data.start) * data.rate) for t in event.when)
    size = last - first
    if size > MAX_SHORT_EVENT_SAMPLES:
        return False
    values = data.residual(base.model)
    if data.missing is not None:
        values = np.where(data.missing, np.nan, values)
    parts = [values[max(0, first) : last], values[max(0, first - size) : max(0, first)]]
    inside, before = (np.sort(part[np.isfinite(part)]) for part in parts)
    if min(inside.size, before.size) < MIN_SEGMENT_SAMPLES:
        return inside.size < MIN_SEGMENT_SAMPLES
    # Trimmed means: a quarter of the sorted values is dropped at each end.
    inner, outer = (part[part.size // 4 : -(part.size // 4)].mean() for part in (inside, before))
    middle = inner - outer
    whole = inside.mean() - before.mean()
    return bool(middle * whole < MAIN_SHARE * whole**2)


def _share_with_normal_tails(event: Deterministic, context: Context) -> float:
    """Fraction, at most 1, of the ΔlogL of a short event that remains if the samples are replaced by normal scores.

    The mean of a few samples is not normal if they have heavy tails or are coarsely rounded.
    """
    assert event.when is not None
    data, given = context.data, context.whitened
    first, last = (round((t - data.start) * data.rate) for t in event.when)
    if not 0 < last - first <= MAX_SHORT_EVENT_SAMPLES or not data.whole:
        return 1.0
    parts = [w.samples[first:last].sum() ** 2 for w in (given.with_normal_tails, given)]
    return float(min(1.0, parts[0] / parts[1])) if parts[1] > 0.0 else 1.0


def _relative_noise_power(solution: Solution, data: Data) -> float:
    """Noise power at the times where the last effect acts, divided by that of the whole record; at least 1.

    Each time is weighted by the squared deviation of the effect from its mean.
    """
    if not any(e.changes_level for e in solution.model.modifiers):
        return 1.0
    cells = min(TIME_CELLS, data.n)
    signal = cell_means(data.signal(solution.model.deterministic[-1:]), cells)
    signal = (signal - signal.mean()) ** 2
    level = expected_level(solution.model, data, cells)
    return max(1.0, float(signal @ level / max(signal.sum(), 1e-300)))


def _equivalent_single_gain(gain: float, amplitudes: int) -> float:
    """ΔlogL of a single amplitude with the same p-value as the ΔlogL `gain` of several `amplitudes`."""
    from scipy.special import ndtri_exp

    if amplitudes == 1 or gain <= 0.0:
        return gain
    log_p = log_chi2_tail(gain, amplitudes)
    return float(0.5 * ndtri_exp(log_p - np.log(2.0)) ** 2)


def gain_less_cost(candidate: Candidate) -> float:
    """ΔlogL of a refitted candidate minus the cost of its parameters, nats."""
    assert candidate.solution is not None
    return candidate.gain - parameters_cost(candidate.solution.effects[-1], candidate.solution)


def _with_gains_next_to_best(found: list[Candidate], data: Data) -> tuple[Candidate, ...]:
    """Tuple of copies of the candidates `found` with lower `judged_gain` for all but the best functions.

    The best functions are those within 3 nats of the highest `gain_less_cost`. `judged_gain` of another function becomes
    its smallest ΔlogL in a model that has one of the best functions. Functions that cannot be significant are not changed.
    """
    # A step at the start looks like a warm-up, and like any temperature that rises from there.
    # Subtract the cost: of two forms of one event the one with more parameters gains a little more.
    top = max(map(gain_less_cost, found), default=0.0)
    best = [c for c in found if gain_less_cost(c) > top - MAX_RIVAL_LOG_EVIDENCE]

    def with_smallest_gain(candidate: Candidate) -> Candidate:
        """Copy of a candidate with `judged_gain` lowered to its smallest ΔlogL, at least 0, beside any one of `best`.

        A candidate of `best`, or one that cannot be significant, is returned unchanged.
        """
        left = candidate.gain if candidate.judged_gain is None else candidate.judged_gain
        if candidate in best or not may_become_significant(candidate.family, left):
            return candidate
        for other in best:
            assert other.solution is not None
            best_one = other.solution
            model = best_one.model + candidate.effect
            both = solve(data, model, like=best_one, polish=False, rounds=4)
            left = min(left, max(both.log_likelihood - best_one.log_likelihood, 0.0))
        return replace(candidate, judged_gain=left)

    return tuple(with_smallest_gain(c) for c in found)
