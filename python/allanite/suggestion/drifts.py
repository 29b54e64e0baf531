"""Candidate slow functions of time and of other columns: ramps, warm-up, steps, covariates with their lags.

Each kind is a matched filter on the whitened ordinates at every point of its shape grid at once; the best is refitted. A
drift has to explain something that a random process does not: its gain is what it adds to the model *with* the best
spectral candidate (otherwise any slow column explains any random walk: spurious regression).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects import Deterministic
from allanite.effects.bias_step import BiasStep
from allanite.effects.covariate import Covariate
from allanite.effects.rate_ramp import RateRamp
from allanite.effects.warm_up import WarmUp
from allanite.fit.data import density
from allanite.fit.engine import Solution, solve
from allanite.suggestion.evidence import arc_length
from allanite.suggestion.spectral import Candidate, Screen

if TYPE_CHECKING:
    from allanite.fit.data import Data

__all__ = ["screen_covariates", "screen_drifts", "screen_steps"]

#: Ordinates of the matched filter; a step has all but 1/4096 of its weight there.
LOW = 4096
#: A matched filter that promises less is not refitted.
LEAST = 3.0


def screen_drifts(solution: Solution, data: Data, rival: Solution | None) -> Screen:
    """A ramp and a warm-up."""
    return _screen((RateRamp(), WarmUp()), "drift", solution, data, rival)


def screen_steps(solution: Solution, data: Data, rival: Solution | None) -> Screen:
    """A step at any time."""
    return _screen((BiasStep(),), "step", solution, data, rival)


def screen_covariates(solution: Solution, data: Data, rival: Solution | None) -> Screen:
    """Every column offered, at every lag."""
    used = {e.values["column"] for e in solution.model.deterministic if e.kind == "covariate"}
    offered = [
        Covariate(column=name)
        for name, values in data.covariates.items()
        if name not in used and float(np.ptp(values)) > 0.0
    ]
    return _screen(tuple(offered), "covariate", solution, data, rival)


def _screen(
    kinds: tuple[Deterministic, ...],
    family: str,
    solution: Solution,
    data: Data,
    rival: Solution | None,
) -> Screen:
    found: list[Candidate] = []
    arcs: list[float] = []
    present = {e.kind for e in solution.model.effects}
    j = np.arange(1, min(data.n, LOW), dtype=np.int64)
    for blank in kinds:
        if blank.kind in present and blank.kind in {"rate_ramp", "warm_up"}:
            continue
        points, matrix = _regressors(blank, data, j)
        null = rival if rival is not None else solution
        gain, arc = _matched(matrix, null, data, j)
        arcs.append(arc)
        top = int(np.argmax(gain))
        if gain[top] < LEAST:
            continue
        candidate = _refit(points[top], family, solution, data, rival)
        if candidate is not None:
            found.append(candidate)
    return Screen(tuple(found), tuple(arcs))


def _regressors(
    blank: Deterministic, data: Data, j: NDArray[np.int64]
) -> tuple[list[Deterministic], NDArray[np.float64]]:
    """Points of the shape grid and the ordinates of each one's regressor, shape (points, ordinates)."""
    shapes = [p.name for p in blank.parameters if p.role == "shape"]
    if not shapes:
        points = [blank]
    else:
        grid = getattr(blank, "grid")(shapes[0], data.n, data.rate)  # noqa: B009
        points = [blank.with_values(**{shapes[0]: float(v)}) for v in grid]
    if blank.kind == "bias_step":
        # Cosine transform of a step at sample k: −√(2/n) sin(πjk/n)/(2 sin(πj/2n)).
        k = np.ceil(np.array([p.values["time"] for p in points]) * data.rate)[:, None]
        return points, -np.sqrt(2.0 / data.n) * np.sin(np.pi * j * k / data.n) / (
            2.0 * np.sin(np.pi * j / (2 * data.n))
        )
    time = np.arange(data.n) / data.rate
    rows = [
        _kernels.cosine_transform(np.ascontiguousarray(p.regressors(time, data.covariates)[:, 0]))[j]
        for p in points
    ]
    return points, np.array(rows)


def _matched(
    matrix: NDArray[np.float64], null: Solution, data: Data, j: NDArray[np.int64]
) -> tuple[NDArray[np.float64], float]:
    """Gain ½z² of each row on the residual of `null`, and the angle that the rows span."""
    root = 1.0 / np.sqrt(density(data.terms(null.model), j, data.n))
    white = matrix * root
    norm = np.linalg.norm(white, axis=1)
    norm[norm == 0.0] = 1.0
    unit = white / norm[:, None]
    return 0.5 * (unit @ (null.ordinates[j] * root)) ** 2, arc_length(unit)


def _refit(
    effect: Deterministic, family: str, base: Solution, data: Data, rival: Solution | None
) -> Candidate | None:
    """The refitted candidate; its gain is the least of what it adds to the model alone and to the rival's."""
    refitted = solve(data, base.model + effect, rounds=4)
    gain = refitted.log_likelihood - base.log_likelihood
    if rival is not None and gain > 0.0:
        beside = solve(data, rival.model + refitted.model.effects[-1], polish=False, rounds=4)
        gain = min(gain, beside.log_likelihood - rival.log_likelihood)
    if gain <= 0.0:
        return None
    shapes = sum(p.role in {"shape", "coefficient"} for p in effect.parameters)
    if effect.values.get("quadratic", 0.0) is None:
        shapes -= 1
    return Candidate(refitted.model.effects[-1], gain, family, refitted, shapes)
