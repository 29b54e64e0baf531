"""Models from sources other than logs: data sheets, files of other tools, tables of deviations, strings with units.

Input: a path or a model string. Output: one model document (``allanite/fit/1``) for each axis, with the assumptions
that were made. To add a source: write a module that returns documents from `model_document`, and call it in
`documents_of`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from allanite.common.documents import invalid_as_input_error, json_of, text_of
from allanite.common.errors import InputError, about
from allanite.common.files import is_file
from allanite.common.plain import plain
from allanite.effects import Effect, Model, model_to_dict
from allanite.effects.strings import parse_with_units

__all__ = ["Source", "documents_of", "is_source_file"]


class Documented(Protocol):
    """Protocol of results with `to_dict`: a fit, a study, a characterization."""

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with all content of a fit, a study or a characterization; its entry ``schema`` names the format."""
        ...


#: Model string, path, JSON record, model, effect or result, from which `documents_of` makes model documents.
Source: TypeAlias = str | Path | Mapping[str, Any] | Model | Effect | Documented


def is_source_file(text: str) -> bool:
    """True if `text` names an existing file, or ends with ``.json``, ``.toml``, ``.yaml`` or ``.yml``; else False."""
    if text.lower().endswith((".json", ".toml", ".yaml", ".yml")):
        return True
    return is_file(text)


def documents_of(
    source: Source,
    unit: str | None = None,
    rate: float | None = None,
    record_length: float | None = None,
) -> list[dict[str, Any]]:
    """List of model documents (dicts), ``allanite/fit/1`` or ``allanite/model/1``, of a source, one for each axis.

    `source` is a model; a result, or its JSON record; a model string, whose values may have units; or a file. Files are
    a model file of allanite (JSON), a data sheet (TOML, JSON), a YAML file of Kalibr or imu_utils, a MATLAB script with
    gyroparams, a loadparams JSON file, and a table of Allan deviations. `unit` is that of the samples, for sources that
    do not state it. `rate`, Hz, and `record_length`, s, are those of the record behind another tool's result. A
    document has ``"assumptions"`` if any were made. Raises `InputError` for a file that does not exist or is of an
    unknown kind, and for a missing value.
    """
    if isinstance(source, Effect):
        source = Model((source,))
    if isinstance(source, Model):
        return [model_to_dict(source)]
    if not isinstance(source, (str, Path)):
        tree = source if isinstance(source, Mapping) else source.to_dict()
        with about("model"):
            return _documents_of_record(tree)
    text = str(source)
    if not is_source_file(text):
        model, own = parse_with_units(text)
        document = model_to_dict(model)
        if own is not None:
            document["recording"] = {"unit": own}
        return [document]
    path = Path(text)
    with (
        about(path),
        invalid_as_input_error("not a model file, a data sheet or a file of another tool"),
    ):
        return _documents_of_file(path, unit, rate, record_length)


def _documents_of_file(
    path: Path, unit: str | None, rate: float | None, record_length: float | None
) -> list[dict[str, Any]]:
    """List of model documents (dicts) in a file; unknown suffixes are read as JSON."""
    suffix = path.suffix.lower()
    if suffix == ".toml":
        from allanite.sources.datasheet import documents_of_sheet, read_datasheet

        return documents_of_sheet(read_datasheet(path), str(path))
    if suffix in (".yaml", ".yml"):
        from allanite.sources.yaml_files import documents_of_yaml

        return documents_of_yaml(path, rate)
    if suffix == ".m":
        from allanite.sources.matlab_parameters import documents_of_script

        return documents_of_script(text_of(path, errors="replace"), str(path))
    if suffix in (".csv", ".txt", ".dat", ".tsv"):
        from allanite.sources.deviation_table import documents_of_table

        return documents_of_table(path, unit, rate, record_length)
    return _documents_of_json_file(path)


def _documents_of_json_file(path: Path) -> list[dict[str, Any]]:
    """List of model documents (dicts) in a JSON file: model file of allanite, data sheet, or loadparams file of MATLAB.

    Raises `InputError` for any other format.
    """
    from allanite.sources.datasheet import TABLES, datasheet_of, documents_of_sheet
    from allanite.sources.matlab_parameters import documents_of_parts, sensor_parts

    tree = json_of(path)
    if isinstance(tree, dict) and not str(tree.get("schema")).startswith("allanite/"):
        if any(isinstance(tree.get(table), dict) for table in TABLES):
            return documents_of_sheet(datasheet_of(tree, path.stem), str(path))
        if parts := sensor_parts(tree):
            return documents_of_parts(parts, str(path))
    return _documents_of_record(tree)


def _documents_of_record(tree: object) -> list[dict[str, Any]]:
    """List of model documents (dicts), one per column, in a parsed JSON record that allanite wrote.

    Raises `InputError` for any other record.
    """
    if not isinstance(tree, Mapping) or not str(tree.get("schema")).startswith("allanite/"):
        raise InputError("not a model file of allanite: it has no allanite schema")
    documents = tree.get("columns", [tree])
    if not (
        isinstance(documents, list)
        and documents
        and all(isinstance(one, Mapping) for one in documents)
    ):
        raise InputError(
            "'columns' must be a list of models, as allanite fit, improve and characterize write it"
        )
    with invalid_as_input_error("not a model as allanite writes it"):
        for one in documents:
            _check_recording(one)
        return [_with_extras(document_of_last_step(one), tree) for one in documents]


def _with_extras(document: Mapping[str, Any], tree: Mapping[str, Any]) -> dict[str, Any]:
    """Copy of the model document of one column, with the extras that the characterization `tree` has for the column.

    The extras are ``working`` (noise at work), ``turn_on`` (bias at switch-on) and ``samples`` (their statistics).
    """
    column = str((document.get("recording") or {}).get("column"))
    found = {}
    for name in ("working", "turn_on", "samples"):
        every = tree.get(name)
        own = every.get(column) if isinstance(every, dict) else None
        if isinstance(own, dict):
            found[name] = own
    return {**document, **found}


def _check_recording(document: Mapping[str, Any]) -> None:
    """Raise `InputError` if a document states a unit that is no text, or a rate that is no positive number.

    Either may be missing.
    """
    recording = document.get("recording") or {}
    unit, rate = recording.get("unit"), recording.get("rate_hz")
    if unit is not None and not isinstance(unit, str):
        raise InputError(f"the unit {plain(unit, 60)} of the recording is not a text")
    if rate is not None and not 0.0 < float(rate) < math.inf:
        raise InputError(
            f"the rate {plain(rate, 60)} of the recording is not a positive number of Hz"
        )


def document_of_last_step(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Document of the last model of a stepwise model building, with the recording of the whole document.

    Documents without steps are returned unchanged.
    """
    ladder = document.get("ladder")
    if not ladder:
        return document
    return {**ladder[-1], "recording": document.get("recording"), "schema": "allanite/fit/1"}
