"""Text table of several fits of one model, in data-sheet units."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.numbers import number, probability_text
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines
from allanite.effects import Deterministic
from allanite.effects.sheet_units import in_sheet_unit
from allanite.fit.estimates import has_interval
from allanite.fit.models import parameter_label
from allanite.fit.table import estimate_cell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects import Model
    from allanite.fit.result import Fit
    from allanite.fit.several.many import ManyFits, Pooled


def many_table(many: ManyFits) -> str:
    """Text table with a row for each column, then the pooled values and the test whether the columns agree."""
    fit = many.fits[0]
    pooled = many.pooled
    common = [_common_estimate(fit, row) for row in pooled]
    table = [["", *(row.name for row in pooled)]]
    for label, found in zip(many.labels, comparable_parameters(many.fits), strict=True):
        cells = (estimate_cell(_in_printed_unit(fit, row.name, found[row.name])) for row in pooled)
        table.append([label, *cells])
    table.append(["all", *map(estimate_cell, common)])
    spreads = ("–" if row.spread is None else f"{number(100 * row.spread, 2)} %" for row in pooled)
    table.append([f"spread between {many.record_noun}", *spreads])
    table.append(["p-value of agreement", *(probability_text(row.p_value) for row in pooled)])
    units = ", ".join(f"{e.name} in {printed(e.unit)}" for e in common if e.unit not in ("1", ""))
    noun, differing = many.record_noun, ", ".join(row.name for row in pooled if not row.agree)
    verdict = f"the {noun} agree: the values of row 'all' are common to all"
    if not many.agree:
        verdict = f"the {noun} differ: {differing} (for these, row 'all' is a mean over {noun}, weighted by precision)"
    return "\n".join([f"model {fit.model.name}, {units}", "", *aligned_lines(table), "", verdict])


def _in_printed_unit(fit: Fit, name: str, value: Estimate) -> Estimate:
    """Copy of an `Estimate` in the unit in which tables print it; `name` is its key in `comparable_parameters`."""
    label, _, parameter = name.rpartition(".")
    effect = fit.model.effects[fit.model.labels.index(label or name)]
    declared = effect.parameter(parameter)
    return in_sheet_unit(value, declared)


def _common_estimate(fit: Fit, row: Pooled) -> Estimate:
    """`Estimate` of a pooled value in the unit in which tables print it.

    It is not detected if 0 lies between the lower end of the interval and the value.
    """
    detected = not row.interval[0] <= 0.0 <= row.value
    own = Estimate(row.value, None, row.interval, row.unit, detected, row.name)
    return _in_printed_unit(fit, row.name, own)


def comparable_parameters(fits: Sequence[Fit]) -> list[dict[str, Estimate]]:
    """List of a dict for each fit: estimates with an interval, by their names in the first fit.

    Derived parameters, times, phases and effects that happen once are excluded. Several effects of a kind are matched by
    their order in frequency or time constant, because each fit puts its strongest first.
    """
    labels, order = fits[0].model.labels, _ranked(fits[0].model)
    out = []
    for fit in fits:
        place = dict(zip(order, _ranked(fit.model), strict=True))
        table = {}
        for i, label in enumerate(labels):
            effect = fit.model.effects[place[i]]
            if isinstance(effect, Deterministic) and effect.happens_once:
                continue
            for name, value in fit.estimates[place[i]].items():
                declared = effect.parameter(name)
                if (
                    has_interval(value)
                    and declared.role not in ("derived", "time")
                    and declared.unit != "rad"
                ):
                    table[parameter_label(label, name)] = value
        out.append(table)
    return out


def _ranked(model: Model) -> list[int]:
    """List of the indices of the effects sorted by kind and, within a kind, by the number of their first free shape.

    An effect without such a number counts as 0.
    """

    def rank(place: int) -> tuple[str, float]:
        """Sort key (kind, first free shape) of the effect at index `place`.

        The number is 0 without a free shape, or if this shape is unknown or a text.
        """
        effect = model.effects[place]
        first = next((effect.values[name] for name in effect.free_shapes), None)
        return effect.kind, float(first) if isinstance(first, (int, float)) else 0.0

    return sorted(range(len(model.effects)), key=rank)
