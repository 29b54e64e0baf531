"""Show foreign names and texts (from logs, options, errors) safely in one line."""

from __future__ import annotations

#: First characters of texts that a spreadsheet evaluates as formulas.
FORMULA_STARTS = tuple("=+-@\t\r")


def plain(text: object, most: int | None = None) -> str:
    r"""Text of an object, with every unprintable character replaced by its escape (``\n``, ``\x1b``, ``\u202e``).

    Line ends, control characters and direction marks could end a comment, control a terminal or break a file. In a
    text of more than `most` characters, ``…`` replaces the middle.
    """
    shown = str(text)
    if not shown.isprintable():
        shown = "".join(
            c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in shown
        )
    if most is not None and len(shown) > most:
        end = most // 3
        shown = f"{shown[: most - end - 1]}…{shown[-end:]}"
    return shown


def file_name(text: str) -> str:
    """Text made safe as a file name of at most 80 bytes; ``_`` if nothing is left."""
    safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in text)
    return safe.strip(".").encode()[:80].decode("utf-8", "ignore") or "_"


def spreadsheet_cell(text: str) -> str:
    """Text of a CSV cell; one that a spreadsheet would evaluate as a formula gets an apostrophe in front."""
    return f"'{text}" if text.lstrip("'").startswith(FORMULA_STARTS) else text
