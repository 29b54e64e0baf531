"""Shape parameters (time constants, frequencies): a scan where there is no value, then a bounded polish."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Deterministic, Effect, Model, Periodic
from allanite.fit.data import density
from allanite.fit.deterministic import comb_ordinates, comb_window, design_of, regress
from allanite.fit.matched import grid_points, matched_gains

if TYPE_CHECKING:
    from allanite.effects.terms import Term
    from allanite.fit.data import Data
    from allanite.fit.whittle import Maximum

__all__ = ["fit_deterministic_shapes", "fit_shapes", "polish_line"]

#: Ordinates about a line within which its frequency is polished.
ZOOM = 48


def _with(model: Model, place: int, effect: Effect) -> Model:
    return Model((*model.effects[:place], effect, *model.effects[place + 1 :]))


def _replace(model: Model, place: int, **values: Any) -> Model:
    return _with(model, place, model.effects[place].with_values(**values))


def fit_shapes(
    model: Model, maximise: Callable[[Model], Maximum], data: Data, *, polish: bool
) -> Model:
    """Shapes of stochastic effects and modifiers that maximise logL."""
    free: list[tuple[int, str]] = []  # (place in the model, shape)
    for place, effect in enumerate(model.effects):
        if isinstance(effect, Deterministic):
            continue
        names = [n for n in effect.free_shapes if not isinstance(effect.values[n], str)]
        missing = [n for n in names if effect.values[n] is None]
        variants = effect.variants()
        if missing or (len(variants) > 1 and _undecided(effect)):
            starts = [_with(model, place, v) for v in variants]
            choices = [_scan(m, place, missing or names, maximise, data) for m in starts]
            model = max(choices, key=lambda m: maximise(m).log_likelihood)
        free += [(place, n) for n in names]
    if not free or not polish:
        return model
    return _polish(model, free, maximise, data)


def _undecided(effect: Effect) -> bool:
    return any(p.role == "choice" and effect.values[p.name] is None for p in effect.parameters)


def _scan(
    model: Model, place: int, names: list[str], maximise: Callable[[Model], Maximum], data: Data
) -> Model:
    grids = [model.effects[place].grid(n, data.n, data.rate) for n in names]
    best, value = model, -np.inf
    for point in np.stack(np.meshgrid(*grids, indexing="ij"), -1).reshape(-1, len(names)):
        tried = _replace(model, place, **dict(zip(names, map(float, point), strict=True)))
        found = maximise(tried).log_likelihood
        if found > value:
            best, value = tried, found
    return best


def _polish(
    model: Model, free: list[tuple[int, str]], maximise: Callable[[Model], Maximum], data: Data
) -> Model:
    """Nelder-Mead in the logarithms; a handful of shapes at most, each evaluation under a millisecond."""
    from scipy.optimize import minimize

    def bounds(place: int, name: str) -> tuple[float, float]:
        effect = model.effects[place]
        declared = effect.parameter(name)
        grid = effect.grid(name, data.n, data.rate)
        if declared.low < 0.0:
            return declared.low, declared.high
        low, high = max(declared.low, grid.min() / 2.0), min(declared.high, grid.max() * 2.0)
        return float(np.log(max(low, 1e-300))), float(np.log(high))

    # Positive shapes move on a logarithmic scale, signed ones (an exponent) on their own.
    signed = [model.effects[p].parameter(n).low < 0.0 for p, n in free]
    limits = [bounds(*f) for f in free]
    values = [model.effects[p].values[n] for p, n in free]
    start = np.array([v if s else np.log(v) for v, s in zip(values, signed, strict=True)])
    start = np.clip(start, [lo for lo, _ in limits], [hi for _, hi in limits])

    def at(point: NDArray[np.float64]) -> Model:
        out = model
        for (place, name), u, plain in zip(free, point, signed, strict=True):
            out = _replace(out, place, **{name: float(u if plain else np.exp(u))})
        return out

    simplex = np.vstack([start, start + 0.15 * np.eye(start.size)])
    options: dict[str, Any] = {
        "initial_simplex": np.clip(simplex, *np.array(limits).T),
        "xatol": 1e-3,
        "fatol": 1e-4,
        "maxfev": 120 * start.size,
    }

    def loss(point: NDArray[np.float64]) -> float:
        return -maximise(at(point)).log_likelihood

    found: Any = minimize(loss, start, method="Nelder-Mead", bounds=limits, options=options)  # type: ignore[call-overload]
    return at(found.x)


def fit_deterministic_shapes(model: Model, data: Data, *, slow: bool) -> Model:
    """Shapes of deterministic effects given the spectrum: frequencies of lines and, if `slow`, times and lags."""
    terms = data.terms(model)
    for place, effect in enumerate(model.effects):
        if not isinstance(effect, Deterministic) or not effect.free_shapes:
            continue
        others = tuple(
            e for i, e in enumerate(model.effects) if i != place and isinstance(e, Deterministic)
        )
        if isinstance(effect, Periodic):
            taken = _others_signal(others, data)
            ordinates = data.ordinates if taken is None else data.without(taken)
            start = effect.frequency
            if start is None:
                start = strongest_line(ordinates, terms, data)
            multiples = [m for m, _, _ in effect.lines]
            found = polish_line(start, ordinates, terms, data, multiples)
            model = _replace(model, place, frequency=found)
            if effect.values["frequency"] is None and not effect.held:
                # The next line without a frequency is looked for in what this one leaves.
                j = comb_window(found, multiples, data)
                line = comb_ordinates(found, multiples, j, data)
                size = regress(line, ordinates[j], density(terms, j, data.n)).amplitudes
                placed = effect.with_values(frequency=found).with_amplitudes(size)
                model = Model((*model.effects[:place], placed, *model.effects[place + 1 :]))
        elif slow or any(effect.values[n] is None for n in effect.free_shapes):
            model = _polish_slow(model, place, others, terms, data)
    return model


def _others_signal(others: tuple[Deterministic, ...], data: Data) -> NDArray[np.float64] | None:
    known = [e for e in others if any(v is not None and v != 0.0 for v in e.amplitudes())]
    known = [e for e in known if all(e.values[n] is not None for n in e.free_shapes)]
    if not known:
        return None
    return data.signal(known)


def strongest_line(ordinates: NDArray[np.float64], terms: tuple[Term, ...], data: Data) -> float:
    """Frequency of the largest whitened ordinate pair, Hz."""
    j = np.arange(8, data.n)
    ratio = ordinates[8:] ** 2 / density(terms, j, data.n)
    return float(j[int(np.argmax(ratio))] * data.rate / (2.0 * data.n))


def polish_line(
    start: float,
    ordinates: NDArray[np.float64],
    terms: tuple[Term, ...],
    data: Data,
    multiples: Sequence[int] = (1,),
) -> float:
    """Frequency near `start` (within 1/T) at which a line, with its harmonics, explains most, Hz."""
    from scipy.optimize import minimize_scalar

    j = comb_window(start, multiples, data, ZOOM)
    variance = density(terms, j, data.n)
    values = ordinates[j]
    step = data.rate / (2.0 * data.n)
    # The highest harmonic moves fastest.
    fine = step / (8.0 * max(multiples))

    def loss(f: float) -> float:
        return -regress(comb_ordinates(f, multiples, j, data), values, variance).gain

    grid = start + np.arange(-2.0 * step, 2.0 * step + 0.5 * fine, fine)
    grid = grid[(grid > step) & (grid * max(multiples) < data.rate / 2.0 - step)]
    centre = grid[int(np.argmin([loss(f) for f in grid]))]
    found = minimize_scalar(
        loss,
        bounds=(centre - fine, centre + fine),
        method="bounded",
        options={"xatol": 1e-3 * fine},
    )
    return float(found.x)


def _polish_slow(
    model: Model,
    place: int,
    others: tuple[Deterministic, ...],
    terms: tuple[Term, ...],
    data: Data,
) -> Model:
    """Profile gain of one shape of a slow effect (lag, time constant, time), others refitted with it."""
    from scipy.optimize import minimize_scalar

    effect = model.effects[place]
    assert isinstance(effect, Deterministic)
    for name in effect.free_shapes:

        def loss(value: float, name: str = name, base: Deterministic = effect) -> float:
            tried = base.with_values(**{name: value})
            design = design_of((tried, *others), data)
            variance = density(terms, design.ordinates, data.n)
            return -regress(design.matrix, data.ordinates[design.ordinates], variance).gain

        grid = np.unique(effect.grid(name, data.n, data.rate))
        known = effect.values[name]
        if known is None:
            points = grid_points(effect, data)
            taken = _others_signal(others, data)
            residual = data.ordinates if taken is None else data.without(taken)
            gains, _ = matched_gains(points, residual, terms, data)
            known = float(points[int(np.argmax(gains))].values[name])
        at = int(np.searchsorted(grid, known))
        low, high = float(grid[max(0, at - 1)]), float(grid[min(grid.size - 1, at + 1)])
        if high > low:
            found = minimize_scalar(
                loss, bounds=(low, high), method="bounded", options={"maxiter": 20}
            )
            if found.fun < loss(known):
                known = float(found.x)
        effect = effect.with_values(**{name: known})
    return _replace(model, place, **{n: effect.values[n] for n in effect.free_shapes})
