"""Work of a tab that is ended: soon, and without harm to anything else in the process."""

import threading
import time
from concurrent.futures import thread

import numpy as np

from allanite.common.threads import Pool, go_on
from allanite.page import jobs


def test_ending_leaves_the_locks_of_the_library_open():
    """Ended by an exception from outside, one of thirty left a lock closed that every pool of the process takes."""

    def work(job):
        while True:
            with Pool(2) as pool:
                pool.submit(int).result(timeout=30.0)
            job.progress(0, 1)

    for pause in np.random.default_rng(1).uniform(0.0, 0.004, 300):
        job = jobs.Job("pools", work)
        job.start()
        time.sleep(pause)
        job.cancel()
        job.wait(30.0)
        assert not job.at_work
    assert thread._global_shutdown_lock.acquire(timeout=5.0)
    thread._global_shutdown_lock.release()


def test_pools_of_the_work_end_with_it():
    begun = threading.Barrier(3)

    def step():
        begun.wait(30.0)
        while True:
            go_on()
            time.sleep(0.001)

    def work(_job):
        with Pool(2) as pool:
            for done in [pool.submit(step) for _ in range(2)]:
                done.result()

    job = jobs.Job("pools", work)
    job.start()
    begun.wait(30.0)
    assert job.busy
    job.cancel()
    assert not job.busy
    job.wait(30.0)
    assert not job.at_work
    assert job.error is None


def test_a_job_that_is_ended_gives_its_turn_back(monkeypatch):
    turns = threading.BoundedSemaphore(1)
    monkeypatch.setattr(jobs, "TURNS", turns)
    taken = threading.Event()

    def work(job):
        job.take_turn()
        taken.set()
        while True:
            go_on()
            time.sleep(0.001)

    first, second = jobs.Job("first", work), jobs.Job("second", work)
    first.start()
    assert taken.wait(30.0)
    second.start()
    while "Waiting" not in second.name:
        time.sleep(0.001)
    # One that waits for its turn has none to give back.
    second.cancel()
    second.wait(30.0)
    first.cancel()
    first.wait(30.0)
    assert turns.acquire(timeout=5.0)
    assert not turns.acquire(blocking=False)


def test_what_is_ended_changes_nothing_any_more():
    """A change that has begun is whole when `cancel` returns; none begins after."""
    inside, out = threading.Event(), threading.Event()
    changes = []

    def work(job):
        with job.undisturbed():
            inside.set()
            out.wait(30.0)
            changes.append("first")
        with job.undisturbed():
            changes.append("second")

    job = jobs.Job("change", work)
    job.start()
    assert inside.wait(30.0)
    threading.Timer(0.05, out.set).start()
    job.cancel()
    assert changes
    job.wait(30.0)
    done = len(changes)
    job.wait(30.0)
    # The second may have begun before the lock came to who cancels: then it was whole by then.
    assert changes[:done] == changes
