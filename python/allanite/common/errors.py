"""Exceptions of allanite.

The command line turns `InputError` into exit code 2 and `TooShortError` into exit code 3. Each message is one line that
names the file, row or option, what was found, and the remedy. The remedy names parameters in the words of the interface:
arguments of the library, options of the command line, or fields of the page.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from allanite.common.plain import plain

#: Parameter → its name in a remedy for callers of the Python library. ``{}`` stands for a value.
CALL: Mapping[str, str] = {
    "rate": "rate=",
    "this_rate": "rate='{}!'",
    "model": "model=",
    "unit": "unit=",
    "this_unit": "unit='{}'",
    "quantity": "quantity={}",
    "column": "column=",
    "covariate": "temperature=",
    "logged": "covariate=",
    "piece": "piece=",
    "topic": "topic=",
    "time_column": "time_column=",
    "to": ".to(unit)",
    "decimate": ".decimate({})",
    "trim": ".trim()",
    "this_span": ".trim({})",
    "quiet": ".quiet()",
    "scale": "scale=",
    "anyway": "anyway=True",
    "record_length": "record_length=",
    "find": "find=",
    "know": "know=",
    "tell": "tell=",
}


#: Maximum length of a message, characters.
MAX_MESSAGE_LENGTH = 288


class AllaniteError(Exception):
    """Base class of the errors that allanite raises about input and options. The message is one printable line.

    Parameters
    ----------
    found : str
        What was found, with the file, row or option.
    missing : str, optional
        The missing parameter that would solve the problem: a key of `CALL`.
    remedy : str
        What to do, appended to `found`. Parameters are written ``{rate}``, or with a value ``{decimate:4}``.

    Examples
    --------
    >>> try:
    ...     al.Recording([1.0, 2.0, 3.0])
    ... except al.AllaniteError as error:
    ...     print(error)
    ...     print(error.worded({"rate": "the field Rate"}))
    no sampling rate: give rate= or a time column
    no sampling rate: give the field Rate or a time column
    """

    def __init__(self, found: str = "", *, missing: str | None = None, remedy: str = "") -> None:
        super().__init__(found)
        self.found = found
        self.where: str | None = None
        self.missing = missing
        self.remedy = remedy

    def worded(self, words: Mapping[str, str] = CALL) -> str:
        """Message as one line: place, problem and remedy. In a message of over 288 characters, ``…`` replaces the middle.

        `words` maps each parameter to the name to print.
        """
        where = f"{self.where}: " if self.where else ""
        return plain(where + self.found + remedy_text(self.remedy, words), MAX_MESSAGE_LENGTH)

    def __str__(self) -> str:
        return self.worded()


class InputError(AllaniteError, ValueError):
    """The input or an option cannot be used.

    Examples
    --------
    >>> try:
    ...     al.Recording([1.0, 2.0], rate=-1)
    ... except al.InputError as error:
    ...     print(error)
    the rate must be a positive number of Hz, found -1
    """


class TooShortError(AllaniteError, ValueError):
    """The input is readable, but too short or too damaged for the computation.

    Examples
    --------
    >>> try:
    ...     al.oadev([1.0, 2.0], rate=10)
    ... except al.TooShortError as error:
    ...     print(error)
    2 samples: at least 3 are needed
    """


class InternalError(RuntimeError):
    """A bug of allanite. The command line ends with exit code 70 and writes a file for the bug report.

    This class is no `AllaniteError`, so that code that handles bad input does not hide the bug.
    """


@contextmanager
def about(where: object, instead: object = None) -> Iterator[None]:
    """Context that puts the name of a file or option in front of the message of each `AllaniteError` raised inside.

    A message that already has a name keeps it, unless that is `instead`, for example a temporary file. With None for
    `where`, messages are unchanged.
    """
    try:
        yield
    except AllaniteError as error:
        if where is not None and error.where in (None, str(instead)):
            error.where = str(where)
        raise


class _ParameterName:
    """Name of a parameter in a remedy, formatted with its value as format specification."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __format__(self, number: str) -> str:
        """Name with ``{}`` replaced by the text `number`."""
        return self.name.format(number)


def remedy_text(remedy: str, words: Mapping[str, str] = CALL) -> str:
    """Text of a remedy in which each placeholder, such as ``{rate}``, is replaced by its entry in `words`."""
    return (
        remedy.format_map({name: _ParameterName(word) for name, word in words.items()})
        if remedy
        else ""
    )
