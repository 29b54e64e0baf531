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
    r"\bdoorway\b": "GIL",
    r"\bDoors? (of|into)\b": "Bindings of",
    r"\b(struct|enum|use .*) Means\b|\{Means\b": "Execution",
    r"\bDesk\b|\bdesk\.": "Sessions",
    r"\bmachine::pages\b": "buffer_pool",
    r"\bsuper::law\b|\bmod law\b": "distribution",
}
#: A distinctive part of each of the twenty sentences of code that a reviewer had to read twice.
TWENTY = (
    "nothing to do unless empty",
    "so many times wider in ln(value)",
    "says nothing about another time than its own",
    "outliers crowd by chance and go first",
    "the price of its search",
    "what chance adds to is left out",
    "every bin has exactly the power that the truth gives it",
    "is as good as the best one where the record is longer by less",
    "their mean is one of a population",
    "know that the spectrum at the slow end is known badly",
    "are nearly the same number, hence",
    "so that it speaks of time alone",
    "may take its place unasked",
    "it is at work for anybody",
    "in words for people: they count from 1",
    "it goes first: to look for another place",
    "to have the system clear small pages costs more",
    "stays in the second-level cache, twice in the third, in neither",
    "Eight doubles for processors without a wider path",
    "without the room for a title",
)
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
    *(ROOT / "rust").rglob("*.rs"),
]
#: Names that no module has any more → the one it has.
MODULES = {
    "asked": "validation",
    "desk": "sessions",
    "doorway": "gil",
    "law": "distribution",
    "pages": "buffer_pool",
    "said": "gap notes",
}


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


@pytest.mark.parametrize("name", MODULES)
def test_a_module_name_is_gone(name):
    assert not [p for p in SOURCES if p.stem == name], f"call it: {MODULES[name]}"


@pytest.mark.parametrize("sentence", TWENTY)
def test_a_sentence_that_was_read_twice_is_gone(sentence):
    # A sentence may be broken over lines of comment.
    texts = {p: re.sub(r"\s+(///?|//!|#:?)?\s*", " ", p.read_text("utf-8")) for p in SOURCES}
    assert not [p.relative_to(ROOT) for p, text in texts.items() if sentence in text]
