"""What can be wrong: one small tree of exceptions.

The command line turns `InputError` into exit code 2 and `TooShortError` into exit code 3, each with
the exception's own one-line message, which names the file, row or option, what was found, and the remedy.
"""

from __future__ import annotations

from allanite.common.plain import plain

__all__ = ["AllaniteError", "InputError", "TooShortError"]


#: Letters of a message.
MOST = 288


class AllaniteError(Exception):
    """Anything that allanite itself reports: one line, in which control characters are shown."""

    def __str__(self) -> str:
        return plain(super().__str__(), MOST)


class InputError(AllaniteError, ValueError):
    """The input or an option cannot be used."""


class TooShortError(AllaniteError, ValueError):
    """The input is usable, but too short or too broken for what was asked."""
