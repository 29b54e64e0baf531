"""One word for one thing, the field's own; no sentence that must be read twice."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
#: What is not said any more → what is said.
INSTEAD = {
    r"chance does not explain": "residual; significant; beyond the expected scatter",
    r"nothing is left that": "no significant effect remains",
    r"held[- ]out": "predictive score (unseen data)",
    r"\btake care\b": "warning",
    r"units of logL more": "fits clearly better (ΔlogL …)",
    r"say how to read it": "set rate and unit",
    r"rounding to it is": "resolution (LSB) …: its rounding adds …",
    r"\"mean of a stretch|smallest to its largest|least and largest sample": "mean, minimum–maximum",
    r"corrected for everything": "p-values account for the number of effects and frequencies searched",
    r"where its definition allows": "linear time per τ where possible",
    r"whether it says nothing about": "True for one-off events",
    r", as here,": "by default",
    r"\bone's own\b": "your own",
    r"\bwhoever\b": "name who",
    r"\bnobody\b": "say what is so: never, unknown, not given",
    r"\bor none of these\b": "or not a …",
    r"says it all": "say what to do",
    r"without a word": "say what happened",
}
PAGES = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").glob("*.md"),
    *(ROOT / "docs" / "howto").glob("*.md"),
    *(ROOT / "docs" / "notebooks").glob("*.ipynb"),
]
SOURCES = [
    *(ROOT / "python").rglob("*.py"),
    *(ROOT / "python").rglob("static/*.js"),
    *(ROOT / "python").rglob("static/*.html"),
]


@pytest.mark.parametrize("phrase", INSTEAD)
def test_a_phrase_is_gone(phrase):
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:90]}"
        for path in (*PAGES, *SOURCES)
        if path.name != "CHANGELOG.md"
        for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1)
        if re.search(phrase, line, re.IGNORECASE)
    ]
    assert not found, f"write instead: {INSTEAD[phrase]}"
