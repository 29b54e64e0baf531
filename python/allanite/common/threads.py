"""Threads, since the core and NumPy compute without the interpreter's lock; and how what they compute is ended.

Work asks between its steps whether it is still wanted. Nothing may interrupt it from outside: an exception raised in the
middle of the standard library leaves the locks closed that were just taken.
"""

from __future__ import annotations

import contextvars
import os
import threading
import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

from allanite.common.errors import AllaniteError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import TracebackType

__all__ = [
    "Ended",
    "Pool",
    "at_once",
    "before",
    "computing",
    "go_on",
    "processors",
    "results",
    "side_by_side",
    "while_wanted",
]

T = TypeVar("T")

#: Most at once: each holds the working memory of a whole column.
WORKERS = 2
NAME = "allanite column"
_wanted: contextvars.ContextVar[Callable[[], bool] | None] = contextvars.ContextVar(
    "wanted", default=None
)
#: Places of the columns that are at work beside each other, that of the one that asks among them.
_at_work: contextvars.ContextVar[set[int]] = contextvars.ContextVar("at work")


def processors() -> int:
    """Processors that this process may use; macOS and Windows tell only those of the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def at_once() -> int:
    """Columns that are computed at a time."""
    return min(WORKERS, processors())


def columns_at_work() -> int:
    """Columns that are computed now, that of the caller included; 1 outside of `side_by_side`."""
    return max(1, len(_at_work.get(())))


class Ended(BaseException):
    """Raised inside work that is not wanted any more; no error, so that nothing inside takes it for one."""


@contextmanager
def while_wanted(wanted: Callable[[], bool]) -> Iterator[None]:
    """What is computed inside, and in pools begun there, ends at its next `go_on` once this says False."""
    token = _wanted.set(wanted)
    try:
        yield
    finally:
        _wanted.reset(token)


def go_on() -> None:
    """Between two steps of a long computation: raises `Ended` if it is not wanted any more."""
    wanted = _wanted.get()
    if wanted is not None and not wanted():
        raise Ended


@contextmanager
def before(deadline: float | None, clock: Callable[[], float] = time.monotonic) -> Iterator[None]:
    """End what is computed inside at its next `go_on` after a deadline of a `clock`, with `TimeoutError`."""
    if deadline is None:
        yield
        return
    outer = _wanted.get()

    def is_wanted() -> bool:
        return clock() < deadline and (outer is None or outer())

    try:
        with while_wanted(is_wanted):
            go_on()
            yield
    except Ended:
        if outer is not None and not outer():
            raise
        raise TimeoutError from None


class Pool(ThreadPoolExecutor):
    """Threads that know what their caller knows: whether the work is wanted, units of tables.

    Whatever is raised inside `with` ends the tasks: those that wait do not begin, those at work end at their next `go_on`.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers, thread_name_prefix=NAME)
        self._over = False

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Like that of the standard library; done at once where other columns keep every processor busy."""
        if len(_at_work.get(())) >= processors():
            done: Future[T] = Future()
            try:
                done.set_result(self._while_open(fn, *args, **kwargs))
            except Exception as error:  # raised where the result is asked for, as from a thread
                done.set_exception(error)
            return done
        run = contextvars.copy_context().run
        return super().submit(run, self._while_open, fn, *args, **kwargs)

    def _while_open(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> T:
        caller = _wanted.get()
        with while_wanted(lambda: not self._over and (caller is None or caller())):
            return fn(*args, **kwargs)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        """Wait for the tasks, but not where the user interrupts."""
        self._over = kind is not None
        waits = kind is None or not issubclass(kind, KeyboardInterrupt)
        self.shutdown(wait=waits, cancel_futures=self._over)


def computing() -> bool:
    """True while an abandoned task is still at work; only the end of the process stops it."""
    return any(thread.name.startswith(NAME) for thread in threading.enumerate())


def side_by_side(tasks: Sequence[Callable[[], T]]) -> list[T | AllaniteError]:
    """Results of tasks in their order; what a task refuses (`AllaniteError`) stands in the place of its result.

    An interrupt or any other error ends the wait at once, and tasks that have not begun do not begin.
    """
    waiting = deque(enumerate(tasks))
    done: SimpleQueue[tuple[int, T | BaseException]] = SimpleQueue()
    at_work: set[int] = set()

    def work() -> None:
        _at_work.set(at_work)
        while True:
            try:
                place, task = waiting.popleft()
            except IndexError:
                return
            at_work.add(place)
            try:
                done.put((place, task()))
            except BaseException as error:  # raised again where it is waited for
                done.put((place, error))
            finally:
                at_work.discard(place)

    for _ in range(min(at_once(), len(tasks))):
        # What was set for the caller (units of tables) holds for its workers.
        context = contextvars.copy_context()
        threading.Thread(target=context.run, args=(work,), daemon=True, name=NAME).start()
    found: dict[int, T | AllaniteError] = {}
    try:
        while len(found) < len(tasks):
            place, result = done.get()
            if isinstance(result, BaseException) and not isinstance(result, AllaniteError):
                raise result
            found[place] = result
    finally:
        waiting.clear()
    return [found[place] for place in range(len(tasks))]


def results(found: Sequence[T | AllaniteError]) -> list[T]:
    """What `side_by_side` returned, where every task must succeed: the first refusal is raised."""
    out = []
    for one in found:
        if isinstance(one, AllaniteError):
            raise one
        out.append(one)
    return out
