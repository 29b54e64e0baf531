"""Searches of two Gauss-Markov processes (1 s and 30 s) from N and from N+B+K: equal ends, and coverage of N.

python benches/claims/two_starts.py [--seeds 10]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

SAMPLES, RATE, N = 20_000, 10.0, 0.01


def main() -> None:
    """Print the final models of each record, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10, help="number of records")
    seeds = parser.parse_args().seeds
    alike = covered = 0
    for seed in range(seeds):
        rng = np.random.default_rng([seed, 9])
        x = g.gauss_markov(rng, SAMPLES, RATE, 1.5e-2, 1.0)
        x += g.gauss_markov(rng, SAMPLES, RATE, 5e-3, 30.0)
        log = al.Recording(x + g.white(rng, SAMPLES, RATE, N), rate=RATE, unit="deg/s")
        studies = [al.improve(log, start) for start in ("N", "N+B+K")]
        kinds = [sorted(e.kind for e in study.fit.model) for study in studies]
        alike += kinds[0] == kinds[1]
        for study in studies:
            over = {} if study.undecided is None else study.undecided.intervals[0]
            interval = over.get("N") or study.fit["N"].interval
            assert interval is not None
            covered += interval[0] < N < interval[1]
        print(seed, *(study.fit.model.name for study in studies), flush=True)
    print(f"{alike} of {seeds} end alike; N is inside its interval in {covered} of {2 * seeds}")


if __name__ == "__main__":
    main()
