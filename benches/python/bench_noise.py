"""Coloured noise: ours against colorednoise and allantools, interleaved, medians and ratios."""

from __future__ import annotations

import argparse
import statistics
import time

import allantools
import colorednoise
import numpy as np

from allanite import _core

FLICKER = [("flicker", [1.0])]
SUM = [("white", [1.0]), *FLICKER, ("random_walk", [0.01]), ("gauss_markov", [1.0, 0.99])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=float, default=1e7)
    parser.add_argument("--repeat", type=int, default=5)
    arguments = parser.parse_args()
    n = int(arguments.n)
    rng = np.random.default_rng(1)
    contenders = {
        "colorednoise pink": lambda: colorednoise.powerlaw_psd_gaussian(1, n, random_state=1),
        "allantools pink, n/20": lambda: allantools.noise.pink(n // 20),
        "numpy normals": lambda: rng.standard_normal(n),
        "flicker, 1 thread": lambda: _core.simulate(FLICKER, n, 1, threads=1),
        "flicker, 2 threads": lambda: _core.simulate(FLICKER, n, 1, threads=2),
        "four effects, 1 thread": lambda: _core.simulate(SUM, n, 1, threads=1),
        "four effects, 2 threads": lambda: _core.simulate(SUM, n, 1, threads=2),
    }
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in contenders}
    for _ in range(arguments.repeat):
        for name, work in contenders.items():
            wall, cpu = time.perf_counter(), time.process_time()
            work()
            times[name].append((time.perf_counter() - wall, time.process_time() - cpu))
    medians = {
        name: [statistics.median(part) for part in zip(*runs, strict=True)]
        for name, runs in times.items()
    }
    medians["allantools pink, n/20"] = [20 * part for part in medians["allantools pink, n/20"]]
    reference = medians["colorednoise pink"]
    print(f"{n} samples, median of {arguments.repeat}; x = colorednoise / this")
    for name, (wall, cpu) in medians.items():
        print(
            f"{name:24} {1e3 * wall:9.1f} ms wall  x{reference[0] / wall:6.1f}"
            f"   {1e3 * cpu:9.1f} ms CPU  x{reference[1] / cpu:6.1f}   CPU/wall {cpu / wall:.2f}"
        )


if __name__ == "__main__":
    main()
