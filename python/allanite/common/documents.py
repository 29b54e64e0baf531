"""Documents: texts that users or other programs wrote, such as models and saved states, and values for JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import AllaniteError, InputError
from allanite.common.memory import bytes_text
from allanite.common.plain import plain

#: Largest document that is read, bytes. Model files of many columns have some megabytes. Chosen by judgment; not measured.
MAX_DOCUMENT_BYTES = 200_000_000


def text_of(path: str | Path, most: int = MAX_DOCUMENT_BYTES, *, errors: str = "strict") -> str:
    """Content of a UTF-8 file of at most `most` bytes; `errors` as in `bytes.decode`.

    Raises `InputError` for a larger file, another encoding, no file, a folder, a pipe or a device.
    """
    file = Path(path)
    try:
        size = file.stat().st_size
        # A pipe would be waited for, and a device may have no end.
        if not file.is_file():
            raise InputError("a folder, a pipe or a device, not a file")
        if size > most:
            raise InputError(f"{bytes_text(size)} are too many for such a file")
        return file.read_text(encoding="utf-8", errors=errors)
    except FileNotFoundError:
        raise InputError("no such file") from None
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError:
        raise InputError("not a text in UTF-8") from None


def json_of(path: str | Path, what: str = "a JSON file") -> Any:
    """Value of a JSON file; raises `InputError` as `text_of`, or that it is not `what`."""
    text = text_of(path)
    with invalid_as_input_error(f"not {what}"):
        return json.loads(text)


@contextmanager
def invalid_as_input_error(otherwise: str) -> Iterator[None]:
    """Context that replaces errors of reading a wrong document (`KeyError`, `TypeError`, …) by an `InputError`.

    Its message begins with `otherwise`. Errors of allanite pass unchanged.
    """
    try:
        yield
    except AllaniteError:
        raise
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        RecursionError,
        TypeError,
        ValueError,
    ) as error:
        raise InputError(f"{otherwise} ({type(error).__name__}: {plain(error, 120)})") from None


def fields_dict(record: Any, **keys: str) -> dict[str, Any]:
    """Dict for JSON of the fields of a dataclass, as `plain_value` converts them: arrays and tuples become lists.

    `keys` rename fields in the dict; an empty key leaves the field out.
    """
    named = {keys.get(f.name, f.name): f.name for f in fields(record)}
    return {key: plain_value(getattr(record, name)) for key, name in named.items() if key}


def rows_of(**columns: NDArray[Any]) -> list[dict[str, Any]]:
    """List of dicts for JSON, one per element of the arrays `columns` of one shape: name of the array → element."""
    rows = zip(*(column.ravel().tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def finite_or_none(array: NDArray[np.float64]) -> NDArray[np.object_]:
    """Array of objects for JSON, shape of `array`: its values as floats, and None for NaN and infinities."""
    out = array.astype(object)
    out[~np.isfinite(array)] = None
    return out


def plain_value(value: Any) -> Any:
    """Value for JSON: a result as its `to_dict`, an array or tuple as a list, a mapping as a dict; others unchanged."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: plain_value(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain_value(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def jsonable(value: Any, figures: int | None = None) -> Any:
    """Copy of a value for JSON, in which floats get `figures` significant digits; NaN and infinities become None."""
    if isinstance(value, dict):
        return {str(key): jsonable(item, figures) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [jsonable(item, figures) for item in value]
    if hasattr(value, "tolist"):
        return jsonable(value.tolist(), figures)
    if isinstance(value, float):
        if not math.isfinite(value):
            return None
        return float(value if figures is None else f"{value:.{figures}g}")
    return value
