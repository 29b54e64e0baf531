"""Child process that works on one log at a time: a log that crashes, hangs or fills its memory affects only its own row.

The parent writes pickles to the standard input of the child: a `Setup`, then the path of each log. The child answers with
one line of JSON for each log. The child ends when its input is closed, so that no child outlives its parent.
"""

from __future__ import annotations

import gc
import hashlib
import json
import os
import pickle
import queue
import signal
import stat
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from allanite.common.child_process import child_environment, python_command
from allanite.common.errors import InputError
from allanite.common.isolation import ONE_THREAD, limit_memory
from allanite.common.memory import VARIABLE
from allanite.common.plain import plain

if TYPE_CHECKING:
    from allanite.effects import Effect, Model

#: Time limit for the start of a process, s. A start takes 1 to 3 s on an idle machine.
START_SECONDS = 300.0
#: Time limit for the end of a process that has closed its output, s.
END_SECONDS = 10.0
#: Resolution of time stamps, s: a file changed more recently may change again without a later stamp (2 s on FAT).
TIME_STAMP_SECONDS = 2.0
#: Command of the child.
COMMAND = "from allanite.scale.log_process import serve; serve()"
#: Name of a signal → explanation of a process that ended with it.
SIGNALS = {
    "SIGBUS": "the log became shorter while it was read (SIGBUS)",
    "SIGKILL": "its process was killed from outside (SIGKILL), probably because the system ran out of memory",
}

#: Remedy for a log that takes too long.
MORE_TIME = "give it a longer deadline"

#: True in a child process that works on logs, False in its parent.
_is_child = False


@dataclass(frozen=True, slots=True)
class Setup:
    """Settings that all logs of a run share.

    `rate` and `unit` are those of `allanite.read`; `anyway` also uses logs in motion. `deadline`, s, and `memory`, bytes,
    limit each log. `settings` is everything that affects a result, as JSON. `done` are the `journal_key` of logs whose rows
    are known. `effects` are those that the caller registered, `paths` its import path. `main` are the arguments by which
    `multiprocessing.spawn` imports the caller's program, if it registered effects.
    """

    model: Model
    rate: float | str | None
    unit: str | None
    anyway: bool
    deadline: float
    memory: int
    settings: str
    done: frozenset[str] = frozenset()
    effects: tuple[type[Effect], ...] = ()
    paths: tuple[str, ...] = ()
    main: tuple[tuple[str, str], ...] = field(default=())


@dataclass(frozen=True, slots=True)
class Answer:
    """Rows of a log and its journal key (empty if the log failed); `rows` is None if the journal has them."""

    path: str
    key: str
    rows: list[dict[str, Any]] | None

    @classmethod
    def failed(cls, path: str, why: str) -> Answer:
        """`Answer` with one row that states why a log failed."""
        return cls(path, "", [failed_row(path, why)])


def failed_row(path: str, why: str) -> dict[str, Any]:
    """Dict: row of a log with the status ``failed``, the reason in ``remarks``, and no values."""
    return {
        "file": plain(path),
        "content": "",
        "column": "",
        "status": "failed",
        "remarks": plain(why, 300),
    }


def journal_key(settings: str, path: str, content: str) -> str:
    """SHA-256 in hexadecimal of everything that affects the rows of a log: settings, suffix of its name and content."""
    text = json.dumps([settings, Path(path).suffix.lower(), content])
    return hashlib.sha256(text.encode()).hexdigest()


def is_child() -> bool:
    """True if this process is a child that works on the logs of a parent process."""
    return _is_child


