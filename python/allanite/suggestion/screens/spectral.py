"""Screen of the spectrum: every random process and filter of the catalog, at every shape of its grid.

At every grid point the likelihood is maximized from several starts. If the model lacks an effect, other effects imitate
it. The slope of the likelihood at the fitted model then does not show what is missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import CATALOG, Effect, Model, Modifier, Stochastic
from allanite.fit.engine import solve, with_coefficients
from allanite.fit.likelihood.expected import column_of
from allanite.fit.likelihood.peaks import (
    MAX_MISSING_FRACTION,
    MAX_NARROW_WIDTH,
    is_fitted_to_ordinates,
)
from allanite.fit.likelihood.random_part import RandomPart
from allanite.fit.likelihood.whittle import Maximum, climb_many
from allanite.fit.rivals.line_trials import line_trials
from allanite.fit.shapes.narrow import is_flat_near
from allanite.fit.shapes.polish import polish
from allanite.fit.shapes.scan import (
    MAX_SIMPLER_LOSS,
    better_form,
    free_shape_parameters,
    polished_designs,
    scan_added_effect,
    simplest_design,
)
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    MAX_DESIGNS_POLISHED,
    MAX_FORMS_TRIED,
    MAX_NARROW_POINTS_CLIMBED,
    MAX_SHAPE_RATIO,
    MIN_DELTA_LOGL_OVER_SIMPLER,
    MIN_SCORE_GAIN,
)
from allanite.suggestion.p_values import Family, arc_length, log_p_value
from allanite.suggestion.screens._screen import Candidate, Context, Screen

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Number of Fisher scoring steps in the scan over other designs of a filter.
DESIGN_SCAN_STEPS = 5
#: Tried widths of a band within a bin, in ordinates; the largest is the width of a bin of a million samples.
WIDTHS = tuple(2**k for k in range(2, 13))


@lru_cache(maxsize=64)
def _grid_of(blank: Effect, n: int, rate: float) -> tuple[Effect, ...]:
    """Tuple of copies of the effect `blank`, one for each combination of its trial shape values and designs.

    The trial values of a shape may depend on shapes that are declared after it.
    """
    out: list[Effect] = list(blank.variants())
    for name in reversed(blank.free_shapes):
        out = [
            point.with_values(**{name: float(value)})
            for point in out
            for value in point.grid(name, n, rate)
        ]
    return tuple(out)


def _tangent(effect: Effect, solution: Solution, data: Data) -> NDArray[np.float64]:
    """Derivative of the bin power with respect to a small amount of the effect, shape (bins,).

    For a modifier, it is the change that the modifier makes in the power of white noise whose coefficient is 1.
    """
    model = solution.model
    if isinstance(effect, Modifier):
        if model.white is None:
            return np.zeros_like(solution.spectrum)
        white = next(own for own in solution.processes if own.effect.white)
        # Only the direction matters, so it works even if another effect has taken all white noise.
        changed = column_of(model + effect, model.white, data)
        return changed - white.column
    assert isinstance(effect, Stochastic)
    return column_of(model, effect, data)


def directions(
    solution: Solution, data: Data
) -> Iterator[tuple[type[Effect], list[Effect], NDArray[np.float64]]]:
    """Iterator over (kind, effects, unit vectors): how each shape of an effect would change the spectrum.

    `effects` are trial effects with the shape values of a grid. The unit vectors, shape (effects, bins), are the normalized
    changes of bin power divided by the scatter of each bin. The part that the model's own effects can fit is subtracted
    first; effects of which nothing remains are omitted. Kinds that are not searched in the spectrum or that the model
    cannot take are omitted, too.
    """
    root = np.sqrt(0.5 * solution.count)
    # Directions of the model's own effects: the refit moves along them anyway.
    own = solution.columns[:, solution.theta > 0.0]
    basis, _ = np.linalg.qr((own / solution.spectrum[:, None]) * root[:, None])
    for cls in CATALOG:
        if not cls.is_tried_in_spectrum():
            continue
        blanks = cls.candidates(solution.model, data.covariates)
        points = [p for blank in blanks for p in _grid_of(blank, data.n, data.rate)]
        if not points:
            continue
        # A thousand points of a thousand bins: one array, in place.
        moved = np.empty((len(points), root.size))
        for row, point in zip(moved, points, strict=True):
            row[:] = _tangent(point, solution, data) / solution.spectrum * root
        size = np.linalg.norm(moved, axis=1)
        for row, share in zip(moved, moved @ basis, strict=True):
            row -= basis @ share
        norm = np.linalg.norm(moved, axis=1)
        usable = norm > 1e-3 * np.maximum(size, 1e-300)
        if usable.any():
            kept = [p for p, keep in zip(points, usable, strict=True) if keep]
            moved = moved if usable.all() else moved[usable]
            moved /= norm[usable, None]
            yield cls, kept, moved


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple with the best refitted `Candidate` of every random process and filter."""
    solution, data, white = context.solution, context.data, context.white
    part = RandomPart(data, solution.power, solution.count)
    found: list[Candidate] = []
    arcs: dict[str, tuple[float, ...]] = {}
    for cls, points, unit in directions(solution, data):
        arc = arc_length(unit)
        arcs[cls.family] = (*arcs.get(cls.family, ()), arc)
        if points[0].occupies is not None:
            points = _residual_maxima(points, unit, solution)
        if white.size == data.n:
            points = [*points, *cls.seen_in(white**2, data.rate)]
        best = _refitted_candidate(points, solution, part, arc)
        narrow = _narrow_band_candidate(points[0], solution, part, white, arc)
        both = [c for c in (best, narrow) if c is not None]
        if both:
            top = max(both, key=lambda c: c.gain)
            found.append(_of_alike_kind(top, solution, part, arc) or top)
    return tuple(replace(c, family=replace(c.family, arcs=arcs[c.family.name])) for c in found)


