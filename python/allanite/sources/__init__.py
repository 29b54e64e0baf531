"""Models that do not come from a log: data sheets, files of other tools, tables of deviations, strings with units.

Input: a path or a model string. Output: model documents (``allanite/fit/1``), one for each axis, with the assumptions
made. Add a source as a module that returns documents of `model_document`, and a line in `documents_of`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from allanite.common.errors import InputError
from allanite.common.files import is_file
from allanite.effects.files import model_to_dict
from allanite.effects.strings import parse_with_units

__all__ = ["documents_of", "is_source_file"]

#: Largest file, bytes: model files of many columns have some megabytes.
LARGEST = 200_000_000


def is_source_file(text: str) -> bool:
    """Whether a text names a file, not a model string."""
    if text.lower().endswith((".json", ".toml", ".yaml", ".yml")):
        return True
    return is_file(text)


def documents_of(
    source: str | Path,
    unit: str | None = None,
    rate: float | None = None,
    record_length: float | None = None,
) -> list[dict[str, Any]]:
    """Model documents of a source, one an axis.

    Parameters
    ----------
    source : str or Path
        A model file of allanite (JSON); a data sheet (TOML, JSON); a YAML file of Kalibr or imu_utils; a MATLAB script
        with gyroparams, or a loadparams JSON file; a table of Allan deviations; or a model string, whose values may have
        units.
    unit : str, optional
        Unit of the samples, for sources that do not state it.
    rate, record_length : float, optional
        Sampling rate in Hz and length in s of the record behind another tool's result.

    Returns
    -------
    list of dict
        ``allanite/fit/1`` or ``allanite/model/1``, with ``"assumptions"`` where some were made.

    Raises
    ------
    InputError
        No such file, an unknown kind of file, or a value that is missing; one line with the remedy.
    """
    text = str(source)
    if not is_source_file(text):
        model, own = parse_with_units(text)
        document = model_to_dict(model)
        if own is not None:
            document["recording"] = {"unit": own}
        return [document]
    path = Path(text)
    try:
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        if path.stat().st_size > LARGEST:
            raise InputError(
                f"{path}: too large for a model, a data sheet or a table of deviations"
            )
        return _of_file(path, unit, rate, record_length)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _of_file(
    path: Path, unit: str | None, rate: float | None, record_length: float | None
) -> list[dict[str, Any]]:
    suffix = path.suffix.lower()
    if suffix == ".toml":
        from allanite.sources.datasheet import documents_of_sheet, read_datasheet

        return documents_of_sheet(read_datasheet(path), str(path))
    if suffix in (".yaml", ".yml"):
        from allanite.sources.yaml_files import documents_of_yaml

        return documents_of_yaml(path, rate)
    if suffix == ".m":
        from allanite.sources.matlab_parameters import documents_of_script

        return documents_of_script(path.read_text(encoding="utf-8", errors="replace"), str(path))
    if suffix in (".csv", ".txt", ".dat", ".tsv"):
        from allanite.sources.deviation_table import documents_of_table

        return documents_of_table(path, unit, rate, record_length)
    return _of_json(path)


def _of_json(path: Path) -> list[dict[str, Any]]:
    from allanite.sources.datasheet import TABLES, datasheet_of, documents_of_sheet
    from allanite.sources.matlab_parameters import documents_of_matlab_json, is_matlab_json

    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not a model file ({error})") from None
    if not isinstance(tree, dict):
        raise InputError(f"{path}: not a model file: no allanite schema in it")
    if str(tree.get("schema")).startswith("allanite/"):
        documents = tree.get("columns", [tree])
        if not isinstance(documents, list) or not all(isinstance(one, dict) for one in documents):
            raise InputError(
                f"{path}: its columns are not as fit, improve or characterize write them"
            )
        return [_with_extras(_last_step(one), tree) for one in documents]
    if any(isinstance(tree.get(table), dict) for table in TABLES):
        return documents_of_sheet(datasheet_of(tree, path.stem), str(path))
    if is_matlab_json(tree):
        return documents_of_matlab_json(tree, str(path))
    raise InputError(f"{path}: not a model file: no allanite schema in it")


def _with_extras(document: dict[str, Any], tree: dict[str, Any]) -> dict[str, Any]:
    """The document with what `characterize` says beside its model: noise at work, bias at switch-on, samples."""
    column = str((document.get("recording") or {}).get("column"))
    found = {}
    for name in ("working", "turn_on", "samples"):
        every = tree.get(name)
        own = every.get(column) if isinstance(every, dict) else None
        if isinstance(own, dict):
            found[name] = own
    return {**document, **found}


def _last_step(document: dict[str, Any]) -> dict[str, Any]:
    """The last model of a stepwise improvement; other documents as they are."""
    ladder = document.get("ladder")
    if not ladder:
        return document
    return {**ladder[-1], "recording": document.get("recording"), "schema": "allanite/fit/1"}