class LogProcess:
    """Handle of a child process that works on logs; the child starts when needed, and again after a log that ended it."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False
        self._lock = threading.Lock()

    def answer(self, path: str) -> Answer:
        """`Answer` with the rows of a log, or one failed row; rows are None if its key is in `Setup.done`.

        If a used child ends, a new child tries the log again, because earlier logs may have damaged the used child.
        `InputError` if the child refuses the setup.
        """
        try:
            before, read_at = _file_stamp(path), time.time()
            content = _content_digest(path)
        except (OSError, InputError) as error:
            return Answer.failed(path, getattr(error, "strerror", None) or str(error))
        key = journal_key(self._setup.settings, path, content)
        if key in self._setup.done:
            return Answer(path, key, None)
        used = self._process is not None
        rows = self._rows_or_none(path)
        if rows is None and used:
            rows = self._rows_or_none(path)
        if rows is None:
            return Answer.failed(path, self._why)
        if _has_changed(path, before, read_at, content):
            why = "changed while it was read: run again when it is complete"
            return Answer.failed(path, why)
        return Answer(path, key, [{**row, "content": content} for row in rows])

    def close(self) -> None:
        """Kill the child; no further child is started."""
        with self._lock:
            self._closed = True
        self._end()

    def _rows_or_none(self, path: str) -> list[dict[str, Any]] | None:
        """Rows of a log from the child; None, with the reason in `_why`, if it does not start or ends.

        If a log exceeds the deadline, the child is killed and the only row is a failed one.
        """
        if self._process is None and not self._start():
            return None
        self._send(path)
        message, late = self._read_line(self._setup.deadline)
        if message is not None and "rows" in message:
            rows: list[dict[str, Any]] = message["rows"]
            return rows
        if not late:
            self._why = self._ending() if message is None else message["why"]
        self._end()
        why = f"not done after {self._setup.deadline:g} s: {MORE_TIME}"
        return [failed_row(path, why)] if late else None

    def _start(self) -> bool:
        """Start a child; False, with the reason in `_why`, if it fails. `InputError` if it refuses the setup."""
        alone: dict[str, Any] = (
            # A new process group, so that Ctrl-C reaches only the parent.
            {"process_group": 0}
            if os.name == "posix"
            else {"creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)}
        )
        with self._lock:
            if self._closed:
                self._why = "the run ended"
                return False
            self._process = subprocess.Popen(
                python_command("-c", COMMAND),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**child_environment(), **ONE_THREAD},
                **alone,
            )
        self._send((self._setup.paths, self._setup.main))
        self._send(replace(self._setup, done=frozenset()))
        message, _ = self._read_line(START_SECONDS)
        if message is not None and "refused" in message:
            self._end()
            raise InputError(message["refused"])
        if message is None:
            self._why = f"a process for the logs did not start: {self._ending()}"
            self._end()
        return message is not None

    def _send(self, value: Any) -> None:
        """Send a value to the child; does nothing if the child has ended."""
        data = pickle.dumps(value)
        assert self._process is not None
        assert self._process.stdin is not None
        # If the child has ended, `_read_line` notices it.
        with suppress(OSError, ValueError):
            self._process.stdin.write(len(data).to_bytes(8, "little") + data)
            self._process.stdin.flush()

    def _read_line(self, seconds: float) -> tuple[dict[str, Any] | None, bool]:
        """Tuple (next message of the child as a dict, or None; True if `seconds` passed and the child was killed).

        The message is None if the child ended or wrote no JSON.
        """
        process = self._process
        assert process is not None
        assert process.stdout is not None
        late = threading.Event()

        def stop() -> None:
            """Kill the child process and set the event `late`; the timer calls this when the time is over."""
            late.set()
            process.kill()

        timer = threading.Timer(seconds, stop)
        timer.daemon = True
        timer.start()
        try:
            text = process.stdout.readline()
        except (OSError, ValueError):  # `close` closed the pipe
            text = b""
        finally:
            timer.cancel()
        try:
            return json.loads(text), False
        except ValueError:
            return None, late.is_set()

    def _ending(self) -> str:
        """Clause on how the child process ended, such as ``its process ended with code 1``; waits for this up to 10 s."""
        assert self._process is not None
        try:
            code = self._process.wait(END_SECONDS)
        except subprocess.TimeoutExpired:
            return "its process closed its output"
        if code >= 0:
            return f"its process ended with code {code}"
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = f"signal {-code}"
        return SIGNALS.get(name, f"its process crashed ({name}): the file may be damaged")

    def _end(self) -> None:
        """Kill the child, if any, and close its pipes."""
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    with suppress(OSError):
                        pipe.close()

    _why = ""


# -- the child ---------------------------------------------------------------------------------------


def serve() -> NoReturn:
    """Main loop of the child: work on logs until the input is closed, then end the process. Does not return.

    The process also ends, after a message to the parent, if the setup fails or a log needs too much memory.
    """
    from allanite import _kernels
    from allanite.scale.logs import rows_of

    global _is_child
    _is_child = True
    say = partial(_write_line, os.dup(1))
    # Output of libraries must not mix with the answers.
    os.dup2(2, 1)
    orders: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_queue_messages, args=(orders,), daemon=True).start()
    try:
        paths, main = pickle.loads(orders.get())
        setup = _receive_setup(paths, main, orders.get())
    except Exception as error:
        say({"refused": plain(error, 300)})
        os._exit(1)
    say({})
    while True:
        path = pickle.loads(orders.get())
        try:
            say({"rows": rows_of(path, setup.model, setup.rate, setup.unit, anyway=setup.anyway)})
        except MemoryError:
            most = f"{setup.memory / 1e9:.3g} GB"
            say({"why": f"needs more memory than the {most} of a log: set {VARIABLE} to more"})
            os._exit(0)
        # The memory of this log would count for the limit of the next one.
        gc.collect()
        _kernels.free_buffers()


def _write_line(answers: int, value: dict[str, Any]) -> None:
    """Write a dict as one line of JSON to the file descriptor `answers`."""
    line = memoryview(json.dumps(value).encode() + b"\n")
    while line:
        line = line[os.write(answers, line) :]


def _queue_messages(orders: queue.SimpleQueue[bytes]) -> None:
    """Put each message of the parent into the queue `orders`. When the input ends, end this process at once."""
    # Not sys.stdin: its lock, held by this thread, would abort the end of the process.
    with os.fdopen(os.dup(0), "rb") as stream:
        try:
            while True:
                size = int.from_bytes(stream.read(8), "little")
                data = stream.read(size)
                if not size or len(data) < size:
                    break
                orders.put(data)
        finally:
            os._exit(0)


def _receive_setup(
    paths: tuple[str, ...], main: tuple[tuple[str, str], ...], pickled: bytes
) -> Setup:
    """Unpickle the `Setup` that the parent sent, return it, and prepare this process: imports, effects, memory limit."""
    # At the end, so that no module next to a log or a program replaces one of Python's.
    sys.path += [path for path in paths if path not in sys.path]
    if main:
        from multiprocessing import spawn

        spawn.prepare(dict(main))
    setup: Setup = pickle.loads(pickled)

    from allanite.effects.registry import CATALOG

    for effect in setup.effects:
        CATALOG.add(effect)
    os.environ[VARIABLE] = str(setup.memory)
    from allanite import _kernels, readers, study

    assert readers
    assert study
    _kernels.own_process()
    limit_memory(setup.memory)
    return setup


def _file_stamp(path: str) -> tuple[int, ...]:
    """Tuple (device, inode, size in bytes, time of the last change in ns) of a file."""
    found = Path(path).stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _has_changed(path: str, before: tuple[int, ...], read_at: float, content: str) -> bool:
    """True if a log differs from that with the `_file_stamp` `before`, read at the time `read_at`, and this `content`."""
    # A time stamp reveals a later change only if it is older than its resolution.
    recent = read_at - before[-1] / 1e9 <= TIME_STAMP_SECONDS
    try:
        return (recent or _file_stamp(path) != before) and _content_digest(path) != content
    except (OSError, InputError):
        return True


def _content_digest(path: str) -> str:
    """SHA-256 (hexadecimal) of a file, or of all files of a folder and their names; `InputError` for a pipe or device."""
    digest = hashlib.sha256()
    log = Path(path)
    files = sorted(p for p in log.rglob("*") if p.is_file()) if log.is_dir() else [log]
    for one in files:
        if not stat.S_ISREG(one.stat().st_mode):
            raise InputError("is no file: a pipe or a device may never end")
        if one != log:
            digest.update(str(one.relative_to(log)).encode(errors="surrogateescape") + b"\0")
        with one.open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