def _number_of_families(context: Context) -> int:
    """Number of families of random processes and filters that the model may get."""
    model, columns = context.solution.model, context.data.covariates
    kinds = (cls for cls in CATALOG if cls.is_tried_in_spectrum())
    return len({cls.family for cls in kinds if cls.candidates(model, columns)})


SCREEN = Screen(
    "spectral",
    "random processes and filters: fits of the mean spectrum at every point of their grids of shapes",
    "frequency",
    look,
    searches=_number_of_families,
)


def bands_overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """True if two frequency bands (low, high) have a range in common; touching ends do not count."""
    return one[0] < other[1] and other[0] < one[1]


def _narrow_band_candidate(
    point: Effect, base: Solution, part: RandomPart, white: NDArray[np.float64], arc: float
) -> Candidate | None:
    """Refitted `Candidate` of the most significant band, of the kind of `point`, narrower than a bin; or None.

    `white` are the whitened single ordinates. `arc` is the path length of this kind's grid of shapes, rad.
    """
    data = part.data
    if not isinstance(point, Stochastic) or point.banded(1.0, 1.001) is None:
        return None
    if data.lost > MAX_MISSING_FRACTION:
        return None
    gain, low, high, variance = max(narrow_bands(base, data, white), default=(0.0,) * 4)
    if _log_p_narrow(gain, data) > np.log(FALSE_ALARM_PROBABILITY):
        return None
    made = point.banded(low, high)
    assert made is not None
    effect = made.with_values(**{point.coefficient: float(np.sqrt(variance))})
    solution = solve(data, base.model + effect, like=base, rounds=3, polish=False)
    return _candidate_of_last_effect(solution, base, data, arc)


def _of_alike_kind(
    found: Candidate, base: Solution, part: RandomPart, arc: float
) -> Candidate | None:
    """Refitted `Candidate` of a kind that takes over the shape of `found` (`Stochastic.like`), if its logL rises; or None.

    It must rise by more than `MAX_SIMPLER_LOSS`. Tried only if `found` raises logL by more than 8 nats.
    """
    if found.gain < MIN_DELTA_LOGL_OVER_SIMPLER:
        return None
    best = None
    for cls in CATALOG:
        made = cls.like(found.effect) if issubclass(cls, Stochastic) else None
        if made is None or made.occupies is None:
            continue
        model, start = base.model + made, None
        if not is_fitted_to_ordinates(made, part.data):
            # The shape of `found` may have fitted one peak of a wider band: the fit starts with three times its width.
            low, high = made.occupies
            model = base.model + (made.banded(2.0 * low - high, 2.0 * high - low) or made)
            places = [(len(base.model), name) for name in made.free_shapes]
            model, start = polish(model, places, part.maximize(model), part, roughly=True)
            model = with_coefficients(model, start.theta)
        solution = solve(part.data, model, start=start, like=base, rounds=3, polish=False)
        other = _candidate_of_last_effect(solution, base, part.data, arc)
        if other is not None and other.gain > (best or found).gain + MAX_SIMPLER_LOSS:
            best = other
    return best


