"""Models as the command line names them: a sum, or a file that knows its unit and rate."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.errors import InputError

if TYPE_CHECKING:
    from allanite.effects import Model

__all__ = ["NamedModel", "for_column", "is_model_file", "models_of"]


#: PATH_MAX of Linux: longer text is no path, and the system would refuse to look it up.
LONGEST = 4096


@dataclass(frozen=True, slots=True)
class NamedModel:
    """A model with what its file says of the recording it was fitted to."""

    name: str
    model: Model
    unit: str | None = None
    rate: float | None = None
    column: str = ""


def is_model_file(text: str) -> bool:
    """Tell a file from a sum of effects."""
    return text.endswith(".json") or (len(text) < LONGEST and Path(text).is_file())


def models_of(text: str) -> list[NamedModel]:
    """Read a model string, or the models of a file, one a column."""
    from allanite.effects.files import model_from_dict, parse_model
    from allanite.export._axis import documents_of

    if not is_model_file(text):
        return [NamedModel(text, parse_model(text))]
    found = []
    documents = documents_of(text)
    for document in documents:
        recording = document.get("recording") or {}
        column = str(recording.get("column") or "")
        name = text if len(documents) == 1 else f"{text} {column}"
        model = model_from_dict(document, text)
        unit, rate = recording.get("unit"), recording.get("rate_hz")
        found.append(NamedModel(name, model, unit, rate, column))
    return found


def for_column(models: list[NamedModel], column: str, text: str) -> NamedModel:
    """The model of a column: the only one that `text` holds, or that of the column's name.

    Raises
    ------
    InputError
        Several models, and none of that name: theirs are listed.
    """
    if len(models) == 1:
        return models[0]
    names = [m.column for m in models]
    if column not in names:
        raise InputError(f"{text} holds no model of column {column}: it holds {', '.join(names)}")
    return models[names.index(column)]
