"""What can be wrong: one small tree of exceptions.

The command line turns `InputError` into exit code 2 and `TooShortError` into exit code 3, each with
one line that names the file, row or option, what was found, and the remedy. Who shows an error words the remedy:
the library speaks of arguments, the command line of its options, the page of its fields.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from allanite.common.plain import plain

__all__ = [
    "CALL",
    "AllaniteError",
    "InputError",
    "InternalError",
    "TooShortError",
    "about",
    "worded",
]

#: Parameters as a remedy names them to who calls the library; a number of it stands for ``{}``.
CALL: Mapping[str, str] = {
    "rate": "rate=",
    "this_rate": "rate='{}!'",
    "model": "model=",
    "unit": "unit=",
    "this_unit": "unit='{}'",
    "quantity": "quantity={}",
    "column": "column=",
    "covariate": "temperature=",
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
}


#: Letters of a message.
MOST = 288


class AllaniteError(Exception):
    """Anything that allanite itself reports, in one line in which control characters are shown.

    Parameters
    ----------
    found : str
        What was found, with the file, row or option.
    missing : str, optional
        The parameter that was not given and would settle it: a key of `CALL`.
    remedy : str
        What to do, joined to `found`; parameters as ``{rate}``, with a number as ``{decimate:4}``.

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
        """One line in the words of the command line or the page."""
        where = f"{self.where}: " if self.where else ""
        return plain(where + self.found + worded(self.remedy, words), MOST)

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
    """The input is usable, but too short or too broken for what was asked.

    Examples
    --------
    >>> try:
    ...     al.oadev([1.0, 2.0], rate=10)
    ... except al.TooShortError as error:
    ...     print(error)
    2 samples: at least 3 are needed
    """


class InternalError(RuntimeError):
    """Allanite itself failed: a bug. The command line ends with exit code 70 and writes a file to report it with.

    It is no `AllaniteError`: code that handles bad input must not hide it.
    """


@contextmanager
def about(where: object, instead: object = None) -> Iterator[None]:
    """Errors raised inside say which file or option they are about.

    Parameters
    ----------
    where : object
        The file or option; None and what an inner `about` has said change nothing.
    instead : object, optional
        What an inner one may have said that `where` stands for: a temporary file.
    """
    try:
        yield
    except AllaniteError as error:
        if where is not None and error.where in (None, str(instead)):
            error.where = str(where)
        raise


class _Slot:
    """A parameter in a remedy."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __format__(self, number: str) -> str:
        return self.name.format(number)


def worded(remedy: str, words: Mapping[str, str] = CALL) -> str:
    """Name the parameters of a remedy in the words of the command line or the page."""
    return remedy.format_map({name: _Slot(word) for name, word in words.items()}) if remedy else ""
