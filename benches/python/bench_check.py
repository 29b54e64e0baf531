"""`check` with all candidates on 10 million samples and a temperature: python benches/python/bench_check.py [SAMPLES]

The limits for 10 million: less than 20 s on 2 cores and less than 2 GiB for the whole process, with progress reported.
"""

import resource
import sys
import time

import numpy as np

import allanite as al

RATE, N = 200.0, 10**7


def main():
    """Print time, memory and the number of progress reports."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else N
    rng = np.random.default_rng(1)
    samples = 0.01 * rng.standard_normal(count) + 1e-7 * np.cumsum(rng.standard_normal(count))
    temperature = 25.0 + 5.0 * np.sin(np.arange(count) / (8000.0 * RATE))
    recording = al.Recording(
        samples, rate=RATE, unit="rad/s", covariates={"temperature": temperature}
    )
    fit = al.fit_model(recording, "N+B+K")
    calls = []
    start, busy = time.perf_counter(), time.process_time()
    check = fit.check(on_progress=lambda *done: calls.append(done))
    wall, busy = time.perf_counter() - start, time.process_time() - busy
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"check of {count:.0e} samples: {wall:.1f} s ({busy:.1f} CPU s; limit 20 s),"
        f" {most:.2f} GiB (limit 2 GiB), progress reported {len(calls)} times,"
        f" {len(check.suggestions)} candidates"
    )


if __name__ == "__main__":
    main()
