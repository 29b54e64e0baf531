"""Changes of models by the user: parsing, setting and holding values, limits, and trial models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import parse_unit
from allanite.effects import standard

if TYPE_CHECKING:
    from allanite.effects import Model, Parameter
    from allanite.fit import Fit

#: Choice of data-sheet units: °/√h, °/h, …
SHEET = "data sheet"
#: Coefficient whose data-sheet unit is that of an Allan deviation.
DEVIATION = "B"


def deviation_unit(sample_unit: str, chosen: str | None) -> str:
    """Name of the unit in which an Allan deviation is displayed.

    It is the sample unit, the unit `chosen` by the viewer if it is of the same kind of sensor, or
    the data-sheet unit.
    """
    kind = parse_unit(sample_unit).kind
    if chosen == SHEET:
        return standard()[DEVIATION].parameter(DEVIATION).sheet.get(kind, sample_unit)
    if chosen is None or parse_unit(chosen).kind != kind:
        return sample_unit
    return chosen


def shown_unit(parameter: Parameter, value: Estimate, sample_unit: str, chosen: str | None) -> str:
    """Name of the unit in which a value is displayed: its own, one with the chosen sample unit, or that of data sheets.

    A parameter without a unit of data sheets gets that of the standard coefficient with the same power of seconds: an
    amplitude or σ is in °/h like B, and the driving noise of a Gauss-Markov process is in °/h/√h like K.
    """
    if chosen is None or not value.unit.startswith(sample_unit) or sample_unit == "1":
        return value.unit
    if chosen == SHEET:
        kind = parse_unit(sample_unit).kind
        declared = (p for name, e in standard().items() for p in (e.parameter(name),))
        alike = (p.sheet for p in declared if p.unit == parameter.unit)
        return (parameter.sheet or next(alike, {})).get(kind, value.unit)
    shown = chosen + value.unit[len(sample_unit) :]
    try:
        value.to(shown)
    except InputError:
        # The chosen unit may be that of another kind of sensor, or the unit of a logged column cannot be converted.
        return value.unit
    return shown


def factor_of(value: Estimate, shown: str) -> float:
    """Factor by which a number in the value's own unit is multiplied to get the displayed unit."""
    return float(Estimate(1.0, unit=value.unit).to(shown))


def parse_model_string(text: str) -> Model:
    """`Model` from a model string of at most 2000 characters; raises InputError otherwise. Files are never opened."""
    from allanite.effects.strings import parse_string

    if not 0 < len(text) <= 2000:
        raise InputError("a model is a sum such as N+B+K")
    return parse_string(text)


def effect(fit: Fit, place: int) -> Any:
    """The effect at index `place` of the fitted model; raises `InputError` if there is none."""
    if not 0 <= place < len(fit.model):
        raise InputError(f"there is no effect {place} in the model")
    return fit.model.effects[place]


def with_value(model: Model, place: int, name: str, value: float | None, held: bool) -> Model:
    """Copy of the model with a parameter set to `value` (None: unchanged), and held or free."""
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
    """Copy of the model with new limits of a parameter; None is an open end."""
    if not 0 <= place < len(model):
        raise InputError(f"there is no effect {place} in the model")
    return model.replaced(place, limits={**model.effects[place].limits, name: (low, high)})


def frozen(effect: Any) -> Any:
    """Copy of the effect with all known values held and without limits, so that a fit changes nothing."""
    names = [p.name for p in effect.parameters if p.role in ("coefficient", "shape")]
    held = tuple(n for n in names if effect.values[n] is not None)
    return effect.with_values(hold=held, limits={}, at_limit=())


def freed(effect: Any, original: Any) -> Any:
    """Copy of the effect with its own values, and with the held names and limits of `original`."""
    return effect.with_values(hold=original.hold, limits=original.limits)
