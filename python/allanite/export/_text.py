"""Safe text in parameter files: names of channels, paths, units and model strings may contain anything."""

from __future__ import annotations

import unicodedata

__all__ = ["block", "comments", "plain"]

#: Maximum length of a text, characters.
MAX_LENGTH = 120


def plain(text: object) -> str:
    """The text as one line that cannot end a line, a comment or a string in any of the formats.

    Control characters, line and paragraph separators, invisible and surrogate characters become ``/uNNNN``. A backslash,
    which would continue a line of C, becomes a slash. A space separates ``--`` (the end of an XML comment), ``*/`` and
    ``%{``. Quotes become typographic quotes.
    """
    out = []
    for c in str(text)[: MAX_LENGTH + 1]:
        if unicodedata.category(c)[0] == "C" or unicodedata.category(c) in ("Zl", "Zp"):
            out.append(f"/u{ord(c):04x}")
        else:
            out.append({"\\": "/", '"': "”", "'": "’", "`": "’"}.get(c, c))
    line = "".join(out)
    for pair in ("--", "*/", "/*", "%{", "%}", "??", "<!", "->"):
        while pair in line:
            line = line.replace(pair, f"{pair[0]} {pair[1]}")
    return line if len(line) <= MAX_LENGTH else line[: MAX_LENGTH - 1] + "…"


def comments(lines: list[str], mark: str = "#") -> str:
    """Text in which every line is a comment that begins with `mark`."""
    return "".join(f"{mark} {line}".rstrip() + "\n" for line in lines)


def block(lines: list[str]) -> str:
    """Text of the lines as one XML comment."""
    return "<!--\n" + "".join(f"  {line}\n" for line in lines) + "-->\n"
