"""Measure all promised speed and memory ratios and print each with its limit.

    python benches/python/bars.py            # about 10 minutes; 1e8 samples need 8 GB
    python benches/python/bars.py --quick    # without 1e8 samples

Figures of two threads are valid only if two cores were available (CPU/wall above 1.6).
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

import allantools
import numpy as np
from bench_oadev import RATE, log_spaced, numba_recipe, octave
from side_by_side import side_by_side

from allanite import _kernels, deviation
from allanite.deviation import oadev
from allanite.deviation.accumulator import Accumulator
from allanite.deviation.theo import theo1

LINES = []


def bar(what, value, least, *, busy=None, below=False):
    """Print and record a value with its limit, a minimum or with `below` a maximum."""
    good = value <= least if below else value >= least
    sign = "<=" if below else ">="
    doubt = (
        "" if busy is None or busy > 1.6 else f"  (cpu/wall {busy:.2f}: repeat on a quiet machine)"
    )
    LINES.append(
        f"{'holds ' if good else 'MISSED'} {what:52s} {value:9.2f} {sign} {least:g}{doubt}"
    )
    print(LINES[-1], flush=True)


def against_peers(n, grid, name, repeats, bars):
    """Compare the overlapping Allan deviation with other programs on n samples."""
    x = np.random.default_rng(1).normal(size=n)
    tau = grid / RATE
    numba = numba_recipe()
    programs = {
        "allantools": lambda: allantools.oadev(x, rate=RATE, data_type="freq", taus=tau),
        "allanite": lambda: oadev(x, rate=RATE, factors=grid),
        "allanite, 1 thread": lambda: _kernels.overlapping_allan(x, grid, False, 1),
        "np.cumsum": lambda: np.cumsum(x),
    }
    if numba is not None and "numba" in bars:
        programs["numba"] = lambda: numba(x, grid)
    rows = {row[1]: row for row in side_by_side(name, programs, repeats)}
    ours, busy = rows["allanite"][2], rows["allanite"][3]
    busy = None if n < 10**6 else busy
    bar(f"{name}: x allantools", rows["allantools"][2] / ours, bars["allantools"], busy=busy)
    if "numba" in rows:
        bar(f"{name}: x numba, parallel", rows["numba"][2] / ours, bars["numba"], busy=busy)
    if "cumsum" in bars:
        share = ours / rows["np.cumsum"][2]
        bar(f"{name}: np.cumsum of it", share, bars["cumsum"], busy=busy, below=True)
    if "scaling" in bars:
        gain = rows["allanite, 1 thread"][2] / ours
        bar(f"{name}: 1 to 2 threads", gain, bars["scaling"], busy=busy)


def once(call):
    """Return the seconds that a call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def slow_ones():
    """Compare the slow deviations with allantools, on 25 times the samples."""
    rng = np.random.default_rng(1)
    small, large = rng.normal(size=4000), rng.normal(size=100_000)
    for name in ("mtotdev", "htotdev", "theo1"):
        ours = theo1 if name == "theo1" else getattr(deviation, name)
        theirs = getattr(allantools, name)
        peer = once(lambda f=theirs: f(small, data_type="freq", taus=2.0 ** np.arange(1, 11)))
        seconds = once(lambda f=ours: f(large))
        bar(f"{name}: 1e5 samples / allantools' 4e3", seconds / peer, 1.0, below=True)


def stream():
    """Measure the samples per second of the streaming accumulator."""
    x = np.random.default_rng(1).normal(size=1 << 24)
    for taus, least in (("octave", 200), (8, 100)):
        best = np.inf
        for _ in range(5):
            sums = Accumulator(taus=taus)
            start = time.process_time()
            for at in range(0, x.size, 1 << 16):
                sums.update(x[at : at + (1 << 16)])
            best = min(best, time.process_time() - start)
        bar(f"stream, {taus} per octave: M samples/s of CPU", x.size / best / 1e6, least)


def memory(n):
    """Print the bytes per sample that one call needs beyond its input."""
    x = np.random.default_rng(1).normal(size=n)
    before = peak()
    oadev(x, rate=RATE, factors=log_spaced(n))
    print((peak() - before) * 1024 / n)


def peak():
    """Return the peak memory so far in KiB, from the kernel: getrusage includes memory of the parent process."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def main(quick):
    """Measure and print all ratios; `quick` omits 1e8 samples."""
    against_peers(10**3, log_spaced(1000), "oadev, 1e3 x 100", 101, {"allantools": 10})
    log, octaves = log_spaced(10**7), octave(10**7)
    bars = {"allantools": 40, "numba": 2.5, "scaling": 1.7}
    against_peers(10**7, log, f"oadev, 1e7 x {log.size}", 7, bars)
    bars = {"allantools": 35, "cumsum": 1.0}
    against_peers(10**7, octaves, "oadev, 1e7, octave", 7, bars)
    slow_ones()
    stream()
    n = 10**7 if quick else 10**8
    if not quick:
        against_peers(n, log_spaced(n), "oadev, 1e8 x 95", 3, {"allantools": 40})
    run = subprocess.run(
        [sys.executable, __file__, "--memory", str(n)], check=True, capture_output=True, text=True
    )
    bar(f"oadev, {n:.0e}: bytes per sample beyond the input", float(run.stdout), 9, below=True)
    print("\n".join(["", *LINES]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="without 1e8 samples")
    parser.add_argument("--memory", type=int, help="print the bytes per sample that one call needs")
    arguments = parser.parse_args()
    if arguments.memory:
        memory(arguments.memory)
    else:
        main(arguments.quick)
