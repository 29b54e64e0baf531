"""What can be wrong: one small tree of exceptions.

The command line turns `InputError` into exit code 2 and `TooShortError` into exit code 3, each with
the exception's own one-line message, which names the file, row or option, what was found, and the remedy.
"""

from __future__ import annotations

__all__ = ["AllaniteError", "InputError", "TooShortError"]


class AllaniteError(Exception):
    """Anything that allanite itself reports."""


class InputError(AllaniteError, ValueError):
    """The input or an option cannot be used."""


class TooShortError(AllaniteError, ValueError):
    """The input is usable, but too short or too broken for what was asked."""
