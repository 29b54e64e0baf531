"""Ctrl-C ends any call into the core within a second.

The processor time of all threads from the signal on counts, because a busy machine is slow. Each call would take
minutes.
"""

import signal
import time
from pathlib import Path

import pytest

from allanite.deviation import ESTIMATORS
from command_line import spent, started

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/stat").exists(), reason="reads the processor time of a process from /proc"
)

#: Seconds of processor time. An item of work takes some milliseconds; waiting and ending add little.
ALLOWED = 1.0

CALL = """
import time
import numpy as np
import allanite as al
x = np.tile(np.random.default_rng(1).normal(size=1000), {thousands})
print("begun", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print(time.process_time(), flush=True)
"""

# Factors for which a single item of work is as long as it gets with so many samples.
LONG = "rate=1.0, factors=np.arange(900_000, 950_000)"
# A term at every m-th point costs little: all factors.
MANY = "rate=1.0, factors=np.arange(1, 1_000_000)"
# Kernels that another name tries.
AGAIN = {"tdev", "ttotdev", "theoh"}
# A band around a curve needs the covariance of all its factors.
BANDS = "from allanite.fit.bands import bands; bands"
CALLS = {
    **{
        name: (4000, f"al.{name}(x, {LONG})")
        for name in ESTIMATORS
        if name not in {"adev", "hdev", "theo1", *AGAIN}
    },
    **{name: (4000, f"al.{name}(x, {MANY})") for name in ("adev", "hdev")},
    "theo1": (400, "al.theo1(x, rate=1.0, taus='all')"),
    "check": (4000, "al.fit_model(al.Recording(x, rate=1.0), 'N+B+K').check()"),
    "covariance": (
        1,
        f"{BANDS}(al.parse_model('N(N=1)+B(B=1)').terms(1.0), 10**6, np.arange(1, 3000))",
    ),
    "simulate": (1, "al.parse_model('N(N=1)+B(B=1)').simulate(duration=1e9, rate=1.0, seed=1)"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_core_hears_an_interrupt(name):
    thousands, call = CALLS[name]
    with started(code=CALL.format(thousands=thousands, call=call)) as process:
        assert process.stdout.readline() == b"begun\n"
        # Beyond what comes before the core: it is at work then, however busy the machine is.
        before = spent(process)
        end = time.monotonic() + 60.0
        while spent(process) < before + 0.3 and time.monotonic() < end:
            time.sleep(0.01)
        before = spent(process)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert out, f"it ended by itself: {err.decode()[-300:]}"
    assert float(out) - before < ALLOWED


SORT = """
import sys
import numpy as np
from allanite import _kernels
from allanite.fit.likelihood import whitened
order, sorted_ = _kernels.order, []
def slowly(values):
    print("begun", flush=True)
    for _ in range(20):
        found = order(values)
    sorted_.append(True)
    return found
_kernels.order = slowly
x = np.random.default_rng(1).laplace(size=5_000_000)
try:
    whitened._samples_and_bands(_kernels.cosine_transform(x)).with_normal_tails
except KeyboardInterrupt:
    print(len(sorted_), flush=True)
"""


def test_a_sort_does_not_hold_an_interrupt_up():
    with started(code=SORT, stderr=None) as process:
        assert process.stdout.readline() == b"begun\n"
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
    assert out == b"0\n", "the interrupt came after the sort"
