"""Work of a tab that is ended: soon, and without harm to anything else in the process."""

import gc
import threading
import time
from concurrent.futures import ThreadPoolExecutor, thread

import numpy as np
import pytest

from allanite import Recording
from allanite.common.threads import Pool, stop_if_unwanted
from allanite.page import child, jobs, source, tab_state
from allanite.page.source import Source
from allanite.page.tab import Tab
from allanite.suggestion import check_fit


@pytest.mark.slow
def test_ending_leaves_the_locks_of_the_library_open():
    """When an exception from outside ended jobs, one of thirty left a lock closed that every pool uses."""

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
        assert not job.is_running
    assert thread._global_shutdown_lock.acquire(timeout=5.0)
    thread._global_shutdown_lock.release()


def test_pools_of_the_work_end_with_it():
    begun = threading.Barrier(3)

    def step():
        begun.wait(30.0)
        while True:
            stop_if_unwanted()
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
    assert not job.is_running
    assert job.error is None


def test_a_job_that_is_ended_gives_its_turn_back(monkeypatch):
    turns = threading.BoundedSemaphore(1)
    monkeypatch.setattr(jobs, "TURNS", turns)
    taken = threading.Event()

    def work(job):
        job.take_turn()
        taken.set()
        while True:
            stop_if_unwanted()
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
    """A change that has begun is complete when `cancel` returns; no change begins afterwards."""
    inside, out = threading.Event(), threading.Event()
    changes = []

    def work(job):
        with job.uncancelable():
            inside.set()
            out.wait(30.0)
            changes.append("first")
        with job.uncancelable():
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


@pytest.mark.long
def test_improve_takes_up_the_check_that_is_at_work(hidden, monkeypatch):
    begun, go = threading.Event(), threading.Event()
    models = []

    def slowly(fit, progress):
        models.append(fit.model.name)
        begun.set()
        while not go.wait(0.001):
            progress(0, 1)
        return check_fit(fit, progress)

    monkeypatch.setattr(tab_state, "check_fit", slowly)
    tab = Tab([Source("hidden", recording=hidden)])
    tab.open(0)
    assert begun.wait(60.0)
    tab.improve()
    go.set()
    tab.job.wait(120.0)
    assert tab.job.error is None
    # Every model of the ladder is checked once, the first one too.
    assert models == [step.fit.model.name for step in tab.column_steps.steps]
    assert len(models) > 1


def test_what_improve_waits_for_ends_with_it(hidden, monkeypatch):
    begun, ends = threading.Event(), threading.Event()

    def forever(_fit, progress):
        begun.set()
        try:
            while True:
                progress(0, 1)
                time.sleep(0.001)
        finally:
            ends.set()

    monkeypatch.setattr(tab_state, "check_fit", forever)
    tab = Tab([Source("hidden", recording=hidden)])
    tab.open(0)
    first = tab.job
    assert begun.wait(60.0)
    tab.improve()
    tab.cancel()
    tab.job.wait(30.0)
    first.wait(30.0)
    assert ends.is_set()
    assert not first.is_running


@pytest.mark.slow
def test_tabs_read_a_log_once_and_again_when_it_has_changed(tmp_path, monkeypatch):
    path = tmp_path / "log.npz"
    np.savez(path, data=np.arange(200.0), rate_hz=10.0, unit="rad/s")
    asked = []

    def read_in_child(*order):
        asked.append(order)
        return child.read_in_child(*order)

    monkeypatch.setattr(source, "read_in_child", read_in_child)
    log = Source("log", path)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: log.read(log.reading), range(4)))
    assert len(asked) == 1
    assert all(one is found[0] for one in found)
    np.savez(path, data=np.arange(300.0), rate_hz=10.0, unit="rad/s")
    assert log.read(log.reading).n == 300
    # Nothing is kept of what no tab has.
    del found
    gc.collect()
    _ = log.read(log.reading)
    assert len(asked) == 3


def test_a_column_chosen_during_the_first_fit_of_another_is_fitted(monkeypatch):
    begun, release, fit = threading.Event(), threading.Event(), tab_state.fit_model

    def fit_later(log, model):
        if log.columns == ("x",):
            begun.set()
            release.wait(60.0)
        return fit(log, model)

    monkeypatch.setattr(tab_state, "fit_model", fit_later)
    data = np.random.default_rng(3).normal(size=(2000, 2))
    log = Recording(data, 10.0, unit="deg/s", columns=["x", "y"])
    tab = Tab([Source("two.npz", recording=log)])
    tab.open(0)
    assert begun.wait(60.0)
    tab.open_column(1)
    release.set()
    tab.job.wait(60.0)
    assert tab.board.columns[1].step.check is not None
