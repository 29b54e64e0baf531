"""Safe text in parameter files: names of channels, paths, units and model strings may contain anything."""

from __future__ import annotations

import re
import textwrap
import unicodedata

#: Maximum length of a name, a path or a unit, characters.
MAX_LENGTH = 120
#: Maximum length of a sentence, characters. Sentences are longer than names, and comments wrap them.
MAX_SENTENCE_LENGTH = 1000
#: Length at which comment lines wrap, characters.
LINE_LENGTH = 120


def plain(text: object, max_length: int = MAX_LENGTH) -> str:
    """Text as one line that cannot end a line, a comment or a string in any of the formats.

    Control and invisible characters become ``/uNNNN``. A backslash, which would continue a line of C, becomes a slash,
    and quotes become typographic quotes. A space separates ``--`` (the end of an XML comment), ``*/``, ``%{`` and
    similar pairs.
    """
    out = []
    for c in str(text)[: max_length + 1]:
        if unicodedata.category(c)[0] == "C" or unicodedata.category(c) in ("Zl", "Zp"):
            out.append(f"/u{ord(c):04x}")
        else:
            out.append({"\\": "/", '"': "”", "'": "’", "`": "’"}.get(c, c))
    line = "".join(out)
    for pair in ("--", "*/", "/*", "%{", "%}", "??", "<!", "->"):
        while pair in line:
            line = line.replace(pair, f"{pair[0]} {pair[1]}")
    return line if len(line) <= max_length else line[: max_length - 1] + "…"


def _wrap_comment(line: str, begin: str) -> list[str]:
    """The line as lines that begin with `begin`, broken between words; later lines are indented by four more spaces.

    An empty line gives only `begin`. No line is longer than `LINE_LENGTH` unless a word is.
    """
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.wrap(
        line,
        LINE_LENGTH,
        initial_indent=begin,
        subsequent_indent=f"{begin}{indent}    ",
        break_long_words=False,
        break_on_hyphens=False,
    ) or [begin.rstrip()]


def as_comments(lines: list[str], mark: str = "#") -> str:
    """Text in which every line is a comment that begins with `mark`; long lines wrap."""
    return "".join(f"{row}\n" for line in lines for row in _wrap_comment(line, f"{mark} "))


def xml_comment(lines: list[str]) -> str:
    """Text of one XML comment that holds the lines; long lines wrap."""
    rows = [row for line in lines for row in _wrap_comment(line, "  ")]
    return "<!--\n" + "".join(f"{row}\n" for row in rows) + "-->\n"


def verdict_in(text: str) -> str:
    """Verdict of an exported file, ``Use: yes. …`` or ``Use: no. …``, on one line without comment marks, or ``""``."""
    found = re.search(r"Use: (yes|no)\b[^\n\"]*(\n(#|%|//|) {5,}[^\n]*)*", text)
    return "" if found is None else re.sub(r"\n(#|%|//|) +", " ", found[0]).strip()
