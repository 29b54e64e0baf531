"""Claim: an effect is found in a record with missing samples as often as in a complete record of equal information.

Each effect is scaled by 1/√(share of valid samples): in white noise it then has the same ΔlogL as in the complete record.
A step is placed between valid samples, since its time inside a gap is not measurable. The samples come from generators.py.

    python benches/claims/found_beside_holes.py [RECORDS] [SAMPLES]
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
#: Sizes in a complete record of 20 000 samples.
LINE, LAG, STEP = 0.0066, 0.006, 0.018
#: Kind of effect → its samples, by length, random generator, relative size and mask of missing samples.
KINDS = {
    "sinusoid": lambda n, rng, size, _: g.sinusoid(n, RATE, rng.uniform(1.0, 20.0), size * LINE),
    "gauss_markov": lambda n, rng, size, _: g.gauss_markov(rng, n, RATE, size * LAG, 2.0),
    "bias_step": lambda n, rng, size, missing: g.step(
        n, RATE, rng.choice(middle(~missing)) / RATE, size * STEP
    ),
}


def middle(seen: np.ndarray) -> np.ndarray:
    """Return the indices of valid samples in the middle of a record."""
    at = np.flatnonzero(seen)
    return at[(at > 0.3 * seen.size) & (at < 0.7 * seen.size)]


def row(kind: str, holes: str, records: int, n: int) -> str:
    """Return a line: in how many records the first suggestion is the effect, and in how many it is another one."""
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
