"""What the house promises about itself."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import allanite as al
from allanite.deviation import accumulator

ROOT = Path(__file__).parents[3]


def test_import_is_light():
    heavy = ("scipy.stats", "scipy.signal", "matplotlib.pyplot", "plotly", "click")
    code = f"import sys, allanite; print([m for m in {heavy!r} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_import_is_quick_beside_numpy():
    """Processor time: a busy machine is slow, and that is not ours."""
    code = (
        "import time, numpy; start = time.process_time(); import allanite; "
        "print(time.process_time() - start)"
    )
    took = [
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout)
        for _ in range(3)
    ]
    assert min(took) < 0.08


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


def test_rooms_are_small():
    package = ROOT / "python" / "allanite"
    top = {p.stem for p in package.glob("*.py")}
    assert top == {"__init__", "_kernels", "simulate", "testing"}
    files = [p for p in package.rglob("*.py") if p.parent != package]
    lengths = sorted(len(p.read_text(encoding="utf-8").splitlines()) for p in files)
    assert lengths[len(lengths) // 2] <= 130
    growing = {"effects"}
    folders = {p.parent for p in files} | {p.parent for p in (ROOT / "rust").rglob("*.rs")}
    full = {
        str(folder.relative_to(ROOT)): count
        for folder in folders
        if folder.name not in growing
        and (count := sum(p.suffix in {".py", ".rs", ".js", ".css"} for p in folder.iterdir())) > 15
    }
    assert not full


def test_no_message_of_the_library_names_an_option():
    package = ROOT / "python" / "allanite"
    doors = {package / "cli"}
    option = re.compile(r"(?<![-\w`])--[a-z]{3,}")
    found = [
        f"{path.relative_to(package)}: {node.value}"
        for path in package.rglob("*.py")
        if not doors & set(path.parents)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and option.search(node.value)
        and "\n    " not in node.value
    ]
    assert not found


def test_constants_kept_twice_agree():
    # The stream reads power laws as kept records do: what the core calls sure and unsure.
    text = (ROOT / "rust" / "deviation" / "identify.rs").read_text(encoding="utf-8")
    constants = dict(re.findall(r"^const (FEWEST|UNSURE): \w+ = ([-\d.]+);", text, re.MULTILINE))
    assert {name: float(value) for name, value in constants.items()} == {
        "FEWEST": accumulator.FEWEST,
        "UNSURE": accumulator.UNSURE,
    }
