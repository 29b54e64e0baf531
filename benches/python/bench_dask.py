"""Time of summaries of 64 logs on a local cluster of one worker and of two, with one thread each.

    python benches/python/bench_dask.py [--samples 10000000] [--rounds 3]

Four logs have 16 names each, so that they fit on the disk and into the cache of files. Rounds alternate, so that other
load on the machine affects both. The best times are printed, and the processor times of the workers and of this process,
which is client and scheduler: these share the processors with the workers.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

FILES, CONTENTS, RATE = 64, 4, 1000.0


def spent():
    """Return the processor time of a worker so far, s."""
    return process_time()


def main():
    """Print the times of each round and their ratios."""
    from dask.distributed import Client, LocalCluster

    import allanite as al

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=10_000_000, help="samples of a log")
    parser.add_argument("--rounds", type=int, default=3, help="rounds of each cluster")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{i:02d}.npy" for i in range(FILES)]
        for i, path in enumerate(paths):
            if i < CONTENTS:
                np.save(path, np.random.default_rng(i).standard_normal(asked.samples))
            else:
                path.hardlink_to(paths[i % CONTENTS])
        clusters = {
            k: LocalCluster(n_workers=k, threads_per_worker=1, dashboard_address=":0")
            for k in (1, 2)
        }
        clients = {k: Client(cluster) for k, cluster in clusters.items()}
        walls, busiest = {1: [], 2: []}, {1: [], 2: []}
        for k, client in clients.items():
            al.scale.summarize(paths[: 4 * k], rate=RATE, client=client)  # imports
        for _ in range(asked.rounds):
            for k, client in clients.items():
                before, mine, began = client.run(spent), process_time(), perf_counter()
                found = al.scale.summarize(paths, rate=RATE, client=client)
                walls[k].append(perf_counter() - began)
                mine = process_time() - mine
                busy = [now - before[where] for where, now in client.run(spent).items()]
                busiest[k].append(max(busy))
                each = " + ".join(f"{b:.2f}" for b in busy)
                print(
                    f"{k} workers: {len(found)} logs in {walls[k][-1]:.2f} s, processor time of the workers {each} s,"
                    f" of this process {mine:.2f} s; load {os.getloadavg()[0]:.1f}"
                )
        ratios = [min(of[1]) / min(of[2]) for of in (walls, busiest)]
        print(f"two workers are {ratios[0]:.2f} × one by time, {ratios[1]:.2f} × by processor time")
        for k in clients:
            clients[k].close()
            clusters[k].close()


if __name__ == "__main__":
    main()
