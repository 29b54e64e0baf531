"""A line, a lag and a step in records with holes: found as often as in a record of equal information?

An effect is made larger by 1/√(share of the samples that are there), so that beside white noise it is worth as much as in
the record without holes. A step is where there are samples: of one within a hole no record says when it was. The samples
come from generators.py.

    python benches/claims/found_beside_holes.py [records a row] [samples]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

from missing_samples import mask

import allanite as al
import generators as g

RATE, N = 100.0, 0.0126
HOLES = ("none", "every second", "0.3 single", "0.3 3 s", "0.3 30 s", "a tenth")
#: Sizes in a whole record of 20 000 samples.
LINE, LAG, STEP = 0.0066, 0.006, 0.018
#: Each of a size, in a record of which some samples are missing.
KINDS = {
    "sinusoid": lambda n, rng, size, _: g.sinusoid(n, RATE, rng.uniform(1.0, 20.0), size * LINE),
    "gauss_markov": lambda n, rng, size, _: g.gauss_markov(rng, n, RATE, size * LAG, 2.0),
    "bias_step": lambda n, rng, size, missing: g.step(
        n, RATE, rng.choice(middle(~missing)) / RATE, size * STEP
    ),
}


def middle(seen: np.ndarray) -> np.ndarray:
    """Samples that are there, of the middle of a record."""
    at = np.flatnonzero(seen)
    return at[(at > 0.3 * seen.size) & (at < 0.7 * seen.size)]


def row(kind: str, holes: str, records: int, n: int) -> str:
    """One line: in how many records the first suggestion is the effect, and in how many another that explains it."""
    found = other = 0
    for seed in range(records):
        rng = np.random.default_rng(seed)
        missing = mask(holes, n, rng)
        size = float(np.sqrt(20_000 / n / (1.0 - missing.mean())))
        samples = g.white(rng, n, RATE, N) + KINDS[kind](n, rng, size, missing)
        samples[missing] = np.nan
        record = al.Recording(samples, RATE, unit="rad/s")
        named = [s.effect for s in al.fit_model(record, "N").check().significant][:1]
        found += any(e.kind == kind for e in named)
        other += any(e.kind != kind for e in named)
    return f"{kind}, {holes}: found first {found} of {records}, another first {other}"


if __name__ == "__main__":
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 20_000
    for kind in KINDS:
        for holes in HOLES:
            print(row(kind, holes, records, samples), flush=True)
