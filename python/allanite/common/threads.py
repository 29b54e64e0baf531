"""Compute in threads, and end computations that are no longer wanted.

Threads help because the compiled core and NumPy release the interpreter's lock. Between its steps, a computation calls
`stop_if_unwanted`. No exception is raised from outside: in the middle of the standard library it would leave locks closed.
"""

from __future__ import annotations

import contextvars
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from types import TracebackType
from typing import Any, TypeVar

from allanite.common.errors import AllaniteError

T = TypeVar("T")

#: Maximum number of columns that are computed at a time. Each needs the working memory of a whole column.
WORKERS = 2
NAME = "allanite column"
#: Seconds between two readings of the clock of a deadline. A reading of the processor time takes 0.15 ms on some machines.
READING_INTERVAL = 0.1
_wanted: contextvars.ContextVar[Callable[[], bool] | None] = contextvars.ContextVar(
    "wanted", default=None
)
#: Indices of the columns that `side_by_side` computes at the moment, including the caller's.
_at_work: contextvars.ContextVar[set[int]] = contextvars.ContextVar("at work")


def processors() -> int:
    """Number of processors that this process may use; on macOS and Windows, the number in the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def max_parallel_columns() -> int:
    """Maximum number of columns that are computed at the same time: 2, or 1 with one processor."""
    return min(WORKERS, processors())


def columns_at_work() -> int:
    """Number of columns that the current `side_by_side` computes at this moment, including this one; 1 outside of it."""
    return max(1, len(_at_work.get(())))


class Ended(BaseException):
    """Raised inside of a computation that is no longer wanted. No `Exception`, so that no handler of errors catches it."""


@contextmanager
def while_wanted(wanted: Callable[[], bool]) -> Iterator[None]:
    """Context in which `stop_if_unwanted`, also in threads of a `Pool`, raises `Ended` once ``wanted()`` is False."""
    token = _wanted.set(wanted)
    try:
        yield
    finally:
        _wanted.reset(token)


def stop_if_unwanted() -> None:
    """Raise `Ended` if the innermost `while_wanted` no longer wants the work; call this between steps of long work."""
    wanted = _wanted.get()
    if wanted is not None and not wanted():
        raise Ended


@contextmanager
def with_deadline(
    deadline: float | None, clock: Callable[[], float] = time.monotonic
) -> Iterator[None]:
    """Context that raises `TimeoutError` after a deadline (s, compared with ``clock()``), at the next `stop_if_unwanted`.

    None means no deadline. If an outer `while_wanted` ends the work, its `Ended` passes unchanged.
    """
    if deadline is None:
        yield
        return
    outer, in_time, due = _wanted.get(), True, float("-inf")

    def is_wanted() -> bool:
        """True before the deadline, unless an outer `while_wanted` ends the work; reads `clock` at most every 0.1 s."""
        nonlocal in_time, due
        now = time.monotonic()
        if now >= due:
            in_time, due = clock() < deadline, now + READING_INTERVAL
        return in_time and (outer is None or outer())

    try:
        with while_wanted(is_wanted):
            stop_if_unwanted()
            yield
    except Ended:
        if outer is not None and not outer():
            raise
        raise TimeoutError from None


class Pool(ThreadPoolExecutor):
    """Thread pool whose tasks inherit the caller's context: whether the work is wanted, and the units of tables.

    An exception inside of `with` ends the tasks: waiting tasks do not begin, running tasks end at their next
    `stop_if_unwanted`.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers, thread_name_prefix=NAME)
        self._over = False

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Future of the result of ``fn(*args, **kwargs)``, computed in a thread.

        If columns already occupy every processor, the calling thread computes the result before it returns the future.
        """
        if len(_at_work.get(())) >= processors():
            done: Future[T] = Future()
            try:
                done.set_result(self._run_task(fn, *args, **kwargs))
            except Exception as error:  # raised by `Future.result`, as for a task in a thread
                done.set_exception(error)
            return done
        run = contextvars.copy_context().run
        return super().submit(run, self._run_task, fn, *args, **kwargs)

    def _run_task(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> T:
        """Result of ``fn(*args, **kwargs)``; ends early if an error has closed the pool or the caller wants no result."""
        caller = _wanted.get()
        with while_wanted(lambda: not self._over and (caller is None or caller())):
            return fn(*args, **kwargs)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        """Wait for the tasks, unless the user interrupts; after an error, end them."""
        self._over = kind is not None
        waits = kind is None or not issubclass(kind, KeyboardInterrupt)
        self.shutdown(wait=waits, cancel_futures=self._over)


def has_running_jobs() -> bool:
    """True if a thread of a `Pool` exists, even if nobody waits for its result."""
    return any(thread.name.startswith(NAME) for thread in threading.enumerate())


def side_by_side(tasks: Sequence[Callable[[], T]]) -> list[T | AllaniteError]:
    """Results of functions that run in parallel threads, at most 2 at a time, in the order of `tasks`.

    An `AllaniteError` of a task takes the place of its result. An interrupt or any other error ends the other tasks, as
    in `Pool`, and is raised.
    """
    at_work: set[int] = set()

    def run(place: int, task: Callable[[], T]) -> T | AllaniteError:
        """Result of a task, or the `AllaniteError` that it raises."""
        token = _at_work.set(at_work)
        at_work.add(place)
        try:
            return task()
        except AllaniteError as error:
            return error
        finally:
            at_work.discard(place)
            _at_work.reset(token)

    with Pool(max_parallel_columns()) as pool:
        futures = [pool.submit(run, *one) for one in enumerate(tasks)]
        for future in as_completed(futures):
            future.result()
    return [future.result() for future in futures]


def results_or_raise(found: Sequence[T | AllaniteError]) -> list[T]:
    """Results that `side_by_side` returned; raises the first `AllaniteError` among them."""
    out = []
    for one in found:
        if isinstance(one, AllaniteError):
            raise one
        out.append(one)
    return out
