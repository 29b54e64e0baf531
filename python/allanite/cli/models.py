"""Models as the command line names them: a sum, or a file that knows its unit and rate."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.effects import Model

__all__ = ["NamedModel", "is_model_file", "models_of"]


#: PATH_MAX of Linux: longer text is no path, and the system would refuse to look it up.
LONGEST = 4096


@dataclass(frozen=True, slots=True)
class NamedModel:
    """A model with what its file says of the recording it was fitted to."""

    name: str
    model: Model
    unit: str | None = None
    rate: float | None = None


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
        name = text if len(documents) == 1 else f"{text} {recording.get('column', '')}"
        model = model_from_dict(document, text)
        found.append(NamedModel(name, model, recording.get("unit"), recording.get("rate_hz")))
    return found
