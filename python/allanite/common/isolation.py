"""Call a function in a child process with limits on memory, processor time and wall time.

If a library crashes, never ends or fills the memory, only the child ends, and the parent raises an `InputError`.
Arguments and results are plain values and arrays (`transfer`). Nothing is pickled.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from allanite.common.child_process import child_environment, python_command
from allanite.common.errors import AllaniteError, InputError, InternalError, TooShortError
from allanite.common.memory import budget, bytes_text, out_of_memory_error
from allanite.common.plain import plain

#: Time between two checks of a child, s.
POLL_S = 0.02
#: Time after the deadline of a child until its parent kills the child, s. A child may be unable to end itself.
GRACE = 5.0
#: Address space in addition to the memory budget, bytes: stacks and arenas of threads, and buffers of libraries. With
#: 200 MB, every reader can read a log of 1 MB (measured with h5py, pyarrow, rosbags, pyulog); less is not enough.
OVERHEAD = 200e6
#: Environment of a child. Libraries start one thread per processor, and each thread reserves address space. Therefore a
#: child uses one thread.
ONE_THREAD = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "ARROW_IO_THREADS": "1",
    "ARROW_DEFAULT_MEMORY_POOL": "system",  # other pools reserve a gigabyte of address space at once
    "MALLOC_ARENA_MAX": "2",
}
#: Program of a child. The package is imported from the parent's folder. Other folders of the parent come last, so that a
#: file in them never replaces a module of the standard library.
START = """
import sys, __future__, importlib, typing
root, *paths = sys.argv[1:]
sys.path.insert(0, root)
import allanite
sys.path.remove(root)
sys.path += [path for path in (root, *paths) if path not in sys.path]
from allanite.common.isolation import main
main()
"""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a child process.

    Processor time `cpu`, s, does not depend on how busy the machine is. Wall time `wall`, s, ends a child that waits
    forever. `memory`, bytes, is in addition to the interpreter and the libraries; None means the budget.
    """

    cpu: float = math.inf
    wall: float = math.inf
    memory: float | None = None


#: Whether this process is such a child. A call inside of a child starts no further process.
_is_child = False


def call_isolated(
    function: str,
    arguments: dict[str, Any],
    limits: Limits,
    *,
    worker: str,
    libraries: Sequence[str] = (),
    watch: Callable[[], None] | None = None,
) -> Any:
    """Result of ``function(**arguments)`` of the function ``"package.module:function"``, called in a child process.

    Inside of such a child, and on systems without processes, the function is called directly. In a child, this call
    sets a new limit on the processor time only. `libraries` are imported before the memory is limited, so that their
    own size does not count. `worker` names what runs in messages. `watch` is called every 20 ms; its exception ends the
    child. Raises `InputError` if the child crashed, reached a limit, or cannot be started, and errors of the function:
    `InputError`, `TooShortError` or `ModuleNotFoundError` as they are, any other as `InternalError`.
    """
    if _is_child or not sys.executable or sys.platform == "emscripten":
        with _cpu_limit(limits.cpu):
            return _function_named(function)(**arguments)
    memory = budget() if limits.memory is None else limits.memory
    order = {
        "function": function,
        "arguments": arguments,
        "libraries": list(libraries),
        # None means no limit, because JSON has no infinity.
        "cpu": limits.cpu if math.isfinite(limits.cpu) else None,
        "wall": limits.wall if math.isfinite(limits.wall) else None,
        "memory": memory if math.isfinite(memory) else None,
    }
    # The file has no name, so that it disappears however this process ends.
    with tempfile.TemporaryFile(prefix="allanite-") as results:
        code = run_child(order, results, watch)
        try:
            from allanite.common.transfer import read_value

            found = read_value(results)
        except (ValueError, TypeError, OSError):
            raise _error_without_result(code, worker, limits, memory) from None
    if "result" in found:
        return found["result"]
    raise _error_of_child(found["error"], worker)


