"""Names and texts of others are data: shown as letters, whatever they hold."""

from __future__ import annotations

__all__ = ["file_name", "plain"]


def plain(text: object, most: int | None = None) -> str:
    r"""Text of visible letters and blanks; anything else as its escape (``\n``, ``\x1b``, ``\u202e``).

    Line ends, control characters, marks of direction and letters that are none would end a comment, speak to a
    terminal or break a file.

    Parameters
    ----------
    text : object
        What is shown, as ``str`` gives it.
    most : int, optional
        Letters of the answer; what is too long loses its middle.
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
    """Part of a file's name made of a column's: letters, digits, ``-``, ``_`` and ``.`` inside, at most 80."""
    safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in text)
    return safe.strip(".").encode()[:80].decode("utf-8", "ignore") or "_"
