"""Models of the command line: a model string, or a file that also holds a unit and a rate."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.units import conversion

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.effects import Effect, Model
    from allanite.recording import Recording


@dataclass(frozen=True, slots=True)
class NamedModel:
    """A model, with the column, unit and rate (Hz) of the recording to which it was fitted, if its file states them.

    `log_unit` is the unit of the numbers in the log, if it is not `unit`.
    """

    name: str
    model: Model
    unit: str | None = None
    rate: float | None = None
    column: str = ""
    document: Mapping[str, Any] = field(default_factory=dict)
    log_unit: str | None = None

    def in_unit(self, unit: str) -> Model:
        """`Model` with its coefficients converted to samples in `unit`; unchanged if the unit of the model is unknown.

        Raises `InputError` if `unit` is that of another kind of sensor.
        """
        if self.unit is None or self.unit == unit:
            return self.model
        factor = conversion(self.unit, unit)
        return type(self.model)(tuple(_scaled_effect(effect, factor) for effect in self.model))


def _scaled_effect(effect: Effect, factor: float) -> Effect:
    """Copy of an effect for samples in another unit, where 1 old unit = `factor` new units; limits are converted, too."""
    names = {p.name for p in effect.parameters if not isinstance(p.unit, str)}
    values = {k: v for k, v in effect.values.items() if k in names and v is not None}
    scaled = {
        k: tuple(factor * one for one in v) if isinstance(v, tuple) else factor * v
        for k, v in values.items()
    }
    ends = {
        k: (low * factor, high * factor)
        for k, (low, high) in effect.checked_limits.items()
        if k in names
    }
    return effect.with_values(**scaled, limits={**effect.limits, **ends})


def models_of(text: str, unit: str | None = None, rate: float | None = None) -> list[NamedModel]:
    """Models from a model string (one) or a file (one per axis); `unit` and `rate` (Hz) are used if it states none."""
    from allanite.effects.files import model_from_dict
    from allanite.sources import documents_of

    found = []
    documents = documents_of(text, unit, rate)
    for document in documents:
        recording = document.get("recording") or {}
        column = str(recording.get("column") or "")
        name = text if len(documents) == 1 else f"{text} {column}"
        model = model_from_dict(document, text)
        own = recording.get("unit"), recording.get("rate_hz")
        found.append(NamedModel(name, model, *own, column, document, recording.get("log_unit")))
    return found


def start_models(text: str | None, columns: Sequence[Recording]) -> list[Model]:
    """Start model of each column, in the unit of its samples, from a model string or file.

    None stands for N+B+K, or Q+F+N+B+K for a clock. Raises `InputError` if `text` is invalid, or if its file has
    several models and none for a column.
    """
    if text is None:
        from allanite.effects.files import parse_model
        from allanite.readers.starts import start_model

        return [parse_model(start_model(column)) for column in columns]
    models = models_of(text)
    return [model_for_column(models, c.columns[0], text).in_unit(c.unit) for c in columns]


def model_for_column(models: list[NamedModel], column: str, text: str) -> NamedModel:
    """The only model, or the model with the column's name; raises `InputError` with the source `text` if there is none."""
    if len(models) == 1:
        return models[0]
    names = [m.column for m in models]
    if column not in names:
        raise InputError(f"{text} has no model of column {column}, only of {', '.join(names)}")
    return models[names.index(column)]
