"""Time of colored noise against colorednoise, allantools and NumPy, interleaved, and its spectrum.

Figures of two threads by wall time are valid if CPU/wall > 1.6. On a shared machine the ratio of CPU times (halved for two
threads) estimates that of the wall times.
"""

from __future__ import annotations

import argparse
import statistics
import time

import allantools
import colorednoise
import numpy as np
from side_by_side import save

from allanite import _core

FLICKER = [("flicker", [1.0])]
SUM = [
    ("white", [1.0]),
    ("flicker", [0.2]),
    ("random_walk", [0.002]),
    ("gauss_markov", [2.0, 0.99]),
]
SEGMENT, BATCH = 4096, 1024


def declared(w):
    """Return the discrete spectrum of `SUM`."""
    s = 2.0 * np.sin(w / 2.0)
    lag = 4.0 * (1.0 - 0.99**2) / (1.0 - 1.98 * np.cos(w) + 0.99**2)
    return 1.0 + 0.04 / s + 4e-6 / s**2 + lag


def welch(samples):
    """Return the largest deviation in percent of a Welch spectrum from the declared one, in broad bands."""
    batches = max(1, samples // (SEGMENT * BATCH))
    stream = _core.Simulator(SUM, 1, 0, 0, SEGMENT * BATCH * batches)
    window = np.sin(np.pi * (np.arange(SEGMENT) + 0.5) / SEGMENT) ** 2
    power = np.zeros(SEGMENT // 2 + 1)
    for _ in range(batches):
        x = stream.next(SEGMENT * BATCH).reshape(BATCH, SEGMENT)
        x -= x.mean(axis=1, keepdims=True)
        power += (np.abs(np.fft.rfft(x * window)) ** 2).sum(axis=0)
    power /= batches * BATCH * np.sum(window**2)
    model = declared(2.0 * np.pi * np.arange(1, SEGMENT // 2 + 1) / SEGMENT)
    inside = np.arange(8, SEGMENT // 2 - 2)
    # A Hann window mixes each ordinate with its neighbors.
    ratio = power[inside] / ((model[inside - 2] + 4.0 * model[inside - 1] + model[inside]) / 6.0)
    edges = [8]
    while edges[-1] < ratio.size:
        edges.append(edges[-1] + max(8, edges[-1] // 4))
    return 100.0 * max(abs(band.mean() - 1.0) for band in np.split(ratio, edges[:-2]))


def main() -> None:
    """Print and save times, ratios and the deviation of the spectrum."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=float, default=1e7, help="samples of a run")
    parser.add_argument("--repeat", type=int, default=5, help="runs of each program")
    parser.add_argument(
        "--welch", type=float, default=1e8, help="samples of the spectrum; 0 omits it"
    )
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
    rows = []
    for name, (wall, cpu) in medians.items():
        threads = 2 if "2 threads" in name else 1
        by_cpu = threads * reference[1] / cpu
        print(
            f"{name:24} {1e3 * wall:9.1f} ms wall  x{reference[0] / wall:6.1f}   {1e3 * cpu:9.1f} ms CPU"
            f"  x{by_cpu:6.1f} per thread of CPU   CPU/wall {cpu / wall:.2f}"
        )
        rows.append((f"{n} samples", name, wall, cpu / wall, reference[0] / wall))
        rows.append((f"{n} samples, by CPU", name, cpu, cpu / wall, by_cpu))
    if arguments.welch:
        worst = welch(int(arguments.welch))
        print(
            f"spectrum of {arguments.welch:.3g} samples: within {worst:.2f} % of the declared one"
        )
        rows.append(
            (f"Welch of {arguments.welch:.3g}", "largest deviation, percent", worst, "", "")
        )
    save(rows, "noise")


if __name__ == "__main__":
    main()
