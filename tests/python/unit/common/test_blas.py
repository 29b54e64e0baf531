"""The library leaves the number of BLAS threads alone; the command sets it for its own process."""

import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.linalg  # noqa: F401 - brings a BLAS library of its own
from threadpoolctl import threadpool_info, threadpool_limits

import allanite as al


def threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


def test_a_search_does_not_change_the_number_of_threads():
    seen = []
    log = al.Recording(np.random.default_rng(1).standard_normal(500), rate=10)
    with threadpool_limits(2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("this BLAS library does not use two threads")
        al.fit_model(log, "N").check(lambda *_: seen.append(threads()))
        al.improve(log, "N", on_progress=lambda *_: seen.append(threads()))
    assert seen
    assert all(one == {2} for one in seen)


@pytest.mark.slow
@pytest.mark.parametrize(("given", "used"), [(None, "1"), ("2", "2")])
def test_the_command_uses_one_thread_unless_the_user_sets_a_number(given, used):
    code = """
import atexit, os, sys
atexit.register(lambda: print(os.environ["OPENBLAS_NUM_THREADS"]))
sys.argv = ["allanite", "--version"]
from allanite._command import main
assert "numpy" not in sys.modules
main()
"""
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    environment |= {"OPENBLAS_NUM_THREADS": given} if given else {}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[-1] == used
