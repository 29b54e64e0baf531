"""Time to read a CSV of 1 M rows x 7 columns, against pandas, NumPy and polars (if installed), interleaved."""

from __future__ import annotations

import argparse
import importlib.util
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from allanite import _core


def main() -> None:
    """Print the times and ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=float, default=1e6, help="rows of the file")
    parser.add_argument("--repeat", type=int, default=5, help="runs of each program")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "log.csv")
        x = np.random.default_rng(0).normal(size=(int(arguments.rows), 7))
        np.savetxt(path, x, fmt="%.9f", delimiter=",", header="t,gx,gy,gz,ax,ay,az", comments="")
        contenders = {
            "allanite": lambda: _core.read_text(path),
            "pandas": lambda: pd.read_csv(path),
            "numpy.loadtxt": lambda: np.loadtxt(path, delimiter=",", skiprows=1),
        }
        if importlib.util.find_spec("polars"):
            import polars as pl

            contenders["polars"] = lambda: pl.read_csv(path)
        times: dict[str, list[tuple[float, float]]] = {name: [] for name in contenders}
        for _ in range(arguments.repeat):
            for name, work in contenders.items():
                wall, cpu = time.perf_counter(), time.process_time()
                work()
                times[name].append((time.perf_counter() - wall, time.process_time() - cpu))
        size = Path(path).stat().st_size
    print(f"{len(x)} rows x 7, {size / 1e6:.0f} MB, median of {arguments.repeat}; x = this / ours")
    ours = statistics.median(wall for wall, _ in times["allanite"])
    for name, runs in times.items():
        wall, cpu = (statistics.median(part) for part in zip(*runs, strict=True))
        print(f"{name:14} {wall:7.3f} s wall  x{wall / ours:5.2f}   {cpu:7.3f} s CPU")


if __name__ == "__main__":
    main()
