"""Processor time of `allanite fleet` for ten axes. Each axis is two minutes long; three axes have dozens of lines.

    python benches/python/bench_fleet.py

Needs the recording ch104.npz in the folder `ALLANITE_DATA`. The logs are three gyroscope triads and one accelerometer axis.
The processor time includes the start of the processes that work on the logs.
"""

import os
import tempfile
from pathlib import Path

import numpy as np
from side_by_side import save

from allanite.scale import run_fleet

DATA = Path(os.environ.get("ALLANITE_DATA", Path(__file__).parents[3] / "shared" / "data"))
#: Samples of a log, at 100 Hz.
SAMPLES = 12_000
#: First and last column of each log.
COLUMNS = ((0, 3), (0, 3), (0, 3), (3, 4))
#: Processor seconds that are promised.
BAR = 40.0


def processor_seconds():
    """Return the processor seconds of this process and its ended children."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def main():
    """Print models and times, and save the total."""
    whole = np.load(DATA / "ch104.npz")
    with tempfile.TemporaryDirectory() as folder:
        for number, (first, last) in enumerate(COLUMNS):
            part = slice(number * SAMPLES, (number + 1) * SAMPLES)
            np.savez(
                Path(folder) / f"log{number}.npz",
                data=whole["data"][part, first:last],
                rate_hz=whole["rate_hz"],
                unit=whole["unit"][first:last],
                channels=whole["channels"][first:last],
            )
        print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
        before, wall = processor_seconds(), os.times().elapsed
        rows = run_fleet(folder, Path(folder) / "fleet.csv")
        spent, passed = processor_seconds() - before, os.times().elapsed - wall
    for row in rows:
        if row["status"] == "failed":
            raise SystemExit(f"{row['file']}: {row['remarks']}")
        print(f"  {Path(row['file']).stem} {row['column']}: {row['seconds']:.1f} s, {row['model']}")
    print(f"load of the machine after: {os.getloadavg()[0]:.1f}")
    verdict = "holds" if spent <= BAR else "MISSED"
    print(f"{len(rows)} axes: {spent:.1f} s of processor time  {verdict}: at most {BAR:g} s")
    save([(f"fleet of {len(rows)} axes of 2 min", "allanite", passed, spent / passed, "")], "fleet")


if __name__ == "__main__":
    main()
