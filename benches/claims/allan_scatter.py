"""How often the Allan error of a true model exceeds twice its expected scatter.

`Study.adequate` refuses such a model. The samples come from tests/python/generators.py, which know nothing of the package.

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
    """Allan error over its expected scatter, one for each record of the model."""
    start, make = NULLS[name]
    errors = [al.fit_model(make(seed), start).error for seed in seeds]
    return np.array([e.adev_rms_percent / e.chance_rms_percent for e in errors])


def main() -> None:
    """Print quantiles of the ratio and how many exceed 2."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--records", type=int, default=200)
    asked = parser.parse_args()
    for name in MODELS:
        found = ratios(name, range(1000, 1000 + asked.records))
        middle, high = np.quantile(found, [0.5, 0.95])
        over = int(np.sum(found > 2.0))
        print(
            f"{name}: median {middle:.2f}, 95 % {high:.2f}; {over} of {asked.records} above 2",
            flush=True,
        )


if __name__ == "__main__":
    main()