def _log_p_narrow(gain: float, data: Data) -> float:
    """Ln of the p-value of the ΔlogL `gain` of a narrow band, searched at all frequencies in several widths."""
    return log_p_value(Family("line", width=line_trials(data.n) * widths_tried(data.n)), gain)


def _residual_maxima(
    points: list[Effect], unit: NDArray[np.float64], solution: Solution
) -> list[Effect]:
    """List of at most 60 of the trial effects `points`, in their order, that fit peaks of the residual spectrum best.

    A row of `unit` is the normalized change of the spectrum by a trial effect. This suits narrow effects only.
    """
    residual = (solution.power / solution.spectrum - 1.0) * np.sqrt(0.5 * solution.count)
    score = unit @ residual
    neighbors = np.maximum(np.append(score[1:], -np.inf), np.append(-np.inf, score[:-1]))
    best = np.argsort(-np.where(score >= neighbors, score, -np.inf), kind="stable")[
        :MAX_NARROW_POINTS_CLIMBED
    ]
    return [points[i] for i in np.sort(best)]


def _with_richer_form(
    ends: list[tuple[Model, Maximum]], model: Model, best: Maximum, part: RandomPart
) -> tuple[Model, Maximum]:
    """Pair (model, maximum of logL) in which the last effect has a form with more parameters, if logL rises by over 8 nats.

    Otherwise (`model`, `best`). `ends` are pairs of the same kind, for other shapes; the forms (`Effect.extended`) of the
    eight best are tried, and only if the model has a discrepancy.
    """
    if best.scale is None:
        return model, best
    last = len(model) - 1
    found = model, best
    for plain, start in sorted(ends, key=lambda end: -end[1].log_likelihood)[:MAX_FORMS_TRIED]:
        for effect in plain.effects[last].extended():
            richer = Model((*plain.effects[:last], effect))
            places = free_shape_parameters(richer, last)
            climbed = part.climb(part.linear(richer), start.theta, start.scale)
            tried = polish(richer, places, climbed, part, roughly=True)
            if tried[1].log_likelihood > max(
                found[1].log_likelihood, best.log_likelihood + MIN_DELTA_LOGL_OVER_SIMPLER
            ):
                found = tried
    return found


def _with_best_design(model: Model, best: Maximum, part: RandomPart) -> tuple[Model, Maximum]:
    """Pair (model, maximum) with optimized shapes, and with other filter designs if the model has a discrepancy.

    A simpler design is preferred if logL falls by at most `MAX_SIMPLER_LOSS` for each omitted parameter. The present shapes
    and designs were fitted without the last effect, and may imitate it.
    """
    found = polish(model, free_shape_parameters(model), best, part, roughly=True)
    if best.scale is None:
        return found
    for place, effect in enumerate(model.effects[:-1]):
        choices = [p.name for p in effect.parameters if p.role == "choice"]
        if not choices or effect.held or not effect.is_tried_in_spectrum():
            continue
        # Other designs are tried in plain form with shapes of their own; they may not need what the present one needs.
        others = [
            Model((*model.effects[:place], point, *model.effects[place + 1 :]))
            for point in _grid_of(type(effect)(), part.data.n, part.data.rate)
            if _has_similar_shapes(point, effect)
        ]
        if not others:
            continue
        columns = np.stack([part.linear(other).matrix for other in others])
        starts = np.stack([best.theta] * len(others))
        thetas, values, scales = climb_many(
            part.power, part.count, columns, starts, best.scale, DESIGN_SCAN_STEPS
        )
        designs: dict[tuple[object, ...], int] = {}
        for k in map(int, np.argsort(-values, kind="stable")):
            designs.setdefault(tuple(others[k].effects[place].values[c] for c in choices), k)
        for k in list(designs.values())[:MAX_DESIGNS_POLISHED]:
            start = part.climb(part.linear(others[k]), thetas[k], scales[k])
            tried = polish(others[k], free_shape_parameters(others[k]), start, part, roughly=True)
            spared = sum(e.numbers for e in found[0]) - sum(e.numbers for e in tried[0])
            if tried[1].log_likelihood > found[1].log_likelihood - MAX_SIMPLER_LOSS * spared:
                found = tried
    return found


def _has_similar_shapes(point: Effect, effect: Effect) -> bool:
    """True if each free shape value of `point` is between half and twice the value of `effect`."""
    return all(
        effect.values[name] / MAX_SHAPE_RATIO
        < point.values[name]
        < MAX_SHAPE_RATIO * effect.values[name]
        for name in point.free_shapes
    )


