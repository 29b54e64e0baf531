"""What the house promises about itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import allanite as al

ROOT = Path(__file__).parents[3]


def test_import_is_light():
    heavy = ("scipy.stats", "scipy.signal", "matplotlib.pyplot", "plotly", "click")
    code = f"import sys, allanite; print([m for m in {heavy!r} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_no_source_file_is_longer_than_400_lines():
    folders = ("rust", "python", "tests", "examples", "benches", "docs")
    files = [p for f in folders for s in ("*.rs", "*.py") for p in (ROOT / f).rglob(s)]
    long = {
        p.name: n for p in files if (n := len(p.read_text(encoding="utf-8").splitlines())) > 400
    }
    assert not long


def test_public_names_are_documented():
    for name in al.__all__:
        value = getattr(al, name)
        assert name == "__version__" or isinstance(value, tuple) or (value.__doc__ or "").strip(), (
            name
        )
