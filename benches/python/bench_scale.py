"""Time and memory of `al.summarize` on a long record and of fit and check after it, compared with a sum by NumPy.

    python benches/python/bench_scale.py [SAMPLES ...]
    python benches/python/bench_scale.py day

The largest size is also written to a file (8 GB for 10⁹ samples). NumPy reads and sums it, and the package summarizes it:
once from the disk, after removing it from the system cache, and once from the cache. `day` is 24 h of six axes at 1 kHz, a
file of 4 GB.

Each size runs in its own process, so that its peak memory can be measured. The record is generated in chunks: one chunk of
white noise, rotated and with a random sign, which takes little time.
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
    """Yield the chunks of a record of n samples."""
    noise = np.random.default_rng(0).standard_normal(CHUNK)
    turns = np.random.default_rng(1)
    for at in range(0, n, CHUNK):
        size = min(CHUNK, n - at)
        yield np.roll(noise, int(turns.integers(CHUNK)))[:size] * turns.choice([-1.0, 1.0])


def peak():
    """Return the peak memory of the process in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def one(n):
    """Print time and memory of a generated record of n samples."""
    import allanite as al

    al.summarize(np.zeros(10) + np.arange(10), rate=RATE)
    before = peak()
    began, busy = perf_counter(), process_time()
    total = sum(float(chunk.sum()) for chunk in chunks(n))
    plain, plain_busy = perf_counter() - began, process_time() - busy
    began, busy = perf_counter(), process_time()
    summary = al.summarize(chunks(n), rate=RATE)
    # Subtract the time of the generator and the sum.
    made, busy = perf_counter() - began - plain, process_time() - busy - plain_busy
    began = perf_counter()
    fit = al.parse_model("N+K").fit(summary)
    check = fit.check()
    checked = perf_counter() - began
    with tempfile.TemporaryDirectory() as folder:
        summary.save(Path(folder) / "s")
        size = (Path(folder) / "s").stat().st_size / 1e6
    print(
        f"{n:>13.0e} {plain:>9.1f} {made:>9.1f} {1e9 * busy / n:>7.0f} {checked:>9.1f} {peak():>8.0f}"
        f" {peak() - before:>8.0f} {size:>8.1f}"
        f"  N = {float(fit['N']):.5f}, {len(check.suggestions)} candidates, sum {total:.3g}"
    )


def write(path, n, columns):
    """Write a file of n rows."""
    data = np.lib.format.open_memmap(path, mode="w+", dtype=np.float64, shape=(n, columns))
    at, flat = 0, data.reshape(-1)
    for chunk in chunks(n * columns):
        flat[at : at + chunk.size] = chunk
        at += chunk.size
    data.flush()


def forget(path):
    """Remove the file from the system cache."""
    with Path(path).open("rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def read_and_sum(path, n):
    """Return the sum of a file, read by NumPy in chunks that fit into the processor cache."""
    with Path(path).open("rb") as file:
        file.seek(-8 * n, os.SEEK_END)
        return sum(float(np.fromfile(file, count=1 << 17).sum()) for _ in range(0, n, 1 << 17))


def file_of(path, n, columns):
    """Print the times to sum and to summarize a file, from the disk and from the cache, and those of fit and check."""
    import allanite as al

    mapped = np.load(path, mmap_mode="r")
    al.summarize(np.zeros(10) + np.arange(10), rate=RATE)
    for state in ("disk", "cache"):
        times = []
        for work in (
            lambda: read_and_sum(path, n * columns),
            lambda: al.summarize(mapped, rate=RATE),
        ):
            if state == "disk":
                forget(path)
            began, busy = perf_counter(), process_time()
            summary = work()
            times.append((perf_counter() - began, process_time() - busy))
        (plain, plain_busy), (made, made_busy) = times
        each = [1e9 * busy / (n * columns) for busy in (plain_busy, made_busy)]
        print(
            f"NPY of {n:.2e} × {columns} samples from the {state}: read and summed in {plain:.2f} s, summarized in"
            f" {made:.2f} s, × {made / plain:.1f}; processor time {each[0]:.1f} and {each[1]:.1f} ns a sample",
            flush=True,
        )
    passed, began = peak(), perf_counter()
    for column in summary:
        al.parse_model("N+K").fit(column).check()
    print(
        f"fit and check in {perf_counter() - began:.1f} s; peak memory {passed:.0f} MB before, {peak():.0f} MB after"
    )


def main():
    """Run the part that the command line names, or all sizes."""
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
    """Write and read a file, each in its own process."""
    with tempfile.TemporaryDirectory() as folder:
        for what in ("--write", "--file"):
            asked = [what, str(Path(folder) / "x.npy"), str(rows), str(columns)]
            subprocess.run([sys.executable, __file__, *asked], check=True)


if __name__ == "__main__":
    main()
