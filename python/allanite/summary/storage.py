"""File format of a summary: NumPy arrays and a JSON header."""

from __future__ import annotations

import json
import zipfile
import zlib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.documents import invalid_as_input_error
from allanite.common.errors import InputError, about
from allanite.common.files import whole_file
from allanite.common.memory import require_memory
from allanite.common.transfer import with_arrays, without_arrays
from allanite.common.validation import positive_rate
from allanite.recording.findings import Finding
from allanite.summary.stream_segment import StreamSegment

if TYPE_CHECKING:
    from allanite.summary.summary import Summary

#: Schema of the header.
SCHEMA = "allanite/summary/1"


def save(summary: Summary, path: str | Path) -> None:
    """Write a summary in NumPy's NPZ format, whatever the suffix; an existing file stays until the new one is complete."""
    with whole_file(path) as draft:
        arrays: dict[str, Any] = {}

        def put(array: NDArray[Any]) -> int:
            """Add an array to `arrays` under its index; returns the index."""
            arrays[f"a{len(arrays)}"] = array
            return len(arrays) - 1

        header = {
            "schema": SCHEMA,
            "rate": summary.rate,
            "units": summary.units,
            "columns": summary.columns,
            "covariates_named": summary.covariates_named,
            "covariate_units": summary.covariate_units,
            "path": summary.path,
            "told": [asdict(finding) for finding in summary.added_findings],
            "stretches": [without_arrays(one.state(), put) for one in summary.stretches],
        }
        text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
        with draft.open("wb") as file:
            np.savez(file, header=text, **arrays)


def load(cls: type[Summary], path: str | Path) -> Summary:
    """`Summary` from a file that `save` wrote; `InputError` for a missing, damaged, too large or other file."""
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
                    StreamSegment.restored(with_arrays(one, lambda at: file[f"a{at}"]))
                    for one in header["stretches"]
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
