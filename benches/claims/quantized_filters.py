"""Filter and quantization, true broad resonances: which of them the search names, for a limit of the damping of a mode.

    python benches/claims/quantized_filters.py [--records 2] [--mode-damping 0.2]

A damping ratio above the limit makes a resonance a broad hump, which a filter with quantization may replace.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g
from allanite.fit.rivals import score

RATE, LENGTH, N = 10.0, 20_000, 0.01
#: Cutoff in Hz, order, and Q of each filter.
FILTERS = (
    (2.5, 2, 1e-3),
    (1.5, 2, 5e-4),
    (2.0, 1, 1e-3),
    (3.0, 4, 1e-3),
    (2.5, 2, 5e-4),
    (2.5, 2, 2e-3),
)
DAMPINGS = (0.15, 0.3, 0.5)


def names(samples: np.ndarray, start: str) -> set[str]:
    """Kinds of the last model of a search."""
    study = al.improve(al.Recording(samples, rate=RATE, unit="deg/s"), start)
    return {effect.kind for effect in study.fit.model}


def main() -> None:
    """Print how many filters and how many resonances were named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=2, help="records of each case")
    parser.add_argument("--mode-damping", type=float, default=score.MAX_MODE_DAMPING)
    given = parser.parse_args()
    score.MAX_MODE_DAMPING = given.mode_damping
    right = kept = 0
    for seed in range(given.records):
        for cutoff, order, q in FILTERS:
            rng = np.random.default_rng([seed, 7])
            x = g.quantized_filter(rng, LENGTH, RATE, N, cutoff, order, q, 3e-3)
            kinds = names(x, "N+B")
            right += {"bandwidth", "quantization"} <= kinds and "resonance" not in kinds
        for damping in DAMPINGS:
            rng = np.random.default_rng([seed, int(100 * damping)])
            x = g.white(rng, LENGTH, RATE, N) + g.resonance(rng, LENGTH, RATE, 2.0, damping, 0.03)
            kept += "resonance" in names(x, "N")
    print(f"filter and quantization named in {right} of {given.records * len(FILTERS)} records")
    print(f"resonance named in {kept} of {given.records * len(DAMPINGS)} records")


if __name__ == "__main__":
    main()
