"""The statistical tests at the full number of their records: two to four times those of `make test-all`, an hour of a core.

python benches/claims/full_counts.py [what pytest takes: a file's path, -k name, -n 2 …]
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def main() -> int:
    """What pytest says."""
    os.environ["ALLANITE_FULL"] = "1"
    os.chdir(ROOT)
    asked = sys.argv[1:]
    where = [] if any(a.startswith("tests/") for a in asked) else ["tests/python/statistical"]
    # Nothing may end a test that takes its time.
    return pytest.main([*where, "-m", "statistical", "--timeout", "0", *asked])


if __name__ == "__main__":
    sys.exit(main())
