"""Compare programs by interleaved runs in one process, and save the medians."""

import csv
import datetime as dt
import os
import platform
import statistics
import time
from pathlib import Path

RECORD = Path(__file__).parents[1] / "record"


def side_by_side(title, programs, repeats):
    """Run all programs in turn; return rows (title, name, seconds, cpu per wall, times faster than the first program)."""
    spent = {name: [] for name in programs}
    for call in programs.values():
        call()
    for _ in range(repeats):
        for name, call in programs.items():
            wall, cpu = time.perf_counter(), time.process_time()
            call()
            spent[name].append((time.perf_counter() - wall, time.process_time() - cpu))
    seconds = {name: statistics.median(w for w, _ in runs) for name, runs in spent.items()}
    reference = next(iter(seconds.values()))
    rows = []
    print(f"{title} (median of {repeats}, interleaved)")
    for name, runs in spent.items():
        busy = statistics.median(c / w for w, c in runs)
        ratio = reference / seconds[name]
        print(
            f"  {name:34s} {seconds[name] * 1e3:11.3f} ms   cpu/wall {busy:4.2f}   {ratio:8.2f} x"
        )
        rows.append((title, name, seconds[name], busy, ratio))
    return rows


def save(rows, name):
    """Write rows and a description of the machine to record/DATE-name.csv."""
    RECORD.mkdir(exist_ok=True)
    file = RECORD / f"{dt.datetime.now(dt.UTC).date()}-{name}.csv"
    with file.open("w", newline="") as out:
        writer = csv.writer(out)
        writer.writerow(
            [f"# {platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"]
        )
        writer.writerow(["case", "program", "median_s", "cpu_per_wall", "times_faster"])
        writer.writerows(rows)
    print(f"written: {file}")
