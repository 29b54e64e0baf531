"""Claim: the Allan error of a true model rarely exceeds twice its expected scatter, and hardly ever three times.

`Study.adequate` is false above twice the scatter, `Fit.adequate` above three times. The samples come from
tests/python/generators.py, which does not use the package.

    python benches/claims/allan_scatter.py [--records 200]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "decisions"))

from records import NULLS

import allanite as al

MODELS = ("N", "N+B", "N+K", "N+B+K")


def ratios(name: str, seeds: range) -> np.ndarray:
    """Return the ratio of the Allan error to its expected scatter for one record per seed."""
    start, make = NULLS[name]
    errors = [al.fit_model(make(seed), start).error for seed in seeds]
    return np.array([e.adev_rms_percent / e.chance_rms_percent for e in errors])


def main() -> None:
    """Print quantiles of the ratio, and how many exceed 2 and 3."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=200, help="records of each model")
    asked = parser.parse_args()
    for name in MODELS:
        found = ratios(name, range(1000, 1000 + asked.records))
        middle, high = np.quantile(found, [0.5, 0.95])
        twice, thrice = (int(np.sum(found > limit)) for limit in (2.0, 3.0))
        print(
            f"{name}: median {middle:.2f}, 95 % {high:.2f}; of {asked.records}, {twice} above 2 and {thrice} above 3",
            flush=True,
        )


if __name__ == "__main__":
    main()