def run_child(order: dict[str, Any], results: IO[bytes], watch: Callable[[], None] | None) -> int:
    """Exit code of a new process that calls the function named in `order` and writes the result to `results`.

    The process is killed if it exceeds its wall time by 5 s; then the code is −SIGALRM (1 on Windows). An exception of
    `watch`, called every 20 ms, kills the process and passes. Raises `InputError` if no process can be started.
    """
    end = math.inf if order["wall"] is None else time.monotonic() + order["wall"] + GRACE
    root = str(Path(__file__).resolve().parents[2])
    here = str(Path.cwd())
    paths = [path for path in sys.path if Path(path).is_absolute() and path not in (here, root)]
    try:
        process = subprocess.Popen(
            python_command("-c", START, root, *paths),
            # The system closes this pipe when this process ends for any reason. Then the child ends, too.
            stdin=subprocess.PIPE,
            stdout=results,
            stderr=subprocess.DEVNULL,
            env={**child_environment(), **ONE_THREAD},
        )
    except OSError as error:
        raise InputError(f"no process can be started to read the file ({error.strerror})") from None
    assert process.stdin is not None
    try:
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps(order).encode("ascii") + b"\n")
            process.stdin.flush()
        while True:
            try:
                return process.wait(POLL_S)
            except subprocess.TimeoutExpired:
                if watch is not None:
                    watch()
                if time.monotonic() > end:
                    return -signal.SIGALRM if os.name == "posix" else 1
    finally:
        process.kill()
        with suppress(OSError):
            process.stdin.close()
        # A process that waits for a disk cannot be killed at once.
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)


def _error_without_result(code: int, worker: str, limits: Limits, memory: float) -> InputError:
    """`InputError` (not raised) that explains by the exit code why a child process wrote no result."""
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"code {code}"
    if name == "SIGXCPU":
        return InputError(
            f"damaged: {worker} does not finish reading this file (stopped after {limits.cpu:.3g} s of processor time)"
        )
    if name == "SIGALRM" or (os.name != "posix" and code == 1):
        return InputError(
            f"damaged: {worker} does not finish reading this file (stopped after {limits.wall:.3g} s)"
        )
    if name == "SIGKILL":
        return InputError(f"{worker} was killed (SIGKILL): the system has too little memory for it")
    if code < 0 or code > 255:
        return InputError(
            f"damaged, or larger than the memory ({bytes_text(memory)}): {worker} crashes on this file ({name})"
        )
    return InputError(
        f"no process could be started for {worker} ({name}): too little memory is free"
    )


def _error_of_child(described: dict[str, Any], worker: str) -> Exception:
    """Exception (not raised) with the message of the error that the function raised in the child."""
    kind = described["kind"]
    if kind == "memory":
        return out_of_memory_error(worker)
    if kind == "missing module":
        return ModuleNotFoundError(described["found"], name=described["name"])
    if kind == "unexpected":
        return InternalError(described["found"])
    error = (TooShortError if kind == "too short" else InputError)(
        described["found"], missing=described["missing"], remedy=described["remedy"]
    )
    error.where = described["where"]
    return error


# -- in the child ---------------------------------------------------------------------------------