def _refitted_candidate(
    points: list[Effect], base: Solution, part: RandomPart, arc: float
) -> Candidate | None:
    """Refitted `Candidate`: the best one of the trial effects `points`, after the best few are optimized; or None.

    `points` are one kind of effect with a grid of shape values, and `arc` is the path length of the grid, rad. None if no
    trial effect raises logL by 0.5 nats, or if `_candidate_of_last_effect` refuses the refitted effect.
    """
    scanned = scan_added_effect(base.model, points, base.best, part)
    if scanned[0][0].log_likelihood - base.best.log_likelihood < MIN_SCORE_GAIN:
        return None
    last = len(base.model)
    ends = polished_designs(scanned, last, part)
    model, best = simplest_design(ends, last)
    if best.log_likelihood > base.best.log_likelihood + MIN_DELTA_LOGL_OVER_SIMPLER:
        top = sorted(ends, key=lambda end: -end[1].log_likelihood)[:MAX_DESIGNS_POLISHED]
        others = [better_form(plain, last, start, part) for plain, start in top]
        model, best = max(
            [(model, best), *others],
            key=lambda end: end[1].log_likelihood + MAX_SIMPLER_LOSS * (end[0] is model),
        )
    model, best = _with_richer_form(ends, model, best, part)
    model, best = _with_best_design(model, best, part)
    # Solve again so that steps and lines are refitted together with the new effect.
    model = with_coefficients(model, best.theta)
    solution = solve(part.data, model, start=best, like=base, rounds=3, polish=False)
    return _candidate_of_last_effect(solution, base, part.data, arc)


def _candidate_of_last_effect(
    solution: Solution, base: Solution, data: Data, arc: float
) -> Candidate | None:
    """`Candidate` of the last effect of the refitted `solution`; None if its logL is not above that of `base`.

    None as well if the effect looks the same as a simpler one (`Effect.shows`), and for a narrow band, fitted to single
    frequencies, if the rest of the model is not flat near it. `arc` is the path length of the tried shapes, rad.
    """
    fitted = solution.model.effects[-1]
    if not fitted.shows(solution.model, data.rate, data.duration):
        return None
    gain = solution.log_likelihood - base.log_likelihood
    if gain <= 0.0:
        return None
    narrow = is_fitted_to_ordinates(fitted, data)
    if narrow and not is_flat_near(solution.model, len(solution.model) - 1, data):
        return None
    log_p, family = None, Family(fitted.family, (arc,))
    if narrow:
        # Two tests: in the few bins, or among all ordinates. The smaller p-value is doubled.
        in_bins = min(gain, solution.best.log_likelihood - base.best.log_likelihood)
        by_bins = log_p_value(family, max(in_bins, 0.0))
        log_p = min(_log_p_narrow(gain, data), by_bins) + np.log(2.0)
    return Candidate(fitted, gain, family, solution, fitted.numbers, log_p_value=log_p)


def widths_tried(n: int) -> int:
    """Number of widths of bands narrower than a bin that are tried in a record of n samples; at least 1."""
    return max(1, sum(width <= MAX_NARROW_WIDTH * n for width in WIDTHS))


def narrow_bands(
    solution: Solution, data: Data, white: NDArray[np.float64]
) -> Iterator[tuple[float, float, float, float]]:
    """Iterator over (ΔlogL, low, high, variance): for each tried width at most one band, that with the most excess power.

    Bands are searched in the whitened ordinates `white`, at frequencies where the bins are wider than the band. ΔlogL is
    that of a flat band: ½k(m − 1 − ln m) for k ordinates with m times the expected power. `low` and `high` are its ends,
    Hz, and `variance` is that of the excess, U². Widths without an excess are left out.
    """
    total = np.square(white)
    np.cumsum(total, out=total)
    hertz = data.rate / (2.0 * data.n)
    # Ordinates that share information count less.
    share = np.minimum(solution.count / np.diff(data.bins.edges), 1.0)
    for width in WIDTHS[: widths_tried(data.n)]:
        first = max(1, int(width / MAX_NARROW_WIDTH))
        sums = total[first + width :] - total[first:-width]
        if sums.size == 0:
            continue
        top = int(np.argmax(sums))
        mean, at = float(sums[top]) / width, first + 1 + top
        if mean > 1.0:
            power = float(np.sum(solution.ordinates[at : at + width] ** 2)) * (1.0 - 1.0 / mean)
            own = share[int(np.searchsorted(data.bins.edges, at, side="right")) - 1]
            gain = 0.5 * float(own) * width * (mean - 1.0 - float(np.log(mean)))
            yield gain, (at - 0.5) * hertz, (at + width - 0.5) * hertz, power / data.n
