"""Claim: a summary by Dask is bit-identical to one without Dask, for any chunks and also if a worker is killed.

Runs alternate between processes and threads, with chunks of 10⁴ to 10⁶ samples. The samples are integers, for which the
Allan curve is exact too. In every fourth run by processes one worker is killed at a random time; Dask starts another one
and recomputes what was lost.

    python benches/claims/dask_bits.py [--runs 20] [--samples 2000000]
"""

from __future__ import annotations

import argparse
import os
import signal
import threading
from contextlib import suppress
from time import perf_counter

import numpy as np

import allanite as al
from allanite.common.child_process import safe_path

RATE = 1000.0


def bits(value):
    """Return the value with each array replaced by its bytes."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, dict):
        return {key: bits(inside) for key, inside in value.items()}
    return [bits(inside) for inside in value] if isinstance(value, (list, tuple)) else value


def kept(summary):
    """Return the parts of a summary that a fit uses, as bytes."""
    reading = summary.reading()
    octaves = [
        (octave.power.value, octave.blocks.sums.value, octave.sections.sums.value)
        for octave in reading.octaves
    ]
    return bits([reading.samples, octaves, summary.oadev().deviation])


def kill(client, after):
    """Kill one worker `after` seconds from now."""

    def end():
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)

    pid = next(iter(client.run(os.getpid).values()))
    timer = threading.Timer(after, end)
    timer.start()
    return timer


def both_workers(cluster, client):
    """Wait for two workers. Dask sometimes does not replace a lost worker; then start both again."""
    try:
        client.wait_for_workers(2, timeout=20)
    except TimeoutError:
        cluster.scale(0)
        client.sync(cluster._correct_state)
        cluster.scale(2)
        client.wait_for_workers(2, timeout=60)


def main():
    """Print how many runs are bit-identical."""
    import dask
    import dask.array as da
    from dask.distributed import Client, LocalCluster

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--runs", type=int, default=20, help="runs in all, half of them by processes"
    )
    parser.add_argument("--samples", type=int, default=2_000_000, help="samples of the record")
    asked = parser.parse_args()
    dask.config.set({"distributed.scheduler.allowed-failures": 10})
    rng = np.random.default_rng(1)
    x = np.round(rng.standard_normal(asked.samples) * 1000.0)
    expected = kept(al.summarize(x, rate=RATE))
    right, killed, took = {True: 0, False: 0}, 0, 0.3
    with safe_path():
        clusters = {
            processes: LocalCluster(
                n_workers=2 if processes else 1,
                threads_per_worker=1 if processes else 2,
                processes=processes,
                dashboard_address=None,
            )
            for processes in (True, False)
        }
        clients = {processes: Client(cluster) for processes, cluster in clusters.items()}
        for run in range(asked.runs):
            processes = run % 2 == 0
            size = int(np.exp(rng.uniform(np.log(1e4), np.log(1e6))))
            client = clients[processes]
            if processes:
                both_workers(clusters[processes], client)
            timer = None
            if processes and run % 8 == 0 and run:
                timer = kill(client, rng.uniform(0.0, took))
                killed += 1
            began = perf_counter()
            try:
                found = al.scale.summarize(da.from_array(x, chunks=size), rate=RATE, client=client)
                same = kept(found) == expected
            except Exception as error:
                same = False
                print(f"run {run}: {type(error).__name__}: {error}")
            if timer is None and processes:
                took = perf_counter() - began
            elif timer is not None:
                timer.join()
            right[processes] += same
            if not same:
                print(f"run {run}: chunks of {size}, {'processes' if processes else 'threads'}")
        for one in (*clients.values(), *clusters.values()):
            one.close()
    total = asked.runs
    print(
        f"{sum(right.values())} of {total} runs have the same bits: {right[True]} of {(total + 1) // 2} by processes"
        f" ({killed} with a worker killed), {right[False]} of {total // 2} by threads"
    )


if __name__ == "__main__":
    main()
