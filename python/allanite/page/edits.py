"""Models changed by hand: parsed, with a value set, held, limited, frozen for a trial."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import parse_unit
from allanite.effects import standard

if TYPE_CHECKING:
    from allanite.effects import Model, Parameter
    from allanite.fit import Fit

__all__ = [
    "SHEET",
    "deviation_unit",
    "effect",
    "factor_of",
    "freed",
    "frozen",
    "parse_model_string",
    "shown_unit",
    "with_limits",
    "with_value",
]


#: The choice of the units that data sheets use: °/√h, °/h, …
SHEET = "data sheet"
#: The coefficient whose unit on data sheets is that of an Allan deviation.
DEVIATION = "B"


def deviation_unit(sample_unit: str, chosen: str | None) -> str:
    """Unit in which an Allan deviation of samples is given: theirs, one of the same kind, or a data sheet's."""
    kind = parse_unit(sample_unit).kind
    if chosen == SHEET:
        return standard()[DEVIATION].parameter(DEVIATION).sheet.get(kind, sample_unit)
    if chosen is None or parse_unit(chosen).kind != kind:
        return sample_unit
    return chosen


def shown_unit(parameter: Parameter, value: Estimate, sample_unit: str, chosen: str | None) -> str:
    """Unit in which a chip shows a value: its own, the same with another sample unit, or a data sheet's."""
    if chosen is None or not value.unit.startswith(sample_unit) or sample_unit == "1":
        return value.unit
    if chosen == SHEET:
        return parameter.sheet.get(parse_unit(sample_unit).kind, value.unit)
    shown = chosen + value.unit[len(sample_unit) :]
    try:
        value.to(shown)
    except InputError:
        # Chosen for a gyroscope, where an accelerometer is looked at now; or per a column whose unit has no other.
        return value.unit
    return shown


def factor_of(value: Estimate, shown: str) -> float:
    """By what a number in the unit of a value is multiplied where it is shown in another."""
    return float(Estimate(1.0, unit=value.unit).to(shown))


def parse_model_string(text: str) -> Model:
    """A model string; never the name of a file, whatever the browser sends."""
    from allanite.effects.strings import parse_string

    if not 0 < len(text) <= 2000:
        raise InputError("a model is a sum such as N+B+K")
    return parse_string(text)


def effect(fit: Fit, place: int) -> Any:
    """The effect at a place of the model; `InputError` if there is none."""
    if not 0 <= place < len(fit.model):
        raise InputError(f"there is no effect {place} in the model")
    return fit.model.effects[place]


def with_value(model: Model, place: int, name: str, value: float | None, held: bool) -> Model:
    """The model with a value set (None: as it is) and held or free."""
    if not 0 <= place < len(model):
        raise InputError(f"there is no effect {place} in the model")
    effect = model.effects[place]
    if name not in {p.name for p in effect.parameters if p.role in ("coefficient", "shape")}:
        raise InputError(f"{effect.kind} has no value {name!r} to set")
    names = (set(effect.hold) | {name}) if held else (set(effect.hold) - {name})
    changed = {} if value is None else {name: value}
    at_limit = tuple(n for n in effect.at_limit if n != name)
    return model.replaced(place, **changed, hold=tuple(sorted(names)), at_limit=at_limit)


def with_limits(
    model: Model, place: int, name: str, low: float | None, high: float | None
) -> Model:
    """The model with other limits of a value; None is an open end."""
    if not 0 <= place < len(model):
        raise InputError(f"there is no effect {place} in the model")
    return model.replaced(place, limits={**model.effects[place].limits, name: (low, high)})


def frozen(effect: Any) -> Any:
    """The effect with every value that it has held, wherever its limits are: a fit of it fits nothing."""
    names = [p.name for p in effect.parameters if p.role in ("coefficient", "shape")]
    held = tuple(n for n in names if effect.values[n] is not None)
    return effect.with_values(hold=held, limits={}, at_limit=())


def freed(effect: Any, original: Any) -> Any:
    """The effect keeping to what `original` keeps to."""
    return effect.with_values(hold=original.hold, limits=original.limits)
