"""Changes of models by the user: parsing, setting and holding values, limits, and trial models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import parse_unit
from allanite.effects.sheet_units import figure_unit, in_sheet_unit, requested_units
from allanite.effects.strings import parse_string

if TYPE_CHECKING:
    from allanite.effects import Effect, Model, Parameter

#: Choice of data-sheet units: °/√h, °/h, …
SHEET = "data sheet"


def chosen_units(sample_unit: str, chosen: str | None) -> dict[str, str]:
    """Dict with one entry: kind of the sensor, and the unit in which figures display its samples and deviations.

    The unit is `chosen` if it is one of this kind of sensor, otherwise `sample_unit`. The dict is empty if `chosen` is
    `SHEET`; figures then use the units of data sheets.
    """
    if chosen == SHEET:
        return {}
    kind = parse_unit(sample_unit).kind
    fits = chosen is not None and parse_unit(chosen).kind == kind
    return {kind: chosen if fits and chosen else sample_unit}


def deviation_unit(sample_unit: str, chosen: str | None) -> str:
    """Unit in which an Allan deviation is displayed, for samples in `sample_unit`; `chosen` as in `chosen_units`."""
    with requested_units(chosen_units(sample_unit, chosen)):
        return figure_unit(sample_unit)


def shown_unit(parameter: Parameter, value: Estimate, sample_unit: str, chosen: str | None) -> str:
    """Name of the unit in which a value is displayed: `chosen` replaces `sample_unit` in the unit of the value.

    `SHEET` stands for the unit of data sheets. The value keeps its unit if `chosen` is None, if the samples are
    dimensionless, or if the value cannot be converted.
    """
    if chosen is None or not value.unit.startswith(sample_unit) or sample_unit == "1":
        return value.unit
    if chosen == SHEET:
        return in_sheet_unit(value, parameter).unit
    shown = chosen + value.unit[len(sample_unit) :]
    try:
        value.to(shown)
    except InputError:
        # The chosen unit may be that of another kind of sensor, or the unit of a logged column cannot be converted.
        return value.unit
    return shown


def factor_of(value: Estimate, shown: str) -> float:
    """Factor that converts a number from the unit of `value` to the unit `shown`."""
    return float(Estimate(1.0, unit=value.unit).to(shown))


def parse_model_string(text: str) -> Model:
    """`Model` from a model string of at most 2000 characters; files are never opened.

    Raises `InputError` for an empty, longer or invalid text.
    """
    if not 0 < len(text) <= 2000:
        raise InputError("a model is a sum such as N+B+K")
    return parse_string(text)


def effect_at(model: Model, place: int) -> Effect:
    """`Effect` at index `place` of a model; raises `InputError` if there is none."""
    if not 0 <= place < len(model):
        raise InputError(f"there is no effect {place} in the model")
    return model.effects[place]


def with_value(model: Model, place: int, name: str, value: float | None, held: bool) -> Model:
    """Copy of the model with the parameter `name` of the effect at index `place` set to `value` (None: unchanged).

    A fit keeps the parameter fixed if `held`, and estimates it otherwise. Raises `InputError` if there is no such
    effect or parameter.
    """
    effect = effect_at(model, place)
    if name not in {p.name for p in effect.parameters if p.role in ("coefficient", "shape")}:
        raise InputError(f"{effect.kind} has no value {name!r} to set")
    names = (set(effect.hold) | {name}) if held else (set(effect.hold) - {name})
    changed = {} if value is None else {name: value}
    at_limit = tuple(n for n in effect.at_limit if n != name)
    return model.replaced(place, **changed, hold=tuple(sorted(names)), at_limit=at_limit)


def with_limits(
    model: Model, place: int, name: str, low: float | None, high: float | None
) -> Model:
    """Copy of the model with limits `low` and `high` of a parameter of the effect at index `place`; None is no limit.

    Raises `InputError` if there is no such effect.
    """
    return model.replaced(place, limits={**effect_at(model, place).limits, name: (low, high)})


def with_values_held(effect: Any) -> Any:
    """Copy of an effect in which every coefficient and shape that has a value is held, and none has limits."""
    names = [p.name for p in effect.parameters if p.role in ("coefficient", "shape")]
    held = tuple(n for n in names if effect.values[n] is not None)
    return effect.with_values(hold=held, limits={}, at_limit=())


def with_holds_of(effect: Any, original: Any) -> Any:
    """Copy of an effect with the same values, and with the held parameters and limits of the effect `original`."""
    return effect.with_values(hold=original.hold, limits=original.limits)
