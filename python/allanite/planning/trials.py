"""Correction for the number of searches that `check` will apply to a future record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic, Modifier
from allanite.fit.likelihood.expected import Noise
from allanite.fit.rivals.line_trials import trials_at
from allanite.fit.shapes.matched import grid_points, matched_gains, slow_families
from allanite.suggestion.constants import LEVEL_CELLS
from allanite.suggestion.p_values import Family, arc_length, interval_trials
from allanite.suggestion.screens.spectral import directions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects import Effect, Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: ΔlogL, nats, at which the number of independent intervals of time is evaluated: that of a weak significant level change.
TYPICAL_DELTA_LOGL = 11.0


def family_of(
    base: Model, effect: Effect, null: Solution, data: Data, grid: Data
) -> tuple[Family, int]:
    """Tuple (family of searches in which `check` looks for the effect, number of families that share the false alarms).

    The family is that of a slow function, a line, a change of level, or else a shape of the spectrum.

    Parameters
    ----------
    base : Model
        Model without the effect.
    null : Solution
        Its random part, fitted to the expected record.
    """
    arcs: dict[str, list[float]] = {"spectral": []}
    for cls, _, unit in directions(null, data):
        arcs.setdefault(cls.family, []).append(arc_length(unit))
    slow = slow_families(base, grid.covariates)
    # Lines, levels, disturbances and outliers are searched in every record.
    families = len(arcs) + len(slow) + 4
    if isinstance(effect, Deterministic) and effect.low:
        return Family(
            effect.family, _arc_lengths(slow.get(effect.family, ()), null, grid), 2
        ), families
    if effect.periodic:
        cycles = np.array([effect.values["frequency"] * data.duration])
        return Family("line", width=float(trials_at(cycles, data.n, data.rate)[0])), families
    if isinstance(effect, Modifier) and effect.passing:
        start, end = effect.when or data.span
        length = (end - start) / data.duration
        octave = 2 ** int(np.log2(np.clip(length * LEVEL_CELLS, 1.0, LEVEL_CELLS / 2)))
        return Family(
            "level",
            (0.0,),
            sides=2 * round(interval_trials(LEVEL_CELLS, octave, TYPICAL_DELTA_LOGL)),
        ), families
    return Family(effect.family, tuple(arcs.get(effect.family, ()))), families


def _arc_lengths(kinds: Sequence[Deterministic], null: Solution, grid: Data) -> tuple[float, ...]:
    """Tuple of angles, rad, one for each known function: how far its direction turns over its grid of shape values.

    The direction is the unit vector of the function's cosine transform, divided by the root of the noise power of
    `null`. The angle between successive shapes is added up. It measures the number of independent trials.
    """
    out = []
    for blank in kinds:
        nothing = np.zeros(grid.n)
        noise = Noise(grid.terms(null.model), grid.bins, np.ones(grid.bins.count.size))
        _, unit = matched_gains(
            grid_points(blank, grid.n, grid.rate), nothing, noise, grid, null.model.deterministic
        )
        out.append(arc_length(unit))
    return tuple(out)
