"""Write docs/validation.md from benches/record/claims.toml: python docs/make_validation.py"""

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "benches" / "record" / "claims.toml"
PAGE = ROOT / "docs" / "validation.md"
HEAD = """# Validation

Each line names a claim, the command or test that tries the claim, the result, and a date.
`docs/make_validation.py` writes this page from `benches/record/claims.toml`. Run programs of `benches/claims` with
`python FILE` in the repository. [Methods](methods.md) explains the terms. A date before
2026-11-28 is that of the entry, a later date that of the run.

The nightly CI workflow (`make test-nightly`) runs the claims that name a test, first on fewer records and then on all.
Programs of `benches/claims` are run by hand. Claims of another kind say how they are tried.
"""


def page() -> str:
    """Markdown of the page: one table for each section of the record."""
    record = tomllib.loads(RECORD.read_text(encoding="utf-8"))
    parts = [HEAD]
    for section in record["section"]:
        rows = ["| Claim | Command or test | Result | Date |", "|---|---|---|---|"]
        run = ""
        for claim, command, result, date in section["claims"]:
            run = run if command == "the same" else command
            shown = f"`{run}`" if "/" in run or run.startswith("make ") else run
            rows.append(f"| {claim} | {shown} | {result} | {date} |")
        note = f"{section['note']}\n\n" if "note" in section else ""
        parts.append(f"## {section['title']}\n\n{note}" + "\n".join(rows) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
