"""Long work of one tab: a thread with progress that can be ended, and turns where many tabs work."""

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

__all__ = ["Job"]

#: Searches at a time, over all tabs: what else the server is asked is then answered at once.
TURNS = threading.BoundedSemaphore(max(1, processors() - 1))


class Job:
    """One piece of work in a thread of its own.

    Parameters
    ----------
    name : str
        What is being done, for the progress bar.
    work : callable
        Called with the job; it reports through `progress`, which raises `Ended` if it shall end.
    """

    def __init__(self, name: str, work: Callable[[Job], None]) -> None:
        self.name = name
        self.done = 0
        self.total = 0
        self.error: str | None = None
        #: May be pre-empted: the user did not request it.
        self.gives_way = False
        #: Columns of the log that are worked on, and the one in hand.
        self.columns: tuple[int, ...] = ()
        self.column: int | None = None
        self._since = time.monotonic()
        self._stop = threading.Event()
        self._gate = threading.Lock()
        self._holds_turn = False
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    @property
    def busy(self) -> bool:
        """True while the result is wanted; a cancelled job may run to its next step."""
        return self._thread.is_alive() and not self._stop.is_set()

    @property
    def at_work(self) -> bool:
        """True until its thread has ended, wanted or not."""
        return self._thread.is_alive()

    def cancel(self) -> None:
        """End it: what it finds from now on is dropped, and the thread stops at its next step."""
        with self._gate:
            # A change that has begun is whole by now.
            self._stop.set()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until it has ended."""
        self._thread.join(seconds)

    def progress(self, done: int, total: int) -> None:
        """Report; raises `Ended` if the job was cancelled."""
        self.done, self.total = done, total
        if self._stop.is_set():
            raise Ended

    def say(self, name: str) -> None:
        """Go on to another part of the work."""
        self.name, self.done, self.total = name, 0, 0
        self._since = time.monotonic()
        self.progress(0, 0)

    def await_end(self, other: Job) -> None:
        """Wait until another job has ended, which ends with this one."""
        name = self.name
        try:
            while other.busy:
                self.name = other.name
                self.progress(other.done, other.total)
                time.sleep(0.02)
        except Ended:
            other.cancel()
            raise
        self.say(name)

    def take_turn(self) -> None:
        """Wait while other tabs search; the turn is given back at the end of the job."""
        name, told = self.name, False
        while not self._holds_turn:
            self._holds_turn = TURNS.acquire(blocking=False)
            if not self._holds_turn:
                if not told:
                    self.say("Waiting for the work of another tab")
                    told = True
                time.sleep(0.05)
            self.progress(self.done, self.total)
        if told:
            self.say(name)

    @contextmanager
    def undisturbed(self) -> Iterator[None]:
        """Change what others see: the whole of it, or nothing."""
        with self._gate:
            self.progress(1, 1)
            yield

    def to_dict(self) -> dict[str, Any]:
        """What the progress bar shows; it moves by its seconds where nothing can be counted."""
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
        try:
            with while_wanted(lambda: not self._stop.is_set()):
                self._work(work)
        except Ended:
            pass
        finally:
            if self._holds_turn:
                TURNS.release()

    def _work(self, work: Callable[[Job], None]) -> None:
        try:
            work(self)
        except AllaniteError as error:
            self.error = " ".join(error.worded(WORDS).split())
        except MemoryError:
            self.error = "Not enough memory for this log: average it down first"
        except Exception as error:  # the page must say that something broke, whatever it was
            self.error = (
                f"Something went wrong inside ({type(error).__name__}: {error}): please report it"
            )
