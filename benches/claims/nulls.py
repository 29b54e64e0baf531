"""Claim: 1 % of the checks of the true model N+B+K are false alarms, at three lengths of record.

The samples come from tests/python/generators.py, which does not use the package. A check is a false alarm if it suggests an
effect or a view fails.

    python benches/claims/nulls.py [--records 2000 400 50] [--samples 500 20000 2000000]
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE = 100.0
N, B, K = 0.0126, 0.002, 9.07e-4


def noise(n: int, seed: int) -> np.ndarray:
    """Return samples of N+B+K."""
    rng = np.random.default_rng([seed, n])
    return g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, B) + g.walk(rng, n, RATE, K)


def main() -> None:
    """Print the false alarms at each length."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--records", type=int, nargs="+", default=[2000, 400, 50], help="records of each length"
    )
    parser.add_argument(
        "--samples", type=int, nargs="+", default=[500, 20_000, 2_000_000], help="lengths"
    )
    asked = parser.parse_args()
    for records, n in zip(asked.records, asked.samples, strict=True):
        kinds: Counter[str] = Counter()
        raised = inadequate = discrepant = 0
        for seed in range(records):
            fit = al.fit_model(al.Recording(noise(n, seed), rate=RATE, unit="rad/s"), "N+B+K")
            check = fit.check()
            raised += bool(check.significant)
            inadequate += not check.adequate
            discrepant += fit.discrepancy.percent > 0.0
            kinds.update({s.kind for s in check.significant})
            if not check.adequate and not check.significant:
                kinds.update(["a view"])
        share = 100.0 * inadequate / records
        print(
            f"{records} of {n} samples: {raised} raise an effect, {inadequate} not adequate ({share:.2f} %), "
            f"{discrepant} with a discrepancy; {dict(kinds)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
