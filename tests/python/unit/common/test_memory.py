"""Memory in proportion to the record, whatever is asked of it."""

import subprocess
import sys
from pathlib import Path

import pytest

import allanite as al
from allanite.effects import lowpass
from allanite.fit.likelihood import expected

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/stat").exists(), reason="ru_maxrss is in bytes elsewhere"
)

ALL = """
import resource
import numpy as np
import allanite as al
x = np.random.default_rng(1).standard_normal(36_000)
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
al.oadev(x[:2000], rate=10.0, taus="all").to_dict()
before = peak()
found = al.oadev(x, rate=10.0, taus="all")
found.to_dict()
print(found.tau.size, peak() - before)
"""


@pytest.mark.long
def test_every_averaging_time():
    """A matrix of them would take 47 MB for so many samples, and 4.7 GB for 360 000."""
    said = subprocess.run(
        [sys.executable, "-c", ALL], capture_output=True, text=True, check=True
    ).stdout.split()
    assert int(said[0]) == 18_000
    # 13 MB are the points of the document; pages of the allocator and of threads come to it.
    assert int(said[1]) < 35_000


@pytest.mark.long
def test_release_empties_the_caches_of_fitted_models():
    recording = al.parse_model("N(N=0.1)+K(K=1e-3)+BW(cutoff=20)").simulate(
        n=4000, rate=100, seed=1
    )
    fit = al.fit_model(recording, "N+K+BW")
    caches = (expected._complete_column, expected._without_coefficient, lowpass.terms)
    assert all(cache.cache_info().currsize for cache in caches)
    al.free_buffers()
    assert not any(cache.cache_info().currsize for cache in caches)
    again = al.fit_model(recording, "N+K+BW")
    assert again.to_dict() == fit.to_dict()


LIBRARY = """
import numpy as np
import allanite as al
from allanite import _kernels
al.fit_model(al.Recording(np.random.default_rng(1).standard_normal(200_000), rate=10.0), "N")
print(_kernels.trim())
"""
COMMAND = """
import atexit, sys
from allanite import _kernels
atexit.register(lambda: print(_kernels.trim()))
sys.argv = ["allanite", "--version"]
from allanite._command import main
main()
"""


@pytest.mark.parametrize(("code", "trims"), [(LIBRARY, "False"), (COMMAND, "True")])
def test_only_the_command_returns_freed_memory_to_the_system(code, trims):
    """A library does not change the allocator of its process."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == trims
