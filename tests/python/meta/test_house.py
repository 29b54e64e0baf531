"""Rules that the whole package follows: light imports, documented names, consistent constants, no searched messages."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import allanite as al
from allanite.deviation import accumulator

ROOT = Path(__file__).parents[3]
PACKAGE = ROOT / "python" / "allanite"


def test_import_is_light():
    heavy = ("scipy.stats", "scipy.signal", "matplotlib.pyplot", "plotly", "click")
    code = f"import sys, allanite; print([m for m in {heavy!r} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_public_names_are_documented():
    for name in al.__all__:
        value = getattr(al, name)
        assert name == "__version__" or isinstance(value, tuple) or (value.__doc__ or "").strip(), (
            name
        )


def test_private_modules_are_imported_only_within_their_package():
    private = re.compile(r"^ *from (allanite\.(\w+)\.[\w.]*\b_\w+) import", re.MULTILINE)
    found = [
        f"{path.relative_to(PACKAGE)}: {module}"
        for path in PACKAGE.rglob("*.py")
        for module, owner in private.findall(path.read_text(encoding="utf-8"))
        if path.relative_to(PACKAGE).parts[0] != owner
    ]
    assert not found


@pytest.mark.slow
def test_no_message_of_the_library_names_an_option():
    package = ROOT / "python" / "allanite"
    doors = {package / "cli"}
    option = re.compile(r"(?<![-\w`])--[a-z]{3,}")

    def texts(tree):
        """Texts of a module, each f-string as one."""
        parts = {c for n in ast.walk(tree) if isinstance(n, ast.JoinedStr) for c in n.values}
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                yield "".join(c.value for c in node.values if isinstance(c, ast.Constant))
            elif isinstance(node, ast.Constant) and node not in parts:
                yield node.value

    found = [
        f"{path.relative_to(package)}: {text}"
        for path in package.rglob("*.py")
        if not doors & set(path.parents)
        for text in texts(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(text, str)
        and option.search(text)
        and "\n    " not in text
        and "allanite characterize " not in text
    ]
    assert not found


def test_constants_kept_twice_agree():
    # The accumulator identifies power laws with the same constants as the core does for stored records.
    text = (ROOT / "rust" / "deviation" / "identify.rs").read_text(encoding="utf-8")
    constants = dict(
        re.findall(
            r"^const (MIN_POINTS|ALPHA_BEYOND_WHITE_FM): \w+ = ([-\d.]+);", text, re.MULTILINE
        )
    )
    assert {name: float(value) for name, value in constants.items()} == {
        "MIN_POINTS": accumulator.MIN_POINTS,
        "ALPHA_BEYOND_WHITE_FM": accumulator.ALPHA_BEYOND_WHITE_FM,
    }


@pytest.mark.slow
def test_no_text_of_an_exception_is_searched():
    searching = {
        "startswith",
        "endswith",
        "find",
        "index",
        "count",
        "lower",
        "replace",
        "partition",
    }
    found = []
    for path in PACKAGE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for handler in ast.walk(tree):
            if not isinstance(handler, ast.ExceptHandler) or handler.name is None:
                continue
            told = {f"str({handler.name})", f"{handler.name}.args[0]", f"repr({handler.name})"}
            # Follow variables to which the message is assigned.
            for node in ast.walk(handler):
                if isinstance(node, ast.Assign) and ast.unparse(node.value) in told:
                    told |= {ast.unparse(target) for target in node.targets}
            for node in ast.walk(handler):
                parts = []
                if isinstance(node, ast.Compare):
                    parts = [node.left, *node.comparators]
                elif isinstance(node, ast.Attribute) and node.attr in searching:
                    parts = [node.value]
                elif isinstance(node, ast.Call) and ast.unparse(node.func).startswith("re."):
                    parts = node.args
                if any(ast.unparse(part) in told for part in parts):
                    found.append(f"{path.relative_to(PACKAGE)}:{node.lineno}")
    assert not found
