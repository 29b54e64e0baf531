"""Read and write models as JSON files, and convert strings, effects and fits to models."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from allanite import _kernels
from allanite.common.documents import invalid_as_input_error, json_of
from allanite.common.errors import InputError, about
from allanite.common.files import is_file, write_text
from allanite.effects._base import Effect
from allanite.effects.model import Model
from allanite.effects.registry import find
from allanite.effects.strings import parse_string

#: Names of the JSON schemas that contain a model; the first one is written.
MODEL_SCHEMAS = ("allanite/model/1", "allanite/fit/1", "allanite/check/1", "allanite/check/2")


def model_to_dict(model: Model) -> dict[str, Any]:
    """Dict (JSON form ``allanite/model/1``) of a model: kinds, values (None if to be fitted), held names, limits."""
    return {
        "schema": MODEL_SCHEMAS[0],
        "version": _kernels.version(),
        "model": model.name,
        "effects": [
            {
                "kind": effect.kind,
                "parameters": {k: {"value": v} for k, v in effect.values.items()},
                "held": [],
                **held_and_limits(effect.with_values(at_limit=())),
            }
            for effect in model
        ],
    }


def held_and_limits(effect: Effect) -> dict[str, Any]:
    """Dict (JSON form) of the ``held`` names, ``limits`` and ``at_limit`` names of an effect; empty entries are omitted."""
    every = {
        "held": sorted(effect.hold),
        "limits": effect.checked_limits.to_dict(),
        "at_limit": sorted(effect.at_limit),
    }
    return {name: value for name, value in every.items() if value}


def model_from_dict(document: dict[str, Any], source: str) -> Model:
    """`Model` in a model, fit or check document; `source` names the document in messages.

    Raises `InputError` for several columns, another schema, an unknown effect, no effects, or an invalid format.
    """
    if "columns" in document:
        raise InputError(
            f"{source} contains models of several columns, but one is needed; save that model separately"
        )
    if document.get("schema") not in MODEL_SCHEMAS:
        raise InputError(
            f"{source}: schema {document.get('schema')!r} is not a model (expected one of {', '.join(MODEL_SCHEMAS)})"
        )
    with invalid_as_input_error(
        f"{source}: the effects do not have the format of a model, fit or check file"
    ):
        effects = [_effect_of_entry(entry, source) for entry in document.get("effects", [])]
    if not effects:
        raise InputError(f"{source}: the document contains no effects")
    return Model(tuple(effects))


def _effect_of_entry(entry: dict[str, Any], source: str) -> Effect:
    """`Effect` of a JSON entry; InputError if its kind is unknown. Derived and unknown parameters are ignored."""
    cls = find(str(entry.get("kind")))
    if cls is None:
        raise InputError(f"{source}: unknown effect {entry.get('kind')!r}")
    known = {p.name for p in cls.parameters if p.role != "derived"}
    values = {k: v.get("value") for k, v in entry.get("parameters", {}).items() if k in known}
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
    return cls(**values, hold=tuple(entry.get("held", ())), limits=entry.get("limits", {}))


def parse_model(text: str | Model) -> Model:
    """`Model` from a model string or from a JSON file; a `Model` is returned unchanged.

    Parameters
    ----------
    text : str or Model
        A model string such as ``N+B+K`` or ``N(N=0.01)+GM(T=30!)``; or the path of a file written by `Model.save` or
        `Fit.save`.

    Returns
    -------
    Model
        Values that are not given are None; a fit estimates them.

    Raises
    ------
    InputError
        Invalid string (the message points at the character), or a missing or foreign file.

    Examples
    --------
    >>> print(al.parse_model("N(N=0.01)+GM(T=30!)"))  # T is held
    N(N=0.01)+GM(correlation_time=30!)
    >>> al.parse_model("angle_random_walk+rate_random_walk").name
    'N+K'
    """
    if isinstance(text, Model):
        return text
    if text.endswith(".json") or is_file(text):
        with about(text):
            document = json_of(text)
        if not isinstance(document, dict):
            raise InputError(f"{text}: not a model file: expected a JSON object")
        return model_from_dict(document, text)
    return parse_string(text)


def save_model(model: Model, path: str | Path, recording: Mapping[str, Any] | None = None) -> None:
    """Write a model as JSON; `recording` has the ``unit`` and ``rate_hz`` of its samples, which exports read."""
    document = model_to_dict(model) | ({} if recording is None else {"recording": dict(recording)})
    write_text(path, json.dumps(document, indent=1) + "\n")


def as_model(given: object) -> Model:
    """`Model` from a `Model`, an effect, a model string, the path of a JSON file, or an object with a `model` (a fit).

    Raises `InputError` for an object of another type, and for an invalid string or file.
    """
    given = getattr(given, "model", given)
    if isinstance(given, os.PathLike):
        given = os.fspath(given)
    if isinstance(given, Effect):
        return Model((given,))
    if isinstance(given, (str, Model)):
        return parse_model(given)
    raise InputError(
        f"expected a model, found {type(given).__name__}; give a string such as 'N+B+K', or al.parse_model(…)"
    )


def as_noise_model(given: object) -> Model:
    """`Model` as by `as_model`; raises `InputError` unless it contains random effects only."""
    model = as_model(given)
    if model.deterministic or model.modifiers:
        raise InputError(
            f"the noise model {model.name} may contain random effects only: remove the others",
            missing="model",
            remedy=" from {model}",
        )
    return model
