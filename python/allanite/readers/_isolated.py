"""Run readers that use foreign libraries in a child process, because a library may crash, hang or fill the memory."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any

from allanite.common.errors import AllaniteError, InputError, InternalError
from allanite.common.isolation import Limits, call_isolated
from allanite.common.memory import out_of_memory_error
from allanite.common.plain import plain
from allanite.readers._table import Picker, Table

Reader = Callable[..., Table]
#: Attributes of a `Table` that a reader in a child process sets.
TRANSFERRED = ("names", "columns", "units", "rate", "time", "named", "notes", "others")
#: Allowed processor time for a log of any size, s. A damaged log of a few kilobytes may need that long.
CPU_SECONDS = 5.0
#: Allowed processor time divided by the measured processor time. An old single-board computer is about five times slower
#: than the 2 GHz server core on which the readers were measured.
CPU_TIME_FACTOR = 8.0
#: Allowed wall time divided by the allowed processor time, for a busy machine or a slow disk.
WALL_TIME_FACTOR = 12.0


def isolated(
    worker: str, seconds_per_megabyte: float, libraries: Sequence[str]
) -> Callable[[Reader], Reader]:
    """Decorator that runs a reader in a child process with limits of processor time, wall time and memory.

    The child reads all columns, whatever the caller picks. `worker` names the library in messages, and `libraries` are
    the modules that the reader imports. `seconds_per_megabyte` is the measured processor time for the slowest kind of
    log.
    """

    def decorator(read: Reader) -> Reader:
        """The reader `read` in a child process; `read` stays its ``__wrapped__``."""
        name = f"{read.__module__}:{read.__name__}"

        @wraps(read)
        def in_child(path: Path, _pick: Picker, topics: Sequence[str] = ()) -> Table:
            """`Table` that `read` returns in a child process; raises `InputError` also if a limit is exceeded."""
            found = call_isolated(
                f"{__name__}:serve_reader",
                {"reader": name, "path": str(path), "topics": list(topics)},
                limits_of(path, seconds_per_megabyte),
                worker=worker,
                libraries=libraries,
            )
            fields: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in found.items()}
            return Table(**fields)

        return in_child

    return decorator


def limits_of(path: Path, seconds_per_megabyte: float) -> Limits:
    """`Limits` (processor and wall time, s) of the child process that reads a log; both grow with the log's size."""
    seconds = CPU_SECONDS + CPU_TIME_FACTOR * seconds_per_megabyte * _size_in_bytes(path) / 1e6
    return Limits(cpu=seconds, wall=WALL_TIME_FACTOR * seconds)


def serve_reader(reader: str, path: str, topics: list[str]) -> dict[str, Any]:
    """Fields of the `Table` that the reader ``"module:function"`` returns; called in the child process."""
    module, _, attribute = reader.partition(":")
    read = getattr(import_module(module), attribute).__wrapped__
    with errors_in_one_line():
        table = read(
            Path(path), lambda first: range(len(first.names)), *([topics] if topics else [])
        )
    return {name: getattr(table, name) for name in TRANSFERRED}


def _size_in_bytes(path: Path) -> int:
    """Size of a log in bytes; for a folder, the sum of the files directly in it."""
    if path.is_dir():
        return sum(file.stat().st_size for file in path.iterdir() if file.is_file())
    return path.stat().st_size


@contextmanager
def refused_as(what: str) -> Iterator[None]:
    """Context that turns an error of a foreign library into an `InputError`: "damaged or not `what` (…)"."""
    try:
        yield
    except (AllaniteError, ModuleNotFoundError, MemoryError):
        raise
    except Exception as error:  # damaged files make libraries raise all kinds of errors
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:
            raise MemoryError from None
        raise InputError(f"damaged or not {what} ({plain(error, 200)})") from None


@contextmanager
def errors_in_one_line() -> Iterator[None]:
    """Context that turns every exception into an `InputError` with one line, also a lack of memory.

    Errors of this package, `InternalError` and `ModuleNotFoundError` pass unchanged.
    """
    try:
        yield
    except (AllaniteError, ModuleNotFoundError, InternalError):
        raise
    except MemoryError:
        raise out_of_memory_error("reading the log") from None
    except OSError as error:
        if error.errno == errno.ENOMEM:
            raise out_of_memory_error("reading the log") from None
        raise InputError(f"cannot be read ({error.strerror or error})") from None
    except Exception as error:  # damaged files make libraries raise all kinds of errors
        what = f"{type(error).__name__}: {plain(error, 100)}"
        raise InputError(f"damaged, or not of the format of its suffix ({what})") from None
