"""Background jobs of a tab: threads with progress and cancellation, which take turns with other tabs."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from allanite.common.errors import AllaniteError
from allanite.common.threads import Ended, processors, while_wanted
from allanite.page.words import WORDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

#: Limits the number of searches that run at the same time, so that the server can answer other requests at once.
TURNS = threading.BoundedSemaphore(max(1, processors() - 1))


class Job:
    """A job `name` that calls ``work(job)`` in its own thread.

    The work reports through `progress`, which raises `Ended` if the job was canceled.
    """

    def __init__(self, name: str, work: Callable[[Job], None]) -> None:
        self.name = name
        self.done = 0
        self.total = 0
        self.error: str | None = None
        #: May be pre-empted: the user did not request it.
        self.gives_way = False
        #: Columns of the log that the job will work on, and the current one.
        self.columns: tuple[int, ...] = ()
        self.column: int | None = None
        self._since = time.monotonic()
        self._stop = threading.Event()
        self._gate = threading.Lock()
        #: True if this job holds one of the `TURNS`.
        self._has_turn = False
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)

    def start(self) -> None:
        """Start the thread that does the work; returns at once."""
        self._thread.start()

    @property
    def busy(self) -> bool:
        """True while the thread runs and the job is not canceled. A canceled job may run to its next progress report."""
        return self._thread.is_alive() and not self._stop.is_set()

    @property
    def is_running(self) -> bool:
        """True until the thread has ended, even if the job was canceled."""
        return self._thread.is_alive()

    def cancel(self) -> None:
        """Cancel the job: later results are dropped, and the thread stops at its next progress report."""
        with self._gate:
            # Holding the gate ensures that a change in progress is complete.
            self._stop.set()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until the thread has ended, at most for some seconds."""
        self._thread.join(seconds)

    def progress(self, done: int, total: int) -> None:
        """Store `done` of `total` steps as the progress; raises `Ended` if the job was canceled."""
        self.done, self.total = done, total
        if self._stop.is_set():
            raise Ended

    def begin_stage(self, name: str) -> None:
        """Set the description of the next part of the work, and reset progress and time; raises `Ended` if canceled."""
        self.name, self.done, self.total = name, 0, 0
        self._since = time.monotonic()
        self.progress(0, 0)

    def await_end(self, other: Job) -> None:
        """Wait until another job has ended or was canceled; meanwhile this job shows the other's name and progress.

        If this job is canceled meanwhile, the other one is canceled too and `Ended` is raised.
        """
        name = self.name
        try:
            while other.busy:
                self.name = other.name
                self.progress(other.done, other.total)
                time.sleep(0.02)
        except Ended:
            other.cancel()
            raise
        self.begin_stage(name)

    def take_turn(self) -> None:
        """Wait until fewer searches run in all tabs than the page allows (one less than the processors, at least 1).

        The permission is kept until the job ends. Raises `Ended` if the job is canceled.
        """
        self._has_turn = self._has_turn or TURNS.acquire(blocking=False)
        if self._has_turn:
            self.progress(self.done, self.total)
            return
        name = self.name
        self.begin_stage("Waiting for another tab")
        while not self._has_turn:
            self._has_turn = TURNS.acquire(timeout=0.05)
            self.progress(0, 0)
        self.begin_stage(name)

    @contextmanager
    def uncancelable(self) -> Iterator[None]:
        """Context manager for which `cancel` waits; raises `Ended` if the job was canceled before."""
        with self._gate:
            self.progress(1, 1)
            yield

    def to_dict(self) -> dict[str, Any]:
        """State of the job for the progress bar; ``seconds`` counts from the last `begin_stage`, ``error`` is a message."""
        return {
            "name": self.name,
            "done": self.done,
            "total": self.total,
            "seconds": round(time.monotonic() - self._since, 1),
            "busy": self.busy,
            "gives_way": self.gives_way,
            "columns": self.columns,
            "column": self.column,
            "error": self.error,
        }

    def _run(self, work: Callable[[Job], None]) -> None:
        """Call `work` with this job in its thread, and end its turn (`take_turn`); a failure is stored in `error`.

        `Ended`, which a canceled job raises, ends the work without an error.
        """
        try:
            with while_wanted(lambda: not self._stop.is_set()):
                work(self)
        except Ended:
            pass
        except AllaniteError as error:
            self.error = " ".join(error.worded(WORDS).split())
        except MemoryError:
            self.error = "Not enough memory for this log: average the samples first"
        except Exception as error:  # the page must report every failure
            self.error = f"Internal error ({type(error).__name__}: {error}): please report it"
        finally:
            if self._has_turn:
                TURNS.release()
