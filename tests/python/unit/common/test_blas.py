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


ON_PROCESSORS = """
import os, sys
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: int(sys.argv.pop(1))])
from allanite._command import main
main()
"""


@pytest.mark.slow
@pytest.mark.skipif(
    len(getattr(os, "sched_getaffinity", lambda _: ())(0)) < 2, reason="needs two processors"
)
def test_the_command_prints_the_same_bits_on_one_and_two_processors(tmp_path):
    """Two axes with a line, a step, gaps and a temperature dependence."""
    rng = np.random.default_rng(7)
    time = np.arange(12000) / 100
    temperature = 20 + 0.01 * rng.standard_normal(time.size).cumsum()
    x, y = 0.01 * rng.standard_normal((2, time.size))
    x += 0.003 * np.sin(2 * np.pi * 3.3 * time) + 0.01 * (time > 70)
    y += 0.02 * (temperature - temperature[0])
    x[5000:5300] = np.nan
    log = tmp_path / "log.csv"
    names = "time_s,gyro_x,gyro_y,temperature"
    np.savetxt(log, np.c_[time, x, y, temperature], delimiter=",", header=names, comments="")
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    options = ["improve", str(log), "--unit", "rad/s", "--json", "--quiet"]
    said = {
        subprocess.run(
            [sys.executable, "-c", ON_PROCESSORS, processors, *options],
            env=environment, capture_output=True, text=True, check=True,
        ).stdout
        for processors in ("1", "2")
    }  # fmt: skip
    assert len(said) == 1
    assert "gyro_y" in said.pop()
