"""One pass over a long record: time and memory of `al.summarise` and of the loop after it, beside NumPy's read and sum.

    python benches/python/bench_scale.py [SAMPLES ...]
    python benches/python/bench_scale.py day

The largest size is also written to a file (8 GB for 10⁹ samples), which NumPy reads and sums beside the pass: from the
disk, put out of the cache of the system before, and from the cache. A day is 24 h of six axes at 1 kHz, a file of 4 GB.

Each size runs in a process of its own, so that the peak of its memory is its own. The record comes from a generator, a
chunk at a time: white noise of one chunk, turned and with either sign, so that making it costs little.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

CHUNK = 1 << 20
RATE = 1000.0


def chunks(n):
    """A record of n samples."""
    noise = np.random.default_rng(0).standard_normal(CHUNK)
    turns = np.random.default_rng(1)
    for at in range(0, n, CHUNK):
        size = min(CHUNK, n - at)
        yield np.roll(noise, int(turns.integers(CHUNK)))[:size] * turns.choice([-1.0, 1.0])


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def one(n):
    import allanite as al

    al.summarise(np.zeros(10) + np.arange(10), rate=RATE)
    before = peak()
    began, busy = perf_counter(), process_time()
    total = sum(float(chunk.sum()) for chunk in chunks(n))
    plain, plain_busy = perf_counter() - began, process_time() - busy
    began, busy = perf_counter(), process_time()
    summary = al.summarise(chunks(n), rate=RATE)
    # Without the generator, which the sum needs as well.
    made, busy = perf_counter() - began - plain, process_time() - busy - plain_busy
    began = perf_counter()
    fit = al.parse_model("N+K").fit(summary)
    check = fit.check()
    told = perf_counter() - began
    with tempfile.TemporaryDirectory() as folder:
        summary.save(Path(folder) / "s")
        size = (Path(folder) / "s").stat().st_size / 1e6
    print(
        f"{n:>13.0e} {plain:>9.1f} {made:>9.1f} {1e9 * busy / n:>7.0f} {told:>9.1f} {peak():>8.0f} {peak() - before:>8.0f}"
        f" {size:>8.1f}  N = {float(fit['N']):.5f}, {len(check.suggestions)} candidates, sum {total:.3g}"
    )


def write(path, n, columns):
    """A file of n rows, on the disk and out of the cache of the system."""
    data = np.lib.format.open_memmap(path, mode="w+", dtype=np.float64, shape=(n, columns))
    at, flat = 0, data.reshape(-1)
    for chunk in chunks(n * columns):
        flat[at : at + chunk.size] = chunk
        at += chunk.size
    data.flush()


def forget(path):
    """Put the file out of the cache of the system."""
    with Path(path).open("rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def read_and_sum(path, n):
    """What NumPy needs for it, in chunks that stay in the cache of the processor."""
    with Path(path).open("rb") as file:
        file.seek(-8 * n, os.SEEK_END)
        return sum(float(np.fromfile(file, count=1 << 17).sum()) for _ in range(0, n, 1 << 17))


def file_of(path, n, columns):
    """The file read and summed, and the whole loop over it, side by side: from the disk, and from the cache."""
    import allanite as al

    mapped = np.load(path, mmap_mode="r")
    al.summarise(np.zeros(10) + np.arange(10), rate=RATE)
    for state in ("disk", "cache"):
        times = []
        for work in (
            lambda: read_and_sum(path, n * columns),
            lambda: al.summarise(mapped, rate=RATE),
        ):
            if state == "disk":
                forget(path)
            began, busy = perf_counter(), process_time()
            summary = work()
            times.append((perf_counter() - began, process_time() - busy))
        (plain, plain_busy), (made, made_busy) = times
        each = [1e9 * busy / (n * columns) for busy in (plain_busy, made_busy)]
        print(
            f"NPY of {n:.2e} × {columns} samples from the {state}: read and summed in {plain:.2f} s, summarised in"
            f" {made:.2f} s, × {made / plain:.1f}; processor time {each[0]:.1f} and {each[1]:.1f} ns a sample",
            flush=True,
        )
    passed, began = peak(), perf_counter()
    for column in summary:
        al.parse_model("N+K").fit(column).check()
    print(
        f"fit and check in {perf_counter() - began:.1f} s; most memory {passed:.0f} MB, with them {peak():.0f} MB"
    )


def main():
    if sys.argv[1:2] == ["--one"]:
        one(int(sys.argv[2]))
        return
    for name, work in (("--file", file_of), ("--write", write)):
        if sys.argv[1:2] == [name]:
            work(sys.argv[2], *map(int, sys.argv[3:]))
            return
    if sys.argv[1:2] == ["day"]:
        with_file(24 * 3600 * int(RATE), 6)
        return
    sizes = [int(float(text)) for text in sys.argv[1:]] or [10**6, 10**7, 10**8, 10**9]
    heads = ("samples", "sum s", "pass s", "cpu ns", "fit+check", "peak MB", "own MB", "file MB")
    print(
        " ".join(
            text.rjust(width) for text, width in zip(heads, (13, 9, 9, 7, 9, 8, 8, 8), strict=True)
        )
    )
    for n in sizes:
        subprocess.run([sys.executable, __file__, "--one", str(n)], check=True)
    with_file(max(sizes), 1)


def with_file(rows, columns):
    """Written and read each by a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        for what in ("--write", "--file"):
            asked = [what, str(Path(folder) / "x.npy"), str(rows), str(columns)]
            subprocess.run([sys.executable, __file__, *asked], check=True)


if __name__ == "__main__":
    main()
