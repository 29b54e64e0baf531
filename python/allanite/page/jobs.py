"""Long work of one tab: a thread with progress that can be cancelled."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from allanite.common.errors import AllaniteError
from allanite.page.words import WORDS

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Cancelled", "Job"]


class Cancelled(Exception):  # noqa: N818 - not an error
    """Raised inside the work when it shall end."""


class Job:
    """One piece of work in a thread of its own.

    Parameters
    ----------
    name : str
        What is being done, for the progress bar.
    work : callable
        Called with the job; it reports through `progress`, which raises `Cancelled` if it shall end.
    """

    def __init__(self, name: str, work: Callable[[Job], None]) -> None:
        self.name = name
        self.done = 0
        self.total = 0
        self.error: str | None = None
        #: Whether other work may take its place unasked: nothing that a person ordered is lost.
        self.gives_way = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether it is at work for anybody: what was cancelled may still be on its way to the next report."""
        return self._thread.is_alive() and not self._stop.is_set()

    def cancel(self) -> None:
        """End it: what it finds from now on is dropped, and it stops at its next report of progress."""
        self._stop.set()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until it has ended."""
        self._thread.join(seconds)

    def progress(self, done: int, total: int) -> None:
        """Report; raises `Cancelled` if the job was cancelled."""
        self.done, self.total = done, total
        if self._stop.is_set():
            raise Cancelled

    def say(self, name: str) -> None:
        """Go on to another part of the work."""
        self.name, self.done, self.total = name, 0, 0
        self.progress(0, 0)

    def to_dict(self) -> dict[str, Any]:
        """What the progress bar shows."""
        return {
            "name": self.name,
            "done": self.done,
            "total": self.total,
            "busy": self.busy,
            "gives_way": self.gives_way,
            "error": self.error,
        }

    def _run(self, work: Callable[[Job], None]) -> None:
        try:
            work(self)
        except Cancelled:
            self.error = None
        except AllaniteError as error:
            self.error = " ".join(error.worded(WORDS).split())
        except MemoryError:
            self.error = "not enough memory for this log: average it down first"
        except Exception as error:  # the page must say that something broke, whatever it was
            self.error = (
                f"something went wrong inside ({type(error).__name__}: {error}): please report it"
            )
