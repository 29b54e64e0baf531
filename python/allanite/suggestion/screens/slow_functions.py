"""Candidate slow functions of time and of other columns: whatever the catalogue declares as slow.

Each kind is a matched filter on the whitened ordinates at every point of its shape grid at once; the best is refitted. A
drift has to explain something that a random process does not: its gain is what it adds to the model *with* the best
spectral candidate (otherwise any slow column explains any random walk: spurious regression).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic
from allanite.fit.engine import Solution, solve
from allanite.fit.likelihood.remembered import give_back
from allanite.fit.likelihood.whitened import (
    cell_means,
    expected_level,
    with_normal_tails,
)
from allanite.fit.rivals.columns import consistent
from allanite.fit.rivals.evidence import RIVAL, cost
from allanite.fit.shapes.matched import best_spans, grid_points, matched_gains
from allanite.fit.solution import Regressed
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAX_NOISE_REFIT_FRACTION,
    MAX_SHORT_EVENT_SAMPLES,
    MAX_STEP_TIME_ERROR,
    MIN_EVENT_SAMPLES,
    MIN_INNER_CHANGE_FRACTION,
    MIN_SCREEN_GAIN,
)
from allanite.suggestion.p_values import Family, arc_length, log_chance
from allanite.suggestion.screens.spectral import Candidate, Screen

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise
    from allanite.fit.likelihood.whitened import Whitened


__all__ = [
    "beside_the_best",
    "evidence",
    "is_placed",
    "screen_slow",
]

#: Cells of the record in which the noise level and the time of an event are resolved.
TIME_CELLS = 8192
#: Shapes tried between the two neighbors of the best point of a grid.
REFINED_POINTS = 33


def screen_slow(
    blanks: tuple[Deterministic, ...],
    solution: Solution,
    data: Data,
    rival: Solution | None,
    whitened: Callable[[], Whitened],
) -> Screen:
    """The best point of the shape grid of each effect of a family, refitted; `whitened` is of the solution."""
    found: list[Candidate] = []
    arcs: list[float] = []
    families: list[str] = []
    for blank in blanks:
        give_back(data.samples.size)
        points = grid_points(blank, data)
        null = rival if rival is not None else solution
        gain, directions = matched_gains(
            points, null.ordinates, null.noise(data), data, null.model.deterministic
        )
        arcs.append(arc_length(directions))
        del directions  # tens of megabytes: not while the best is refitted
        families.append(blank.family)
        top = int(np.argmax(gain))
        worth = gain[top] >= MIN_SCREEN_GAIN
        simple = _refit(points[top], solution, data, rival, whitened) if worth else None
        if simple is not None and simple.solution is not None:
            placed = is_placed(simple.solution.effects[-1], data.duration)
            found += [simple] if placed else []
            alone = log_chance(Family(blank.family, (arcs[-1],)), simple.judged or 0.0)
            named = simple if placed and alone < np.log(FALSE_ALARM_PROBABILITY) else None
        else:
            named = None
        # Each place of the simple form that is a place of its own might have been the start of these.
        starts = max(1.0, arcs[-1] / (0.5 * np.pi))
        forms = _forms(type(blank), simple, starts, solution, data)
        found += _richer(named, forms, solution, data, rival, whitened)
        arcs += [arc * times for arc, times, _ in forms.values()]
        families += [effect.family for effect in forms]
    return Screen(tuple(found), tuple(arcs), tuple(families))


def is_placed(own: object, duration: float) -> bool:
    """True unless the effect is a lasting change whose time has a standard error above `MAX_STEP_TIME_ERROR`."""
    if not isinstance(own, Regressed) or not own.effect.lasting:
        return True
    name = own.effect.free_shapes[0] if own.effect.free_shapes else ""
    error = own.effect.shape_error(name, float(own.covariance[0, 0]), duration)
    return error is None or error <= MAX_STEP_TIME_ERROR * duration


def _forms(
    kind: type[Deterministic],
    simple: Candidate | None,
    starts: float,
    solution: Solution,
    data: Data,
) -> dict[Deterministic, tuple[float, float, Noise]]:
    """Richer forms of an effect that was found, at the best of the shapes that it has not.

    With their arcs, how often each, and the noise in which it was found.

    Beside them what is there between two places of its kind, which may have nothing to do with the one that was found.
    """
    base, known = solution.noise(data), solution.model.deterministic
    beside = None if simple is None else simple.solution
    noise = base if beside is None else beside.noise(data)
    found: dict[Deterministic, tuple[float, float, Noise]] = {}
    for blank in () if simple is None else simple.effect.extended():
        assert isinstance(blank, Deterministic)
        grid = grid_points(blank, data)
        gain, directions = matched_gains(grid, solution.ordinates, noise, data, known)
        start = grid[int(np.argmax(gain))]
        finer = _finer(start, blank.free_shapes, solution, noise, data)
        found[finer] = arc_length(directions), starts, noise
    # The noise beside the step may be too quiet for what has another step: a random walk that stood for it is gone.
    for own in (noise,) if beside is None else (noise, base):
        for effect, arc in best_spans(kind, solution.ordinates, own, data, known):
            # Each place that is one of its own might be either end.
            finer = _finer(effect, effect.free_shapes, solution, own, data)
            found.setdefault(finer, (arc, max(1.0, arc / (0.5 * np.pi)), own))
    return found


def _richer(
    simple: Candidate | None,
    forms: Mapping[Deterministic, tuple[float, float, Noise]],
    solution: Solution,
    data: Data,
    rival: Solution | None,
    whitened: Callable[[], Whitened],
) -> list[Candidate]:
    """Those of the richer forms, refitted, that explain more than by chance, beside the simple one if that is named."""
    found: list[Candidate] = []
    for effect, (arc, _, noise) in forms.items():
        plain = 0.0
        if simple is not None and isinstance(simple.effect, Deterministic):
            plain = _gain(simple.effect, solution, noise, data)
        best = _gain(effect, solution, noise, data)
        hope = best - plain + MAX_NOISE_REFIT_FRACTION * best
        if log_chance(Family(effect.family, (arc,)), hope) >= np.log(FALSE_ALARM_PROBABILITY):
            continue
        candidate = _refit(effect, solution, data, rival, whitened)
        if candidate is None:
            continue
        # Searching for one more time always gains something: what it adds must be more than chance gives.
        more = candidate.gain - (0.0 if simple is None else simple.gain)
        added = log_chance(Family(effect.family, (arc,)), more)
        if added < np.log(FALSE_ALARM_PROBABILITY) and not any(
            _same(candidate, c, data) for c in found
        ):
            found.append(candidate)
    return found


def _same(one: Candidate, other: Candidate, data: Data) -> bool:
    """Whether two candidates are one event, refitted from two starts."""
    a, b = one.effect.when, other.effect.when
    if one.effect.kind != other.effect.kind or a is None or b is None:
        return False
    return float(np.abs(np.subtract(a, b)).max()) < data.duration / TIME_CELLS


def _gain(effect: Deterministic, solution: Solution, noise: Noise, data: Data) -> float:
    """Gain of a slow function beside a model whose noise is known better."""
    known = solution.model.deterministic
    return float(matched_gains([effect], solution.ordinates, noise, data, known)[0][0])


def _finer(
    effect: Deterministic, names: tuple[str, ...], solution: Solution, noise: Noise, data: Data
) -> Deterministic:
    """The best between the neighbours of a point of the grid, one shape after the other."""
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


def _refit(
    effect: Deterministic,
    base: Solution,
    data: Data,
    rival: Solution | None,
    whitened: Callable[[], Whitened],
) -> Candidate | None:
    """The refitted candidate, judged by the least of what it adds to the model alone and to the rival's.

    It is ranked by its whole gain: a random process that takes part of a drift is not the better explanation for that.
    """
    refitted = solve(data, base.model + effect, like=base, settled=len(base.model), rounds=4)
    gain = judged = refitted.log_likelihood - base.log_likelihood
    if rival is not None and gain > 0.0:
        beside = solve(data, rival.model + refitted.model.effects[-1], polish=False, rounds=4)
        judged = min(gain, beside.log_likelihood - rival.log_likelihood)
    judged /= _louder(refitted, data)
    if judged <= 0.0 or not consistent(refitted.model.deterministic[-1:], refitted, data):
        return None
    judged = _of_one(judged, effect.amplitudes().size)
    found = refitted.model.effects[-1]
    assert isinstance(found, Deterministic)
    if found.happens_once and not found.lasting and found.when is not None:
        if _of_few(found, base, data):
            return None
        judged *= _with_normal_tails(found, data, whitened)
    return Candidate(found, gain, effect.family, refitted, found.numbers, judged=judged)


def _of_few(event: Deterministic, base: Solution, data: Data) -> bool:
    """Whether a short event is that of a few samples alone: outliers, or the tails of the noise."""
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
    if min(inside.size, before.size) < MIN_EVENT_SAMPLES:
        return inside.size < MIN_EVENT_SAMPLES
    # Without the quarter at either end.
    inner, outer = (part[part.size // 4 : -(part.size // 4)].mean() for part in (inside, before))
    middle = inner - outer
    whole = inside.mean() - before.mean()
    return bool(middle * whole < MIN_INNER_CHANGE_FRACTION * whole**2)


def _with_normal_tails(event: Deterministic, data: Data, whitened: Callable[[], Whitened]) -> float:
    """The part of a short event's evidence that is left where the samples are normal ones in the same order.

    The mean of a few samples of a heavy tail, or of a coarse step, is no normal number.
    """
    assert event.when is not None
    first, last = (round((t - data.start) * data.rate) for t in event.when)
    if not 0 < last - first <= MAX_SHORT_EVENT_SAMPLES or data.ordinates.size != data.n:
        return 1.0
    given = whitened()
    parts = [w.samples[first:last].sum() ** 2 for w in (with_normal_tails(given), given)]
    return float(min(1.0, parts[0] / parts[1])) if parts[1] > 0.0 else 1.0


def _louder(solution: Solution, data: Data) -> float:
    """By how much the noise where the last effect acts is louder than the mean, at least 1.

    The ordinates know the mean over the record alone.
    """
    if not any(e.passing for e in solution.model.modifiers):
        return 1.0
    cells = min(TIME_CELLS, data.n)
    signal = cell_means(data.signal(solution.model.deterministic[-1:]), cells)
    signal = (signal - signal.mean()) ** 2
    level = expected_level(solution.model, data, cells)
    return max(1.0, float(signal @ level / max(signal.sum(), 1e-300)))


def _of_one(gain: float, amplitudes: int) -> float:
    """Gain of one amplitude with the same p-value as this gain of one, two or three: half a χ² of as many freedoms."""
    from scipy.special import erfcx, ndtri_exp

    if amplitudes == 1 or gain <= 0.0:
        return gain
    log_p = -gain
    if amplitudes == 3:
        log_p += np.log(2.0 * np.sqrt(gain / np.pi) + erfcx(np.sqrt(gain)))
    return float(0.5 * ndtri_exp(log_p - np.log(2.0)) ** 2)


def evidence(candidate: Candidate) -> float:
    """Gain of a refitted candidate less what its numbers cost."""
    assert candidate.solution is not None
    return candidate.gain - cost(candidate.solution.effects[-1], candidate.solution)


def beside_the_best(screens: dict[str, Screen], data: Data) -> dict[str, Screen]:
    """The screens by family; a slow function that others beat clearly is judged by the least that it adds to one of them.

    A step at the start looks like a warm-up and like any temperature that rises from there.
    """
    found = [c for screen in screens.values() for c in screen.candidates]
    if not found:
        return screens

    # Of two forms of one thing the one with more numbers explains a little more.
    top = max(map(evidence, found))
    best = [c for c in found if evidence(c) > top - RIVAL]

    def judged(candidate: Candidate) -> Candidate:
        if candidate in best:
            return candidate
        left = candidate.gain if candidate.judged is None else candidate.judged
        for other in best:
            assert other.solution is not None
            both = solve(data, other.solution.model + candidate.effect, polish=False, rounds=4)
            left = min(left, max(both.log_likelihood - other.solution.log_likelihood, 0.0))
        return replace(candidate, judged=left)

    arcs: dict[str, list[float]] = {}
    for screen in screens.values():
        for family, arc in zip(screen.families, screen.arcs, strict=True):
            arcs.setdefault(family, []).append(arc)
    candidates = [judged(c) for c in found]
    return {
        family: Screen(tuple(c for c in candidates if c.family == family), tuple(angles))
        for family, angles in arcs.items()
    }
