"""Read NPZ with the keys data, rate_hz, channels, unit and optionally t, as `simulate` writes it."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import AllaniteError, InputError
from allanite.common.memory import require_memory
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table, check_shape, columns_of
from allanite.recording.samples import default_names

#: Keys of the archive that are read; other keys are ignored.
KEYS = ("data", "rate_hz", "channels", "unit", "t")


def read(path: Path, pick: Picker) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of the array ``data`` in an NPZ file, shape (n,) or (n, channels), with rate, names, units and time.

    Their keys are ``rate_hz``, ``channels``, ``unit`` and ``t``. Pickled objects are never loaded. Without
    ``channels``, the names are ``x`` or ``x0``, ``x1`` …. Raises `InputError` without ``data``, and for a wrong shape
    or type.
    """
    found = _load_arrays(path)
    if "data" not in found:
        raise InputError(f"no key 'data' among {', '.join(found) or 'no keys at all'}")
    data = found["data"]
    if data.ndim == 1:
        data = data[:, np.newaxis]
    if data.ndim != 2 or data.dtype.kind not in "iufb":
        raise InputError(
            f"'data' must be numbers of shape (n,) or (n, channels), found {data.dtype} of"
            f" shape {data.shape}"
        )
    check_shape(data.shape)
    n, k = data.shape
    names = _texts_of_key(found, "channels", k)
    units = _texts_of_key(found, "unit", k)
    time = found.get("t")
    if time is not None and time.shape != (n,):
        raise InputError(f"'t' has shape {time.shape}, 'data' has {n} rows")
    if time is not None and time.dtype.kind not in "iufM":
        raise InputError(f"'t' must be numbers or moments of time, found {time.dtype}")
    rate = found.get("rate_hz")
    if rate is not None and (rate.size != 1 or rate.dtype.kind not in "iuf"):
        raise InputError(f"'rate_hz' must be one number, found shape {rate.shape}")
    return Table(
        names=names or default_names(k),
        columns=columns_of(data),
        units=units or (None,) * k,
        rate=None if rate is None else float(rate.reshape(())),
        time=time,
        named=names is not None,
    )


def _load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of an NPZ file by key; keys other than `KEYS` get empty arrays and are not loaded.

    Raises `InputError` if the file is damaged, holds pickled objects in a needed key, or exceeds the memory budget.
    """
    key = ""
    try:
        # Opened here, because numpy leaves a damaged file open.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            found = {}
            wanted = [i for i in archive.zip.infolist() if i.filename.removesuffix(".npy") in KEYS]
            # Unpacking can enlarge a file by a factor of 1000.
            require_memory(sum(i.file_size for i in wanted), "the unpacked file")
            for key in archive.files:
                # Only the needed keys are loaded, so that a foreign key costs no memory.
                if key in KEYS:
                    found[key] = archive[key]
                else:
                    found.setdefault(key, np.empty(0))
            return found
    except (AllaniteError, MemoryError, OSError):
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError) as error:
        raise InputError(f"damaged or truncated NPZ file ({error})") from None
    except Exception as error:  # damaged heads make the library raise all kinds of errors
        where = f"key {key!r} of the NPZ file is" if key else "NPZ file"
        raise InputError(
            f"{where} damaged or truncated, or holds pickled objects, which are never loaded ({error}):"
            " save plain arrays"
        ) from None


def _texts_of_key(found: dict[str, NDArray[Any]], key: str, k: int) -> tuple[str, ...] | None:
    """Texts of a key, one for each of `k` channels; a single text is repeated. None without the key.

    Raises `InputError` for another number of entries, and for entries that are no text.
    """
    if key not in found:
        return None
    if found[key].dtype.kind not in "US":
        raise InputError(f"{key!r} must be text, found {found[key].dtype}")
    texts = tuple(
        text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
        for text in np.atleast_1d(found[key]).ravel()[: k + 1]
    )
    if len(texts) == 1:
        texts *= k
    if len(texts) != k:
        raise InputError(f"{found[key].size} entries in {key!r} for {k} channels")
    return texts


FORMAT = LogFormat(
    "NumPy archive",
    read,
    suffixes=(".npz",),
    magic=((b"PK\x03\x04", ".npz"),),
    reads="the arrays of one length",
)
