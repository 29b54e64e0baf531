"""Text of others inside a file: names of channels, paths, units and model strings are data."""

from __future__ import annotations

import unicodedata

__all__ = ["block", "comments", "plain"]

#: Characters of a name that are shown.
LONGEST = 120


def plain(text: object) -> str:
    """One line of harmless text: whatever could end a line, a comment or a string is spelled out.

    Control characters, line and paragraph separators, invisible and surrogate characters become ``/uNNNN``, a
    backslash (which would continue a line of C) a slash; ``--`` (the end of an XML comment), ``*/`` and
    ``%{`` are parted by a space; quotes become typographic.
    """
    out = []
    for c in str(text)[: LONGEST + 1]:
        if unicodedata.category(c)[0] == "C" or unicodedata.category(c) in ("Zl", "Zp"):
            out.append(f"/u{ord(c):04x}")
        else:
            out.append({"\\": "/", '"': "”", "'": "’", "`": "’"}.get(c, c))
    line = "".join(out)
    for pair in ("--", "*/", "/*", "%{", "%}", "??", "<!", "->"):
        while pair in line:
            line = line.replace(pair, f"{pair[0]} {pair[1]}")
    return line if len(line) <= LONGEST else line[: LONGEST - 1] + "…"


def comments(lines: list[str], mark: str = "#") -> str:
    """Lines behind a mark that makes each a comment."""
    return "".join(f"{mark} {line}".rstrip() + "\n" for line in lines)


def block(lines: list[str]) -> str:
    """Lines as an XML comment."""
    return "<!--\n" + "".join(f"  {line}\n" for line in lines) + "-->\n"