def main() -> None:
    """Call the function that a line of JSON on standard input names, write its result, and end this process."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    with open(0, "rb", buffering=0, closefd=False) as orders:
        line = orders.readline()
    if not line.endswith(b"\n"):
        os._exit(1)  # the parent has ended
    order = json.loads(line)
    results = os.fdopen(os.dup(1), "wb")
    # Output of libraries must not get into the result.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    _end_with_parent()
    serve_order(order, results)
    # The usual end of the interpreter would wait for the thread that reads standard input.
    os._exit(0)


def serve_order(order: dict[str, Any], results: IO[bytes]) -> None:
    """Call the function that `order` names, within its limits, and write its result or its error to `results`.

    Exceptions of the function are not raised. A result that cannot be written is replaced by an error.
    """
    global _is_child
    _is_child = True
    found: dict[str, Any]
    described: dict[str, Any]
    try:
        for library in order["libraries"]:
            import_module(library)
        function = _function_named(order["function"])
        _set_limits(order)
        found = {"result": function(**order["arguments"])}
    except AllaniteError as error:
        kind = "too short" if isinstance(error, TooShortError) else "input"
        described = {name: getattr(error, name) for name in ("found", "missing", "remedy", "where")}
        found = {"error": {"kind": kind, **described}}
    except MemoryError:
        found = {"error": {"kind": "memory"}}
    except ModuleNotFoundError as error:
        found = {"error": {"kind": "missing module", "found": str(error), "name": error.name}}
    except Exception as error:
        found = {"error": {"kind": "unexpected", "found": _error_text(error)}}
    from allanite.common.transfer import write_value

    try:
        write_value(found, results)
    except Exception as error:
        described = {"kind": "unexpected", "found": _error_text(error)}
        if isinstance(error, (OSError, MemoryError)):
            full = f"the samples do not fit into the folder of temporary files ({error})"
            described = {"kind": "input", "found": full, "missing": None, "where": None}
            described["remedy"] = "; set TMPDIR to a larger folder"
        results.seek(0)
        results.truncate()
        write_value({"error": described}, results)


def _function_named(name: str) -> Callable[..., Any]:
    """Function with the name ``"package.module:function"``; its module is imported."""
    module, _, attribute = name.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), attribute)
    return function


def _error_text(error: Exception) -> str:
    """Text ``"KeyError: 'x' (file.py:12)"``: type, message (at most 200 characters), and the line that raised the error."""
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    place = "" if frame is None else f"{frame.tb_frame.f_code.co_filename}:{frame.tb_lineno}"
    return f"{type(error).__name__}: {plain(error, 200)} ({place})"


def _end_with_parent() -> None:
    """Start a thread that ends this process when standard input is closed, because the parent has ended."""
    import _thread

    def wait() -> None:
        """Wait until standard input is closed, then end this process with exit code 1."""
        # os.read instead of sys.stdin: the interpreter aborts if a thread holds the buffer of sys.stdin at its end.
        while os.read(0, 1 << 16):
            pass
        os._exit(1)

    # If there is no memory for a thread, only the limits end a child without a parent.
    with suppress(RuntimeError):
        _thread.start_new_thread(wait, ())


def _set_limits(order: dict[str, Any]) -> None:
    """Set the limits of this process that `order` states: wall time, processor time, and memory beyond the present one.

    A limit of None is not set. No limit is set on Windows, which does not support them.
    """
    if order["wall"] is not None and hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, order["wall"])
    if order["cpu"] is not None:
        _lower_limit("RLIMIT_CPU", math.ceil(time.process_time() + order["cpu"]))
    if order["memory"] is not None:
        # The result file cannot be larger than the memory that held the result.
        _lower_limit("RLIMIT_FSIZE", int(order["memory"] + OVERHEAD))
    limit_memory(order["memory"])


def limit_memory(most: float | None) -> None:
    """Limit the memory beyond the present one to `most` bytes (on Linux only), and turn off core files.

    None sets no limit.
    """
    _lower_limit("RLIMIT_CORE", 0)
    if most is not None:
        with suppress(OSError, ValueError, IndexError):
            pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
            taken = pages * os.sysconf("SC_PAGE_SIZE")
            _lower_limit("RLIMIT_AS", int(taken + most + OVERHEAD))


def _lower_limit(name: str, most: int) -> None:
    """Set the soft limit of a resource, such as ``RLIMIT_CPU``, to `most`, unless a limit is already lower.

    Nothing happens on Windows (only the deadline of the parent applies there), or if the system does not know it.
    """
    with suppress(ModuleNotFoundError, OSError, ValueError):  # macOS does not know all of them
        import resource

        which = getattr(resource, name)
        soft, hard = resource.getrlimit(which)
        known = (limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY)
        resource.setrlimit(which, (min([most, *known]), hard))


@contextmanager
def _cpu_limit(seconds: float) -> Iterator[None]:
    """Context in which this child process is ended by a signal after `seconds` more of processor time.

    Does nothing in a process that is no such child, on Windows, and for infinite `seconds`. Afterwards the previous
    limit applies.
    """
    if not _is_child or not math.isfinite(seconds):
        yield
        return
    try:
        import resource
    except ModuleNotFoundError:
        yield
        return
    before = resource.getrlimit(resource.RLIMIT_CPU)
    _lower_limit("RLIMIT_CPU", math.ceil(time.process_time() + seconds))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, before)
