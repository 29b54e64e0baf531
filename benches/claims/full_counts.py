"""Run the statistical tests with two to four times the records of `make test-all`, about an hour of one core.

python benches/claims/full_counts.py [arguments of pytest: a file's path, -k name, -n 2 …]
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def main() -> int:
    """Run pytest and return its exit code."""
    os.environ["ALLANITE_FULL"] = "1"
    os.chdir(ROOT)
    asked = sys.argv[1:]
    where = [] if any(a.startswith("tests/") for a in asked) else ["tests/python/statistical"]
    # No timeout: the tests take longer with more records.
    return pytest.main([*where, "-m", "statistical", "--timeout", "0", *asked])


if __name__ == "__main__":
    sys.exit(main())
