"""An interrupt of a pool of threads: nothing that waits begins, and what is at work ends at its next step."""

import contextvars
import os
import threading
import time

import pytest

import allanite as al
from allanite.common import threads
from allanite.common.threads import (
    Ended,
    Pool,
    has_running_jobs,
    processors,
    stop_if_unwanted,
    while_wanted,
)

NUMBER = 2
#: Seconds after which a thread gives up: only where a test fails.
PATIENCE = 20.0


class Work:
    """Tasks of a pool, two of which run while others wait."""

    def __init__(self):
        self.begun = [threading.Event() for _ in range(6)]
        self.ended = threading.Semaphore(0)

    def task(self, place):
        self.begun[place].set()
        end = time.monotonic() + PATIENCE
        try:
            while time.monotonic() < end:
                stop_if_unwanted()
                time.sleep(0.002)
        except Ended:
            self.ended.release()
            raise

    def interrupted(self, kind):
        """Time in s until an interrupt ends the pool, raised while two tasks run."""
        with pytest.raises(kind), Pool(NUMBER) as pool:  # noqa: PT012
            for place in range(len(self.begun)):
                pool.submit(self.task, place)
            for event in self.begun[:NUMBER]:
                assert event.wait(PATIENCE)
            start = time.monotonic()
            raise kind("as asked")
        return time.monotonic() - start


@pytest.mark.parametrize("kind", [KeyboardInterrupt, al.InputError, Ended])
def test_nothing_that_waits_begins(kind):
    work = Work()
    assert work.interrupted(kind) < PATIENCE
    for _ in range(NUMBER):
        assert work.ended.acquire(timeout=PATIENCE)
    assert not any(event.is_set() for event in work.begun[NUMBER:])


def test_an_interrupt_does_not_wait_for_a_step():
    hold, inside = threading.Event(), threading.Event()

    def step():
        inside.set()
        hold.wait(PATIENCE)

    with pytest.raises(KeyboardInterrupt), Pool(NUMBER) as pool:  # noqa: PT012
        future = pool.submit(step)
        assert inside.wait(PATIENCE)
        raise KeyboardInterrupt
    # Still at work: the command line ends the process without it.
    assert not future.done()
    assert has_running_jobs()
    hold.set()


def test_a_task_knows_what_its_caller_knows():
    known = contextvars.ContextVar("known", default=0)
    known.set(3)
    with Pool(NUMBER) as pool:
        assert pool.submit(known.get).result() == 3
    wanted = threading.Event()
    wanted.set()
    with while_wanted(wanted.is_set), pytest.raises(Ended), Pool(NUMBER) as pool:  # noqa: PT012
        work = Work()
        future = pool.submit(work.task, 0)
        assert work.begun[0].wait(PATIENCE)
        wanted.clear()
        future.result()


def test_processors_are_counted_on_every_system(monkeypatch):
    """Only Linux states those that a process may use; a fleet once failed on other systems."""
    assert 1 <= processors() <= (os.cpu_count() or 1)
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert processors() == os.cpu_count()
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert processors() == 1


@pytest.mark.parametrize("number", [1, 2])
def test_columns_that_keep_every_processor_busy_do_their_work_themselves(number, monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 2)
    together = threading.Barrier(number)

    def column():
        together.wait(PATIENCE)
        with Pool(1) as pool:
            own = pool.submit(threading.get_ident).result() == threading.get_ident()
            with pytest.raises(al.InputError, match="as asked"):
                pool.submit(refuse).result()
        together.wait(PATIENCE)
        return own

    def refuse():
        raise al.InputError("as asked")

    assert threads.side_by_side([column] * number) == [number == 2] * number
