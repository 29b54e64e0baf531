"""A fit limits BLAS to one thread while it runs, and leaves the setting of the process as it was."""

import threading

import numpy as np
import pytest
import scipy.linalg  # noqa: F401 - brings a BLAS library of its own
from threadpoolctl import threadpool_info, threadpool_limits

import allanite as al
from allanite.common.blas import _let_all_threads_set_limits, one_thread


def threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.fixture
def two_threads():
    # A context would forbid other threads to change the setting.
    limit = threadpool_limits(2, user_api="blas")
    _let_all_threads_set_limits()
    if threads() != {2}:
        pytest.skip("this BLAS library does not use two threads")
    yield
    _let_all_threads_set_limits(force=True)
    limit.restore_original_limits()
    _let_all_threads_set_limits()


def test_a_fit_leaves_the_number_of_threads(two_threads):
    log = al.Recording(np.random.default_rng(1).standard_normal(500), rate=10)
    al.fit_model(log, "N").check()
    assert threads() == {2}


def test_an_error_leaves_the_number_of_threads(two_threads):
    with pytest.raises(ZeroDivisionError), one_thread():
        _ = 1 / 0
    assert threads() == {2}


def held(start, go):
    """A thread that needs one BLAS thread until `go` is set."""

    def body():
        with one_thread():
            start.set()
            go.wait(10.0)

    thread = threading.Thread(target=body)
    thread.start()
    start.wait(10.0)
    return thread


def test_the_last_of_several_computations_restores_the_threads(two_threads):
    go, last = threading.Event(), threading.Event()
    first = held(threading.Event(), go)
    second = held(threading.Event(), last)
    assert threads() == {1}
    go.set()
    first.join()
    assert threads() == {1}
    last.set()
    second.join()
    assert threads() == {2}


def test_the_last_computation_restores_what_a_living_thread_has_set(two_threads):
    go = threading.Event()
    with one_thread():  # this thread sets the limit, another one restores it
        other = held(threading.Event(), go)
    assert threads() == {1}
    go.set()
    other.join()
    assert threads() == {2}


def test_a_limit_of_the_user_stays(two_threads):
    """A limit that another thread sets while a computation runs works, and is not undone at its end."""
    go = threading.Event()
    other = held(threading.Event(), go)
    with threadpool_limits(2, user_api="blas"):
        assert threads() == {2}
        go.set()
        other.join()
        assert threads() == {2}
