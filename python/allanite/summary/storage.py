"""File format of a summary: NumPy arrays and a JSON header."""

from __future__ import annotations

import json
import zipfile
import zlib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import invalid_as_input_error
from allanite.common.errors import InputError, about
from allanite.common.files import whole_file
from allanite.common.memory import require_memory
from allanite.common.validation import positive_rate
from allanite.recording.findings import Finding
from allanite.summary.stream_segment import StreamSegment

if TYPE_CHECKING:
    from allanite.summary.summary import Summary

#: Schema of the header.
SCHEMA = "allanite/summary/1"


def save(summary: Summary, path: str | Path) -> None:
    """Write a summary to a file in NumPy's NPZ format, whatever the suffix.

    An existing file is replaced only after the new file is complete.
    """
    with whole_file(path) as draft:
        arrays: list[np.ndarray[Any, Any]] = []
        header = {
            "schema": SCHEMA,
            "rate": summary.rate,
            "units": summary.units,
            "columns": summary.columns,
            "covariates_named": summary.covariates_named,
            "covariate_units": summary.covariate_units,
            "path": summary.path,
            "told": [asdict(finding) for finding in summary.told],
            "stretches": [_without_arrays(one.state(), arrays) for one in summary.stretches],
        }
        text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
        with draft.open("wb") as file:
            named: dict[str, Any] = {f"a{i}": array for i, array in enumerate(arrays)}
            np.savez(file, header=text, **named)


def load(cls: type[Summary], path: str | Path) -> Summary:
    """`Summary` from a file that `save` wrote. Raises `InputError` for a missing or damaged file.

    Also for a file of another schema, or one too large for the memory.
    """
    source = Path(path)
    with about(source), invalid_as_input_error("damaged, or not a summary"):
        try:
            if source.exists() and not source.is_file():
                raise InputError("a folder, a pipe or a device, not a summary")
            with zipfile.ZipFile(source) as archive:
                # Unpacking can enlarge a file by a factor of 1000.
                require_memory(sum(i.file_size for i in archive.infolist()), "the summary")
            with np.load(source, allow_pickle=False) as file:
                header = json.loads(bytes(file["header"]).decode())
                if header["schema"] != SCHEMA:
                    raise InputError(f"{header['schema']} is not {SCHEMA}")
                stretches = tuple(
                    StreamSegment.restored(_with_arrays(one, file)) for one in header["stretches"]
                )
        except FileNotFoundError:
            raise InputError("no such file") from None
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror or error})") from None
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError) as error:
            raise ValueError(error) from None
        return cls(
            positive_rate(header["rate"]),
            tuple(header["units"]),
            tuple(header["columns"]),
            tuple(header["covariates_named"]),
            header["covariate_units"],
            header["path"],
            stretches,
            tuple(Finding(**finding) for finding in header["told"]),
        )


def _without_arrays(value: Any, arrays: list[np.ndarray[Any, Any]]) -> Any:
    """Copy of a nested `value` in which ``{"array": i}`` replaces each array. Side effect: appends the arrays to `arrays`.

    i is the index of the array in `arrays`.
    """
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, dict):
        return {key: _without_arrays(inside, arrays) for key, inside in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [_without_arrays(inside, arrays) for inside in value]
    return value


def _with_arrays(value: Any, arrays: Any) -> Any:
    """Copy of a nested `value` in which the array ``ai`` of the file replaces each ``{"array": i}``.

    It is the inverse of `_without_arrays`.
    """
    if isinstance(value, dict):
        if set(value) == {"array"}:
            return arrays[f"a{value['array']}"]
        return {key: _with_arrays(inside, arrays) for key, inside in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [_with_arrays(inside, arrays) for inside in value]
    return value
